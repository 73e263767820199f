"""Mean correlation of each two raters, without the matrix of all pairs where it can be done without."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.masked_pairs import FEWEST_COMMON, MaskedRatings
from evaluation.statistics.agreement.raters import listed, named_table
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array
from evaluation.statistics.result import Result
from evaluation.statistics.threads import one_thread
from evaluation.statistics.wording import counted

# Columns that vary by at least this share of their mean square lose no more than two digits to their mean.
_WELL_SPREAD = 1e-2
_ROUNDING = 1e-14


@dataclass(frozen=True, kw_only=True)
class MeanPairwiseCorrelation(Result):
    """The mean of Pearson's correlation over pairs of raters.

    Attributes
    ----------
    r : float
        Mean correlation, without Fisher's transformation; not below -1 / (raters - 1) if nothing is missing.
    items, raters : int
        Items with a rating, and raters who are in a pair.
    pairs : int
        Pairs of raters behind the mean.
    F, df1, df2 : float
        Kendall's test of agreement, for scores in place of ranks.
    p : float
        One-sided probability of a mean at least as large if the raters were independent of each other.
    """

    r: float
    items: int
    raters: int
    pairs: int
    F: float
    df1: float
    df2: float
    p: float

    def apa(self) -> str:
        """Return a sentence, for instance ``mean pairwise r = .62 (3 pairs), F(7.33, 14.67) = 6.43, p = .001``."""
        ratio = f"F({wording.number(self.df1)}, {wording.number(self.df2)}) = {wording.number(self.F)}"
        pairs = counted(self.pairs, "pair")
        return f"mean pairwise r = {wording.share(self.r)} ({pairs}), {ratio}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        names = ("r", "items", "raters", "pairs", "F", "df1", "df2", "p")
        return pd.DataFrame({name: [getattr(self, name)] for name in names})


def mean_pairwise_pearson(ratings: npt.ArrayLike | pd.DataFrame) -> MeanPairwiseCorrelation:
    """Return the mean of Pearson's correlation between the ratings of each two raters.

    Parameters
    ----------
    ratings : array_like or pandas.DataFrame, shape (items, raters)
        Ratings; NaN where a rater did not rate an item. The columns of a frame name the raters in the flags.

    Returns
    -------
    MeanPairwiseCorrelation
        The mean with its test. Raters who gave one rating throughout correlate with nobody: they are left out and named
        in `flags`. So are pairs with fewer than three items in common, or where one of the two gave these a single
        rating.

    Raises
    ------
    DataError
        If the ratings are no table of numbers or one is infinite or beyond 1e140.
    InsufficientDataError
        If there are fewer than three items, or no two raters who vary on three items in common.

    Notes
    -----
    The mean is plain, as in Jia et al. (2013), section 2.4. With z_j a rater's ratings less their mean and scaled to
    length 1, k raters have the mean (|z_1 + ... + z_k|² - k) / (k (k - 1)), which needs no pair. With missing ratings,
    each pair's sums over its common items are products of masked matrices.

    If raters are independent (each one's ratings in random order), the correlations have mean 0 and variance
    1 / (common items - 1) and are uncorrelated, so the moments of their mean are known, whatever the ratings are.
    W = (1 + (k - 1) r) / k, which is Kendall's coefficient of concordance if the ratings are ranks, is taken to have
    the beta distribution with these moments: F = (k - 1) W / (1 - W) with n - 1 - 2 / k and k - 1 times as many degrees
    of freedom. For two raters this is Student's test of r. (n - 1) (1 + (k - 1) r), Friedman's chi-square for ranks, is
    its limit for many raters. With missing ratings, k is one more than the mean number of partners of a rater and n
    such that the variance is right.

    References
    ----------
    Pitman (1938), Biometrika 29:322, for the distribution of scores; Kendall and Babington Smith (1939), Ann. Math.
    Stat. 10:275, for ranks.
    """
    names, table = named_table(ratings)
    check_size(table)
    with np.errstate(all="ignore"):
        squares = np.einsum("ij,ij->j", table, table)
    if np.isfinite(squares).all():
        return _complete(names, table, squares)
    return _with_missing(names, table)


def check_size(table: FloatArray) -> None:
    """Raise InsufficientDataError unless there are three items and two raters."""
    items, raters = table.shape
    if items < FEWEST_COMMON or raters < 2:
        raise InsufficientDataError(
            f"Pairwise correlation needs at least {FEWEST_COMMON} items and 2 raters; there are {items} items and "
            f"{raters} raters."
        )


def check_varying(varying: int) -> None:
    """Raise InsufficientDataError unless two raters vary."""
    if varying < 2:
        raise InsufficientDataError("Fewer than two raters gave different ratings, so there is no correlation.")


def check_pairs(pairs: int) -> None:
    """Raise InsufficientDataError unless there is a pair with a correlation."""
    if not pairs:
        raise InsufficientDataError(
            f"No two raters vary on {FEWEST_COMMON} or more items in common, so there is no correlation."
        )


def standardised(table: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return the columns that vary, less their means and scaled to length 1, and which columns do.

    Parameters
    ----------
    table : numpy.ndarray, shape (items, raters)
        Finite ratings.

    Returns
    -------
    tuple of numpy.ndarray, shapes (items, varying raters) and (raters,)
        The columns, and True for each that varies.
    """
    _, differences = centred_columns(table)
    varying = ~constant_columns(table, differences)
    columns = differences if varying.all() else differences[:, varying]
    # Scaled by the largest first, so that squares of small numbers do not vanish.
    columns /= np.maximum(columns.max(axis=0), -columns.min(axis=0))
    columns /= np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return columns, varying


def left_out_raters(names: tuple[str, ...], varying: npt.NDArray[np.bool_]) -> tuple[str, ...]:
    """Return the flag that names the raters who gave no two different ratings; empty if there are none."""
    constant = [name for name, varies in zip(names, varying, strict=True) if not varies]
    if not constant:
        return ()
    return (f"Raters who did not give two different ratings were left out: {listed(constant)}.",)


def left_out_pairs(few: int, constant: int) -> tuple[str, ...]:
    """Return the flags that say how many pairs were left out, and why."""
    flags = []
    if few:
        flags.append(f"{counted(few, 'pair')} with fewer than {FEWEST_COMMON} items in common left out.")
    if constant:
        flags.append(f"{counted(constant, 'pair')} left out since one of the two gave the common items one rating.")
    return tuple(flags)


@one_thread()
def _complete(names: tuple[str, ...], table: FloatArray, squares: FloatArray) -> MeanPairwiseCorrelation:
    items, raters = table.shape
    # Sums as products with a vector, which are the quickest.
    means = np.ones(items) @ table / items
    spreads = squares - items * means**2
    if (spreads > _WELL_SPREAD * squares).all() and squares.min() > np.finfo(float).tiny / _WELL_SPREAD:
        varying = np.ones(raters, dtype=bool)
        weights = 1 / np.sqrt(spreads)
        total = table @ weights - means @ weights
    else:
        columns, varying = standardised(finite_array(table, axes=("items", "raters"), name="ratings"))
        total = columns.sum(axis=1)
    k = int(np.count_nonzero(varying))
    check_varying(k)
    pairs = k * (k - 1) // 2
    r = min(1.0, max(-1 / (k - 1), (float(total @ total) - k) / (2 * pairs)))
    return _tested(
        r, pairs=pairs, raters=k, items=items, variance=1 / (items - 1) / pairs, flags=left_out_raters(names, varying)
    )


def _with_missing(names: tuple[str, ...], table: FloatArray) -> MeanPairwiseCorrelation:
    masked = MaskedRatings.of(table)
    check_varying(masked.raters)
    pairs = few = constant = 0
    total = variances = 0.0
    partners = np.zeros(masked.raters, dtype=np.int64)
    for block in masked.blocks():
        pairs += int(np.count_nonzero(block.used))
        few += block.few
        constant += block.constant
        total += float(block.correlations.sum())
        variances += float((block.used / np.maximum(block.common - 1, 1)).sum())
        partners[block.rows] += np.count_nonzero(block.used, axis=1)
        partners[block.columns] += np.count_nonzero(block.used, axis=0)
    check_pairs(pairs)
    flags = (*left_out_raters(names, masked.varying), *left_out_pairs(few, constant))
    return _tested(
        total / pairs,
        pairs=pairs,
        raters=int(np.count_nonzero(partners)),
        items=int(np.count_nonzero(masked.given.any(axis=1))),
        variance=variances / pairs**2,
        flags=flags,
    )


def _tested(
    r: float, *, pairs: int, raters: int, items: int, variance: float, flags: tuple[str, ...]
) -> MeanPairwiseCorrelation:
    # Both are k and n - 1 themselves if nothing is missing.
    k = 1 + 2 * pairs / raters
    freedom = 2 / (k * (k - 1) * variance)
    df1 = freedom - 2 / k
    df2 = (k - 1) * df1
    agreed, disagreed = (1 + (k - 1) * r) / k, (k - 1) * (1 - r) / k
    if agreed <= 0:
        F, p = 0.0, 1.0
    elif disagreed <= _ROUNDING:
        F, p, flags = math.inf, 0.0, (*flags, "All raters agree perfectly but for level and scale, so F has no bound.")
    else:
        F = (k - 1) * agreed / disagreed
        p = float(special.betainc(df2 / 2, df1 / 2, disagreed))
    return MeanPairwiseCorrelation(
        r=r, items=items, raters=raters, pairs=pairs, F=F, df1=df1, df2=df2, p=p, flags=flags
    )
