"""The SOS hypothesis: how the spread of ratings goes with their mean on a bounded scale."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, finite_vector
from evaluation.statistics.result import Result

_LEAST_RESAMPLES = 100
# Numbers that are held at once.
_MOST_AT_ONCE = 4_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Sos(Result):
    """The SOS parameter of ratings: variance = a (mean - low) (high - mean).

    Attributes
    ----------
    a : float
        The parameter: 0 if raters agree, 1 if they use the ends of the scale alone; a binomial of high - low trials has
        1 / (high - low).
    se : float or None
        Standard error of the least-squares slope; None for one item.
    ci : tuple of float, or None
        Percentile interval of bootstrapped items; None for one item.
    confidence : float
        Confidence of the interval.
    r_squared : float or None
        Share of the squared variances that the hypothesis explains, 1 - sum(residual^2) / sum(variance^2), as usual for
        a line through the origin; None if all variances are 0.
    mean, variance : numpy.ndarray, shape (items,)
        Mean and variance (n - 1) of the ratings of each item that counts.
    low, high : float
        Ends of the scale.
    """

    a: float
    se: float | None
    ci: tuple[float, float] | None
    confidence: float
    r_squared: float | None
    mean: FloatArray
    variance: FloatArray
    low: float
    high: float

    def expected_sd(self, mean: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation that the hypothesis expects at means on the scale."""
        means = np.asarray(mean, dtype=float)
        result: FloatArray = np.sqrt(np.maximum(self.a * (means - self.low) * (self.high - means), 0))
        return result

    def apa(self) -> str:
        """Return for instance ``SOS parameter a = 0.21, SE = 0.01, 95% CI [0.18, 0.24], 79 items``."""
        parts = [f"SOS parameter a = {wording.number(self.a)}"]
        if self.se is not None:
            parts.append(f"SE = {wording.number(self.se)}")
        if self.ci is not None:
            parts.append(wording.interval(*self.ci, confidence=self.confidence))
        return ", ".join([*parts, f"{self.mean.size} item{'' if self.mean.size == 1 else 's'}"])

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no value."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            [
                {
                    "a": self.a,
                    "se": math.nan if self.se is None else self.se,
                    "ci_low": low,
                    "ci_high": high,
                    "r_squared": math.nan if self.r_squared is None else self.r_squared,
                    "items": self.mean.size,
                }
            ]
        )


def sos(
    groups: Mapping[str, npt.ArrayLike],
    *,
    low: float,
    high: float,
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = 2000,
) -> Sos:
    """Return the SOS parameter of ratings of several items.

    Parameters
    ----------
    groups : mapping of str to array_like
        The ratings of each item; items with fewer than two do not count.
    low, high : float
        Ends of the scale.
    rng, confidence, resamples
        As in `sos_from_summary`.

    Returns
    -------
    Sos
        The parameter with standard error and interval.

    Raises
    ------
    DataError
        As `sos_from_summary`, or if a rating is no finite number on the scale.
    InsufficientDataError
        As `sos_from_summary`.

    References
    ----------
    As `sos_from_summary`.
    """
    means, variances = [], []
    _check_scale(low, high)
    for name, ratings in groups.items():
        values = finite_vector(ratings, name=str(name))
        if ((values < low) | (values > high)).any():
            raise DataError(f"{name}: a rating is not on the scale from {low:g} to {high:g}.")
        if values.size > 1:
            mean, rest = centred(values)
            means.append(min(max(mean, low), high))
            variances.append(float(rest @ rest) / (values.size - 1))
    found = sos_from_summary(means, variances, low=low, high=high, rng=rng, confidence=confidence, resamples=resamples)
    few = len(groups) - len(means)
    if not few:
        return found
    out = f"{few} of {len(groups)} items have fewer than two ratings and do not count."
    return Sos(**{**vars(found), "flags": (*found.flags, out)})


def sos_from_summary(
    means: npt.ArrayLike,
    variances: npt.ArrayLike,
    *,
    low: float,
    high: float,
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = 2000,
) -> Sos:
    """Return the SOS parameter from means and variances of the ratings of several items.

    Parameters
    ----------
    means, variances : array_like, shape (items,)
        Mean, from `low` to `high`, and variance (n - 1) of the ratings of each item.
    low, high : float
        Ends of the scale.
    rng : numpy.random.Generator
        For the bootstrap of items.
    confidence : float
        Confidence of the interval, between 0 and 1.
    resamples : int
        How many resamples are drawn, 100 or more.

    Returns
    -------
    Sos
        The parameter, flagged if it is not from 0 to 1.

    Raises
    ------
    DataError
        If the two differ in length, a number is not finite or out of range, or the scale has no length.
    InsufficientDataError
        If no item has a mean between the ends of the scale.

    Notes
    -----
    With g = -mean^2 + (low + high) mean - low high, a = sum(g variance) / sum(g^2), the least-squares line through the
    origin; items whose ratings all lie at one end of the scale have g = 0 and tell nothing. The variance with n - 1
    does not depend on the number of raters; among few raters a may exceed 1 for that reason.

    References
    ----------
    Hossfeld, Schatz and Egger (2011), SOS: The MOS is not enough!, 3rd International Workshop on
    Quality of Multimedia Experience.
    """
    check_confidence(confidence)
    _check_scale(low, high)
    mean, variance = finite_vector(means, name="means"), finite_vector(variances, name="variances")
    if mean.size != variance.size:
        raise DataError(f"There are {mean.size} means, but {variance.size} variances.")
    if ((mean < low) | (mean > high)).any():
        raise DataError(f"A mean is not on the scale from {low:g} to {high:g}.")
    if (variance < 0).any():
        raise DataError("A variance is negative.")
    if resamples < _LEAST_RESAMPLES:
        raise DataError(f"resamples is {resamples}, but must be {_LEAST_RESAMPLES} or more.")
    # On a scale from 0 to 1, where squares neither vanish nor overflow.
    share = (mean - low) / (high - low)
    g, v = share * (1 - share), variance / (high - low) / (high - low)
    inside = g > 0
    if not inside.any():
        raise InsufficientDataError("No item has two ratings and a mean between the ends of the scale.")
    gg, gv = g[inside] ** 2, g[inside] * v[inside]
    a = float(gv.sum() / gg.sum())
    size = int(gg.size)
    rest = v[inside] - a * g[inside]
    se = math.sqrt(float(rest @ rest) / (size - 1) / float(gg.sum())) if size > 1 else None
    squares = float(v[inside] @ v[inside])
    return Sos(
        a=a,
        se=se,
        ci=_bootstrapped(gg, gv, confidence, resamples, rng) if size > 1 else None,
        confidence=confidence,
        r_squared=1 - float(rest @ rest) / squares if squares else None,
        mean=mean[inside],
        variance=variance[inside],
        low=low,
        high=high,
        flags=_flags(a, size, mean.size),
    )


def _flags(a: float, size: int, items: int) -> tuple[str, ...]:
    flags = []
    if not 0 <= a <= 1:
        flags.append("The parameter is not from 0 to 1, as it is for ratings on this scale by more than a few raters.")
    if not a:
        flags.append("The ratings of no item vary, so that the parameter is 0 whatever the hypothesis.")
    if size == 1:
        flags.append("One item tells nothing of how spread goes with the mean: no standard error and no interval.")
    if size < items:
        flags.append(f"{items - size} of {items} items are rated at one end of the scale by all and tell nothing.")
    return tuple(flags)


def _check_scale(low: float, high: float) -> None:
    if not np.isfinite(high - low) or low >= high:
        raise DataError(f"The scale goes from {low} to {high}, but must have a lower and a higher end.")


def _bootstrapped(
    gg: FloatArray, gv: FloatArray, confidence: float, resamples: int, rng: np.random.Generator
) -> tuple[float, float]:
    part = max(1, _MOST_AT_ONCE // gg.size)
    found = []
    for start in range(0, resamples, part):
        drawn = rng.integers(gg.size, size=(min(part, resamples - start), gg.size))
        found.append(gv[drawn].sum(axis=1) / gg[drawn].sum(axis=1))
    low, high = np.quantile(np.concatenate(found), [(1 - confidence) / 2, (1 + confidence) / 2])
    return float(low), float(high)
