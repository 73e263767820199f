"""The way back: from FAPs to PEPs and from these to PAD, an idea of MTAP 2013 (section 6), with its error stated."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.least_squares import least_squares
from synth.expression.pad_pep import bounded
from synth.expression.samples import check_pad, check_pairs, digest
from synth.expression.validation import Split, correlations

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PepPadModel:
    """A second-order polynomial without mixed terms, ACII 2007, Eq. 3, turned round: ``E = a PEP^2 + b PEP + d``.

    Attributes
    ----------
    coefficients : (2 K + 1, 3) float64
        Rows: the squares of the K PEPs, the PEPs, 1.
    rmse : (3,) float64
        Root mean square error of P, A and D on expressions that the model was not fitted to (cross-validation).
    correlation : (3,) float64
        Pearson's r of predicted and real P, A and D on the same.
    """

    coefficients: Floats
    rmse: Floats
    correlation: Floats

    def __post_init__(self) -> None:
        rows = self.coefficients.shape[0] if self.coefficients.ndim == 2 else 0
        if rows % 2 == 0 or self.coefficients.shape[1:] != (3,) or not np.isfinite(self.coefficients).all():
            raise SpecError(
                f"PEP to PAD: the coefficients must be finite numbers (2 K + 1, 3), not of {self.coefficients.shape}."
            )
        for name in ("rmse", "correlation"):
            if getattr(self, name).shape != (3,):
                raise SpecError(f"PEP to PAD: {name} must be three numbers, for P, A and D.")

    @classmethod
    def fit(cls, pep: Floats, pad: Floats, split: Split) -> Self:
        """Fit to PEPs (N, K) and PAD values (N, 3); the folds of ``split`` tell the error.

        Raises
        ------
        SpecError
            If they are not pairs of finite numbers, or the split has no folds.
        """
        if not split.folds:
            raise SpecError("PEP to PAD: the split has no folds, so the error cannot be told.")
        pep, pad = _check_pep(pep), check_pad(pad)
        check_pairs(pep, pad, names=("PEP", "PAD"))
        terms = _terms(pep)
        predicted = np.full_like(pad, np.nan)
        for fold, rows in enumerate(split.folds):
            learned = split.rest(fold)
            predicted[rows] = bounded(terms[rows] @ least_squares(terms[learned], pad[learned]))
        seen = np.isfinite(predicted).all(axis=1)
        return cls(
            coefficients=least_squares(terms, pad),
            rmse=np.sqrt(np.mean((predicted[seen] - pad[seen]) ** 2, axis=0)),
            correlation=correlations(pad[seen], predicted[seen]),
        )

    @property
    def digest(self) -> str:
        """Sha-256 of the coefficients."""
        return digest("inverse", self.coefficients)

    def predict(self, pep: NDArray[np.floating] | Floats) -> Floats:
        """Return the PAD values (N, 3), clipped to [-1, 1], of PEPs (N, K); these are cut to [-1, 1] first.

        Raises
        ------
        SpecError
            If the PEPs are not finite numbers (N, K).
        """
        values = _check_pep(pep)
        if 2 * values.shape[1] + 1 != len(self.coefficients):
            raise SpecError(
                f"PEP to PAD: {values.shape[1]} PEPs given, but the model takes {len(self.coefficients) // 2}."
            )
        return bounded(_terms(np.clip(values, -1.0, 1.0)) @ self.coefficients)


def _terms(pep: Floats) -> Floats:
    return np.hstack([pep**2, pep, np.ones((len(pep), 1))])


def _check_pep(pep: NDArray[np.floating] | Floats) -> Floats:
    values = np.asarray(pep, dtype=np.float64)
    if values.ndim != 2 or not np.isfinite(values).all():
        raise SpecError(f"PEP to PAD: the PEPs, of shape {values.shape}, must be finite numbers (N, K).")
    return values
