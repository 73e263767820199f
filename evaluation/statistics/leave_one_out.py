"""How single raters stand to the others: correlation with the mean of the others, and mean difference from it."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.matrices import ratings_table
from evaluation.statistics.result import Result

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class LeaveOneOut(Result):
    """The correlation of each rater with the mean of the others.

    Attributes
    ----------
    r : numpy.ndarray, shape (raters,)
        Pearson's r; NaN where there is none (`flags` says how often).
    n : numpy.ndarray of int, shape (raters,)
        Items that the rater and another one rated.
    p : numpy.ndarray, shape (raters,)
        Two-sided probability of a correlation at least as strong if there were none.
    ci_low, ci_high : numpy.ndarray, shape (raters,)
        Fisher's interval; NaN with fewer than four items.
    confidence : float
        Confidence of the intervals.
    """

    r: FloatArray
    n: IntArray
    p: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    confidence: float

    def apa(self) -> str:
        """Return for instance ``Correlation of 26 raters with the mean of the others: Mdn r = .93, .84 to .97``."""
        known = self.r[~np.isnan(self.r)]
        if not known.size:
            return f"None of {self.r.size} raters has a correlation with the mean of the others"
        span = f"{wording.share(float(known.min()))} to {wording.share(float(known.max()))}"
        return (
            f"Correlation of {known.size} raters with the mean of the others: "
            f"Mdn r = {wording.share(float(np.median(known)))}, {span}"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each rater, numbered from 0 as the columns of the ratings."""
        columns = {"rater": np.arange(self.r.size), "n": self.n, "r": self.r, "p": self.p}
        return pd.DataFrame(columns | {"ci_low": self.ci_low, "ci_high": self.ci_high})


def leave_one_out(ratings: npt.ArrayLike, *, confidence: float = 0.95) -> LeaveOneOut:
    """Return the correlation of each rater with the mean of the others, with p and interval.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    LeaveOneOut
        Correlations over the items that the rater and another one rated.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite, or `confidence` is not between 0 and 1.

    References
    ----------
    p by Student's t with n - 2 degrees of freedom; interval by Fisher (1921), Metron 1:3.
    """
    check_confidence(confidence)
    r, number = _correlations(ratings)
    known = ~np.isnan(r)
    p, low, high = np.full((3, r.size), np.nan)
    half_df = number[known] / 2 - 1
    p[known] = 2 * special.betainc(half_df, half_df, (1 - np.abs(r[known])) / 2)
    wide = known & (number > 3) & (np.abs(r) < 1)
    half = float(stats.norm.ppf((1 + confidence) / 2)) / np.sqrt(number[wide] - 3)
    low[wide], high[wide] = np.tanh(np.arctanh(r[wide]) - half), np.tanh(np.arctanh(r[wide]) + half)
    exact = known & (number > 3) & ~wide
    low[exact] = high[exact] = r[exact]
    without = {
        "correlation: fewer than three shared items, or nothing varies": int(np.count_nonzero(~known)),
        "interval: that needs four shared items": int(np.count_nonzero(known & (number <= 3))),
    }
    flags = tuple(f"{count} of {r.size} raters have no {what}." for what, count in without.items() if count)
    return LeaveOneOut(r=r, n=number, p=p, ci_low=low, ci_high=high, confidence=confidence, flags=flags)


def leave_one_out_correlation(ratings: npt.ArrayLike) -> FloatArray:
    """Return the correlation of each rater with the mean of the others.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.

    Returns
    -------
    numpy.ndarray, shape (raters,)
        Pearson's r over the items that the rater and another one rated; NaN with fewer than three of them, or where the
        rater or the mean of the others does not vary.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    """
    return _correlations(ratings)[0]


def deviations(ratings: npt.ArrayLike) -> FloatArray:
    """Return each rater's mean difference from the items' means.

    Where everybody rated everything this is the rater's mean less the mean of all; with missing ratings it takes out
    which items a rater happened to get, but not who else rated them.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.

    Returns
    -------
    numpy.ndarray, shape (raters,)
        Mean over the items that the rater and another one rated; NaN without any.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    """
    scores, given = ratings_table(ratings)
    number = given.sum(axis=1, keepdims=True)
    shared = given & (number > 1)
    differences = np.where(shared, scores - scores.sum(axis=1, keepdims=True) / np.maximum(number, 1), 0)
    counts = shared.sum(axis=0)
    result: FloatArray = np.where(counts > 0, differences.sum(axis=0) / np.maximum(counts, 1), math.nan)
    return result


def _correlations(ratings: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
    scores, given = ratings_table(ratings)
    others = given.sum(axis=1, keepdims=True) - given
    shared = given & (others > 0)
    mean = (scores.sum(axis=1, keepdims=True) - scores) / np.maximum(others, 1)
    number: IntArray = shared.sum(axis=0)
    own, own_constant = _centred_where(scores, shared, number)
    rest, rest_constant = _centred_where(mean, shared, number)
    product = np.einsum("ji,ji->i", own, rest)
    norm = np.sqrt(np.einsum("ji,ji->i", own, own) * np.einsum("ji,ji->i", rest, rest))
    known = (number >= 3) & ~own_constant & ~rest_constant
    result = np.full(number.size, np.nan)
    result[known] = np.clip(product[known] / norm[known], -1, 1)
    return result, number


def _centred_where(values: FloatArray, where: BoolArray, number: IntArray) -> tuple[FloatArray, BoolArray]:
    """Return differences from the columns' means, scaled by the largest, and which columns do not vary."""
    means = np.where(where, values, 0).sum(axis=0) / np.maximum(number, 1)
    differences = np.where(where, values - means, 0)
    largest = np.abs(differences).max(axis=0, initial=0)
    constant: BoolArray = largest <= _ROUNDING * np.where(where, np.abs(values), 0).max(axis=0, initial=0)
    return differences / np.where(constant, 1, largest), constant
