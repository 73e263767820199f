"""What the commands that make faces share: sizes, files to write, face data."""

import re
import signal
import sys
import tempfile
from pathlib import Path

import click

from synth.errors import SynthError
from synth.expression.models import DEFAULT_MODEL, MODEL_NAMES, check_model_name
from synth.face import assets
from synth.face.identity import DEFAULT_IDENTITY
from synth.speech.voices import DEFAULT_VOICE, VOICES
from webapp.config import Settings
from webapp.errors import ConfigError

_SIZE = re.compile(r"(\d{2,4})[x×](\d{2,4})")


class SizeType(click.ParamType[tuple[int, int]]):
    """A picture's size, WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Read the size."""
        match = _SIZE.fullmatch(str(value))
        if match is None:
            self.fail(f"'{value}' is no size; it takes WIDTHxHEIGHT in pixels, for instance 720x576", param, ctx)
        return int(match[1]), int(match[2])


FILE = click.Path(path_type=Path, dir_okay=False)
identity_option = click.option("--identity", default=DEFAULT_IDENTITY, show_default=True, help="Whose face.")
size_option = click.option(
    "--size", type=SizeType(), default="720x576", show_default=True, help="Size of the picture in pixels."
)
voice_option = click.option(
    "--voice",
    type=click.Choice(list(VOICES)),
    default=DEFAULT_VOICE,
    show_default=True,
    help="Who speaks; hibari (English only) needs padlab[voice].",
)


class ModelType(click.ParamType[str]):
    """The name of a model, or one of some more words."""

    name = "model"

    def __init__(self, *others: str) -> None:
        self._others = others

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Check a name; whether the set that it names exists is found when it is loaded."""
        if value in self._others:
            return str(value)
        try:
            return check_model_name(value)
        except SynthError as error:
            also = f" (or {', '.join(self._others)})" if self._others else ""
            self.fail(f"{error}{also}", param, ctx)


model_option = click.option(
    "--model",
    type=ModelType(),
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="NAME",
    help=f"From PAD to expression: {', '.join(MODEL_NAMES)}, or SET/KIND of a set made by `padlab train`.",
)


def check_out(out: Path | None, *suffixes: str, option: str = "--out") -> None:
    """Refuse a file that could not be written, before any work is done for it.

    Parameters
    ----------
    out : Path, optional
        The file; None, an option that was not given, is fine.
    *suffixes : str
        How its name may end, for instance ".png".
    option : str
        Its option, for messages.

    Raises
    ------
    click.BadParameter
        If the name ends otherwise.
    ConfigError
        If the folder does not exist or cannot be written to.
    """
    if out is None:
        return
    if out.suffix.lower() not in suffixes:
        raise click.BadParameter(f"'{out}' must end with {' or '.join(suffixes)}", param_hint=option)
    folder = out.resolve().parent
    if not folder.is_dir():
        raise ConfigError(f"The folder {folder} does not exist; make it, or name another with {option}")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ConfigError(
            f"The folder {folder} cannot be written to ({error.strerror or error}); name another with {option}"
        ) from error


def end_on_signals() -> None:
    """Let a closed terminal or a stopped service end the command as Ctrl-C does: with nothing half-written left."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda which, _frame: sys.exit(128 + which))


def face_dir() -> Path:
    """Return the folder of the face data, fetched if it was missing."""
    folder = Settings.from_env().face_dir
    if not assets.is_compiled(folder):
        click.echo("Fetching the face data (48 MB, once)", err=True)
        assets.fetch(folder)
    return folder
