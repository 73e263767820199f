"""``padlab report`` and ``padlab export``: what a study says, and its data."""

from pathlib import Path

import click

from evaluation.report import html, tables
from evaluation.report.analysis import StudyReport
from webapp.cli.context import open_database
from webapp.errors import ConfigError
from webapp.services import exports, results

FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command()
@click.argument("slug")
@click.option("--part", help="Only this part of the study; left out, all parts, one after the other.")
@click.option(
    "--out", type=FOLDER, help="Write each report with figures to OUT/report.html (report-PART.html) as well."
)
def report(slug: str, part: str | None, out: Path | None) -> None:
    """Print the statistics of the study SLUG: evaluated PAD, opinion scores, votes, preferences, screening.

    With --out the report of a study of several parts is one file for each part: OUT/report-PART.html.
    """
    _, database = open_database()
    with database.read() as session:
        found = results.reports(session, slug) if part is None else {part: results.report(session, slug, part)}
    click.echo("\n".join(tables.to_text(one) for one in found.values()))
    if out is not None:
        for name, one in found.items():
            click.echo(f"Written: {_write(one, out / ('report.html' if len(found) == 1 else f'report-{name}.html'))}")


def _write(report: StudyReport, path: Path) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(html.render(report), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path} cannot be written ({error.strerror}); name another folder with --out") from error
    return path


@click.command()
@click.argument("slug")
@click.option("--out", type=FOLDER, help="Write all tables as CSV files into this folder.")
@click.option("--format", "formats", default="csv", show_default=True, help="Format of the files: csv.")
def export(slug: str, out: Path | None, formats: str) -> None:
    """Export the data of the study SLUG as CSV: all tables with --out, the responses alone to standard output."""
    if formats != "csv":
        raise click.BadParameter(f"'{formats}' is not written yet; use csv", param_hint="--format")
    _, database = open_database()
    with database.read() as session:
        frames = exports.frames(session, slug)
    if out is None:
        click.echo(exports.to_csv(frames["responses"]), nl=False)
        return
    for path in exports.write_csv(frames, out):
        click.echo(f"Written: {path}")
