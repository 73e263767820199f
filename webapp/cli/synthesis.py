"""``padlab face`` and ``padlab say``: one face, one clip."""

import json
import re
from pathlib import Path

import click

from synth.clip import ClipSpec, render_clip, render_still
from synth.expression.pad_pep import MODEL_NAMES
from synth.face import assets
from synth.face.identity import DEFAULT_IDENTITY
from synth.pad import PAD
from webapp.cli.context import NEGATIVE_NUMBERS
from webapp.config import Settings
from webapp.errors import ConfigError

SIZE = re.compile(r"(\d{2,4})[x×](\d{2,4})")
CJK = re.compile(r"[\u3400-\u9fff]")


class SizeType(click.ParamType[tuple[int, int]]):
    """A picture's size, WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Read the size."""
        match = SIZE.fullmatch(str(value))
        if match is None:
            self.fail(f"'{value}' is no size; it takes WIDTHxHEIGHT in pixels, for instance 720x576", param, ctx)
        return int(match[1]), int(match[2])


def _face_dir() -> Path:
    folder = Settings.from_env().face_dir
    if not assets.is_compiled(folder):
        click.echo("Fetching the face data (48 MB, once)", err=True)
        assets.fetch(folder)
    return folder


def _check_out(out: Path, suffix: str, *, option: str = "--out") -> None:
    if out.suffix.lower() != suffix:
        raise click.BadParameter(f"'{out}' must end with {suffix}", param_hint=option)
    if not out.resolve().parent.is_dir():
        raise ConfigError(f"The folder {out.resolve().parent} does not exist; make it, or name another with {option}")


@click.command(context_settings=NEGATIVE_NUMBERS)
@click.argument("p", type=float)
@click.argument("a", type=float)
@click.argument("d", type=float)
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="The picture (PNG).")
@click.option(
    "--model", type=click.Choice(MODEL_NAMES), default="table", show_default=True, help="From PAD to expression."
)
@click.option("--identity", default=DEFAULT_IDENTITY, show_default=True, help="Whose face.")
@click.option("--size", type=SizeType(), default="720x576", show_default=True)
def face(*, p: float, a: float, d: float, out: Path, model: str, identity: str, size: tuple[int, int]) -> None:
    """Draw the face of the emotion P A D (pleasure, arousal, dominance, each from -1 to 1)."""
    _check_out(out, ".png")
    # Checked before the face data is fetched: a wrong number should not cost a download.
    pad = PAD.parse((p, a, d)).as_tuple()
    render_still(pad, out, _face_dir(), model=model, identity=identity, width=size[0], height=size[1])
    click.echo(f"Written: {out}")


@click.command(context_settings=NEGATIVE_NUMBERS)
@click.argument("text")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="The clip (MP4).")
@click.option("--lang", type=click.Choice(["en", "zh"]), help="Language [default: Chinese if it has Chinese letters].")
@click.option("--pad", nargs=3, type=float, default=(0.55, 0.24, 0.28), show_default=True, help="The emotion P A D.")
@click.option(
    "--face",
    "face_model",
    type=click.Choice([*MODEL_NAMES, "neutral"]),
    default="table",
    show_default=True,
    help="From PAD to expression; neutral shows none.",
)
@click.option("--mute", is_flag=True, help="Without sound (clips are silent for now, so this changes nothing yet).")
@click.option("--identity", default=DEFAULT_IDENTITY, show_default=True, help="Whose face.")
@click.option("--size", type=SizeType(), default="720x576", show_default=True)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of the blinks.")
@click.option("--lineage", type=click.Path(path_type=Path, dir_okay=False), help="Write how it was made (JSON).")
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
    lineage: Path | None,
) -> None:
    """Make a clip that is as long as TEXT takes to say, with the expression of the emotion --pad."""
    _check_out(out, ".mp4")
    if lineage is not None:
        _check_out(lineage, ".json", option="--lineage")
    neutral = face_model == "neutral"
    spec = ClipSpec(
        text=text,
        lang=lang or ("zh" if CJK.search(text) else "en"),
        pad=(0.0, 0.0, 0.0) if neutral else pad,
        model="table" if neutral else face_model,
        identity=identity,
        width=size[0],
        height=size[1],
        seed=seed,
    )
    made = render_clip(spec, out, _face_dir())
    if lineage is not None:
        lineage.write_text(json.dumps(made, ensure_ascii=False, indent=1), encoding="utf-8")
    click.echo(f"Written: {out}")
