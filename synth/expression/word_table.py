"""A table of expressions as a model: exact at the fourteen words of MTAP 2013, smooth between and beyond."""

import json
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.least_squares import least_squares
from synth.expression.pad_pep import bounded
from synth.expression.pep import PEP_COUNT, check_peps
from synth.expression.samples import check_pad, check_pairs, digest
from synth.pad import emotion_words

Floats = NDArray[np.float64]

FORMAT = 2
"""Version of the model's arithmetic; raise it when the same table predicts otherwise."""

_REACH = 1.3
"""Where the table's trend levels off, as a multiple of its largest P, A and D."""

_RIDGE = 0.3


@dataclass(frozen=True, eq=False)
class TableModel:
    """A table of expressions, exact at its rows and at neutral, smooth between and beyond.

    A trend through neutral, which levels off beyond the outermost rows, carries the expression outward; what the rows
    have beyond the trend is shared out by inverse distance (Shepard's method), whose weights are positive and sum to
    1. So a blend stays between its neighbours, where a polynomial or spline through rows as near to each other as Sad
    and Anxious would overshoot.

    Attributes
    ----------
    pad : (M, 3) float64
        Nodes: neutral, then the table's rows.
    pep : (M, 9) float64
        Their PEPs.
    digest : str
        Sha-256 of the table.
    """

    pad: Floats
    pep: Floats
    digest: str
    _reach: Floats = field(repr=False)
    _trend: Floats = field(repr=False)

    @classmethod
    def fit(cls, pad: Floats, pep: Floats) -> Self:
        """Make the model of PAD values (N, 3) and PEPs (N, 9); neutral is added as all zero."""
        pad, pep = check_pad(pad), check_peps(pep)
        check_pairs(pad, pep)
        nodes = np.vstack([np.zeros(3), pad])
        if len(np.unique(nodes, axis=0)) != len(nodes):
            raise SpecError(
                "PAD to PEP: two rows of the table have the same PAD, or one is (0, 0, 0), which is neutral."
            )
        reach = _REACH * np.maximum(np.abs(pad).max(axis=0), 1e-6)
        # Rows of the ridge: slopes that the table does not insist on would exaggerate faces far from its words.
        ridge = np.sqrt(_RIDGE) * np.eye(3)
        trend = least_squares(np.vstack([_levelled(pad, reach), ridge]), np.vstack([pep, np.zeros((3, PEP_COUNT))]))
        return cls(
            pad=nodes,
            pep=np.vstack([np.zeros(PEP_COUNT), pep]),
            digest=digest("table", FORMAT, pad, pep),
            _reach=reach,
            _trend=trend,
        )

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, 9), clipped to [-1, 1], of PAD values (N, 3)."""
        points = check_pad(pad)
        squares = np.sum((points[:, None, :] - self.pad[None, :, :]) ** 2, axis=2)
        # The fourth power is the smallest even one that keeps a node's reach local in three dimensions;
        # the tiny addend stands for a distance of 1e-6, below which a point is its node.
        weights = 1.0 / (squares**2 + 1e-24)
        weights /= weights.sum(axis=1, keepdims=True)
        beyond = self.pep - _levelled(self.pad, self._reach) @ self._trend
        # Sums of many terms end in noise around 1e-17; rounding makes neutral exactly zero.
        return bounded(np.round(_levelled(points, self._reach) @ self._trend + weights @ beyond, 12))


@cache
def word_table() -> tuple[tuple[str, ...], Floats, Floats]:
    """Return the fourteen words of MTAP 2013, Table 8, their PAD (14, 3) and their PEPs (14, 9)."""
    text = resources.files("synth.data").joinpath("pad_pep.json").read_text(encoding="utf-8")
    rows = json.loads(text)["words"]
    words = tuple(emotion_words())
    pad = np.array([emotion_words()[word].as_tuple() for word in words])
    return words, pad, check_peps(np.array([rows[word] for word in words], dtype=np.float64))


def _levelled(pad: Floats, reach: Floats) -> Floats:
    """Return PAD values that follow the given ones near neutral and level off at ``reach`` (3,)."""
    return np.asarray(reach * np.tanh(pad / reach), dtype=np.float64)
