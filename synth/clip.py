"""The clip: a short film of an expressive face, as a pure function of its specification."""

import hashlib
import json
import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.course import Course, blink_track, expression_track
from synth.expression.models import DEFAULT_MODEL, ExpressionModel, check_model_name, load_model
from synth.face.identity import DEFAULT_IDENTITY, IDENTITIES
from synth.fap.table import FAP_COUNT, check_sequence
from synth.lineage import digests, expression, picture_digests, versions
from synth.pad import PAD
from synth.stage import Stage
from synth.video import write_png

Floats = NDArray[np.float64]

LANGUAGES = ("en", "zh")
MAX_TEXT = 1000

_SECONDS_PER_WORD = 0.35
_SECONDS_PER_CHARACTER = 0.25

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
    model : str
        From PAD to the face, see `synth.expression.models.load_model`.
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
    model: str = DEFAULT_MODEL
    intensity: float = 1.0
    identity: str = DEFAULT_IDENTITY
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
        check_model_name(self.model)
        _check_choice("identity", self.identity, tuple(IDENTITIES))
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

    @property
    def course(self) -> Course:
        """When the expression comes; the hold is as long as asked, or longer if the text needs it."""
        characters = sum("\u3400" <= char <= "\u9fff" for char in self.text)
        words = len(re.findall(r"[^\W\u3400-\u9fff]+(?:['’-][^\W\u3400-\u9fff]+)*", self.text))
        spoken_s = _SECONDS_PER_WORD * words + _SECONDS_PER_CHARACTER * characters
        hold_s = max(self.hold_s, spoken_s)
        return Course(fps=self.fps, neutral_s=self.neutral_s, onset_s=self.onset_s, hold_s=hold_s)

    def canonical(self) -> str:
        """Return the one JSON text of this specification: sorted keys, no spaces, ASCII only."""
        return json.dumps(self.to_dict(), sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def clip_digest(spec: ClipSpec, face_dir: Path, models_dir: Path | None = None) -> str:
    """Return the clip's identity: the SHA-256 (hex) of all that its pictures depend on.

    Parameters
    ----------
    spec : ClipSpec
        The specification.
    face_dir : Path
        Folder of the compiled face data.
    models_dir : Path, optional
        Folder of trained models, for specifications that name one.

    Raises
    ------
    AssetError
        If the face data are missing or damaged.
    SpecError
        If there is no such model.
    """
    model = load_model(spec.model, models_dir)
    return hashlib.sha256(json.dumps(digests(model, face_dir) | {"spec": spec.canonical()}).encode()).hexdigest()


def clip_faps(spec: ClipSpec, models_dir: Path | None = None) -> Floats:
    """Return the FAP values of a clip: (T, 68) float64, in FAPU; ``models_dir`` as in `clip_digest`."""
    _, apex = _apex(spec.pad, load_model(spec.model, models_dir), spec.intensity)
    expression = expression_track(apex, spec.course)
    tracks = [expression, blink_track(expression, spec.course, np.random.default_rng(spec.seed))]
    faps: Floats = np.sum(tracks, axis=0)
    return faps


def render_clip(spec: ClipSpec, out: Path, face_dir: Path, models_dir: Path | None = None) -> dict[str, Any]:
    """Render a clip to an MP4 file; equal specifications give equal bytes.

    Parameters
    ----------
    spec : ClipSpec
        The specification.
    out : Path
        The file; it appears complete or not at all. Its folder must exist.
    face_dir, models_dir
        As in `clip_digest`.

    Returns
    -------
    dict
        The lineage as plain JSON values: specification, text, PAD, PEP, FAP targets, seed, digests, versions, frames
        and duration.

    Raises
    ------
    AssetError, RenderError, VideoError
        If the face data are missing, OpenGL does not start, or the file cannot be written.
    """
    model = load_model(spec.model, models_dir)
    stage = Stage(face_dir, spec.identity)
    faps = clip_faps(spec, models_dir)
    stage.film(faps, out, fps=spec.fps, width=spec.width, height=spec.height)
    pep, apex = _apex(spec.pad, model, spec.intensity)
    return {
        "digest": clip_digest(spec, face_dir, models_dir),
        "spec": spec.to_dict(),
        "text": spec.text,
        "seed": spec.seed,
        "frames": len(faps),
        "duration_s": len(faps) / spec.fps,
        **expression(spec.pad, pep, apex),
        "digests": digests(model, face_dir),
        "versions": versions(),
    }


def render_faps(
    values: NDArray[np.floating] | Floats,
    out: Path,
    face_dir: Path,
    *,
    fps: int = 25,
    identity: str = DEFAULT_IDENTITY,
    width: int = 720,
    height: int = 576,
    audio: Path | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Render FAP values to an MP4 file, frame after frame: a long film takes no more memory than a short one.

    Parameters
    ----------
    values : (T, 68)
        FAP values in FAPU, at least one frame.
    out : Path
        The file; it appears complete or not at all. Its folder must exist.
    face_dir : Path
        Folder of the compiled face data.
    fps : int
        Frames per second.
    identity, width, height
        As in `ClipSpec`.
    audio : Path, optional
        Sound (WAV), from the film's beginning; see `synth.video.VideoWriter`.
    on_progress : callable, optional
        Called with the number of finished frames and of all.

    Returns
    -------
    dict
        The lineage as plain JSON values: digests of FAP values and sound, identity, size, frames, duration, digests,
        versions.

    Raises
    ------
    SpecError
        If an argument is not valid.
    AssetError, RenderError, VideoError
        If the face data are missing, OpenGL does not start, or the file cannot be written.
    """
    sequence = check_sequence(values)
    Stage(face_dir, identity).film(
        sequence, out, fps=fps, width=width, height=height, audio=audio, on_progress=on_progress
    )
    faps = hashlib.sha256(np.ascontiguousarray(sequence, dtype="<f8").tobytes()).hexdigest()
    sound = {} if audio is None else {"audio": hashlib.sha256(audio.read_bytes()).hexdigest()}
    return {
        "identity": identity,
        "width": width,
        "height": height,
        "fps": fps,
        "frames": len(sequence),
        "duration_s": len(sequence) / fps,
        "digests": {
            "faps": faps,
            **sound,
            **picture_digests(face_dir),
        },
        "versions": versions(),
    }


def render_still(
    pad: tuple[float, float, float],
    out: Path,
    face_dir: Path,
    *,
    models_dir: Path | None = None,
    model: str = DEFAULT_MODEL,
    identity: str = DEFAULT_IDENTITY,
    width: int = 720,
    height: int = 576,
    intensity: float = 1.0,
) -> dict[str, Any]:
    """Render the apex of an expression to a PNG file.

    Parameters
    ----------
    pad : tuple of float
        Pleasure, arousal, dominance, each in [-1, 1].
    out : Path
        The file; it appears complete or not at all. Its folder must exist.
    face_dir, models_dir
        As in `clip_digest`.
    model, identity, width, height, intensity
        As in `ClipSpec`; odd sizes are welcome here.

    Returns
    -------
    dict
        The lineage as plain JSON values.

    Raises
    ------
    SpecError
        If an argument is not valid.
    AssetError, RenderError, VideoError
        If the face data are missing, OpenGL does not start, or the file cannot be written.
    """
    point = PAD.parse(pad).as_tuple()
    for picture in draw_expressions(
        [point],
        face_dir,
        models_dir=models_dir,
        model=model,
        identity=identity,
        width=width,
        height=height,
        intensity=intensity,
    ):
        write_png(out, picture)
    chosen = load_model(model, models_dir)
    pep, apex = _apex(point, chosen, float(intensity))
    return {
        "model": model,
        "identity": identity,
        "width": width,
        "height": height,
        "intensity": float(intensity),
        **expression(point, pep, apex),
        "digests": digests(chosen, face_dir),
        "versions": versions(),
    }


def draw_expressions(
    pads: Sequence[tuple[float, float, float]],
    face_dir: Path,
    *,
    models_dir: Path | None = None,
    model: str = DEFAULT_MODEL,
    identity: str = DEFAULT_IDENTITY,
    width: int = 720,
    height: int = 576,
    intensity: float = 1.0,
) -> Iterator[NDArray[np.uint8]]:
    """Draw the apex of each of several expressions.

    Parameters
    ----------
    pads : sequence of tuple of float
        Pleasure, arousal, dominance of each, from -1 to 1.
    face_dir, models_dir
        As in `clip_digest`.
    model, identity, width, height, intensity
        As in `ClipSpec`; odd sizes are welcome here.

    Yields
    ------
    (height, width, 3) uint8
        The pictures, sRGB.

    Raises
    ------
    SpecError
        If an argument is not valid.
    AssetError, RenderError
        If the face data are missing, or OpenGL does not start.
    """
    points = [PAD.parse(pad).as_tuple() for pad in pads]
    chosen = load_model(model, models_dir)
    strength = _real("intensity", intensity, *_REAL_RANGES["intensity"])
    apices = np.array([_apex(point, chosen, strength)[1] for point in points]).reshape(-1, FAP_COUNT)
    yield from Stage(face_dir, identity).pictures(apices, width=width, height=height)


def _apex(pad: tuple[float, float, float], model: ExpressionModel, intensity: float) -> tuple[Floats, Floats]:
    """Return the PEPs (9,) at full expression and their FAPs (68,)."""
    pep, faps = model.apex(np.array([pad]), intensity=intensity)
    return pep[0], faps[0]


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
