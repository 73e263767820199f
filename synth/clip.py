"""The clip: a short film of an expressive, speaking face, as a pure function of its specification."""

import hashlib
import json
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.clip_spec import INTENSITIES, ClipSpec, real
from synth.errors import SpecError
from synth.expression.models import DEFAULT_MODEL, load_model
from synth.face.identity import DEFAULT_IDENTITY
from synth.fap.table import FAP_COUNT, check_sequence
from synth.lineage import digests, expression, picture_digests, speech_digests, versions
from synth.pad import DIMENSIONS, PAD
from synth.plan import ClipPlan, plan_clip
from synth.speech.sound import fitted, write_wav
from synth.speech.spoken import Speech
from synth.stage import Stage
from synth.video import write_png

Floats = NDArray[np.float64]


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
    return _combined(spec, _digests(spec, face_dir, models_dir))


def _combined(spec: ClipSpec, parts: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(parts | {"spec": spec.canonical()}).encode()).hexdigest()


def _digests(
    spec: ClipSpec, face_dir: Path, models_dir: Path | None, *, recording: Speech | None = None
) -> dict[str, Any]:
    own = digests(load_model(spec.model, models_dir), face_dir)
    return own | (speech_digests(spec.lang, voice=spec.voice, recording=recording) if spec.text.strip() else {})


def render_clip(
    spec: ClipSpec,
    out: Path,
    face_dir: Path,
    models_dir: Path | None = None,
    *,
    plan: ClipPlan | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Render a clip to an MP4 file, with its sound; equal specifications give equal bytes.

    Parameters
    ----------
    spec : ClipSpec
        The specification.
    out : Path
        The file; it appears complete or not at all. Its folder must exist.
    face_dir, models_dir
        As in `clip_digest`.
    plan : ClipPlan, optional
        The plan of the specification, if it is there already, or one with a recording.
    on_progress : callable, optional
        Called with the number of finished frames and of all.

    Returns
    -------
    dict
        The lineage as plain JSON values: specification, text with prosodic words, PAD, PEP, FAP targets, phones, head
        motion, seed, digests, versions, frames and duration. The digest is `clip_digest`, but for a recording, whose
        digest stands instead of the voice.

    Raises
    ------
    SpecError, SpeechError
        If the text cannot be spoken, or the plan is of another specification.
    AssetError, RenderError, VideoError
        If the face data are missing, OpenGL does not start, or the file cannot be written.
    """
    planned = plan or plan_clip(spec, models_dir)
    if planned.spec != spec:
        raise SpecError("Clip: the plan is that of another specification; plan this one, or leave the plan out.")
    film_plan(planned, out, face_dir, on_progress=on_progress)
    parts = _digests(spec, face_dir, models_dir, recording=planned.speech if planned.recorded else None)
    return {
        "digest": _combined(spec, parts),
        **planned.lineage(),
        "digests": parts,
        "versions": versions(),
    }


def film_plan(
    plan: ClipPlan, out: Path, face_dir: Path, *, on_progress: Callable[[int, int], None] | None = None
) -> None:
    """Film a plan to an MP4 file; the parameters are those of `render_clip`."""
    spec, speech = plan.spec, plan.speech
    stage = Stage(face_dir, spec.identity)
    with tempfile.TemporaryDirectory() as place:
        audio = None
        if speech is not None and len(speech.samples) and not spec.mute:
            audio = Path(place) / "speech.wav"
            write_wav(audio, fitted(speech.samples, speech.rate, len(plan.faps), spec.fps), speech.rate)
        stage.film(
            plan.faps,
            out,
            fps=spec.fps,
            width=spec.width,
            height=spec.height,
            audio=audio,
            on_progress=on_progress,
        )


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
    pep, apex = chosen.apex(np.array([point]), intensity=float(intensity))
    return {
        "model": model,
        "identity": identity,
        "width": width,
        "height": height,
        "intensity": float(intensity),
        **expression(point, pep[0], apex[0]),
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
    strength = real("intensity", intensity, *INTENSITIES)
    pads_given = np.array(points).reshape(-1, len(DIMENSIONS))
    apices = chosen.apex(pads_given, intensity=strength)[1].reshape(-1, FAP_COUNT)
    yield from Stage(face_dir, identity).pictures(apices, width=width, height=height)
