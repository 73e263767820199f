"""Tukey's studentised range, for all pairs of many groups at once.

scipy's `scipy.stats.studentized_range` integrates anew for each probability and takes about 0.1 s for a quantile; the
thousands that a hundred groups need would take minutes. Here the range of normal values is tabulated once.
"""

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy import interpolate, special
from scipy.optimize import elementwise

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray

# Ranges of normal values beyond this have probabilities below 1e-250.
_WIDEST = 48.0
# What is smaller than the largest part of an integrand by this factor (as a logarithm) does not count.
_NEGLIGIBLE = -40.0
_CHUNK = 512


def upper_tail(q: npt.ArrayLike, groups: int, df: npt.ArrayLike) -> FloatArray:
    """Return the probability that the studentised range exceeds q.

    Parameters
    ----------
    q : array_like
        Ranges, 0 or more: the largest less the smallest of `groups` means, in units of a mean's standard error.
    groups : int
        Number of means, 2 or more.
    df : array_like
        Degrees of freedom of the standard error, 1 or more; broadcast with `q`.

    Returns
    -------
    numpy.ndarray, shape as `q` and `df` broadcast
        Probabilities, with a relative error below 1e-9 (as long as they exceed 1e-200).

    Raises
    ------
    DataError
        If there are fewer than 2 groups or a degree of freedom below 1.

    Notes
    -----
    The probability is the mean of that of a range of normal values, Q(q s), over s = sqrt(chi²(df) / df). Both
    integrals have smooth integrands that die out on both sides, for which the trapezoid rule is exact to rounding
    (Trefethen and Weideman, 2014, SIAM Review 56:385).

    References
    ----------
    Copenhaver and Holland (1988), Journal of Statistical Computation and Simulation 30:1, equations 1 to 3; Tukey
    (1953), The Problem of Multiple Comparisons.
    """
    ranges, freedom = np.broadcast_arrays(np.asarray(q, dtype=float), np.asarray(df, dtype=float))
    if groups < 2 or not (freedom >= 1).all():
        raise DataError("The studentised range needs 2 groups or more, and 1 degree of freedom or more.")
    flat_q, flat_df = ranges.ravel(), freedom.ravel()
    parts = [
        _tail(flat_q[start : start + _CHUNK], groups, flat_df[start : start + _CHUNK])
        for start in range(0, flat_q.size, _CHUNK)
    ]
    return np.concatenate(parts).reshape(ranges.shape) if parts else np.empty(ranges.shape)


def quantile(probability: float, groups: int, df: npt.ArrayLike) -> FloatArray:
    """Return the range that the studentised range exceeds with a probability of 1 - `probability`.

    Parameters
    ----------
    probability : float
        Between 0 and 1, for instance .95.
    groups : int
        Number of means, 2 or more.
    df : array_like
        Degrees of freedom of the standard error, 1 or more.

    Returns
    -------
    numpy.ndarray, shape as `df`
        Quantiles.

    Raises
    ------
    DataError
        As `upper_tail`.
    """
    freedom = np.atleast_1d(np.asarray(df, dtype=float))
    different, places = np.unique(freedom, return_inverse=True)
    target = math.log1p(-probability)

    def excess(logarithm: FloatArray, freedom: FloatArray) -> FloatArray:
        return np.log(upper_tail(np.exp(logarithm), groups, freedom)) - target

    start = np.full(different.shape, math.log(3.0))
    ends = elementwise.bracket_root(excess, start - 0.5, start + 0.5, args=(different,)).bracket
    found = np.exp(elementwise.find_root(excess, ends, args=(different,), tolerances={"xatol": 1e-13}).x)
    return np.asarray(found[places].reshape(np.shape(df)))


def _tail(q: FloatArray, groups: int, df: FloatArray) -> FloatArray:
    freedom, normal = df[:, None], _normal_range(groups)

    def integrand(v: FloatArray) -> FloatArray:
        # Logarithm of the density of v = log s (but for its constant) times the probability.
        widths = np.minimum(q[:, None] * np.exp(v), _WIDEST)
        logarithm: FloatArray = freedom * (v - np.expm1(2 * v) / 2) + normal(widths)
        return logarithm

    # The first two grids find where the integrand lies; it is long, with a steep end, if df is small.
    low = np.minimum(-1.0, np.log(1 / np.maximum(q, 1.0)) - 1) - 45 / df
    high = np.minimum(np.sqrt(45 / df) + 0.05, 2.5)
    final = 192 if df.min() > 10 else 900
    for points in (96, 96, final):
        v = np.linspace(low, high, points, axis=1)
        values = integrand(v)
        largest = values.max(axis=1, keepdims=True)
        counts = values > largest + _NEGLIGIBLE
        step = (high - low) / (points - 1)
        if points != final:
            last = points - 1 - counts[:, ::-1].argmax(axis=1)
            low, high = low + (counts.argmax(axis=1) - 1) * step, low + (last + 1) * step
    total = np.log(np.exp(values - largest).sum(axis=1)) + largest[:, 0] + np.log(step)
    probabilities: FloatArray = np.exp(np.minimum(total + _constant(df / 2), 0.0))
    return probabilities


def _constant(half: FloatArray) -> FloatArray:
    # Of large numbers, what Stirling's formula leaves of the gamma function; the gamma function itself loses digits.
    left = (1 / 12 - (1 / 360 - 1 / (1260 * half**2)) / half**2) / half
    small = np.minimum(half, 100.0)
    exact = small * np.log(small) - special.gammaln(small) - small
    stirling: FloatArray = np.log(half / (2 * math.pi)) / 2 - left
    constant: FloatArray = math.log(2) + np.where(half > 100, stirling, exact)
    return constant


@lru_cache(maxsize=64)
def _normal_range(groups: int) -> interpolate.BSpline:
    """Return the logarithm of the probability that the range of normal values exceeds w, for w up to the widest."""
    w = np.linspace(0, _WIDEST, 1201)
    logarithms = np.empty(w.size)
    z = np.arange(-9.0, 34.0, 0.09)
    below = special.ndtr(z)
    density = groups * np.exp(-(z**2) / 2) / math.sqrt(2 * math.pi) * below ** (groups - 1)
    with np.errstate(divide="ignore"):
        for place, width in enumerate(w):
            # 1 - (1 - share)^(k - 1), to full relative precision.
            shares = np.minimum(special.ndtr(z - width) / below, 1.0)
            logarithms[place] = math.log(density @ -np.expm1((groups - 1) * np.log1p(-shares)) * 0.09)
    logarithms = np.minimum(logarithms, 0.0)
    return interpolate.make_interp_spline(w, logarithms, k=5)
