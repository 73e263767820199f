"""What all models share: checks of the samples that they are fed, and digests of numbers."""

import hashlib
import json

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]


def check_pad(pad: NDArray[np.floating] | Floats) -> Floats:
    """Return PAD values as an (N, 3) float64 array.

    Raises
    ------
    SpecError
        If the shape is another, or a value is not a number from -1 to 1; the message names the row.
    """
    array = np.asarray(pad, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SpecError(f"PAD: the values have shape {array.shape}, but must be (N, 3).")
    if not (np.abs(array) <= 1.0).all():
        row, col = np.argwhere(~(np.abs(array) <= 1.0))[0]
        raise SpecError(f"PAD: the value {array[row, col]} in row {row} is not a number from -1 to 1.")
    return array


def check_pairs(inputs: Floats, outputs: Floats, *, names: tuple[str, str] = ("PAD", "PEP")) -> None:
    """Check that inputs (N, I) and outputs (N, K) are pairs, at least one.

    Raises
    ------
    SpecError
        If they differ in number, or there are none.
    """
    if len(inputs) != len(outputs):
        raise SpecError(
            f"{names[0]} to {names[1]}: {len(inputs)} rows of {names[0]} and {len(outputs)} of {names[1]} given, "
            "but they must be pairs."
        )
    if not len(inputs):
        raise SpecError(f"{names[0]} to {names[1]}: there is no sample to learn from; give at least one.")


def digest(kind: str, *parts: Floats | int) -> str:
    """Return the sha-256 (hex) of a kind of model and its numbers, each to its last digit."""
    values = [part if isinstance(part, int) else part.tolist() for part in parts]
    return hashlib.sha256(json.dumps([kind, *values], separators=(",", ":")).encode()).hexdigest()
