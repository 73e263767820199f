"""Models that turn PAD values into partial expression parameters.

Every model has ``predict(pad (N, 3)) -> (N, 9)`` with values in [-1, 1], and a ``digest`` that stands for all that its
predictions depend on.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.pep import PEP_COUNT, check_peps
from synth.pad import emotion_words

Floats = NDArray[np.float64]

FORMAT = 1
"""Version of the models' arithmetic; raise it when the same training set predicts otherwise."""

_REACH = 1.3
"""Where the table's trend levels off, as a multiple of its largest P, A and D."""

_RIDGE = 0.3


class PadPepModel(Protocol):
    """What every PAD to PEP model offers."""

    @property
    def digest(self) -> str:
        """Sha-256 of the kind of model and what it was made from."""
        ...

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, 9), each in [-1, 1], of PAD values (N, 3)."""
        ...


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The affine minimum mean square error estimator (MTAP 2013, Eqs. 5-7): ``PEP = T PAD + V``.

    Attributes
    ----------
    T : (9, 3) float64
        Transformation, ``K_FE K_E^-1``, found by least squares on centred values rather than by an inverse.
    V : (9,) float64
        Translation, ``U_F - T U_E``.
    digest : str
        Sha-256 of the training set.
    """

    T: Floats
    V: Floats
    digest: str

    @classmethod
    def fit(cls, pad: Floats, pep: Floats) -> Self:
        """Fit to PAD values (N, 3) and PEPs (N, 9)."""
        pad, pep = _training_set(pad, pep)
        mean_pad, mean_pep = pad.mean(axis=0), pep.mean(axis=0)
        T = _least_squares(pad - mean_pad, pep - mean_pep).T
        return cls(T=T, V=mean_pep - T @ mean_pad, digest=_digest("linear", pad, pep))

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, 9), clipped to [-1, 1], of PAD values (N, 3)."""
        return _bounded(_check_pad(pad) @ self.T.T + self.V)


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """The second-order polynomial without mixed terms (ACII 2007, Eqs. 2 and 3): ``PEP = a E^2 + b E + d``.

    Attributes
    ----------
    coefficients : (7, 9) float64
        Rows: P^2, A^2, D^2, P, A, D, 1.
    digest : str
        Sha-256 of the training set.
    """

    coefficients: Floats
    digest: str

    @classmethod
    def fit(cls, pad: Floats, pep: Floats) -> Self:
        """Fit by least squares to PAD values (N, 3) and PEPs (N, 9)."""
        pad, pep = _training_set(pad, pep)
        coefficients = _least_squares(_quadratic_terms(pad), pep)
        return cls(coefficients=coefficients, digest=_digest("quadratic", pad, pep))

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, 9), clipped to [-1, 1], of PAD values (N, 3)."""
        return _bounded(_quadratic_terms(_check_pad(pad)) @ self.coefficients)


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
        pad, pep = _training_set(pad, pep)
        nodes = np.vstack([np.zeros(3), pad])
        if len(np.unique(nodes, axis=0)) != len(nodes):
            raise SpecError(
                "PAD to PEP: two rows of the table have the same PAD, or one is (0, 0, 0), which is neutral."
            )
        reach = _REACH * np.maximum(np.abs(pad).max(axis=0), 1e-6)
        # Rows of the ridge: slopes that the table does not insist on would exaggerate faces far from its words.
        ridge = np.sqrt(_RIDGE) * np.eye(3)
        trend = _least_squares(np.vstack([_levelled(pad, reach), ridge]), np.vstack([pep, np.zeros((3, PEP_COUNT))]))
        return cls(
            pad=nodes,
            pep=np.vstack([np.zeros(PEP_COUNT), pep]),
            digest=_digest("table", pad, pep),
            _reach=reach,
            _trend=trend,
        )

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, 9), clipped to [-1, 1], of PAD values (N, 3)."""
        points = _check_pad(pad)
        squares = np.sum((points[:, None, :] - self.pad[None, :, :]) ** 2, axis=2)
        # The fourth power is the smallest even one that keeps a node's reach local in three dimensions;
        # the tiny addend stands for a distance of 1e-6, below which a point is its node.
        weights = 1.0 / (squares**2 + 1e-24)
        weights /= weights.sum(axis=1, keepdims=True)
        beyond = self.pep - _levelled(self.pad, self._reach) @ self._trend
        # Sums of many terms end in noise around 1e-17; rounding makes neutral exactly zero.
        return _bounded(np.round(_levelled(points, self._reach) @ self._trend + weights @ beyond, 12))


@cache
def word_table() -> tuple[tuple[str, ...], Floats, Floats]:
    """Return the fourteen words of MTAP 2013, Table 8, their PAD (14, 3) and their PEPs (14, 9)."""
    text = resources.files("synth.data").joinpath("pad_pep.json").read_text(encoding="utf-8")
    rows = json.loads(text)["words"]
    words = tuple(emotion_words())
    pad = np.array([emotion_words()[word].as_tuple() for word in words])
    return words, pad, check_peps(np.array([rows[word] for word in words], dtype=np.float64))


def _fit_with_neutral(fit: Callable[[Floats, Floats], PadPepModel]) -> PadPepModel:
    _, pad, pep = word_table()
    return fit(np.vstack([np.zeros(3), pad]), np.vstack([np.zeros(PEP_COUNT), pep]))


_BUILT_IN: Mapping[str, Callable[[], PadPepModel]] = MappingProxyType(
    {
        "table": lambda: TableModel.fit(*word_table()[1:]),
        "linear": lambda: _fit_with_neutral(LinearModel.fit),
        "quadratic": lambda: _fit_with_neutral(QuadraticModel.fit),
    }
)

MODEL_NAMES = tuple(_BUILT_IN)
"""The models that come with padlab."""


@cache
def load_model(name: str) -> PadPepModel:
    """Return a built-in model.

    Raises
    ------
    SpecError
        If there is no model of that name.
    """
    if name not in _BUILT_IN:
        raise SpecError(f"There is no PAD to PEP model {name!r}; there are {', '.join(MODEL_NAMES)}.")
    return _BUILT_IN[name]()


def _levelled(pad: Floats, reach: Floats) -> Floats:
    """Return PAD values that follow the given ones near neutral and level off at ``reach`` (3,)."""
    return np.asarray(reach * np.tanh(pad / reach), dtype=np.float64)


def _least_squares(terms: Floats, values: Floats) -> Floats:
    """Return the coefficients with ``terms @ coefficients`` nearest to ``values``: by SVD, not by an inverse."""
    return np.asarray(np.linalg.lstsq(terms, values, rcond=None)[0], dtype=np.float64)


def _quadratic_terms(pad: Floats) -> Floats:
    return np.hstack([pad**2, pad, np.ones((len(pad), 1))])


def _bounded(pep: Floats) -> Floats:
    # Adding 0.0 turns -0.0 into 0.0, so that equal predictions are also written alike.
    return np.clip(pep, -1.0, 1.0) + 0.0


def _check_pad(pad: NDArray[np.floating] | Floats) -> Floats:
    array = np.asarray(pad, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SpecError(f"PAD: the values have shape {array.shape}, but must be (N, 3).")
    if not (np.abs(array) <= 1.0).all():
        row, col = np.argwhere(~(np.abs(array) <= 1.0))[0]
        raise SpecError(f"PAD: the value {array[row, col]} in row {row} is not a number from -1 to 1.")
    return array


def _training_set(pad: Floats, pep: Floats) -> tuple[Floats, Floats]:
    pad, pep = _check_pad(pad), check_peps(pep)
    if len(pad) != len(pep):
        raise SpecError(f"PAD to PEP: {len(pad)} PAD rows and {len(pep)} PEP rows given, but they must be pairs.")
    return pad, pep


def _digest(kind: str, pad: Floats, pep: Floats) -> str:
    text = json.dumps([FORMAT, kind, pad.tolist(), pep.tolist()], separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
