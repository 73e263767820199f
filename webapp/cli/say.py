"""``padlab say``: from a sentence to a clip; ``padlab text``: what is found in it."""

import json
import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from synth.clip import render_clip
from synth.clip_spec import ClipSpec
from synth.errors import SpecError
from synth.experiments import CONDITIONS, condition_fields
from synth.expression.models import DEFAULT_MODEL, MODEL_NAMES, load_model
from synth.fap.table import column
from synth.files import write_whole
from synth.head.trajectory import KINDS as HEAD_KINDS
from synth.interchange.emotionml import write_emotionml
from synth.plan import ClipPlan, plan_clip, sentence_of
from synth.plot import plot_clip
from synth.speech.recorded import read_recording
from synth.text.analysis import guess_language
from synth.text.annotated import AnnotatedText, read_annotated
from synth.text.sentence import LANGUAGES
from webapp.cli.animation import write_animation
from webapp.cli.context import NEGATIVE_NUMBERS, echo_json, progress_bar
from webapp.cli.options import (
    FILE,
    ModelType,
    check_out,
    end_on_signals,
    face_dir,
    identity_option,
    size_option,
    voice_option,
)
from webapp.config import Settings
from webapp.errors import NotFoundError

FIELDS = {"face_model": "model"} | {
    name: name for name in ("lang", "voice", "pad", "head", "intensity", "delta", "mute", "identity", "seed")
}
"""Options to the fields of the clip that they set."""


class TextType(click.ParamType[str]):
    """What is said; it may begin with a minus sign, but a misspelt option is not said."""

    name = "text"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the text."""
        written = str(value)
        if re.fullmatch(r"--?[a-z][a-z-]*(=.*)?", written):
            known = [option for one in ctx.command.params for option in one.opts] if ctx else []
            raise click.NoSuchOption(written, possibilities=get_close_matches(written, known), ctx=ctx)
        return written


# With -h among the options, click would find it in the letters of "-5 degrees, and then it thaws".
TEXT_MAY_BEGIN_WITH_MINUS = {**NEGATIVE_NUMBERS, "help_option_names": ["--help"]}


class SentenceCommand(click.Command):
    """A command with a TEXT that may begin with a minus sign."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; -h alone still asks for help."""
        return super().parse_args(ctx, ["--help" if one == "-h" else one for one in args])


lang_option = click.option(
    "--lang", type=click.Choice(LANGUAGES), help="Language [default: Chinese if it has Chinese characters]."
)


@click.command(cls=SentenceCommand, context_settings=TEXT_MAY_BEGIN_WITH_MINUS)
@click.argument("text", type=TextType(), required=False)
@click.option("--out", type=FILE, required=True, help="The clip (MP4).")
@lang_option
@click.option(
    "--annotated",
    type=FILE,
    help="Instead of TEXT: words with P and A (word|P|A), SSML or EmotionML; what --emotionml wrote gives its clip, "
    "changed by the options given.",
)
@click.option("--pad", nargs=3, type=float, help="The emotion P A D of the face [default: the text's].")
@click.option(
    "--condition",
    type=click.Choice(list(CONDITIONS)),
    help="A condition of MTAP 2013, Table 9: sets --head and --face.",
)
@click.option("--head", type=click.Choice(HEAD_KINDS), help="How the head moves [default: prosodic].")
@click.option(
    "--face",
    "face_model",
    type=ModelType(),
    metavar="NAME",
    help=f"From PAD to expression: {', '.join(MODEL_NAMES)}, or SET/KIND of a set of `padlab train` [default: "
    f"{DEFAULT_MODEL}].",
)
@click.option(
    "--intensity",
    type=click.FloatRange(0.0, 1.5),
    default=ClipSpec.intensity,
    show_default=True,
    help="Of the expression.",
)
@click.option(
    "--delta",
    type=click.FloatRange(0.0, 1.0),
    default=ClipSpec.delta,
    show_default=True,
    help="Viseme's share (Eq. 14).",
)
@click.option("--still", is_flag=True, help="Without blinks and small shifts of gaze.")
@voice_option
@click.option("--mute", is_flag=True, help="Without sound; the timing stays.")
@click.option("--audio", type=FILE, help="Recorded speech (WAV) instead of a voice; with --align.")
@click.option("--align", type=FILE, help="When its phones are heard (CSV).")
@identity_option
@size_option
@click.option(
    "--seed", type=click.IntRange(0, 2**32 - 1), default=ClipSpec.seed, show_default=True, help="Seed of all chance."
)
@click.option("--fap", type=FILE, help="Write the clip's FAP values (FAP file).")
@click.option("--arkit", type=FILE, help="Write its animation as ARKit weights (JSON or CSV).")
@click.option("--gltf", type=FILE, help="Write figure and animation (GLB).")
@click.option("--lineage", type=FILE, help="Write how it was made (JSON).")
@click.option("--emotionml", type=FILE, help="Write text, appraisal and clip as EmotionML (XML).")
@click.option("--plot", type=FILE, help="Plot head angles, words and peaks (SVG or PNG).")
@click.pass_context
def say(ctx: click.Context, /, **given: Any) -> None:
    """Make a clip of a face that says TEXT, in English or Chinese.

    The face expresses what the text says (its target P A D), or --pad; the head nods with the words.
    """
    end_on_signals()
    files = {name: given[name] for name in ("out", "fap", "arkit", "gltf", "lineage", "emotionml", "plot")}
    _check_files(files, {name: given[name] for name in ("annotated", "audio", "align")})
    asked = {name for name in given if ctx.get_parameter_source(name) is not ParameterSource.DEFAULT}
    spec = _spec({name: value for name, value in given.items() if name in asked})
    models_dir = Settings.from_env().models_dir
    load_model(spec.model, models_dir)
    plan = plan_clip(spec, models_dir, speech=_recording(spec, given["audio"], given["align"]))
    if plan.sentence is None:
        raise click.UsageError("There is nothing to say: give a TEXT with words, or --annotated FILE.")
    folder = face_dir()
    with progress_bar("Rendering frames") as update:
        made = render_clip(spec, files["out"], folder, models_dir, plan=plan, on_progress=update)
    click.echo(f"Written: {files['out']}")
    _write_beside(plan, made, files, folder)


@click.command(cls=SentenceCommand, context_settings=TEXT_MAY_BEGIN_WITH_MINUS)
@click.argument("text", type=TextType())
@lang_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def text(text: str, lang: str | None, as_json: bool) -> None:
    """Tell what is found in TEXT: prosodic words with P and A, syllables, tones, stress; its goal and target P A D."""
    sentence = sentence_of(ClipSpec(text=text, lang=lang or guess_language(text)))
    if sentence is None:
        raise click.UsageError("There is nothing to analyse: give a TEXT with words.")
    if as_json:
        echo_json(sentence.to_dict())
        return
    for word in sentence.words:
        parts = " ".join(f"{one.text}{one.tone or ''}{'*' if one.stress else ''}" for one in word.syllables)
        click.echo(f"{word.text}\tP {word.P:+.0f}\tA {word.A:.1f}\t{parts}")
    click.echo(f"Goal: {sentence.goal}, D {sentence.D:+.1f}. Target PAD: {sentence.target.as_tuple()}")
    click.echo("A number is a tone, * marks where the head's peak is wanted.", err=True)


def _check_files(files: dict[str, Path | None], read: dict[str, Path | None]) -> None:
    """Refuse files that could not be written, that are named twice, or that are read, before any work is done."""
    suffixes = {
        **{"out": (".mp4",), "fap": (".fap",), "arkit": (".json", ".csv"), "gltf": (".glb",)},
        **{"lineage": (".json",), "emotionml": (".xml", ".emotionml"), "plot": (".svg", ".png")},
    }
    taken = {path.resolve(): name for name, path in read.items() if path is not None}
    for name, path in files.items():
        check_out(path, *suffixes[name], option=f"--{name}")
        if path is None:
            continue
        place = path.resolve()
        if place in taken:
            raise click.BadParameter(
                f"'{path}' is the file of --{taken[place]}, too; name another", param_hint=f"--{name}"
            )
        taken[place] = name


def _spec(given: dict[str, Any]) -> ClipSpec:
    """Return the specification that the options ask for; ``given`` has only those that were given."""
    if ("text" in given) == ("annotated" in given):
        raise click.UsageError("Give TEXT or --annotated FILE, one of them.")
    fields = _annotated(given["annotated"]) if "annotated" in given else {"text": given["text"]}
    fields |= {field: given[option] for option, field in FIELDS.items() if option in given}
    if "size" in given:
        fields |= {"width": given["size"][0], "height": given["size"][1]}
    if "still" in given:
        fields |= {"blinks": False, "gaze": False}
    if "condition" in given:
        if "head" in given or "face_model" in given:
            raise click.UsageError("--condition sets --head and --face; leave these out.")
        fields |= condition_fields(given["condition"])
    return ClipSpec(**{"lang": guess_language(fields["text"]), **fields})


def _annotated(path: Path) -> dict[str, Any]:
    """Return the fields that a file of annotated text sets; all if it is EmotionML that padlab wrote for a clip."""
    if not path.is_file():
        raise NotFoundError(f"There is no file {path}; --annotated takes one that exists")
    found = read_annotated(path)
    own: dict[str, Any] = {}
    if found.clip is not None:
        try:
            clip = ClipSpec.from_dict(found.clip)
        except SpecError as error:
            raise SpecError(f"{path}: {error}") from None
        own = clip.to_dict()
        if _unchanged(found, clip):
            return own
    language = {} if found.lang is None else {"lang": found.lang}
    return own | language | {"text": found.text, "words": found.words, "dominance": found.D}


def _unchanged(found: AnnotatedText, clip: ClipSpec) -> bool:
    """Tell whether a sentence is as its clip's text is understood anyway, so that nothing of it has to be set."""
    if (found.text, found.lang) != (clip.text, clip.lang):
        return False
    sentence = sentence_of(clip)
    if sentence is None or sentence.D != found.D:
        return False
    words = [(word.start, word.text, word.P, word.A) for word in sentence.words]
    return words == [(start, *word) for (start, _), word in zip(found.spans, found.words, strict=True)]


def _recording(spec: ClipSpec, audio: Path | None, align: Path | None) -> Any:
    if (audio is None) != (align is None):
        raise click.UsageError("--audio and --align go together: the sound, and when its phones are heard.")
    if audio is None or align is None:
        return None
    for path in (audio, align):
        if not path.is_file():
            raise NotFoundError(f"There is no file {path}")
    sentence = sentence_of(spec)
    return None if sentence is None else read_recording(audio, align, sentence)


def _write_beside(plan: ClipPlan, made: dict[str, Any], files: dict[str, Path | None], folder: Path) -> None:
    spec = plan.spec
    animations = [path for path in (files["fap"], files["arkit"], files["gltf"]) if path is not None]
    write_animation(plan.faps, animations, folder, fps=spec.fps, identity=spec.identity)
    if files["lineage"] is not None:
        write_whole(files["lineage"], json.dumps(made, ensure_ascii=False, indent=1))
    if files["emotionml"] is not None and plan.sentence is not None:
        write_emotionml(files["emotionml"], plan.sentence, clip=spec.to_dict())
    if files["plot"] is not None:
        plot_clip(plan.head.angles, spec.fps, plan.words, plan.head, files["plot"], mouth=plan.faps[:, column(3)])
    for name in ("lineage", "emotionml", "plot"):
        if files[name] is not None:
            click.echo(f"Written: {files[name]}")
