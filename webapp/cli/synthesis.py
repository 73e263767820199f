"""``padlab face`` and ``padlab say``: one face, one clip."""

import json
import re
from pathlib import Path

import click

from synth.clip import ClipSpec, clip_faps, render_clip, render_still
from synth.expression.models import DEFAULT_MODEL, MODEL_NAMES, load_model
from synth.face.identity import find_identity
from synth.files import write_whole
from synth.pad import PAD
from webapp.cli.animation import write_animation
from webapp.cli.context import NEGATIVE_NUMBERS
from webapp.cli.description import describe_file
from webapp.cli.options import (
    FILE,
    ModelType,
    check_out,
    end_on_signals,
    face_dir,
    identity_option,
    model_option,
    size_option,
)
from webapp.config import Settings

NEUTRAL = "neutral"

CJK = re.compile(r"[\u3400-\u9fff]")


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


@click.command(context_settings=NEGATIVE_NUMBERS)
@click.argument("text")
@click.option("--out", type=FILE, required=True, help="The clip (MP4).")
@click.option("--lang", type=click.Choice(["en", "zh"]), help="Language [default: Chinese if it has Chinese letters].")
@click.option("--pad", nargs=3, type=float, default=(0.55, 0.24, 0.28), show_default=True, help="The emotion P A D.")
@click.option(
    "--face",
    "face_model",
    type=ModelType(NEUTRAL),
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="NAME",
    help=f"From PAD to expression: {', '.join(MODEL_NAMES)}, SET/KIND of a set made by `padlab train`, or neutral.",
)
@click.option("--mute", is_flag=True, help="Without sound (clips are silent for now, so this changes nothing yet).")
@identity_option
@size_option
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of the blinks.")
@click.option("--fap", type=FILE, help="Write the clip's FAP values (FAP file).")
@click.option("--arkit", type=FILE, help="Write its animation as ARKit weights (JSON or CSV).")
@click.option("--gltf", type=FILE, help="Write figure and animation (GLB).")
@click.option("--lineage", type=FILE, help="Write how it was made (JSON).")
def say(
    *,
    text: str,
    out: Path,
    lang: str | None,
    pad: tuple[float, float, float],
    face_model: str,
    mute: bool,
    identity: str,
    size: tuple[int, int],
    seed: int,
    fap: Path | None,
    arkit: Path | None,
    gltf: Path | None,
    lineage: Path | None,
) -> None:
    """Make a clip that is as long as TEXT takes to say, with the expression of the emotion --pad."""
    end_on_signals()
    check_out(out, ".mp4")
    check_out(fap, ".fap", option="--fap")
    check_out(arkit, ".json", ".csv", option="--arkit")
    check_out(gltf, ".glb", option="--gltf")
    check_out(lineage, ".json", option="--lineage")
    if arkit is not None and lineage is not None and arkit.resolve() == lineage.resolve():
        raise click.BadParameter(f"'{arkit}' is the file of --lineage, too; name another", param_hint="--arkit")
    neutral = face_model == NEUTRAL
    spec = ClipSpec(
        text=text,
        lang=lang or ("zh" if CJK.search(text) else "en"),
        pad=(0.0, 0.0, 0.0) if neutral else pad,
        model=DEFAULT_MODEL if neutral else face_model,
        identity=identity,
        width=size[0],
        height=size[1],
        seed=seed,
    )
    models_dir = Settings.from_env().models_dir
    load_model(spec.model, models_dir)
    folder = face_dir()
    made = render_clip(spec, out, folder, models_dir)
    click.echo(f"Written: {out}")
    files = [path for path in (fap, arkit, gltf) if path is not None]
    write_animation(clip_faps(spec, models_dir), files, folder, fps=spec.fps, identity=identity)
    if lineage is not None:
        write_whole(lineage, json.dumps(made, ensure_ascii=False, indent=1))
        click.echo(f"Written: {lineage}")
