"""``padlab identities`` and ``padlab faces``: whose faces there are, and many expressions in one picture."""

from pathlib import Path

import click

from synth.face.identity import DEFAULT_IDENTITY, IDENTITIES, find_identity
from synth.sheet import expressions, render_sheet
from webapp.cli.context import echo_json
from webapp.cli.options import FILE, SizeType, check_out, end_on_signals, face_dir, model_option
from webapp.config import Settings


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def identities(as_json: bool) -> None:
    """List whose faces there are; the names are what --identity takes."""
    rows = [
        {"name": one.name, "sex": one.sex, "ethnicity": one.ethnicity, "description": one.description}
        for one in IDENTITIES.values()
    ]
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        click.echo("\t".join(row.values()))


@click.command()
@click.argument("words", metavar="WORD…", nargs=-1, required=True)
@click.option("--out", type=FILE, required=True, help="The sheet (PNG).")
@model_option
@click.option(
    "--identity",
    "chosen",
    multiple=True,
    default=(DEFAULT_IDENTITY,),
    show_default=True,
    help="Whose face; may be repeated, then each begins a row.",
)
@click.option(
    "--intensity", type=click.FloatRange(0.0, 1.5), default=1.0, show_default=True, help="Strength of the expression."
)
@click.option(
    "--columns", type=click.IntRange(min=1), help="Pictures in a row [default: a square, or a row for each identity]."
)
@click.option("--size", type=SizeType(), default="360x288", show_default=True, help="Size of each picture in pixels.")
def faces(
    *,
    words: tuple[str, ...],
    out: Path,
    model: str,
    chosen: tuple[str, ...],
    intensity: float,
    columns: int | None,
    size: tuple[int, int],
) -> None:
    """Draw expressions as a labelled sheet.

    WORD is one of the papers' fourteen emotion words, one of the six basic emotions (joy, anger, sadness, surprise,
    fear, disgust), neutral, or any other word that `padlab words` knows; "basic" stands for the six, "all" for the
    fourteen.
    """
    end_on_signals()
    check_out(out, ".png")
    expressions(words)
    for name in chosen:
        find_identity(name)
    render_sheet(
        words,
        out,
        face_dir(),
        identities=chosen,
        model=model,
        models_dir=Settings.from_env().models_dir,
        intensity=intensity,
        columns=columns,
        width=size[0],
        height=size[1],
    )
    click.echo(f"Written: {out}")
