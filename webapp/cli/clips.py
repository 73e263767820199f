"""``padlab clips``: rendering a study's clips."""

import click

from webapp import farm
from webapp.cli.context import echo_json, open_database, progress_bar
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import FarmError


def render_clips(database: Database, settings: Settings, slug: str, *, workers: int | None = None) -> None:
    """Render what a study still lacks, with a progress bar.

    Raises
    ------
    FarmError
        If clips could not be rendered; the message holds the first reason.
    """
    with progress_bar("Rendering clips") as update:
        farm.requeue_lost(database, settings)
        outcomes = farm.render_unfinished(
            database, settings, slug=slug, insist=True, workers=workers, on_progress=update
        )
    failed = [outcome for outcome in outcomes if outcome.error]
    if failed:
        raise FarmError(f"{len(failed)} of {len(outcomes)} clips could not be rendered; the first: {failed[0].error}")


@click.group()
def clips() -> None:
    """Render the clips of a study and tell how far that is."""


@clips.command()
@click.argument("slug")
@click.option("--workers", type=click.IntRange(min=1), help="Worker processes [default: one for each core].")
def render(slug: str, workers: int | None) -> None:
    """Render the clips that the study SLUG still lacks; failed ones are tried again."""
    settings, database = open_database()
    render_clips(database, settings, slug, workers=workers)
    click.echo(f"{farm.progress(database, slug).done} clips of '{slug}' are rendered.")


@clips.command()
@click.argument("slug")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def status(slug: str, as_json: bool) -> None:
    """Tell how many clips of the study SLUG are pending, rendering, done and failed."""
    _, database = open_database()
    counts = farm.progress(database, slug).to_dict()
    if as_json:
        echo_json(counts)
    else:
        click.echo(", ".join(f"{count} {name}" for name, count in counts.items()))
