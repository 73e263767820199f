"""The clip: a short film of an expressive face, as a pure function of its specification."""

import json
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from synth.errors import SpecError
from synth.pad import PAD

LANGUAGES = ("en", "zh")
MODELS = ("table", "linear", "quadratic")
MAX_TEXT = 1000
_IDENTITY = re.compile(r"[a-z][a-z0-9_-]{0,39}")

# Inclusive ranges of the numeric fields; a hold of 0.1 s leaves at least one frame at any frame rate.
_REAL_RANGES = {"intensity": (0.0, 1.5), "neutral_s": (0.0, 10.0), "onset_s": (0.0, 10.0), "hold_s": (0.1, 120.0)}
_WHOLE_RANGES = {"width": (16, 3840), "height": (16, 2160), "fps": (10, 120), "seed": (0, 2**32 - 1)}


@dataclass(frozen=True, kw_only=True)
class ClipSpec:
    """Everything a clip depends on besides the face data and the renderer.

    Parameters
    ----------
    text : str
        The sentence, up to 1000 characters; empty for an expression without speech.
    lang : {"en", "zh"}
        Language of the text.
    pad : tuple of float
        Pleasure, arousal, dominance, each in [-1, 1].
    model : {"table", "linear", "quadratic"}
        The PAD to PEP model.
    intensity : float
        Factor of the partial expression parameters, 0 to 1.5.
    identity : str
        Name of the face.
    width, height : int
        Frame size in pixels, even numbers.
    fps : int
        Frames per second, 10 to 120.
    neutral_s, onset_s, hold_s : float
        Seconds of the neutral face, of the way to the expression, and (at least) of the expression held.
    seed : int
        Seed of the small life in the face (blinks), 0 to 2**32 - 1.

    Raises
    ------
    SpecError
        If a field is of the wrong type or out of range.
    """

    text: str = ""
    lang: str = "en"
    pad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    model: str = "table"
    intensity: float = 1.0
    identity: str = "default"
    width: int = 720
    height: int = 576
    fps: int = 25
    neutral_s: float = 0.4
    onset_s: float = 0.5
    hold_s: float = 1.6
    seed: int = 0

    def __post_init__(self) -> None:
        _check_text(self.text)
        _check_choice("lang", self.lang, LANGUAGES)
        _check_choice("model", self.model, MODELS)
        if not isinstance(self.identity, str) or not _IDENTITY.fullmatch(self.identity):
            raise SpecError(
                f"Clip: identity is {self.identity!r}, but must be 1 to 40 lower-case letters, digits, - and _, "
                "beginning with a letter."
            )
        # Equal specifications must be written alike, so 1 becomes 1.0 and -0.0 becomes 0.0.
        object.__setattr__(self, "pad", PAD.parse(self.pad).as_tuple())
        for name, (low, high) in _REAL_RANGES.items():
            object.__setattr__(self, name, _real(name, getattr(self, name), low, high))
        for name, (low, high) in _WHOLE_RANGES.items():
            _check_whole(name, getattr(self, name), low, high)
        for name in ("width", "height"):
            if getattr(self, name) % 2:
                raise SpecError(f"Clip: {name} is {getattr(self, name)}, but must be even, as the video format asks.")

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as plain JSON values."""
        return {**asdict(self), "pad": list(self.pad)}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Make a specification of plain JSON values; fields left out take their defaults.

        Raises
        ------
        SpecError
            If a name is unknown or a value is not valid.
        """
        known = [field.name for field in fields(cls)]
        unknown = sorted(set(values) - set(known))
        if unknown:
            raise SpecError(f"Clip: there is no field {', '.join(unknown)}; the fields are {', '.join(known)}.")
        return cls(**values)

    def canonical(self) -> str:
        """Return the one JSON text of this specification: sorted keys, no spaces, ASCII only."""
        return json.dumps(self.to_dict(), sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def _check_text(text: object) -> None:
    if not isinstance(text, str):
        raise SpecError(f"Clip: text is {text!r}, but must be a string.")
    if len(text) > MAX_TEXT:
        raise SpecError(f"Clip: text has {len(text)} characters, but at most {MAX_TEXT} are spoken in one clip.")
    for char in text:
        if unicodedata.category(char) in {"Cc", "Cs"} and char not in "\t\n\r":
            raise SpecError(f"Clip: text contains the character U+{ord(char):04X}, but must be printable text.")


def _check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise SpecError(f"Clip: {name} is {value!r}, but must be one of {', '.join(choices)}.")


def _real(name: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise SpecError(f"Clip: {name} is {value!r}, but must be a number from {low:g} to {high:g}.")
    return float(value) + 0.0


def _check_whole(name: str, value: object, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SpecError(f"Clip: {name} is {value!r}, but must be a whole number from {low} to {high}.")
