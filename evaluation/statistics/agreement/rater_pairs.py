"""Correlation of each two raters, with its p value."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.masked_pairs import MaskedRatings
from evaluation.statistics.agreement.pairwise import (
    check_pairs,
    check_size,
    check_varying,
    left_out_pairs,
    left_out_raters,
    standardised,
)
from evaluation.statistics.agreement.raters import named_table
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.correlation import pearson_p_values, without_rounding
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.multiplicity import Method, adjusted_p
from evaluation.statistics.result import Result
from evaluation.statistics.wording import counted


@dataclass(frozen=True, kw_only=True, eq=False)
class PairwiseCorrelations(Result):
    """Pearson's correlation of each two raters.

    Attributes
    ----------
    raters : tuple of str
        Names of all raters, in the order of the columns.
    correlations : numpy.ndarray, shape (raters, raters)
        Correlations, symmetric; NaN for a pair that has none, and 1 on the diagonal or NaN for a rater who does not
        vary.
    common : numpy.ndarray of int, shape (raters, raters)
        Items that both rated; 0 for a rater who does not vary.
    varying : numpy.ndarray of bool, shape (raters,)
        Raters who gave two different ratings.
    """

    raters: tuple[str, ...]
    correlations: FloatArray
    common: npt.NDArray[np.int64]
    varying: npt.NDArray[np.bool_]

    @property
    def pairs(self) -> int:
        """Number of pairs that have a correlation."""
        return int(self._known()[0].size)

    @property
    def mean(self) -> float:
        """Plain mean of the correlations."""
        return float(self.correlations[self._known()].mean())

    @property
    def fisher_mean(self) -> float | None:
        """Mean on Fisher's scale, turned back: tanh of the mean of artanh r; None if a pair is perfect (|r| = 1)."""
        values = self.correlations[self._known()]
        if np.abs(values).max() == 1:
            return None
        return math.tanh(float(np.arctanh(values).mean()))

    def p_values(self, *, adjusted: Method = "none") -> FloatArray:
        """Return the two-sided p value of each pair.

        Parameters
        ----------
        adjusted : {"none", "holm", "bonferroni", "BH", "BY"}
            Adjustment for the number of pairs, as in `evaluation.statistics.multiplicity.adjust`.

        Returns
        -------
        numpy.ndarray, shape (raters, raters)
            p values, symmetric; NaN on the diagonal and for a pair without correlation.

        Raises
        ------
        DataError
            If the adjustment is unknown.
        """
        known = self._known()
        result = np.full(self.correlations.shape, math.nan)
        p = pearson_p_values(self.correlations[known], self.common[known])
        result[known] = adjusted_p(p, method=adjusted)
        result.T[known] = result[known]
        return result

    def significant(self, *, alpha: float = 0.05, adjusted: Method = "holm") -> float:
        """Return the share of the pairs with a correlation whose p value, adjusted as in `p_values`, is below `alpha`.

        Raises
        ------
        DataError
            If the adjustment is unknown or `alpha` is not between 0 and 1.
        """
        if not 0 < alpha < 1:
            raise DataError(f"alpha is {alpha}, but must lie between 0 and 1.")
        return float((self.p_values(adjusted=adjusted)[self._known()] < alpha).mean())

    def apa(self) -> str:
        """Return a sentence, ``mean pairwise r = .73, 3 pairs from .60 to 1.00, 33% with p < .05 (Holm)``."""
        values = self.correlations[self._known()]
        extremes = f"{counted(self.pairs, 'pair')} from {wording.share(values.min())} to {wording.share(values.max())}"
        share = f"{100 * self.significant():.0f}% with p < .05 (Holm)"
        return f"mean pairwise r = {wording.share(self.mean)}, {extremes}, {share}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each pair: the two raters, items in common, r and p; NaN for a pair without correlation."""
        one, other = np.triu_indices(len(self.raters), 1)
        names = np.array(self.raters, dtype=object)
        return pd.DataFrame(
            {
                "rater": names[one],
                "other": names[other],
                "items": self.common[one, other],
                "r": self.correlations[one, other],
                "p": self.p_values()[one, other],
            }
        )

    def _known(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        one, other = np.nonzero(np.triu(~np.isnan(self.correlations), 1))
        return one, other


def pairwise_pearson(ratings: npt.ArrayLike | pd.DataFrame) -> PairwiseCorrelations:
    """Return Pearson's correlation between the ratings of each two raters, over the items that both rated.

    Parameters
    ----------
    ratings : array_like or pandas.DataFrame, shape (items, raters)
        As `evaluation.statistics.agreement.pairwise.mean_pairwise_pearson`.

    Returns
    -------
    PairwiseCorrelations
        The matrix of correlations. p is Student's test with two fewer degrees of freedom than items in common.

    Raises
    ------
    DataError, InsufficientDataError
        As `mean_pairwise_pearson`, which is quicker where only the mean is needed.
    """
    names, table = named_table(ratings)
    check_size(table)
    correlations = np.full((len(names), len(names)), math.nan)
    common = np.zeros(correlations.shape, dtype=np.int64)
    pair_flags: tuple[str, ...] = ()
    if np.isnan(table).any():
        masked = MaskedRatings.of(table)
        varying = masked.varying.copy()
        between, counts, pair_flags = _masked(masked)
    else:
        columns, varying = standardised(finite_array(table, axes=("items", "raters"), name="ratings"))
        between = columns.T @ columns
        counts = np.full(between.shape, len(table))
    check_varying(int(np.count_nonzero(varying)))
    check_pairs(int(np.count_nonzero(~np.isnan(between))))
    between = without_rounding(between)
    np.fill_diagonal(between, 1)
    places = np.ix_(np.flatnonzero(varying), np.flatnonzero(varying))
    correlations[places], common[places] = between, counts
    for array in (correlations, common, varying):
        array.flags.writeable = False
    return PairwiseCorrelations(
        raters=names,
        correlations=correlations,
        common=common,
        varying=varying,
        flags=(*left_out_raters(names, varying), *pair_flags),
    )


def _masked(masked: MaskedRatings) -> tuple[FloatArray, npt.NDArray[np.int64], tuple[str, ...]]:
    between = np.full((masked.raters, masked.raters), math.nan)
    counts = np.zeros(between.shape, dtype=np.int64)
    few = constant = 0
    for block in masked.blocks():
        upper = (
            np.arange(block.columns.start, block.columns.stop) > np.arange(block.rows.start, block.rows.stop)[:, None]
        )
        correlations = np.where(block.used, block.correlations, math.nan)
        np.copyto(between[block.rows, block.columns], correlations, where=upper)
        np.copyto(between.T[block.rows, block.columns], correlations, where=upper)
        counts[block.rows, block.columns] = block.common
        counts.T[block.rows, block.columns] = block.common
        few, constant = few + block.few, constant + block.constant
    return between, counts, left_out_pairs(few, constant)
