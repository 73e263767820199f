"""Sizes of the difference between two conditions, with intervals."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import (
    FloatArray,
    centred,
    check_confidence,
    finite_vector,
    is_constant,
    standard_deviation,
)
from evaluation.statistics.groups import group_vectors, moments
from evaluation.statistics.noncentral_t import noncentrality_interval
from evaluation.statistics.result import Result

Standardiser = Literal["difference", "average"]


@dataclass(frozen=True, kw_only=True)
class EffectSize(Result):
    """A difference without units.

    Attributes
    ----------
    name : str
        ``d`` (two groups), ``d_z`` or ``d_av`` (pairs), ``g``, ``g_z`` or ``g_av`` (the same without bias), or
        ``delta`` (Cliff's).
    value : float
        Its value; positive if x is larger than y.
    ci : tuple of float
        Interval.
    confidence : float
        Confidence of the interval.
    interval_method : str
        How the interval was made.
    n : tuple of int
        Numbers of values: of x and of y, or of pairs.
    """

    name: str
    value: float
    ci: tuple[float, float]
    confidence: float
    interval_method: str
    n: tuple[int, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``d_z = -1.28, 95% CI [-2.12, -0.41]``."""
        bounded = self.name == "delta"
        value = wording.share(self.value) if bounded else wording.number(self.value)
        symbol = "Cliff's δ" if bounded else self.name
        return f"{symbol} = {value}, {wording.interval(*self.ci, confidence=self.confidence, bounded=bounded)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        return pd.DataFrame(
            {
                "effect_size": [self.name],
                "value": [self.value],
                "ci_low": [self.ci[0]],
                "ci_high": [self.ci[1]],
                "confidence": [self.confidence],
                "interval": [self.interval_method],
                "n": [sum(self.n)],
            }
        )


def cohens_d(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> EffectSize:
    """Return the difference of the means of two groups in pooled standard deviations, with its noncentral t interval.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers of different raters or items.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    EffectSize
        Cohen's d (d_s of Lakens).

    Raises
    ------
    DataError
        If a value is not a finite number or `confidence` is not between 0 and 1.
    InsufficientDataError
        If a group is empty, there are fewer than three values, or values vary in no group.

    References
    ----------
    Cohen (1988), Statistical Power Analysis for the Behavioral Sciences, 2nd ed., section 2.5; interval by Steiger and
    Fouladi (1997); Lakens (2013), Frontiers in Psychology 4:863.
    """
    return _two_groups(x, y, confidence)[0]


def cohens_d_paired(
    x: npt.ArrayLike, y: npt.ArrayLike, *, standardiser: Standardiser = "difference", confidence: float = 0.95
) -> EffectSize:
    """Return the mean difference of pairs in standard deviations, with its interval.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Finite numbers of the same raters or items.
    standardiser : {"difference", "average"}
        Standard deviation of the differences (d_z), or the root of the mean of both variances (d_av), which can be
        compared with d of two groups.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    EffectSize
        d_z with the noncentral t interval, or d_av with the same interval in the other unit, which is approximate.

    Raises
    ------
    DataError
        If a value is not a finite number, the two differ in length, or an option is unknown or out of range.
    InsufficientDataError
        If there are fewer than two pairs or the differences do not vary.

    References
    ----------
    Cohen (1988), section 2.3; d_av by Cumming (2012), Understanding the New Statistics, chapter 11; its interval by
    Algina and Keselman (2003), Educational and Psychological Measurement 63:537.
    """
    return _pairs(x, y, standardiser, confidence)[0]


def hedges_g(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    paired: bool = False,
    standardiser: Standardiser = "difference",
    confidence: float = 0.95,
) -> EffectSize:
    """Return Cohen's d without its bias in small samples.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers.
    paired : bool
        Whether the values are pairs.
    standardiser : {"difference", "average"}
        Of pairs; see `cohens_d_paired`.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    EffectSize
        d and the limits of its interval, times the exact correction J = Γ(m/2) / (√(m/2) Γ((m-1)/2)), where m is the
        degrees of freedom.

    Raises
    ------
    DataError, InsufficientDataError
        As `cohens_d` or `cohens_d_paired`; also if there is only one degree of freedom, where d has no mean.

    References
    ----------
    Hedges (1981), Journal of Educational Statistics 6:107, equation 6.
    """
    d, df = _pairs(x, y, standardiser, confidence) if paired else _two_groups(x, y, confidence)
    if df < 2:
        raise InsufficientDataError("Hedges' g needs two degrees of freedom or more; there is one.")
    J = _correction(df)
    return replace(
        d,
        name=d.name.replace("d", "g", 1),
        value=J * d.value,
        ci=(J * d.ci[0], J * d.ci[1]),
        interval_method=f"{d.interval_method}, corrected as g",
    )


def cliffs_delta(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> EffectSize:
    """Return how much more often a value of x exceeds one of y than the reverse.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers, two or more on each side; only their order counts.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    EffectSize
        P(x > y) - P(x < y), from -1 to 1, with the asymmetric interval from the consistent estimate of its variance;
        if all of one side exceeds all of the other, Wilson's interval for a share of 1 of the smaller side.

    Raises
    ------
    DataError
        If a value is not a finite number or `confidence` is not between 0 and 1.
    InsufficientDataError
        If a side has fewer than two values.

    Notes
    -----
    By sorting, in O((n + m) log(n + m)) time and no table of n x m.

    References
    ----------
    Cliff (1993), Psychological Bulletin 114:494; interval by Feng and Cliff (2004), Journal of Modern Applied
    Statistical Methods 3:322.
    """
    check_confidence(confidence)
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    n, m = xs.size, ys.size
    if min(n, m) < 2:
        raise InsufficientDataError(f"Cliff's delta needs two values or more on each side; there are {n} and {m}.")
    wins, losses = _counts(xs, ys)
    losses_of_y, wins_of_y = _counts(ys, xs)[::-1]
    delta = float(wins.sum() - losses.sum()) / (n * m)
    # Dominance of each value of x over y, and of x over each value of y.
    rows, columns = (wins - losses) / m - delta, (losses_of_y - wins_of_y) / n - delta
    cells = float(wins.sum() + losses.sum()) - n * m * delta**2
    variance = (
        (m - 1) * float(rows @ rows) / (n - 1)
        + (n - 1) * float(columns @ columns) / (m - 1)
        + cells / ((n - 1) * (m - 1))
    ) / (n * m)
    z = float(special.ndtri((1 + confidence) / 2))
    return EffectSize(
        name="delta",
        value=delta,
        ci=_cliff_interval(delta, variance, z, smaller=min(n, m)),
        confidence=confidence,
        interval_method="asymmetric, consistent variance" if abs(delta) < 1 else "Wilson's, of the smaller side",
        n=(n, m),
        flags=() if abs(delta) < 1 else ("All values of one side exceed all of the other.",),
    )


def _counts(xs: FloatArray, ys: FloatArray) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return for each value of x how many of y are below and above it."""
    ordered = np.sort(ys)
    below = np.searchsorted(ordered, xs, side="left")
    return below, ys.size - np.searchsorted(ordered, xs, side="right")


def _cliff_interval(delta: float, variance: float, z: float, *, smaller: int) -> tuple[float, float]:
    if abs(delta) == 1:
        inner = (smaller - z**2) / (smaller + z**2)
        return (inner, 1.0) if delta > 0 else (-1.0, -inner)
    rest, wide = 1 - delta**2, z**2 * variance
    middle, half = delta * rest, math.sqrt(wide * (rest**2 + wide))
    return max(-1.0, (middle - half) / (rest + wide)), min(1.0, (middle + half) / (rest + wide))


def _two_groups(x: npt.ArrayLike, y: npt.ArrayLike, confidence: float) -> tuple[EffectSize, int]:
    check_confidence(confidence)
    found = moments(group_vectors({"x": x, "y": y}))
    n, m = (int(size) for size in found.sizes)
    df, squares = n + m - 2, float(found.squares.sum())
    if df < 1:
        raise InsufficientDataError(f"Cohen's d needs three values or more; there are {n + m}.")
    if squares <= found.negligible:
        raise InsufficientDataError("The values vary in no group, so there is no unit for their difference.")
    d = float(found.offsets[0] - found.offsets[1]) / math.sqrt(squares / df)
    unit = math.sqrt(1 / n + 1 / m)
    low, high = noncentrality_interval(d / unit, df, confidence=confidence)
    effect = EffectSize(
        name="d",
        value=d,
        ci=(low * unit, high * unit),
        confidence=confidence,
        interval_method="noncentral t",
        n=(n, m),
    )
    return effect, df


def _pairs(x: npt.ArrayLike, y: npt.ArrayLike, standardiser: Standardiser, confidence: float) -> tuple[EffectSize, int]:
    check_confidence(confidence)
    if standardiser not in ("difference", "average"):
        raise DataError(f"The standardiser is {standardiser!r}, but must be 'difference' or 'average'.")
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"x has {xs.size} values and y has {ys.size}, but pairs are needed.")
    n = xs.size
    if n < 2:
        raise InsufficientDataError(f"The effect size needs two pairs or more; there {'is one' if n else 'are none'}.")
    mean, spread = centred(xs - ys)
    if is_constant(np.concatenate([xs, ys]), spread):
        raise InsufficientDataError("All differences are the same, so there is no unit for their mean.")
    sd = standard_deviation(spread)
    low, high = noncentrality_interval(mean / sd * math.sqrt(n), n - 1, confidence=confidence)
    unit, name, method = sd, "d_z", "noncentral t"
    if standardiser == "average":
        sides = [standard_deviation(centred(side)[1]) for side in (xs, ys)]
        unit, name, method = math.hypot(*sides) / math.sqrt(2), "d_av", "noncentral t in units of d_av (approximate)"
    factor = sd / unit / math.sqrt(n)
    effect = EffectSize(
        name=name,
        value=mean / unit,
        ci=(low * factor, high * factor),
        confidence=confidence,
        interval_method=method,
        n=(n,),
    )
    return effect, n - 1


def _correction(df: int) -> float:
    if df < 200:
        return math.exp(special.gammaln(df / 2) - special.gammaln((df - 1) / 2)) / math.sqrt(df / 2)
    # Γ(a + 1/2) / (Γ(a) √a) in powers of 1 / a, where the gamma functions themselves would lose digits.
    a = (df - 1) / 2
    series = 1 - (1 / 8 - (1 / 128 + (5 / 1024 - 21 / 32768 / a) / a) / a) / a
    return math.sqrt(a / (a + 0.5)) * series
