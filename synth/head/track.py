"""Files of tracks (CSV): rotation angles, and facial points, with a line for each frame.

Files of angles have the columns ``frame,pitch,yaw,roll``, in degrees; positive is down, to the subject's left, to the
subject's right. Files of points have ``frame`` and for each landmark ``NAME_x`` and ``NAME_y`` in pixels, from the
upper left corner of the picture, y downward. Frames are numbered without gaps, from any number on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from synth.csv_file import Row, read_csv
from synth.errors import SpecError
from synth.files import write_whole
from synth.head.published import AXES

Floats = NDArray[np.float64]

_MAX_PIXELS = 1e5


@dataclass(frozen=True, eq=False)
class AngleTrack:
    """Rotation angles of consecutive frames.

    Attributes
    ----------
    first : int
        Number of the first frame.
    angles : (T, 3) float64
        Pitch, yaw and roll in degrees.
    """

    first: int
    angles: Floats


@dataclass(frozen=True, eq=False)
class PointTrack:
    """Facial points of consecutive frames.

    Attributes
    ----------
    first : int
        Number of the first frame.
    names : tuple of str
        Landmarks.
    points : (T, K, 2) float64
        x and y in pixels.
    """

    first: int
    names: tuple[str, ...]
    points: Floats


def read_angles(path: Path) -> AngleTrack:
    """Read a file of angles.

    Raises
    ------
    SpecError
        If the file is malformed; the message names the file and the line, and says what would be right.
    OSError
        If the file cannot be read.
    """
    _, rows = read_csv(path, ("frame", *AXES))
    first = _first(rows)
    return AngleTrack(first, np.array([[row.number(axis, -180.0, 180.0) for axis in AXES] for row in rows]))


def write_angles(path: Path, angles: npt.ArrayLike, *, first: int = 0) -> None:
    """Write a file of angles (T, 3) in degrees, to a millionth; it appears complete or not at all.

    Raises
    ------
    SpecError
        If the angles are malformed.
    VideoError
        If the file cannot be written.
    """
    sequence = np.asarray(angles, dtype=np.float64)
    if sequence.ndim != 2 or sequence.shape[1] != 3 or not len(sequence):
        raise SpecError(f"Angles: they have shape {sequence.shape}, but must be (frames, 3), at least one frame.")
    if not (np.abs(sequence) <= 180.0).all():
        raise SpecError("Angles: one is not a number from -180 to 180 degrees.")
    lines = [",".join(("frame", *AXES))]
    # Adding 0.0 turns the -0.0 that rounding leaves into 0.0.
    for frame, row in enumerate((np.round(sequence, 6) + 0.0).tolist(), start=first):
        lines.append(",".join([str(frame), *(f"{value:.10g}" for value in row)]))
    write_whole(path, "\n".join(lines) + "\n")


def read_points(path: Path, names: Sequence[str]) -> PointTrack:
    """Read those of the named landmarks that a file of points has; other columns are passed over.

    Raises
    ------
    SpecError
        If the file is malformed, or has an x without its y.
    OSError
        If the file cannot be read.
    """
    header, rows = read_csv(path, ("frame",), expected="frame and, for each landmark, NAME_x and NAME_y")
    found = [name for name in names if f"{name}_x" in header.columns or f"{name}_y" in header.columns]
    header.require([f"{name}_{axis}" for name in found for axis in "xy"])
    if not found:
        right = f"name columns such as {names[0]}_x and {names[0]}_y (known are {', '.join(names)})"
        raise header.fault("there is no landmark", right)
    first = _first(rows)
    points = [
        [[row.number(f"{name}_{axis}", -_MAX_PIXELS, _MAX_PIXELS) for axis in "xy"] for name in found] for row in rows
    ]
    return PointTrack(first, tuple(found), np.array(points))


def _first(rows: Sequence[Row]) -> int:
    """Return the number of the first frame, the others being found to follow it."""
    first = rows[0].whole("frame")
    for expected, row in enumerate(rows, start=first):
        if row.whole("frame") != expected:
            right = f"it must be {expected}, as frames are numbered without gaps"
            raise row.fault(f"the frame is {row.text('frame')}", right, column="frame")
    return first
