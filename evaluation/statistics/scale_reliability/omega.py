"""McDonald's omega: the reliability of a sum of items that one factor explains."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.result import Result
from evaluation.statistics.scale_reliability.answer_table import AnswerTable, answer_table
from evaluation.statistics.scale_reliability.factor_fit import (
    LEAST_UNIQUENESS,
    Extraction,
    OneFactor,
    fit_many,
    fit_one_factor,
)

_BATCH = 2_000_000
_SINGULAR = 1e-10
_EXTRACTIONS = {"ml": "maximum likelihood", "minres": "minimum residuals"}


@dataclass(frozen=True, kw_only=True)
class McdonaldOmega(Result):
    """McDonald's omega total from a one-factor model.

    Attributes
    ----------
    omega : float
        Of the sum of standardised items.
    omega_raw : float
        Of the sum of the items as they are.
    extraction : str
        ``ml`` or ``minres``: how the factor was found; omega depends on it.
    ci : tuple of float, or None
        Bootstrap interval for `omega`; None if none was asked for.
    confidence : float
        Confidence of the interval.
    replicates : int
        Bootstrap samples that the interval comes from.
    rows : int
        Number of complete rows.
    names : tuple of str
        Names of the items.
    loadings, uniquenesses : tuple of float
        Of each standardised item.
    heywood : tuple of str
        Items whose uniqueness is at its lower bound of 0.005.
    """

    omega: float
    omega_raw: float
    extraction: Extraction
    ci: tuple[float, float] | None
    confidence: float
    replicates: int
    rows: int
    names: tuple[str, ...]
    loadings: tuple[float, ...]
    uniquenesses: tuple[float, ...]
    heywood: tuple[str, ...]

    def apa(self) -> str:
        """Return a sentence that names the extraction, the number of items and rows, omega and its interval."""
        text = (
            f"McDonald's omega total (one factor by {_EXTRACTIONS[self.extraction]}, {len(self.names)} items, "
            f"n = {self.rows}) = {wording.share(self.omega)}"
        )
        if self.ci is not None:
            text = f"{text}, {wording.interval(*self.ci, confidence=self.confidence, bounded=True)}"
        return f"{text}."

    def to_frame(self) -> pd.DataFrame:
        """Return omega as a frame of one row; `item_frame` has the loadings."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "extraction": [self.extraction],
                "items": [len(self.names)],
                "n": [self.rows],
                "omega": [self.omega],
                "ci_low": [low],
                "ci_high": [high],
                "confidence": [self.confidence],
                "omega_raw": [self.omega_raw],
                "replicates": [self.replicates],
            }
        )

    def item_frame(self) -> pd.DataFrame:
        """Return a row for each item."""
        return pd.DataFrame({"item": self.names, "loading": self.loadings, "uniqueness": self.uniquenesses})


def mcdonald_omega(
    answers: npt.ArrayLike | pd.DataFrame,
    *,
    extraction: Extraction = "ml",
    names: Sequence[str] | None = None,
    rng: np.random.Generator | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
) -> McdonaldOmega:
    """Return McDonald's omega total from a one-factor model of the items' correlations.

    Parameters
    ----------
    answers : array_like or pandas.DataFrame, shape (rows, items)
        Answers, those to items of opposite meaning reversed; rows with a missing answer (NaN) are left out.
    extraction : {"ml", "minres"}
        Maximum likelihood or minimum residuals; state which, since omega depends on it.
    names : sequence of str, optional
        Names of the items; the columns of a frame or else ``item 1`` ... without it.
    rng : numpy.random.Generator, optional
        Source of bootstrap samples of the rows; without it there is no interval.
    replicates : int
        Number of bootstrap samples, at least 100.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    McdonaldOmega
        Omega, its interval, and the loadings.

    Raises
    ------
    DataError
        If the answers are no table of numbers, one is infinite, or an option is wrong.
    InsufficientDataError
        If there are fewer than three items, no more complete rows than items, an item does not vary, or (ml) some item
        is a sum of others.

    Notes
    -----
    omega = (sum of loadings)^2 / ((sum of loadings)^2 + sum of uniquenesses). `omega_raw` weighs the items by their
    standard deviations, as the sum of answers does.

    References
    ----------
    McDonald (1999), Test Theory, chapter 6. Extraction: Joreskog (1967), Psychometrika 32:443; Harman and Jones (1966),
    Psychometrika 31:351. Bootstrap: Kelley and Pornprasertmanit (2016), Psychological Methods 21:69.
    """
    check_confidence(confidence)
    if rng is not None and replicates < 100:
        raise DataError(f"replicates is {replicates}, but an interval needs at least 100.")
    table = answer_table(answers, names=names, for_factor=True)
    fit = fit_one_factor(table.correlations, extraction=extraction)
    ci, drawn, flags = None, 0, table.flags + fit_flags(fit, table.names)
    if rng is not None:
        ci, drawn = _bootstrap(table, fit, extraction, rng, replicates=replicates, confidence=confidence)
        if drawn < replicates:
            flags += (f"In {replicates - drawn} of {replicates} bootstrap samples the model could not be fitted.",)
        if ci is None:
            flags += ("Too few bootstrap samples could be fitted, so that there is no interval.",)
    return McdonaldOmega(
        omega=_omega(fit, np.ones(len(table.names))),
        omega_raw=_omega(fit, table.deviations),
        extraction=extraction,
        ci=ci,
        confidence=confidence,
        replicates=drawn,
        rows=table.rows,
        names=table.names,
        loadings=tuple(fit.loadings.tolist()),
        uniquenesses=tuple(fit.uniquenesses.tolist()),
        heywood=tuple(table.names[place] for place in fit.heywood),
        flags=flags,
    )


def fit_flags(fit: OneFactor, names: Sequence[str]) -> tuple[str, ...]:
    """Return sentences about a one-factor model that cannot be trusted as it is."""
    flags = []
    if len(fit.heywood):
        listed = ", ".join(names[place] for place in fit.heywood)
        flags.append(
            f"Heywood case: the factor takes up all variance of {listed} (uniqueness held at {LEAST_UNIQUENESS}), "
            "which is a sign of too few rows, of another structure, or of items that hardly differ."
        )
    against = [name for name, loading in zip(names, fit.loadings, strict=True) if loading < 0]
    if against:
        flags.append(f"Items that load negatively: {', '.join(against)}; are they reversed?")
    if not fit.converged:
        flags.append("The fit of the one-factor model did not converge.")
    return tuple(flags)


def _omega(fit: OneFactor, scale: FloatArray) -> float:
    common = float(fit.loadings @ scale) ** 2
    return common / (common + float(fit.uniquenesses @ scale**2))


def _bootstrap(
    table: AnswerTable,
    fit: OneFactor,
    extraction: Extraction,
    rng: np.random.Generator,
    *,
    replicates: int,
    confidence: float,
) -> tuple[tuple[float, float] | None, int]:
    """Return the percentile interval, and how many samples had a converged fit."""
    # Rows that are alike are drawn together: what is drawn of each kind of row is multinomial.
    kinds, numbers = np.unique(table.standardized, axis=0, return_counts=True)
    items = kinds.shape[1]
    products = (kinds[:, :, None] * kinds[:, None, :]).reshape(-1, items * items)
    size = max(1, _BATCH // len(kinds))
    found = []
    for start in range(0, replicates, size):
        samples = min(size, replicates - start)
        weights = rng.multinomial(table.rows, numbers / table.rows, size=samples) / table.rows
        means = weights @ kinds
        covariances = (weights @ products).reshape(samples, items, items) - means[:, :, None] * means[:, None, :]
        variances = np.einsum("sii->si", covariances)
        covariances = covariances[variances.min(axis=1) > 1e-12]
        sizes = np.sqrt(np.einsum("sii->si", covariances))
        correlations = covariances / (sizes[:, :, None] * sizes[:, None, :])
        correlations = correlations[np.linalg.eigvalsh(correlations)[:, 0] > _SINGULAR]
        loadings, uniquenesses, converged = fit_many(correlations, extraction=extraction, start=fit.uniquenesses)
        common = loadings.sum(axis=1) ** 2
        found.append((common / (common + uniquenesses.sum(axis=1)))[converged])
    omegas = np.concatenate(found)
    if omegas.size < 100:
        return None, omegas.size
    low, high = np.quantile(omegas, [(1 - confidence) / 2, (1 + confidence) / 2])
    return (float(low), float(high)), omegas.size
