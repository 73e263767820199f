"""The nine partial expression parameters (PEP) of MTAP 2013, Table 5.

PEP values are arrays (N, 9), PEP n in column n - 1, each in [-1, 1]; zero is the neutral face.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]

PEP_COUNT = 9


@dataclass(frozen=True, slots=True)
class Pep:
    """One partial expression parameter.

    Attributes
    ----------
    pep : int
        Number, 1 to 9.
    name : str
        Name in Table 5.
    key : int
        The key FAP, which stands for the whole movement.
    faps : tuple of int
        All its FAPs, the key among them.
    minus, plus : str
        What -1 and +1 look like.
    """

    pep: int
    name: str
    key: int
    faps: tuple[int, ...]
    minus: str
    plus: str


@cache
def peps() -> tuple[Pep, ...]:
    """Return the nine parameters in order."""
    text = resources.files("synth.data").joinpath("pep.json").read_text(encoding="utf-8")
    return tuple(Pep(**{**row, "faps": tuple(row["faps"])}) for row in json.loads(text)["peps"])


def check_peps(values: NDArray[np.floating] | Floats) -> Floats:
    """Return ``values`` as an (N, 9) float64 array.

    Raises
    ------
    SpecError
        If the shape is another or a value is not a finite number.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != PEP_COUNT:
        raise SpecError(f"PEP: the values have shape {array.shape}, but must be (N, {PEP_COUNT}).")
    if not np.isfinite(array).all():
        row, col = np.argwhere(~np.isfinite(array))[0]
        raise SpecError(f"PEP: the value of PEP {col + 1} in row {row} is not a finite number.")
    return array
