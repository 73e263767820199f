"""FAP files: a sequence of FAP values as text.

The first line is ``version name fps frames``. Each frame has two lines: 68 masks, 0 or 1, and the frame's number
followed by a value for each mask that is 1. Lines that begin with ``#`` and empty lines mean nothing.

What padlab makes of the rest, which files in the wild leave open:

- Values of version 2.0 count twentieths of a step; those of 2.1 and 2.2 count steps.
- A parameter whose mask is 0 is 0 in that frame. But of the inner and the outer lip, one that is left out follows the
  one that is given; the heights of the outer corners (59, 60) follow the inner ones (12, 13), not the other way round.
- FAP 1 and 2 (viseme, expression) have several fields in a bit stream, and it is not known how a text orders them.
  One value for each is read and ignored; they are never written.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, check_sequence, column, faps
from synth.files import read_text, shown, write_whole

Floats = NDArray[np.float64]
Masks = NDArray[np.bool_]

MAX_RATE = 240
"""Most frames per second that a file may ask for."""

MAX_VALUE = 1e6
"""Largest amount of a value; a whole turn of the head is 6.3e5."""

_STEPS_OF_VERSION = {"2.0": 1 / 20, "2.1": 1.0, "2.2": 1.0}
_VERSION = "2.1"
_HIGH_LEVEL = (1, 2)
_ONE_WAY = {12: 59, 13: 60}
# The characters of plain decimal numbers: without the words (nan, inf) and signs (_) that Python would also read.
_NUMBERS = re.compile(r"[-+.0-9eE \t]*")
_WHOLE = re.compile(r"[0-9]{1,9}")


@dataclass(frozen=True, eq=False)
class FapFile:
    """What a FAP file says.

    Attributes
    ----------
    name : str
        Name of the sequence.
    fps : int
        Frames per second.
    values : (T, 68) float64
        Values in FAPU, FAP n in column n - 1; those that are left out are filled in.
    masks : (T, 68) bool
        Which values the file gives.
    ignored : tuple of int
        High-level parameters (1, 2) for which the file gives values that are not used.
    """

    name: str
    fps: int
    values: Floats
    masks: Masks
    ignored: tuple[int, ...]


def read_fap(path: Path) -> FapFile:
    """Read a FAP file.

    Raises
    ------
    SpecError
        If the file is malformed; the message names the file and the line, and says what would be right.
    OSError
        If the file cannot be read.
    """
    lines = _Lines(path)
    name, fps, frames, step = _header(lines)
    # Lists that grow with the file: the number of frames in its first line need not be true.
    mask_rows: list[Masks] = []
    value_rows: list[Floats] = []
    for frame in range(frames):
        mask_rows.append(_masks(lines, frame, frames))
        value_rows.append(_values(lines, frame, mask_rows[-1]))
    lines.expect_end(frames)
    masks, values = np.array(mask_rows), np.zeros((frames, FAP_COUNT))
    values[masks] = np.concatenate(value_rows) * step
    ignored = tuple(fap for fap in _HIGH_LEVEL if masks[:, column(fap)].any())
    for fap in ignored:
        values[:, column(fap)] = 0.0
    _follow_twins(values, masks)
    return FapFile(name=name, fps=fps, values=values + 0.0, masks=masks, ignored=ignored)


def write_fap(path: Path, values: NDArray[np.floating] | Floats, *, fps: int, name: str) -> None:
    """Write FAP values to a file, which appears complete or not at all; reading it gives exactly these values.

    Parameters
    ----------
    path : Path
        The file; its folder must exist.
    values : (T, 68)
        FAP values, at least one frame, FAP 1 and 2 all zero. Whole numbers are written as such, others by the fewest
        digits that mean the same.
    fps : int
        Frames per second, 1 to 240.
    name : str
        Name of the sequence, without blanks.

    Raises
    ------
    SpecError
        If an argument is not valid.
    VideoError
        If the file cannot be written.
    """
    sequence = check_sequence(values)
    if not len(sequence):
        raise SpecError("FAP file: there are no frames; give at least one.")
    if not (np.abs(sequence) <= MAX_VALUE).all():
        frame, col = np.argwhere(np.abs(sequence) > MAX_VALUE)[0]
        raise SpecError(f"FAP file: the value of FAP {col + 1} in frame {frame} is beyond {MAX_VALUE:g}.")
    if sequence[:, [column(fap) for fap in _HIGH_LEVEL]].any():
        raise SpecError("FAP file: FAP 1 and 2 (viseme, expression) have no known form as text; they must be 0.")
    if isinstance(fps, bool) or not isinstance(fps, int) or not 1 <= fps <= MAX_RATE:
        raise SpecError(f"FAP file: fps is {fps!r}, but must be a whole number from 1 to {MAX_RATE}.")
    if not name or not name.isprintable() or re.search(r"\s", name):
        raise SpecError(f"FAP file: the name {name!r} must be one word of printable characters.")
    mask: Masks = (sequence != 0.0).any(axis=0)
    # A lip parameter that rests while its twin moves is given as 0: left out, it would follow.
    for fap in faps().values():
        if fap.twin is not None and sequence[:, column(fap.twin)].any():
            mask[column(fap.fap)] = True
    mask_line = " ".join("1" if given else "0" for given in mask)
    lines = [f"{_VERSION} {name} {fps} {len(sequence)}"]
    for frame, row in enumerate(sequence[:, mask].tolist()):
        lines += [mask_line, " ".join([str(frame), *map(_number, row)])]
    write_whole(path, "\n".join(lines) + "\n")


def _number(value: float) -> str:
    return str(int(value)) if value.is_integer() else repr(value)


class _Lines:
    """The lines of a file that mean something, and faults told by their number."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.number = 0
        text = read_text(path, "a FAP file is plain text")
        self._rest = self._meaningful(re.split(r"\r\n|\r|\n", text))

    def _meaningful(self, lines: list[str]) -> Iterator[str]:
        # What follows the last line end is no line.
        for number, line in enumerate(lines, start=1):
            if number < len(lines) or line:
                self.number = number
            if line.strip() and not line.lstrip().startswith("#"):
                yield line

    def next(self) -> str | None:
        """Return the next line, None at the end."""
        return next(self._rest, None)

    def expect_end(self, frames: int) -> None:
        """Raise if there is one more line."""
        if self.next() is not None:
            raise self.fault(
                f"goes on after frame {frames - 1}", f"by the first line there are {frames}, counted from 0"
            )

    def fault(self, wrong: str, right: str) -> SpecError:
        """Return the error for the current line."""
        return SpecError(f"{self._path}, line {max(self.number, 1)}: {wrong}; {right}.")


def _header(lines: _Lines) -> tuple[str, int, int, float]:
    """Return name, frames per second, number of frames, and how many steps one unit of the values is."""
    right = "the first line must be 'version name fps frames', for instance '2.1 smile 25 100'"
    line = lines.next()
    if line is None:
        raise lines.fault("the file is empty", right)
    parts = _fields(line)
    if len(parts) != 4:
        raise lines.fault(f"has {len(parts)} fields", right)
    version, name, fps, frames = parts
    if version not in _STEPS_OF_VERSION:
        raise lines.fault(f"the version is {shown(version)}", f"it must be one of {', '.join(_STEPS_OF_VERSION)}")
    if not name.isprintable():
        raise lines.fault("the name holds control characters", right)
    if not _WHOLE.fullmatch(fps) or not 1 <= int(fps) <= MAX_RATE:
        raise lines.fault(f"the frame rate is {shown(fps)}", f"it must be a whole number from 1 to {MAX_RATE}")
    if not _WHOLE.fullmatch(frames) or int(frames) < 1:
        raise lines.fault(f"the number of frames is {shown(frames)}", "it must be a whole number, 1 or more")
    return name, int(fps), int(frames), _STEPS_OF_VERSION[version]


def _masks(lines: _Lines, frame: int, frames: int) -> Masks:
    line = lines.next()
    if line is None:
        raise lines.fault(
            f"the file ends after {frame} of {frames} frames", "add the missing frames or correct the first line"
        )
    masks = _fields(line)
    if len(masks) != FAP_COUNT:
        raise lines.fault(
            f"frame {frame} has {len(masks)} masks", f"there must be {FAP_COUNT}, one for each FAP, separated by blanks"
        )
    wrong = next((mask for mask in masks if mask not in {"0", "1"}), None)
    if wrong is not None:
        raise lines.fault(f"a mask of frame {frame} is {shown(wrong)}", "masks are 0 or 1")
    return np.array([mask == "1" for mask in masks])


def _values(lines: _Lines, frame: int, mask: Masks) -> Floats:
    """Return the values that a frame gives."""
    line = lines.next()
    if line is None:
        raise lines.fault(f"frame {frame} has masks but no values", "a line with its number and values must follow")
    fields = _fields(line)
    if fields[0] != str(frame):
        raise lines.fault(f"the frame's number is {shown(fields[0])}", f"it must be {frame}; numbers count from 0")
    wanted = int(mask.sum())
    if len(fields) - 1 != wanted:
        high = " (one for each of FAP 1 and 2, too)" if mask[[column(fap) for fap in _HIGH_LEVEL]].any() else ""
        raise lines.fault(
            f"frame {frame} has {len(fields) - 1} values", f"its masks ask for {wanted}{high} after the frame's number"
        )
    if not _NUMBERS.fullmatch(line):
        wrong = next(field for field in fields if not _NUMBERS.fullmatch(field))
        raise lines.fault(f"{shown(wrong)} is no number", "values are decimal numbers such as 120 or -3.5")
    try:
        values = np.array([float(field) for field in fields[1:]])
    except ValueError:
        wrong = next(field for field in fields if not _is_number(field))
        raise lines.fault(f"{shown(wrong)} is no number", "values are decimal numbers such as 120 or -3.5") from None
    if not (np.abs(values) <= MAX_VALUE).all():
        wrong = fields[1 + int(np.argmax(~(np.abs(values) <= MAX_VALUE)))]
        raise lines.fault(f"the value {shown(wrong)} is too large", f"values go from -{MAX_VALUE:g} to {MAX_VALUE:g}")
    return values


def _fields(line: str) -> list[str]:
    """Return the parts between blanks and tabs; other white space is an error in a number, not a separator."""
    return re.split(r"[ \t]+", line.strip(" \t"))


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _follow_twins(values: Floats, masks: Masks) -> None:
    """Let a lip parameter that is left out follow its twin, in place."""
    given = masks.copy()
    for fap in faps().values():
        if fap.twin is None or _ONE_WAY.get(fap.fap) == fap.twin:
            continue
        own, twin = column(fap.fap), column(fap.twin)
        follows = ~given[:, own] & given[:, twin]
        values[follows, own] = values[follows, twin]
