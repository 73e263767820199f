"""``padlab face``: one face."""

from pathlib import Path

import click

from synth.clip import render_still
from synth.expression.models import load_model
from synth.face.identity import find_identity
from synth.pad import PAD
from webapp.cli.context import NEGATIVE_NUMBERS
from webapp.cli.description import describe_file
from webapp.cli.options import (
    FILE,
    check_out,
    end_on_signals,
    face_dir,
    identity_option,
    model_option,
    size_option,
)
from webapp.config import Settings


@click.command(context_settings=NEGATIVE_NUMBERS)
@click.argument("p", type=float, required=False)
@click.argument("a", type=float, required=False)
@click.argument("d", type=float, required=False)
@click.option("--out", type=FILE, help="The picture (PNG).")
@model_option
@identity_option
@size_option
@click.option("--describe", type=FILE, help="Instead of drawing: tell which emotion a FAP file shows.")
@click.option("--json", "as_json", is_flag=True, help="With --describe: print JSON.")
def face(
    *,
    p: float | None,
    a: float | None,
    d: float | None,
    out: Path | None,
    model: str,
    identity: str,
    size: tuple[int, int],
    describe: Path | None,
    as_json: bool,
) -> None:
    """Draw the face of the emotion P A D (pleasure, arousal, dominance, each from -1 to 1).

    The other way round, --describe FILE.fap estimates the P A D that a FAP file shows; --model then names the set whose
    way back is used.
    """
    end_on_signals()
    if describe is not None:
        if out is not None or p is not None:
            raise click.UsageError("--describe takes a FAP file alone, without P A D and --out.")
        describe_file(describe, model, as_json=as_json)
        return
    if as_json:
        raise click.UsageError("--json belongs to --describe FILE.fap.")
    if p is None or a is None or d is None or out is None:
        raise click.UsageError("Give P A D and --out FILE.png, or --describe FILE.fap.")
    check_out(out, ".png")
    # Checked before the face data is fetched: a wrong number should not cost a download.
    pad = PAD.parse((p, a, d)).as_tuple()
    find_identity(identity)
    models_dir = Settings.from_env().models_dir
    load_model(model, models_dir)
    render_still(
        pad, out, face_dir(), models_dir=models_dir, model=model, identity=identity, width=size[0], height=size[1]
    )
    click.echo(f"Written: {out}")
