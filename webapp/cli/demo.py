"""``padlab demo``: from nothing to a served study with rendered clips."""

import click

from evaluation import study as study_file
from synth.face import assets
from webapp.cli import serve
from webapp.cli.clips import render_clips
from webapp.config import Settings
from webapp.db import Database
from webapp.models import StudyState
from webapp.services import experimenters, studies

SLUG = "demo"
EXPERIMENTER = "experimenter"
WEB_WORKERS = 2


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", type=click.IntRange(1, 65535), default=8000, show_default=True)
@click.option("--no-serve", is_flag=True, help="Prepare everything, then return instead of serving.")
def demo(host: str, port: int, no_serve: bool) -> None:
    """Create what is missing (face data, database, demo study, its clips, an experimenter), then serve."""
    if not no_serve:
        serve.require_free_port(host, port)
    settings = Settings.from_env()
    database = Database(settings.database_url)
    database.upgrade()
    if not assets.is_compiled(settings.face_dir):
        click.echo("Fetching the face data (48 MB, once)", err=True)
    assets.fetch(settings.face_dir)
    password = _prepare(database, settings)
    base = serve.url(host, port)
    click.echo(f"Participants:  {base}/s/{SLUG}/")
    click.echo(f"Experimenter:  {base}/experimenter/{SLUG}/")
    if password is not None:
        # Said before the long work: whoever interrupts that would never see it again.
        click.echo(f"               name: {EXPERIMENTER}   password (shown only now): {password}")
    render_clips(database, settings, SLUG)
    if no_serve:
        click.echo("Everything is ready; `padlab demo` or `padlab serve` serves it.")
        return
    database.dispose()
    serve.check(settings)
    click.echo(f"Ready: open {base}/s/{SLUG}/ in a browser. Stop with Ctrl-C; what was answered is kept.")
    serve.run(settings, host=host, port=port, workers=WEB_WORKERS)


def _prepare(database: Database, settings: Settings) -> str | None:
    """Apply and open the demo study once, and make the first account; return its password if it is new."""
    with database.write() as session:
        known = {overview.slug: overview for overview in studies.overviews(session)}
        # Before anybody took part, the demo follows the code: a changed face or study file takes effect.
        if SLUG not in known or known[SLUG].participants == 0:
            studies.apply(session, study_file.load_bundled(SLUG), study_file.bundled_text(SLUG), settings)
        if SLUG not in known:
            studies.set_state(session, SLUG, StudyState.OPEN)
        if experimenters.any_exists(session):
            return None
        password = experimenters.new_password()
        experimenters.add(session, EXPERIMENTER, password, role="admin")
        return password
