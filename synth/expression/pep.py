"""The partial expression parameters (PEP) of the two papers.

A scheme is one paper's set of parameters: ``mtap2013`` has nine (Table 5), ``acii2007`` eighteen with left and right
(Tables 1 and 2). PEP values are arrays (N, K) in the scheme's order, each in [-1, 1]; zero is the neutral face.
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

MTAP, ACII = "mtap2013", "acii2007"
"""The nine parameters of MTAP 2013, and the eighteen of ACII 2007."""

PEP_COUNT = 9
"""Parameters of the scheme `MTAP`, which the avatar's models predict."""


@dataclass(frozen=True, slots=True)
class Pep:
    """One partial expression parameter.

    Attributes
    ----------
    code : str
        Number in the paper's table, for instance "8" (MTAP) or "1.1L" (ACII).
    name : str
        What it does.
    key : int
        The key FAP, which stands for the whole movement.
    faps : tuple of int
        All its FAPs, the key among them, in order.
    minus, plus : str
        What -1 and +1 look like.
    """

    code: str
    name: str
    key: int
    faps: tuple[int, ...]
    minus: str
    plus: str


@cache
def _schemes() -> Mapping[str, tuple[Pep, ...]]:
    text = resources.files("synth.data").joinpath("pep.json").read_text(encoding="utf-8")
    return MappingProxyType(
        {
            name: tuple(Pep(**{**row, "faps": tuple(row["faps"])}) for row in scheme["peps"])
            for name, scheme in json.loads(text)["schemes"].items()
        }
    )


def peps(scheme: str = MTAP) -> tuple[Pep, ...]:
    """Return the parameters of a scheme in order.

    Raises
    ------
    SpecError
        If there is no such scheme.
    """
    if scheme not in _schemes():
        raise SpecError(f"PEP: there is no scheme {scheme!r}; there are {', '.join(_schemes())}.")
    return _schemes()[scheme]


def codes(scheme: str = MTAP) -> tuple[str, ...]:
    """Return the codes of a scheme's parameters in order."""
    return tuple(pep.code for pep in peps(scheme))


def check_peps(values: NDArray[np.floating] | Floats, scheme: str = MTAP) -> Floats:
    """Return ``values`` as an (N, K) float64 array.

    Raises
    ------
    SpecError
        If the shape is another or a value is not a finite number.
    """
    array = np.asarray(values, dtype=np.float64)
    count = len(peps(scheme))
    if array.ndim != 2 or array.shape[1] != count:
        raise SpecError(f"PEP: the values have shape {array.shape}, but must be (N, {count}).")
    if not np.isfinite(array).all():
        row, col = np.argwhere(~np.isfinite(array))[0]
        raise SpecError(f"PEP: the value of PEP {codes(scheme)[col]} in row {row} is not a finite number.")
    return array
