"""``padlab report`` and ``padlab export``: what a study says, and its data."""

from pathlib import Path

import click

from evaluation.report import html, tables
from webapp.cli.context import open_database
from webapp.errors import ConfigError
from webapp.services import exports, results

FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command()
@click.argument("slug")
@click.option("--out", type=FOLDER, help="Write the report with figures to OUT/report.html as well.")
def report(slug: str, out: Path | None) -> None:
    """Print the statistics of the study SLUG: reverse evaluation of PAD, MOS, analysis of variance."""
    _, database = open_database()
    with database.read() as session:
        found = results.report(session, slug)
    click.echo(tables.to_text(found))
    if out is None:
        return
    path = out / "report.html"
    try:
        out.mkdir(parents=True, exist_ok=True)
        path.write_text(html.render(found), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path} cannot be written ({error.strerror}); name another folder with --out") from error
    click.echo(f"Written: {path}")


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
