"""The 68 facial animation parameters (FAP) of MPEG-4 as data.

A sequence of FAP values is an array (T, 68): one row for each frame, FAP n in column n - 1 (see `column`),
in face animation parameter units (FAPU).
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]

FAP_COUNT = 68

_BEYOND_USABLE = 1.1
_LOWER_LIP = [fap - 1 for fap in (5, 10, 11, 52, 57, 58)]

_DIRECTIONS = {
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "up": (0.0, 1.0, 0.0),
    "down": (0.0, -1.0, 0.0),
    "forward": (0.0, 0.0, 1.0),
}
_ACROSS = {"left": "right", "right": "left"}


@dataclass(frozen=True, slots=True)
class Fap:
    """One facial animation parameter.

    Attributes
    ----------
    fap : int
        Number, 1 to 68.
    name : str
        Name in the standard.
    group : int
        Group, 1 (visemes and expressions) to 10 (ears).
    unit : str or None
        FAPU: IRISD, ES, ENS, MNS, MW or AU; None for the two high-level parameters.
    positive : str or None
        Motion of a positive value, in the subject's own left and right.
    two_way : bool
        Whether negative values are allowed.
    points : tuple of str
        Feature points that it moves.
    mirror : int or None
        The same parameter of the other half of the face.
    twin : int or None
        The inner lip parameter of an outer one, and back.
    usable : tuple of float or None
        Smallest and largest value that look natural when nothing else moves, padlab's own choice; None for the two
        high-level parameters.
    quantum : int
        Step of the coded value.
    moves : str
        What it moves, in words.
    """

    fap: int
    name: str
    group: int
    unit: str | None
    positive: str | None
    two_way: bool
    points: tuple[str, ...]
    mirror: int | None
    twin: int | None
    usable: tuple[float, float] | None
    quantum: int
    moves: str

    @property
    def is_rotation(self) -> bool:
        """Whether the value is an angle."""
        return self.unit == "AU"

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """Unit vector of a positive displacement (x to the subject's left, y up, z forward); None if not straight."""
        return None if self.is_rotation or self.positive is None else _DIRECTIONS.get(self.positive)


@cache
def faps() -> Mapping[int, Fap]:
    """Return the parameters by number."""
    text = resources.files("synth.data").joinpath("fap.json").read_text(encoding="utf-8")
    rows = json.loads(text)["faps"]
    return MappingProxyType(
        {
            row["fap"]: Fap(**{**row, "points": tuple(row["points"]), "usable": row["usable"] and tuple(row["usable"])})
            for row in rows
        }
    )


def column(fap: int) -> int:
    """Return the column of FAP ``fap`` in a (T, 68) sequence.

    Raises
    ------
    SpecError
        If there is no such parameter.
    """
    if not 1 <= fap <= FAP_COUNT:
        raise SpecError(f"FAP: there is no parameter {fap}; they are numbered from 1 to {FAP_COUNT}.")
    return fap - 1


def check_sequence(values: NDArray[np.floating] | Floats) -> Floats:
    """Return ``values`` as a (T, 68) float64 array.

    Raises
    ------
    SpecError
        If the shape is another or a value is not finite.
    """
    sequence = np.asarray(values, dtype=np.float64)
    if sequence.ndim != 2 or sequence.shape[1] != FAP_COUNT:
        raise SpecError(f"FAP: the sequence has shape {sequence.shape}, but must be (frames, {FAP_COUNT}).")
    if not np.isfinite(sequence).all():
        frame, col = np.argwhere(~np.isfinite(sequence))[0]
        raise SpecError(f"FAP: the value of FAP {col + 1} in frame {frame} is not a finite number.")
    return sequence


def within_reach(values: Floats) -> Floats:
    """Return FAP values (T, 68) cut to a tenth beyond their usable ranges, as far as a face can look natural.

    The usable range is that of a face on which nothing else moves: the lower lip, which an open jaw carries, may go as
    much farther down as the jaw does (FAP 3, in the same unit).
    """
    sequence = check_sequence(values)
    low, high = _reach()
    carried = np.zeros_like(sequence)
    carried[:, _LOWER_LIP] = np.clip(sequence[:, [column(3)]], 0.0, high[column(3)])
    return np.clip(sequence, low - carried, high)


def mirrored(values: Floats) -> Floats:
    """Return a (T, 68) sequence as the same face in a mirror would need it."""
    sequence = check_sequence(values)
    order, signs = _mirror()
    return sequence[:, order] * signs


@cache
def _reach() -> tuple[Floats, Floats]:
    low, high = np.full(FAP_COUNT, -np.inf), np.full(FAP_COUNT, np.inf)
    for fap in faps().values():
        if fap.usable is not None:
            low[column(fap.fap)], high[column(fap.fap)] = (_BEYOND_USABLE * end for end in fap.usable)
    return low, high


@cache
def _mirror() -> tuple[NDArray[np.int64], Floats]:
    order = np.arange(FAP_COUNT)
    signs = np.ones(FAP_COUNT)
    for fap in faps().values():
        other = faps()[fap.mirror or fap.fap]
        order[column(fap.fap)] = column(other.fap)
        if fap.positive in _ACROSS and other.positive != _ACROSS[fap.positive]:
            signs[column(fap.fap)] = -1.0
    return order, signs
