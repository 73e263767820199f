"""``padlab demo``: from nothing to a served study with rendered clips."""

from pathlib import Path

import click

from synth.face import assets
from webapp.cli import serve
from webapp.cli.clips import render_clips
from webapp.cli.study import read_study_file
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
    render_clips(database, settings, SLUG)

    base = f"http://{host}:{port}"
    click.echo(f"Participants:  {base}/s/{SLUG}/")
    click.echo(f"Experimenter:  {base}/experimenter/{SLUG}/")
    if password is not None:
        click.echo(f"               name: {EXPERIMENTER}   password (shown only now): {password}")
    if no_serve:
        click.echo("Everything is ready; `padlab demo` or `padlab serve` serves it.")
        return
    click.echo("Stop with Ctrl-C; what was answered is kept.")
    database.dispose()
    serve.run(settings, host=host, port=port, workers=WEB_WORKERS)


def _prepare(database: Database, settings: Settings) -> str | None:
    """Apply and open the demo study once, and make the first account; return its password if it is new."""
    with database.write() as session:
        known = {overview.slug: overview for overview in studies.overviews(session)}
        # Before anybody took part, the demo follows the code: a changed face or study file takes effect.
        if SLUG not in known or known[SLUG].participants == 0:
            spec, text = read_study_file(Path(SLUG))
            studies.apply(session, spec, text, settings)
        if SLUG not in known:
            studies.set_state(session, SLUG, StudyState.OPEN)
        if experimenters.any_exists(session):
            return None
        password = experimenters.new_password()
        experimenters.add(session, EXPERIMENTER, password, role="admin")
        return password
