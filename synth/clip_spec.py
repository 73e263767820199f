"""The specification of a clip: everything that it depends on besides the face data, the models and the renderer."""

import json
import unicodedata
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from synth.errors import SpecError
from synth.expression.models import DEFAULT_MODEL, check_model_name
from synth.face.identity import DEFAULT_IDENTITY, IDENTITIES
from synth.head.trajectory import KINDS as HEAD_KINDS
from synth.head.trajectory import TRANSITIONS
from synth.pad import PAD
from synth.speech.voices import DEFAULT_VOICE, check_voice
from synth.text.sentence import LANGUAGES, LONGEST_TEXT

INTENSITIES = (0.0, 1.5)
"""Least and largest factor of an expression."""

# Inclusive ranges of the numeric fields; a hold of 0.1 s leaves at least one frame at any frame rate.
_REAL_RANGES = {
    "intensity": INTENSITIES,
    "delta": (0.0, 1.0),
    "neutral_s": (0.0, 10.0),
    "onset_s": (0.0, 10.0),
    "hold_s": (0.1, 120.0),
    "offset_s": (0.0, 10.0),
}
_WHOLE_RANGES = {"width": (16, 3840), "height": (16, 2160), "fps": (10, 120), "seed": (0, 2**32 - 1)}
_SWITCHES = ("mute", "blinks", "gaze")


@dataclass(frozen=True, kw_only=True)
class ClipSpec:
    """Everything a clip depends on besides the face data, the models and the renderer.

    Parameters
    ----------
    text : str
        The sentence, up to 2000 characters; empty for an expression without speech.
    lang : {"en", "zh"}
        Language of the text.
    voice : str
        Who speaks, one of `synth.speech.voices.VOICES` that speaks the language.
    words : tuple of (str, float or None, float or None)
        Prosodic words with P and A that are given instead of found, see `synth.text.analysis.analyse`.
    dominance : float or None
        D of the sentence that is given instead of found.
    pad : tuple of float, or None
        Pleasure, arousal, dominance of the expression, each in [-1, 1]; None: the text's target PAD (MTAP 2013,
        section 5.4), and neutral without text.
    model : str
        From PAD to the face, see `synth.expression.models.load_model`.
    intensity : float
        Factor of the partial expression parameters, 0 to 1.5.
    head : {"prosodic", "random", "static"}
        How the head moves with the text (MTAP 2013, Table 9).
    transition : {"average", "glide"}
        How one word's motion passes into the next: the paper's moving average, or smoother.
    delta : float
        Weight of the viseme against the expression (MTAP 2013, Eq. 14), 0 to 1.
    mute : bool
        Leave the sound out; all else stays.
    blinks, gaze : bool
        Whether the eyes blink, and move a little.
    identity : str
        Name of the face.
    width, height : int
        Frame size in pixels, even numbers.
    fps : int
        Frames per second, 10 to 120.
    neutral_s, onset_s, hold_s, offset_s : float
        Seconds of the neutral face, of the way to the expression, (at least) of the expression held, and of the way
        out of it after a spoken text.
    seed : int
        Seed of blinks, gaze and the chance in the head's motion, 0 to 2**32 - 1.

    Raises
    ------
    SpecError
        If a field is of the wrong type or out of range.
    """

    text: str = ""
    lang: str = "en"
    voice: str = DEFAULT_VOICE
    words: tuple[tuple[str, float | None, float | None], ...] = ()
    dominance: float | None = None
    pad: tuple[float, float, float] | None = None
    model: str = DEFAULT_MODEL
    intensity: float = 1.0
    head: str = "prosodic"
    transition: str = "glide"
    delta: float = 0.5
    mute: bool = False
    blinks: bool = True
    gaze: bool = True
    identity: str = DEFAULT_IDENTITY
    width: int = 720
    height: int = 576
    fps: int = 25
    neutral_s: float = 0.4
    onset_s: float = 0.5
    hold_s: float = 1.6
    offset_s: float = 0.4
    seed: int = 0

    def __post_init__(self) -> None:
        _check_text(self.text)
        for name, choices in {
            "lang": LANGUAGES,
            "head": HEAD_KINDS,
            "transition": tuple(TRANSITIONS),
            "identity": tuple(IDENTITIES),
        }.items():
            check_choice(name, getattr(self, name), choices)
        check_voice(self.voice, self.lang)
        check_model_name(self.model)
        # Equal specifications must be written alike, so 1 becomes 1.0 and -0.0 becomes 0.0.
        if self.pad is not None:
            object.__setattr__(self, "pad", PAD.parse(self.pad).as_tuple())
        if self.dominance is not None:
            object.__setattr__(self, "dominance", PAD(0.0, 0.0, self.dominance).D)
        object.__setattr__(self, "words", _annotation(self.words))
        for name, (low, high) in _REAL_RANGES.items():
            object.__setattr__(self, name, real(name, getattr(self, name), low, high))
        for name, (low, high) in _WHOLE_RANGES.items():
            _check_whole(name, getattr(self, name), low, high)
        for name in _SWITCHES:
            if not isinstance(getattr(self, name), bool):
                raise SpecError(f"Clip: {name} is {getattr(self, name)!r}, but must be true or false.")
        for name in ("width", "height"):
            if getattr(self, name) % 2:
                raise SpecError(f"Clip: {name} is {getattr(self, name)}, but must be even, as the video format asks.")

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as plain JSON values."""
        pad = None if self.pad is None else list(self.pad)
        return {**asdict(self), "pad": pad, "words": [list(row) for row in self.words]}

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


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise a `SpecError` if a value is not one of those that there are."""
    if value not in choices:
        raise SpecError(f"Clip: {name} is {value!r}, but must be one of {', '.join(choices)}.")


def real(name: str, value: object, low: float, high: float) -> float:
    """Return a number from ``low`` to ``high``; anything else raises a `SpecError`."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise SpecError(f"Clip: {name} is {value!r}, but must be a number from {low:g} to {high:g}.")
    return float(value) + 0.0


def _check_text(text: object) -> None:
    if not isinstance(text, str):
        raise SpecError(f"Clip: text is {text!r}, but must be a string.")
    if len(text) > LONGEST_TEXT:
        raise SpecError(f"Clip: text has {len(text)} characters, but at most {LONGEST_TEXT} are spoken in one clip.")
    for char in text:
        if unicodedata.category(char) in {"Cc", "Cs"} and char not in "\t\n\r":
            raise SpecError(f"Clip: text contains the character U+{ord(char):04X}, but must be printable text.")


def _annotation(words: object) -> tuple[tuple[str, float | None, float | None], ...]:
    if not isinstance(words, (tuple, list)):
        raise SpecError(f"Clip: words is {words!r}, but must be a list of words, each with its P and A.")
    return tuple(map(_annotated, words))


def _annotated(row: object) -> tuple[str, float | None, float | None]:
    if isinstance(row, (tuple, list)) and len(row) == 3 and isinstance(row[0], str):
        word, P, A = row
        return word, None if P is None else PAD(P=P).P, None if A is None else PAD(A=A).A
    raise SpecError(f"Clip: the word {row!r} is not a list of a word, its P and its A.")


def _check_whole(name: str, value: object, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SpecError(f"Clip: {name} is {value!r}, but must be a whole number from {low} to {high}.")
