"""``padlab bots``: simulated raters go through the real pages."""

import sys
import time
from collections.abc import Callable, Sequence
from urllib.parse import urlsplit

import click

from webapp.bots import known
from webapp.bots.browser import Browser
from webapp.bots.crowd import AT_ONCE, PATIENCE_S, Crowd
from webapp.bots.known import Known
from webapp.bots.lengths import ClipLengths
from webapp.bots.rater import Rater
from webapp.bots.visit import WAITING, Standing, Visit
from webapp.cli.context import open_database
from webapp.errors import DatabaseError, NotFoundError

_PLAIN_LINE_S = 10


def _site(_context: click.Context, _param: click.Parameter, address: str) -> str:
    """Refuse what is no address of a site."""
    try:
        place = urlsplit(address)
        sound = place.scheme in ("http", "https") and bool(place.hostname) and place.port != 0
    except ValueError:
        sound = False
    if not sound:
        raise click.BadParameter(f"'{address}' is no address of a site; right is one such as http://127.0.0.1:8000")
    return address


@click.command()
@click.argument("slug")
@click.option("--raters", type=click.IntRange(1, 100_000), required=True, help="How many raters take part.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of their answers.")
@click.option("--base-url", default="http://127.0.0.1:8000", show_default=True, callback=_site, help="The site.")
@click.option("--at-once", type=click.IntRange(1, 64), default=AT_ONCE, show_default=True, help="How many at a time.")
@click.option(
    "--patience",
    type=click.FloatRange(min=0),
    default=PATIENCE_S,
    show_default=True,
    help="Seconds without any progress after which raters who wait give up.",
)
@click.pass_context
def bots(
    ctx: click.Context, *, slug: str, raters: int, seed: int, base_url: str, at_once: int, patience: float
) -> None:
    """Let simulated raters take part in the study SLUG, over HTTP, as people in a browser do.

    The study must be open and served (`padlab serve`). What they answer is the true emotion and quality of each clip,
    seen through the noise of people; the same seed gives the same answers.
    """
    told = _known(slug)
    lengths = ClipLengths(told)
    visits = [
        Visit(place + 1, slug, browser=Browser(base_url), rater=Rater(place, seed=seed, known=told), lengths=lengths)
        for place in range(raters)
    ]
    seconds = Crowd(visits, at_once=at_once, patience_s=patience).run(_progress())
    if sys.stderr.isatty():
        click.echo("\r\033[K", err=True, nl=False)
    _tell(visits, seconds)
    failed = [visit for visit in visits if visit.standing == Standing.FAILED]
    for visit in failed:
        click.echo(f"Error: rater {visit.number}: {visit.note}", err=True)
    if failed:
        ctx.exit(1)


def _known(slug: str) -> Known:
    """Return what the local database knows of the study; nothing if the site is somebody else's."""
    try:
        _, database = open_database()
        with database.read() as session:
            return known.read(session, slug)
    except (DatabaseError, NotFoundError):
        return Known()


def _tell(visits: Sequence[Visit], seconds: float) -> None:
    """Print one line for each rater, and the totals."""
    for visit in visits:
        note = f"; {visit.note}" if visit.note and visit.standing != Standing.FAILED else ""
        click.echo(f"rater {visit.number}: {visit.standing}, {_pages(visit.answered)}{note}")
    answered = sum(visit.answered for visit in visits)
    through = sum(visit.standing == Standing.DONE for visit in visits)
    click.echo(
        f"{through} of {len(visits)} raters are through; {_pages(answered)} answered in {seconds:.1f} s, "
        f"{answered / max(seconds, 1e-9):.1f} page turns per second."
    )


def _pages(count: int) -> str:
    return "1 page" if count == 1 else f"{count} pages"


def _progress() -> Callable[[Sequence[Visit]], None]:
    """Return what shows how far the raters are: a line that changes on a terminal, a line now and then elsewhere."""
    terminal = sys.stderr.isatty()
    said = time.monotonic()

    def report(visits: Sequence[Visit]) -> None:
        nonlocal said
        if not terminal and time.monotonic() - said < _PLAIN_LINE_S:
            return
        said = time.monotonic()
        answered = sum(visit.answered for visit in visits)
        through = sum(visit.standing == Standing.DONE for visit in visits)
        waiting = sum(visit.standing in WAITING for visit in visits)
        line = f"Raters: {through} of {len(visits)} through, {waiting} waiting, {_pages(answered)} answered"
        click.echo(f"\r\033[K{line}" if terminal else line, err=True, nl=not terminal)

    return report
