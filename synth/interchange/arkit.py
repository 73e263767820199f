"""ARKit-52: an animation as weights of Apple's 52 blend shapes, in JSON or CSV.

JSON has the keys of NVIDIA Audio2Face's exports (``exportFps``, ``numPoses``, ``numFrames``, ``facsNames``,
``weightMat``) and two of our own for the rotations. CSV has the columns of Epic's Live Link Face. Rotations are in
radians, with the signs of `synth.face.motion.Motion`: yaw to the subject's left, pitch down, roll to the subject's
right. The ``eyeLook`` weights carry the gaze, too.
"""

import csv
import io
import json
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.face.mesh import MORPH_NAMES
from synth.face.motion import Motion
from synth.files import write_whole

Floats = NDArray[np.float64]

ROTATIONS = (
    *("HeadYaw", "HeadPitch", "HeadRoll"),
    *("LeftEyeYaw", "LeftEyePitch", "LeftEyeRoll"),
    *("RightEyeYaw", "RightEyePitch", "RightEyeRoll"),
)
"""The rotations, in the order of the CSV's last columns."""

_DIGITS = 6
_SWAPPED = {"jawLeft": "jawRight", "jawRight": "jawLeft", "mouthLeft": "mouthRight", "mouthRight": "mouthLeft"}
# Live Link Face has right before left in these two pairs.
_CSV_NAMES = tuple(_SWAPPED.get(name, name) for name in MORPH_NAMES)
_CSV_HEADER = ("Timecode", "BlendshapeCount", *(name[0].upper() + name[1:] for name in _CSV_NAMES), *ROTATIONS)
_TIMECODE = re.compile(r"(\d\d):(\d\d):(\d\d):(\d\d\d?)(?:\.(\d{3}))?", re.ASCII)


@dataclass(frozen=True, eq=False)
class ArkitTrack:
    """An animation in ARKit's terms.

    Attributes
    ----------
    fps : float
        Frames per second.
    weights : (T, 52) float64
        Weights in Apple's order (`synth.face.mesh.MORPH_NAMES`), each in [0, 1].
    head : (T, 3) float64
        Pitch, yaw and roll, rad, as in `synth.face.motion.Motion`.
    eyes : (T, 2, 2) float64
        Left and right eye: yaw and pitch, rad.
    clipped : int
        How many weights lay outside [0, 1] and were cut; 0 for a track that was read.
    """

    fps: float
    weights: Floats
    head: Floats
    eyes: Floats
    clipped: int = 0

    @classmethod
    def of(cls, motion: Motion, *, fps: float) -> "ArkitTrack":
        """Return a motion in ARKit's terms; what has no place in them (residual, pupils, thrust) is left out.

        Raises
        ------
        SpecError
            If the rate is not above 0.
        """
        if not 0 < fps < float("inf"):
            raise SpecError(f"ARKit: {fps} frames per second are impossible; give a number above 0.")
        weights = np.clip(motion.weights, 0.0, 1.0)
        return cls(fps, weights, motion.head, motion.eyes, clipped=int((weights != motion.weights).sum()))


def write_arkit(path: Path, motion: Motion, *, fps: float) -> int:
    """Write a motion as ARKit weights to a JSON or CSV file, by its suffix; it appears complete or not at all.

    Returns
    -------
    int
        How many weights lay outside [0, 1] and were cut.

    Raises
    ------
    SpecError
        If the suffix is another, the motion has no frames, or the rate is impossible: CSV takes whole rates to 999.
    VideoError
        If the file cannot be written.
    """
    track = ArkitTrack.of(motion, fps=fps)
    if not len(motion):
        raise SpecError("ARKit: the motion has no frames; give at least one.")
    suffix = path.suffix.lower()
    if suffix == ".json":
        content = _to_json(track)
    elif suffix == ".csv":
        content = _to_csv(track)
    else:
        raise SpecError(f"ARKit: {path} must end with .json or .csv.")
    write_whole(path, content)
    return track.clipped


def read_arkit(path: Path, *, fps: float | None = None) -> ArkitTrack:
    """Read a JSON or CSV file as `write_arkit` makes them.

    Parameters
    ----------
    path : Path
        The file. JSON without rotations gets rotations of 0.
    fps : float, optional
        Frames per second of a CSV file, which tells them only by its timecodes and only if it lasts a second.

    Raises
    ------
    SpecError
        If the file is malformed, its suffix is another, or the frame rate is not known.
    OSError
        If it cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in {".json", ".csv"}:
        raise SpecError(f"ARKit: {path} must end with .json or .csv.")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise SpecError(f"{path} is not UTF-8 text; ARKit files are.") from None
    return _from_json(text, path) if suffix == ".json" else _from_csv(text, path, fps)


def _to_json(track: ArkitTrack) -> str:
    document = {
        "exportFps": track.fps,
        "trackPath": "",
        "numPoses": len(MORPH_NAMES),
        "numFrames": len(track.weights),
        "facsNames": MORPH_NAMES,
        "weightMat": _rounded(track.weights),
        "rotationNames": ROTATIONS,
        "rotationMat": _rounded(_rotations(track)),
    }
    return json.dumps(document, allow_nan=False, indent=None, separators=(",", ":")) + "\n"


def _from_json(text: str, path: Path) -> ArkitTrack:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SpecError(f"{path} is not JSON ({error}).") from None
    if not isinstance(document, dict):
        raise SpecError(f"{path} holds no object; it must have exportFps, facsNames and weightMat.")
    names, weights = _table(document, "facsNames", "weightMat", path)
    missing = sorted(set(MORPH_NAMES) - set(names))
    if missing:
        raise SpecError(f"{path}: facsNames lacks {', '.join(missing)}; all 52 names of ARKit must be there.")
    rotations = np.zeros((len(weights), len(ROTATIONS)))
    if "rotationNames" in document or "rotationMat" in document:
        given, values = _table(document, "rotationNames", "rotationMat", path)
        if given != ROTATIONS or len(values) != len(weights):
            raise SpecError(
                f"{path}: rotationMat must have a row for each frame and the columns {', '.join(ROTATIONS)}."
            )
        rotations = values
    fps = document.get("exportFps")
    if isinstance(fps, bool) or not isinstance(fps, (int, float)) or not 0 < fps < float("inf"):
        raise SpecError(f"{path}: exportFps is {fps!r}; it must be a number above 0.")
    return _track(float(fps), weights[:, [names.index(name) for name in MORPH_NAMES]], rotations, path)


def _table(document: dict[str, Any], names_key: str, values_key: str, path: Path) -> tuple[tuple[str, ...], Floats]:
    names, rows = document.get(names_key), document.get(values_key)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise SpecError(f"{path}: {names_key} must be a list of names.")
    try:
        values = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.zeros(0)
    if values.ndim != 2 or not len(values) or values.shape[1] != len(names) or not np.isfinite(values).all():
        raise SpecError(f"{path}: {values_key} must have at least one row, each of {len(names)} finite numbers.")
    return tuple(names), values


def _to_csv(track: ArkitTrack) -> str:
    if track.fps != int(track.fps) or track.fps > 999:
        raise SpecError(f"ARKit: a CSV file counts whole frames up to 999 in a second, not {track.fps}; write JSON.")
    fps = int(track.fps)
    order = [MORPH_NAMES.index(name) for name in _CSV_NAMES]
    table = np.hstack([track.weights[:, order], _rotations(track)])
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(_CSV_HEADER)
    count = str(table.shape[1])
    for frame, row in enumerate(table):
        writer.writerow([_timecode(frame, fps), count, *(f"{value:.{_DIGITS}f}" for value in row + 0.0)])
    return sheet.getvalue()


def _timecode(frame: int, fps: int) -> str:
    """Return hours, minutes, seconds, frame within the second, and the part of a frame, which is always 0."""
    seconds, rest = divmod(frame, fps)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{rest:02d}.000"


def _from_csv(text: str, path: Path, fps: float | None) -> ArkitTrack:
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if row]
    except csv.Error as error:
        raise SpecError(f"{path} is not CSV ({error}).") from None
    if not rows or sorted(rows[0]) != sorted(_CSV_HEADER):
        missing = sorted(set(_CSV_HEADER) - set(rows[0] if rows else ()))
        lacks = f" lacks {', '.join(missing)} and" if missing else ""
        raise SpecError(f"{path}, line 1:{lacks} must have the {len(_CSV_HEADER)} columns of Live Link Face.")
    header = rows[0]
    if len(rows) == 1:
        raise SpecError(f"{path} has no frames; there must be at least one.")
    columns = [header.index(_CSV_HEADER[2 + k]) for k in range(len(_CSV_HEADER) - 2)]
    table = np.zeros((len(rows) - 1, len(columns)))
    frames = []
    for k, row in enumerate(rows[1:]):
        match = _TIMECODE.fullmatch(row[header.index("Timecode")]) if len(row) == len(header) else None
        if match is None:
            raise SpecError(f"{path}, frame {k}: must have {len(header)} fields, the timecode as HH:MM:SS:FF.mmm.")
        frames.append(int(match[4]))
        try:
            table[k] = [float(row[column]) for column in columns]
        except ValueError:
            raise SpecError(f"{path}, frame {k}: holds a field that is no number.") from None
    order = [_CSV_NAMES.index(name) for name in MORPH_NAMES]
    return _track(fps or _rate(frames, path), table[:, order], table[:, len(MORPH_NAMES) :], path)


def _rate(frames: list[int], path: Path) -> float:
    """Return the frame rate: one more than the last frame within a second that is over."""
    over = [before for before, after in pairwise(frames) if after < before]
    if not over:
        raise SpecError(f"{path} is shorter than a second, so that its timecodes do not tell the frame rate; give fps.")
    return float(max(over) + 1)


def _track(fps: float, weights: Floats, rotations: Floats, path: Path) -> ArkitTrack:
    if not (np.isfinite(rotations).all() and (weights >= 0.0).all() and (weights <= 1.0).all()):
        raise SpecError(f"{path}: weights must lie from 0 to 1, and rotations be finite numbers.")
    head = rotations[:, [1, 0, 2]]
    eyes = rotations[:, 3:].reshape(-1, 2, 3)[:, :, :2]
    return ArkitTrack(fps, weights, head, eyes)


def _rotations(track: ArkitTrack) -> Floats:
    """Return the rotations (T, 9) in the order of `ROTATIONS`; eyes do not roll."""
    eyes = np.zeros((len(track.eyes), 2, 3))
    eyes[:, :, :2] = track.eyes
    return np.hstack([track.head[:, [1, 0, 2]], eyes.reshape(-1, 6)])


def _rounded(values: Floats) -> list[list[float]]:
    rounded: list[list[float]] = (np.round(values, _DIGITS) + 0.0).tolist()
    return rounded
