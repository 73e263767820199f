"""Limits of the noncentrality of Student's t, from which intervals of standardised differences are made."""

import math

import numpy as np
from scipy import optimize, special

# Beyond this scipy's series of the noncentral t lose digits, and the integral below takes over.
_SERIES = 1000.0
_MOST_POINTS = 400_000
# Beyond this t² / df the normal part of t changes less than the eighth digit.
_ALL_CHI = 1e8


def noncentrality_interval(t: float, df: float, *, confidence: float) -> tuple[float, float]:
    """Return the noncentralities at which a t as large, or as small, as this is just improbable enough.

    Parameters
    ----------
    t : float
        The observed statistic, finite.
    df : float
        Its degrees of freedom, 1 or more.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    tuple of float
        Lower and upper limit.

    References
    ----------
    Steiger and Fouladi (1997), Noncentrality interval estimation and the evaluation of statistical models.
    """
    tail = (1 - confidence) / 2
    if t < 0:
        low, high = noncentrality_interval(-t, df, confidence=confidence)
        return -high, -low
    return _limit(t, df, 1 - tail), _limit(t, df, tail)


def _limit(t: float, df: float, probability: float) -> float:
    if t * t > _ALL_CHI * df:
        return t * math.sqrt(float(special.chdtri(df, probability)) / df)

    def excess(noncentrality: float) -> float:
        return _below(t, df, noncentrality) - probability

    width = 1 + t / math.sqrt(2 * df)
    low, high = t - width, t + width
    while excess(low) < 0:
        low -= (width := 2 * width)
    while excess(high) > 0:
        high += (width := 2 * width)
    return float(optimize.brentq(excess, low, high, xtol=1e-12 * (1 + t), rtol=1e-14))


def _below(t: float, df: float, noncentrality: float) -> float:
    if t <= _SERIES and abs(noncentrality) <= _SERIES * 10:
        return float(special.nctdtr(df, noncentrality, t))
    # The mean of Φ(t s - δ) over s = sqrt(chi²(df) / df), by the trapezoid rule in log s.
    spread = math.sqrt(2 * df)
    low = -40 / df - 1 if df < 60 else -12 / spread
    high = min(math.sqrt(45 / df), 2.5) if df < 60 else 12 / spread
    points = min(_MOST_POINTS, 200 + int(2 * (high - low) * max(abs(noncentrality), spread)))
    v = np.linspace(low, high, points)
    weights = np.exp(df * (v - np.expm1(2 * v) / 2))
    return float(weights @ special.ndtr(t * np.exp(v) - noncentrality) / weights.sum())
