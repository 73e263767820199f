"""Limits of the noncentrality of Student's t, from which intervals of standardised differences are made."""

import math

from scipy import optimize, special

from evaluation.statistics.noncentral import t_exceeds

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
        return 1 - t_exceeds(t, df, noncentrality) - probability

    width = 1 + t / math.sqrt(2 * df)
    low, high = t - width, t + width
    while excess(low) < 0:
        low -= (width := 2 * width)
    while excess(high) > 0:
        high += (width := 2 * width)
    return float(optimize.brentq(excess, low, high, xtol=1e-12 * (1 + t), rtol=1e-14))
