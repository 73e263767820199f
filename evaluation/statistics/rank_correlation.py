"""Rank correlation of two measurements of the same things."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.correlation import fisher_interval, paired, pearson, pearson_p_values
from evaluation.statistics.result import Result

# Up to so many pairs without ties, p is counted from all orders of the ranks.
_EXACT_SPEARMAN = 10
_EXACT_KENDALL = 50

Test = Literal["exact", "t", "normal"]


@dataclass(frozen=True, kw_only=True)
class RankCorrelation(Result):
    """Spearman's or Kendall's correlation.

    Attributes
    ----------
    name : str
        ``Spearman's rho`` or ``Kendall's tau-b``.
    value : float
        The coefficient, -1 to 1.
    n : int
        Number of pairs.
    p : float
        Two-sided probability of a coefficient at least as far from 0 if the two sides were independent.
    test : str
        Where p comes from: ``exact`` (all orders of the ranks), ``t`` or ``normal`` (approximations for many pairs or
        ties).
    ci : tuple of float, or None
        Interval for the coefficient; None if there are too few pairs for one.
    confidence : float
        Confidence of the interval.
    """

    name: str
    value: float
    n: int
    p: float
    test: Test
    ci: tuple[float, float] | None
    confidence: float

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``rs(12) = .87, 95% CI [.61, .96], p < .001``."""
        spearmans = self.name.startswith("Spearman")
        parts = [
            f"rs({self.n - 2}) = {wording.share(self.value)}" if spearmans else f"τb = {wording.share(self.value)}"
        ]
        if self.ci:
            parts.append(wording.interval(*self.ci, confidence=self.confidence, bounded=True))
        if not spearmans:
            parts.append(f"n = {self.n}")
        p = wording.p_value(self.p)
        return ", ".join([*parts, f"exact {p}" if self.test == "exact" else p])

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no interval."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "coefficient": [self.name],
                "value": [self.value],
                "n": [self.n],
                "p": [self.p],
                "test": [self.test],
                "ci_low": [low],
                "ci_high": [high],
                "confidence": [self.confidence],
            }
        )


def spearman(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> RankCorrelation:
    """Return Spearman's correlation, Pearson's of the ranks.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers; equal ones (to rounding) get the mean of their ranks.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    RankCorrelation
        rho with its p value and interval.

    Raises
    ------
    DataError
        If the two differ in length, a value is not a finite number, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than three pairs or one side does not vary.

    Notes
    -----
    p is exact for up to 10 pairs without ties, and otherwise that of the t distribution with n - 2 degrees of freedom.
    The interval is symmetric on Fisher's scale with the standard error sqrt((1 + rho² / 2) / (n - 3)) of Bonett and
    Wright; it needs four pairs.

    References
    ----------
    Spearman (1904), Am. J. Psychol. 15:72; Kendall and Gibbons (1990), Rank Correlation Methods, 5th ed., chapter 4,
    for p; Bonett and Wright (2000), Psychometrika 65:23.
    """
    check_confidence(confidence)
    ranks_x, ranks_y = _ranked(x, y)
    n = ranks_x.size
    value = pearson(ranks_x, ranks_y).r
    exact = n <= _EXACT_SPEARMAN and not _ties(ranks_x) and not _ties(ranks_y)
    p = _exact_spearman(ranks_x, ranks_y) if exact else float(pearson_p_values(np.array(value), n))
    return RankCorrelation(
        name="Spearman's rho",
        value=value,
        n=n,
        p=p,
        test="exact" if exact else "t",
        ci=fisher_interval(value, math.sqrt((1 + value**2 / 2) / (n - 3)), confidence) if n > 3 else None,
        confidence=confidence,
        flags=_flags(n, exact=exact, fewest=4),
    )


def kendall(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> RankCorrelation:
    """Return Kendall's tau-b, which counts pairs of things that both sides order alike and allows for ties.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers; those that are equal to rounding are tied.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    RankCorrelation
        tau-b with its p value and interval.

    Raises
    ------
    DataError, InsufficientDataError
        As `spearman`.

    Notes
    -----
    p is exact for up to 50 pairs without ties, and otherwise normal with the variance for ties. The interval is
    symmetric on Fisher's scale with the standard error sqrt(0.437 / (n - 4)) of Fieller, Hartley and Pearson; it needs
    five pairs and is good for |tau| below 0.8 (Bonett and Wright).

    References
    ----------
    Kendall (1938), Biometrika 30:81, and (1945), Biometrika 33:239, for ties; Fieller, Hartley and Pearson (1957),
    Biometrika 44:470; Bonett and Wright (2000), Psychometrika 65:23.
    """
    check_confidence(confidence)
    ranks_x, ranks_y = _ranked(x, y)
    n = ranks_x.size
    exact = n <= _EXACT_KENDALL and not _ties(ranks_x) and not _ties(ranks_y)
    found = stats.kendalltau(ranks_x, ranks_y, method="exact" if exact else "asymptotic", variant="b")
    value = min(1.0, max(-1.0, float(found.statistic)))
    return RankCorrelation(
        name="Kendall's tau-b",
        value=value,
        n=n,
        p=float(found.pvalue),
        test="exact" if exact else "normal",
        ci=fisher_interval(value, math.sqrt(0.437 / (n - 4)), confidence) if n > 4 else None,
        confidence=confidence,
        flags=_flags(n, exact=exact, fewest=5),
    )


def _ranked(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    ranks = tuple(_ranks(values) for values in paired(x, y))
    for name, side in zip("xy", ranks, strict=True):
        if (side == side[0]).all():
            raise InsufficientDataError(
                f"All {side.size} values of {name} are the same, so there is no correlation to compute."
            )
    return ranks[0], ranks[1]


def _ranks(values: FloatArray) -> FloatArray:
    # Means of the same ratings may differ in the last digit; such a difference is no order.
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    rounding = 4 * np.finfo(float).eps * np.maximum(np.abs(ordered[1:]), np.abs(ordered[:-1]))
    groups = np.empty(values.size)
    groups[order] = np.concatenate([[0], np.cumsum(np.diff(ordered) > rounding)])
    ranks: FloatArray = stats.rankdata(groups)
    return ranks


def _ties(ranks: FloatArray) -> bool:
    return np.unique(ranks).size < ranks.size


def _flags(n: int, *, exact: bool, fewest: int) -> tuple[str, ...]:
    flags = []
    if n < fewest:
        flags.append(f"The interval needs at least {fewest} pairs.")
    if not exact and n <= _EXACT_SPEARMAN:
        flags.append("With ties among so few pairs p is only an approximation.")
    return tuple(flags)


def _exact_spearman(ranks_x: FloatArray, ranks_y: FloatArray) -> float:
    n = ranks_x.size
    counts = _products_of_ranks(n)
    # The distribution of the sum of products is symmetric around that of no correlation, half the sum of its extremes.
    products = np.arange(counts.size)
    centre = n * (n + 1) ** 2 / 4
    as_far = np.abs(products - centre) >= abs(float(ranks_x @ ranks_y) - centre) - 1e-9
    return float(counts[as_far].sum()) / math.factorial(n)


@cache
def _products_of_ranks(n: int) -> npt.NDArray[np.int64]:
    """Return how many of the n! orders of the ranks 1 ... n have each sum of products with 1 ... n.

    Ranks are given out one after another; what counts on the way is which are taken, not in which order.
    """
    counts = np.zeros((2**n, n * (n + 1) * (2 * n + 1) // 6 + 1), dtype=np.int64)
    counts[0, 0] = 1
    taken = np.arange(2**n)
    given = np.bitwise_count(taken)
    for place in range(1, n + 1):
        before = taken[given == place - 1]
        for rank in range(1, n + 1):
            free = before[(before >> (rank - 1)) & 1 == 0]
            counts[free | 1 << (rank - 1), place * rank :] += counts[free, : counts.shape[1] - place * rank]
    totals: npt.NDArray[np.int64] = counts[-1].copy()
    totals.flags.writeable = False
    return totals
