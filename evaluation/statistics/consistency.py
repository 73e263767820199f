"""Consistency of raters with themselves: what they say when an item comes back."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence, finite_vector
from evaluation.statistics.label_codes import IntArray, level_codes
from evaluation.statistics.result import Result

LEAST_ITEMS = 3
"""Fewer repeated items than these give a rater no correlations."""

# Sums of squares below this share of the squared values are rounding.
_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True)
class Consistency(Result):
    """How far repeated ratings of the same item by the same rater agree.

    Attributes
    ----------
    items : int
        Repeated items: pairs of a rater and an item that this rater rated twice or more.
    ratings : int
        Ratings of these.
    mean_difference : float
        Mean of the second rating less the first; far from 0, ratings drift.
    mean_absolute_difference : float
        Mean of the absolute differences of all two ratings of an item, each item counting alike.
    within_sd : float
        Standard deviation of one rater's ratings of one item (Dahlberg's error): the root of the mean variance within
        items, sqrt(sum(d^2) / (2 n)) where each comes twice.
    within_sd_ci : tuple of float
        Its interval by the chi-square.
    repeatability : float
        Repeatability coefficient 1.96 sqrt(2) within_sd (1.96 for a confidence of 95 %): so far two ratings of an item
        differ at most in 95 % of cases.
    icc : float or None
        ICC(1): share of the variance between a rater's items in all variance of the rater's ratings; below 0 if the
        ratings of an item differ more than those of different items. None if nothing varies or items are too few.
    icc_ci : tuple of float, or None
        Its interval by the F distribution.
    r : float or None
        Pearson's correlation of first and second ratings, each less the rater's mean; None as for the ICC.
    confidence : float
        Confidence of the intervals.
    """

    items: int
    ratings: int
    mean_difference: float
    mean_absolute_difference: float
    within_sd: float
    within_sd_ci: tuple[float, float]
    repeatability: float
    icc: float | None
    icc_ci: tuple[float, float] | None
    r: float | None
    confidence: float

    def apa(self) -> str:
        """Return for instance ``40 repeated items: within-rater SD = 0.41, ..., ICC(1,1) = .82, 95% CI [.69, .90]``."""
        interval = wording.interval(*self.within_sd_ci, confidence=self.confidence)
        parts = [
            f"{self.items} repeated items: within-rater SD = {wording.number(self.within_sd)}, {interval}",
            f"mean absolute difference {wording.number(self.mean_absolute_difference)}",
            f"repeatability coefficient {wording.number(self.repeatability)}",
        ]
        if self.icc is not None:
            parts.append(f"ICC(1,1) = {wording.share(self.icc)}")
        if self.icc_ci is not None:
            parts.append(wording.interval(*self.icc_ci, confidence=self.confidence, bounded=True))
        if self.r is not None:
            parts.append(f"r = {wording.share(self.r)}")
        return ", ".join(parts)

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no value."""
        icc_low, icc_high = self.icc_ci or (math.nan, math.nan)
        return pd.DataFrame(
            [
                {
                    "items": self.items,
                    "ratings": self.ratings,
                    "mean_difference": self.mean_difference,
                    "mean_absolute_difference": self.mean_absolute_difference,
                    "within_sd": self.within_sd,
                    "within_sd_ci_low": self.within_sd_ci[0],
                    "within_sd_ci_high": self.within_sd_ci[1],
                    "repeatability": self.repeatability,
                    "icc": math.nan if self.icc is None else self.icc,
                    "icc_ci_low": icc_low,
                    "icc_ci_high": icc_high,
                    "r": math.nan if self.r is None else self.r,
                }
            ]
        )


@dataclass(frozen=True, kw_only=True)
class RaterConsistency(Result):
    """The consistency of each rater who rated something twice, and of all together.

    Attributes
    ----------
    raters : tuple
        The raters, in the order of their first rating, or that of a pandas categorical.
    by_rater : tuple of Consistency
        The consistency of each.
    pooled : Consistency
        That of all, within raters: what raters differ in their means does not count.
    """

    raters: tuple[Hashable, ...]
    by_rater: tuple[Consistency, ...]
    pooled: Consistency

    def apa(self) -> str:
        """Return the sentence of the pooled consistency, with the number of raters."""
        noun = "rater" if len(self.raters) == 1 else "raters"
        return f"{len(self.raters)} {noun}, {self.pooled.apa()}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each rater and a last one, without a rater, for all."""
        frames = [one.to_frame() for one in (*self.by_rater, self.pooled)]
        table = pd.concat(frames, ignore_index=True)
        table.insert(0, "rater", pd.Series([*self.raters, None], dtype=object))
        return table


def rater_consistency(
    ratings: npt.ArrayLike,
    *,
    raters: Sequence[Hashable],
    items: Sequence[Hashable],
    confidence: float = 0.95,
) -> RaterConsistency:
    """Return how consistent raters are with themselves, from items that they rated twice or more.

    Parameters
    ----------
    ratings : array_like, shape (n,)
        Ratings in the order in which they were given.
    raters, items : sequence, length n
        Who rated what. A hidden repeat has the name of the item that it repeats; items that a rater rated once are left
        out.
    confidence : float
        Confidence of the intervals and of the repeatability coefficient, between 0 and 1.

    Returns
    -------
    RaterConsistency
        The consistency of each rater with repeats, and pooled.

    Raises
    ------
    DataError
        If the three differ in length, a rating is no finite number, a rater or item is missing (None or NaN), or
        `confidence` is not between 0 and 1.
    InsufficientDataError
        If nobody rated anything twice.

    Notes
    -----
    With mean squares between (MSB) and within (MSW) items of an analysis of variance within each rater, ICC(1,1) =
    (MSB - MSW) / (MSB + (k - 1) MSW), where k is 2, or the mean number of ratings of an item (less a term for their
    spread, as usual in unbalanced designs, where the interval is an approximation and the result says so).

    References
    ----------
    Dahlberg (1940), Statistical Methods for Medical and Biological Students. Bland and Altman (1999), Stat. Methods
    Med. Res. 8:135 (repeatability). Shrout and Fleiss (1979), Psychol. Bull. 86:420 (ICC and interval).
    """
    check_confidence(confidence)
    values = finite_vector(ratings, name="ratings")
    if not len(raters) == len(items) == values.size:
        raise DataError(
            f"There are {values.size} ratings, {len(raters)} raters and {len(items)} items; each rating needs both."
        )
    who, names = level_codes(raters, name="raters")
    what, _ = level_codes(items, name="items")
    cell = np.unique(who * (int(what.max(initial=0)) + 1) + what, return_inverse=True)[1]
    repeated = np.bincount(cell)[cell] > 1 if values.size else np.zeros(0, dtype=bool)
    if not repeated.any():
        raise InsufficientDataError("No rater rated an item twice, so that there is no consistency to compute.")
    values = values[repeated]
    # The unit, so that squares of small numbers do not vanish.
    unit = float(np.abs(values - values[0]).max()) or 1.0
    cells = _cells(values, who[repeated], cell[repeated], unit)
    known = np.unique(cells.rater)
    ends = np.searchsorted(cells.rater, known, side="right")
    starts = np.concatenate([[0], ends[:-1]])
    by_rater = tuple(
        _consistency(cells.part(slice(start, end)), confidence, unit) for start, end in zip(starts, ends, strict=True)
    )
    pooled = _consistency(cells, confidence, unit)
    return RaterConsistency(
        raters=tuple(names[code] for code in known), by_rater=by_rater, pooled=pooled, flags=pooled.flags
    )


class _Cells(NamedTuple):
    """Repeated items: of each its rater, and what its ratings are, less a constant and in units of their extent."""

    rater: IntArray
    number: IntArray
    mean: FloatArray
    squares: FloatArray
    absolute: FloatArray
    first: FloatArray
    second: FloatArray
    largest: FloatArray

    def part(self, where: slice) -> "_Cells":
        return _Cells._make(column[where] for column in self)


def _cells(values: FloatArray, who: IntArray, cell: IntArray, unit: float) -> _Cells:
    """Return the cells in the order of their raters, from ratings in the order in which they were given."""
    order = np.argsort(cell, kind="stable")
    code, starts, number = np.unique(cell[order], return_index=True, return_counts=True)
    place = np.repeat(np.arange(code.size), number)
    given = values[order]
    shifted = (given - given[0]) / unit
    mean = np.add.reduceat(shifted, starts) / number
    rest = shifted - mean[place]
    # The mean absolute difference of k ordered numbers is the sum of (2 i - k + 1) x[i], i from 0, over k (k - 1) / 2.
    rising = np.lexsort([rest, place])
    rank = np.arange(given.size) - np.repeat(starts, number)
    pairs = np.add.reduceat((2 * rank - np.repeat(number, number) + 1) * rest[rising], starts)
    return _Cells(
        rater=who[order][starts],
        number=number,
        mean=mean,
        squares=np.add.reduceat(rest**2, starts),
        absolute=pairs / (number * (number - 1) / 2),
        first=shifted[starts],
        second=shifted[starts + 1],
        largest=np.maximum.reduceat(np.abs(given / unit), starts),
    )


def _consistency(cells: _Cells, confidence: float, unit: float) -> Consistency:
    items, ratings = cells.number.size, int(cells.number.sum())
    rounding = ratings * (_ROUNDING * float(cells.largest.max())) ** 2
    within = float(cells.squares.sum())
    within = within if within > rounding else 0.0
    df = ratings - items
    sd = unit * math.sqrt(within / df)
    tail = (1 - confidence) / 2
    factors = [math.sqrt(df / float(special.chdtri(df, share))) for share in (tail, 1 - tail)]
    raters = np.unique(cells.rater, return_inverse=True)[1]
    flags = []
    if not within:
        flags.append("All repeated ratings are the same as the first: the intervals have no width.")
    icc, icc_ci = None, None
    df_between = items - int(raters.max()) - 1
    between = _between(cells, raters)
    if df_between < LEAST_ITEMS - 1:
        flags.append(f"Fewer than {LEAST_ITEMS} repeated items of a rater are too few for an ICC and a correlation.")
    elif max(between, within) <= rounding:
        flags.append("The ratings do not vary, so that there is no ICC and no correlation.")
    else:
        size = _size(cells, raters, df_between)
        if cells.number.min() < cells.number.max():
            flags.append("Items were repeated unequally often: the interval of the ICC is an approximation.")
        icc, icc_ci = _icc(between / df_between, within / df, (df_between, df), size=size, confidence=confidence)
    return Consistency(
        items=items,
        ratings=ratings,
        mean_difference=unit * float((cells.second - cells.first).mean()),
        mean_absolute_difference=unit * float(cells.absolute.mean()),
        within_sd=sd,
        within_sd_ci=(sd * factors[0], sd * factors[1]),
        repeatability=float(special.ndtri(1 - tail)) * math.sqrt(2) * sd,
        icc=icc,
        icc_ci=icc_ci,
        r=None if icc is None else _correlation(cells, raters, rounding),
        confidence=confidence,
        flags=tuple(flags),
    )


def _between(cells: _Cells, raters: IntArray) -> float:
    """Return the sum of squares between the items of each rater."""
    means = np.bincount(raters, cells.mean * cells.number) / np.bincount(raters, cells.number)
    return float(cells.number @ (cells.mean - means[raters]) ** 2)


def _size(cells: _Cells, raters: IntArray, df_between: int) -> float:
    """Return the mean number of ratings of an item, less a term for their spread."""
    squares = np.bincount(raters, cells.number.astype(float) ** 2) / np.bincount(raters, cells.number)
    return float(cells.number.sum() - squares.sum()) / df_between


def _icc(
    between: float, within: float, df: tuple[int, int], *, size: float, confidence: float
) -> tuple[float, tuple[float, float]]:
    """Return ICC(1) and its interval from mean squares and their degrees of freedom."""
    if not within:
        return 1.0, (1.0, 1.0)
    ratio, quantile = between / within, (1 + confidence) / 2
    low = ratio / float(special.fdtri(*df, quantile))
    high = ratio * float(special.fdtri(*df[::-1], quantile))
    icc, ci_low, ci_high = ((one - 1) / (one + size - 1) for one in (ratio, low, high))
    return icc, (ci_low, ci_high)


def _correlation(cells: _Cells, raters: IntArray, rounding: float) -> float | None:
    number = np.bincount(raters)
    first = cells.first - (np.bincount(raters, cells.first) / number)[raters]
    second = cells.second - (np.bincount(raters, cells.second) / number)[raters]
    squares = float(first @ first), float(second @ second)
    if min(squares) <= rounding:
        return None
    return min(1.0, max(-1.0, float(first @ second) / math.sqrt(squares[0] * squares[1])))
