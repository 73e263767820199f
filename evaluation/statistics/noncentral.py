"""Probabilities with which tests exceed their critical values, and checks of what goes into them."""

import math
from typing import Literal

import numpy as np
from scipy import special, stats

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray

Alternative = Literal["two-sided", "greater"]

# Beyond this the noncentral chi-squared varies by less than a third of a percent, and series become long.
_SURE = 1e6
_WEIGHTLESS = 1e-14
_FEW = 60
_MOST_POINTS = 400_000
_NEAR_ONE = 1 - 1e-8


def f_power(
    df_effect: float,
    df_error: float,
    noncentrality: float,
    *,
    alpha: float = 0.05,
    df_test: float | None = None,
    inflation: float = 1.0,
) -> float:
    """Return the probability that an F ratio exceeds its critical value.

    Parameters
    ----------
    df_effect, df_error, noncentrality : float
        Of the distribution of the ratio.
    alpha : float
        Level of the test.
    df_test : float, optional
        Degrees of freedom in the denominator that the test supposes; left out, `df_error`.
    inflation : float
        Expected numerator without an effect over the expected denominator: 1 for a valid test, more for one whose
        denominator leaves out a source of variance.

    Returns
    -------
    float
        The probability.

    Raises
    ------
    DataError
        If `alpha` is not between 0 and 1.
    """
    check_level(alpha)
    critical = float(stats.f.isf(alpha, df_effect, df_error if df_test is None else df_test))
    return f_exceeds(critical / inflation, df_effect, df_error, noncentrality)


def check_level(alpha: float) -> None:
    """Raise DataError unless a level lies between 0 and 1."""
    if not 0 < alpha < 1:
        raise DataError(f"alpha is {alpha}, but must lie between 0 and 1.")


def check_count(count: int, least: int, name: str) -> None:
    """Raise DataError unless a count is a whole number of `least` or more."""
    whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
    if not whole or count < least:
        raise DataError(f"{name} is {count}, but must be a whole number of {least} or more.")


def check_positive(value: float, name: str) -> None:
    """Raise DataError unless a value is a positive finite number."""
    if not (math.isfinite(value) and value > 0):
        raise DataError(f"{name} is {value}, but must be a positive number.")


def t_power(df: float, noncentrality: float, alternative: Alternative, alpha: float) -> float:
    """Return the probability that a t ratio exceeds its critical value.

    Raises
    ------
    DataError
        If `alternative` is neither "two-sided" nor "greater", or `alpha` is not between 0 and 1.
    """
    check_level(alpha)
    if alternative not in ("two-sided", "greater"):
        raise DataError(f"The alternative is {alternative!r}, but must be 'two-sided' or 'greater'.")
    if alternative == "two-sided":
        # The square of t is F; so also the wrong side counts, as in the test.
        return f_power(1, df, noncentrality**2, alpha=alpha)
    critical = float(stats.t.isf(alpha, df))
    # scipy 1.17 has minus infinity for some levels below 1e-200.
    return t_exceeds(math.inf if alpha < 0.5 and critical < 0 else critical, df, noncentrality)


def f_exceeds(value: float, df_effect: float, df_error: float, noncentrality: float) -> float:
    """Return the probability that a noncentral F is larger than a value.

    A sum of central beta probabilities with Poisson weights, around the largest of these; scipy 1.17 has no number for
    some large noncentralities and a wrong one for some tiny ones.

    References
    ----------
    Tang (1938), Statistical Research Memoirs 2:126.
    """
    if value <= 0:
        return 1.0
    if noncentrality > _SURE:
        # The numerator hardly varies any more.
        return float(stats.chi2.cdf(df_error * (noncentrality + df_effect) / (df_effect * value), df_error))
    terms, weights = _poisson(noncentrality / 2)
    left = df_error / (df_error + df_effect * value)
    return _probability(float(weights @ special.betainc(df_error / 2, df_effect / 2 + terms, left)))


def t_exceeds(value: float, df: float, noncentrality: float) -> float:
    """Return the probability that a noncentral t is larger than a value.

    The mean of Φ(δ - value s) over s = sqrt(chi²(df) / df), by the trapezoid rule in log s, which is exact to rounding
    for a smooth function that vanishes at both ends. scipy 1.17 has no number for some large values with few degrees of
    freedom.

    References
    ----------
    Trefethen and Weideman (2014), SIAM Review 56:385, for the rule.
    """
    if math.isinf(value):
        return float(value < 0)
    spread = math.sqrt(2 * df)
    low = -40 / df - 1 if df < _FEW else -12 / spread
    high = min(math.sqrt(45 / df), 2.5) if df < _FEW else 12 / spread
    # Far in the tail, most is from small s.
    low -= math.log(max(1.0, abs(value) / (math.sqrt(df) + abs(noncentrality))))
    points = min(_MOST_POINTS, 200 + int((high - low) * max(2 * abs(noncentrality), 2 * spread, 8)))
    v = np.linspace(low, high, points)
    weights = np.exp(df * (v - np.expm1(2 * v) / 2))
    with np.errstate(over="ignore"):
        above = special.ndtr(noncentrality - value * np.exp(v))
    return _probability(float(weights @ above / weights.sum()))


def correlation_exceeds(critical: float, squared: float, n: int) -> float:
    """Return the probability that r² of `n` normal pairs exceeds `critical` if the true r² is `squared`."""
    if squared >= _NEAR_ONE:
        return 1.0
    mixing = stats.nbinom((n - 1) / 2, 1 - squared)
    low, high = int(mixing.ppf(_WEIGHTLESS)), int(mixing.isf(_WEIGHTLESS))
    # Smooth in its terms: of very many, some thousand evenly spread ones with the weight of all around them are enough.
    edges = np.unique(np.linspace(low, high + 1, min(high + 1 - low, 4096) + 1).astype(np.int64))
    weights = np.diff(mixing.cdf(edges - 1.0))
    middles = (edges[:-1] + edges[1:] - 1) / 2
    return _probability(float(weights @ special.betaincc(0.5 + middles, (n - 2) / 2, critical)))


def _poisson(mean: float) -> tuple[FloatArray, FloatArray]:
    """Return the terms of a Poisson distribution that have any weight, and their weights."""
    spread = 12 * math.sqrt(mean) + 40
    terms = np.arange(max(0, math.floor(mean - spread)), math.ceil(mean + spread) + 1, dtype=float)
    weights = np.exp(special.xlogy(terms, mean) - mean - special.gammaln(terms + 1))
    return terms, weights / weights.sum()


def _probability(value: float) -> float:
    return min(1.0, max(0.0, value))
