"""PEP to FAP: the key FAP follows the PEP, the others follow the key (ACII 2007, Eq. 1; MTAP 2013, Eq. 3)."""

import hashlib
import json
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.expression.pep import PEP_COUNT, check_peps, peps
from synth.fap.table import FAP_COUNT, column, faps

Floats = NDArray[np.float64]


def pep_to_fap(values: NDArray[np.floating] | Floats) -> Floats:
    """Translate partial expression parameters to facial animation parameters.

    The key FAP is ``F_key = PEP * F_max``, with one maximum for positive and one for negative values, as the face's
    reach differs (lids close farther than they open); any other FAP of the PEP is ``F_j = alpha_j * F_key``. As in
    MTAP's Eq. 4, and unlike in ACII, an ``alpha_j`` may be larger than 1: the middle of a lip goes beyond the key.

    Parameters
    ----------
    values : (N, 9)
        PEP values, normally in [-1, 1]; larger ones (an intensity above 1) scale on.

    Returns
    -------
    (N, 68) float64
        FAP values in FAPU.
    """
    array = check_peps(values)
    plus, minus = _maxima()
    # Each FAP belongs to at most one PEP, so the sum over PEPs only places the values in their columns.
    result: Floats = np.maximum(array, 0.0) @ plus + np.maximum(-array, 0.0) @ minus
    return result + 0.0


@cache
def translation_digest() -> str:
    """Return the sha-256 of the translation's numbers."""
    return hashlib.sha256(json.dumps(_rows(), sort_keys=True).encode()).hexdigest()


@cache
def _rows() -> list[dict[str, Any]]:
    text = resources.files("synth.data").joinpath("pep_fap.json").read_text(encoding="utf-8")
    rows: list[dict[str, Any]] = json.loads(text)["peps"]
    return rows


@cache
def _maxima() -> tuple[Floats, Floats]:
    """Return the FAP values at PEP +1 and at PEP -1: twice (9, 68)."""
    plus, minus = np.zeros((PEP_COUNT, FAP_COUNT)), np.zeros((PEP_COUNT, FAP_COUNT))
    for k, (pep, row) in enumerate(zip(peps(), _rows(), strict=True)):
        shares = {pep.key: 1.0} | {int(fap): share for fap, share in row["shares"].items()}
        for fap, share in shares.items():
            for values, maximum in ((plus, row["plus"]), (minus, row["minus"])):
                # A jaw that is closed cannot close further, nor may its FAP say so.
                two_way = faps()[fap].two_way
                values[k, column(fap)] = share * maximum if two_way else max(share * maximum, 0.0)
    return plus, minus
