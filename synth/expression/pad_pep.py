"""Models from PAD values to partial expression parameters by a formula that is linear in its coefficients.

Every PAD to PEP model has ``predict(pad (N, 3)) -> (N, K)`` with values in [-1, 1], and a ``digest`` that stands for
all that its predictions depend on. K is 9 for the scheme of MTAP 2013, by which the avatar is animated.
"""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.least_squares import least_squares
from synth.expression.samples import check_pad, check_pairs, digest

Floats = NDArray[np.float64]


class PadPepModel(Protocol):
    """What every PAD to PEP model offers."""

    @property
    def digest(self) -> str:
        """Sha-256 of the kind of model and its numbers."""
        ...

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, K), each in [-1, 1], of PAD values (N, 3)."""
        ...


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The affine minimum mean square error estimator (AMMSE; MTAP 2013, Eqs. 5-7): ``PEP = T PAD + V``.

    Attributes
    ----------
    T : (K, 3) float64
        Transformation, ``K_FE K_E^-1``, found by a QR decomposition of the centred values rather than by an inverse.
    V : (K,) float64
        Translation, ``U_F - T U_E``.
    """

    T: Floats
    V: Floats

    @classmethod
    def fit(cls, pad: Floats, pep: Floats) -> Self:
        """Fit to PAD values (N, 3) and PEPs (N, K).

        Raises
        ------
        SpecError
            If they are not pairs of finite numbers, PAD from -1 to 1.
        """
        pad, pep = _training_set(pad, pep)
        mean_pad, mean_pep = pad.mean(axis=0), pep.mean(axis=0)
        T = least_squares(pad - mean_pad, pep - mean_pep).T
        return cls(T=T, V=mean_pep - T @ mean_pad)

    @property
    def digest(self) -> str:
        """Sha-256 of the coefficients."""
        return digest("linear", self.T, self.V)

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, K), clipped to [-1, 1], of PAD values (N, 3)."""
        return bounded(check_pad(pad) @ self.T.T + self.V)


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """The second-order polynomial without mixed terms (ACII 2007, Eqs. 2 and 3): ``PEP = a E^2 + b E + d``.

    Attributes
    ----------
    coefficients : (7, K) float64
        Rows: P^2, A^2, D^2, P, A, D, 1.
    """

    coefficients: Floats

    @classmethod
    def fit(cls, pad: Floats, pep: Floats) -> Self:
        """Fit by least squares to PAD values (N, 3) and PEPs (N, K); raises as `LinearModel.fit`."""
        pad, pep = _training_set(pad, pep)
        return cls(coefficients=least_squares(_quadratic_terms(pad), pep))

    @property
    def digest(self) -> str:
        """Sha-256 of the coefficients."""
        return digest("quadratic", self.coefficients)

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, K), clipped to [-1, 1], of PAD values (N, 3)."""
        return bounded(_quadratic_terms(check_pad(pad)) @ self.coefficients)


def bounded(pep: Floats) -> Floats:
    """Return predictions cut to [-1, 1]."""
    # Adding 0.0 turns -0.0 into 0.0, so that equal predictions are also written alike.
    return np.clip(pep, -1.0, 1.0) + 0.0


def _quadratic_terms(pad: Floats) -> Floats:
    return np.hstack([pad**2, pad, np.ones((len(pad), 1))])


def _training_set(pad: Floats, pep: Floats) -> tuple[Floats, Floats]:
    pad, pep = check_pad(pad), np.asarray(pep, dtype=np.float64)
    check_pairs(pad, pep)
    if pep.ndim != 2 or not np.isfinite(pep).all():
        raise SpecError(f"PAD to PEP: the PEPs, of shape {pep.shape}, must be finite numbers (N, K).")
    return pad, pep
