"""``padlab report`` and ``padlab export``: what a study says, and its data."""

from collections.abc import Iterable
from pathlib import Path

import click

from evaluation.report import bundle, tables
from webapp.cli.context import open_database
from webapp.errors import ConfigError
from webapp.services import exports, results

FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command()
@click.argument("slug")
@click.option("--part", help="Only this part of the study; left out, all parts, one after the other.")
@click.option(
    "--out",
    type=FOLDER,
    help="Write the full report into this folder: report.html, figures (SVG, PNG), tables (CSV, LaTeX), methods.txt.",
)
def report(slug: str, part: str | None, out: Path | None) -> None:
    """Print the main results of the study SLUG: evaluated PAD, opinion scores, votes, preferences, screening.

    With --out the full report is written: comparisons of the conditions with every unit, mixed models, agreement,
    raters, scale quality and precision besides. That of a study of several parts has a page for each part,
    report-PART.html, and its files in OUT/PART. papers.html sets the papers' printed tables beside padlab's.
    """
    _, database = open_database()
    with database.read() as session:
        found = (
            results.full_reports(session, slug) if part is None else {part: results.full_report(session, slug, part)}
        )
    click.echo("\n".join(tables.to_text(one.report) for one in found.values()))
    if out is not None:
        written = _write(bundle.study_files(found), out)
        pages = [str(path) for path in written if path.suffix == ".html"]
        click.echo(f"Written: {', '.join(pages)}, and {len(written) - len(pages)} files of figures and tables")


def _write(files: Iterable[tuple[str, bytes]], folder: Path) -> list[Path]:
    paths = []
    try:
        for name, content in files:
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            paths.append(path)
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written ({error.strerror}); name another folder with --out") from error
    return paths


def _formats(_: click.Context, option: click.Parameter, value: str) -> tuple[str, ...]:
    """Return the formats named, each once."""
    chosen = tuple(dict.fromkeys(name.strip().lower() for name in value.split(",")))
    for name in chosen:
        if name not in exports.FORMATS:
            raise click.BadParameter(
                f"'{name}' is no format; it takes {', '.join(exports.FORMATS)}, or several with commas between them",
                param=option,
            )
    return chosen


@click.command()
@click.argument("slug")
@click.option("--out", type=FOLDER, help="Write all tables into this folder.")
@click.option(
    "--format",
    "formats",
    default="csv",
    show_default=True,
    callback=_formats,
    help=f"Formats of the files, with commas between them: {', '.join(exports.FORMATS)}.",
)
def export(slug: str, out: Path | None, formats: tuple[str, ...]) -> None:
    """Export the data of the study SLUG: all tables with --out, the responses alone to standard output."""
    printed = {"csv": exports.to_csv, "json": exports.to_json}
    if out is None and (len(formats) > 1 or formats[0] not in printed):
        raise click.UsageError("Only csv or json can be printed, one of them; give --out DIR to write files.")
    _, database = open_database()
    with database.read() as session:
        frames = exports.frames(session, slug)
        labels = exports.value_labels(session, slug)
    if out is None:
        click.echo(printed[formats[0]](frames["responses"]), nl=False)
        return
    for path in exports.write(frames, out, formats, labels=labels):
        click.echo(f"Written: {path}")
