"""Tests that a difference is small enough not to matter: two one-sided tests (TOST)."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import centred, finite_vector, is_constant, standard_deviation
from evaluation.statistics.groups import group_vectors, moments
from evaluation.statistics.result import Result

Verdict = Literal["equivalent", "different", "both", "inconclusive"]

_WORDS: dict[str, str] = {
    "equivalent": "equivalent, and not different from {point}",
    "different": "different from {point}, and not shown to be equivalent",
    "both": "different from {point}, but by less than the bounds",
    "inconclusive": "neither shown to be equivalent nor different from {point}",
}
_ESTIMATED = "The bounds are in standard deviations of the sample, so they vary with it and the levels are approximate."


@dataclass(frozen=True, kw_only=True)
class Equivalence(Result):
    """Two one-sided tests of a mean or a difference, and the usual test beside them.

    Attributes
    ----------
    design : str
        ``paired``, ``independent`` (Welch) or ``one sample``.
    difference : float
        Mean difference, x less y; of one sample, its mean less `reference`.
    se : float
        Its standard error.
    df : float
        Degrees of freedom.
    bounds : tuple of float
        Lower and upper bound of equivalence, in the units of the difference.
    t_lower, t_upper : float
        Statistics of the tests that the difference exceeds the lower bound and falls short of the upper one.
    p_lower, p_upper : float
        Their one-sided probabilities.
    t, p : float
        The usual two-sided test that the difference is 0.
    alpha : float
        Level of each test.
    ci : tuple of float
        The interval of confidence 1 - 2 alpha, which lies within the bounds exactly if both one-sided tests reject.
    verdict : str
        ``equivalent``, ``different``, ``both`` or ``inconclusive``.
    """

    design: str
    difference: float
    se: float
    df: float
    bounds: tuple[float, float]
    t_lower: float
    t_upper: float
    p_lower: float
    p_upper: float
    t: float
    p: float
    alpha: float
    ci: tuple[float, float]
    verdict: Verdict

    @property
    def p_tost(self) -> float:
        """The larger of the two one-sided probabilities, which decides."""
        return max(self.p_lower, self.p_upper)

    def apa(self) -> str:
        """Return the result as a sentence: difference, interval, deciding one-sided test, usual test, verdict."""
        freedom = wording.number(self.df) if self.df % 1 else f"{self.df:g}"
        deciding = self.t_lower if self.p_lower >= self.p_upper else self.t_upper
        low, high = (wording.number(bound) for bound in self.bounds)
        interval = wording.interval(*self.ci, confidence=round(1 - 2 * self.alpha, 12))
        tests = (
            f"TOST t({freedom}) = {wording.number(deciding)}, {wording.p_value(self.p_tost)}; "
            f"difference from 0 t({freedom}) = {wording.number(self.t)}, {wording.p_value(self.p)}"
        )
        verdict = _WORDS[self.verdict].format(point="0")
        return f"Difference = {wording.number(self.difference)}, {interval}, bounds [{low}, {high}], {tests}: {verdict}"

    def to_frame(self) -> pd.DataFrame:
        """Return the three tests, one on a row."""
        return pd.DataFrame(
            {
                "test": ["above lower bound", "below upper bound", "different from 0"],
                "against": [*self.bounds, 0.0],
                "difference": self.difference,
                "se": self.se,
                "t": [self.t_lower, self.t_upper, self.t],
                "df": self.df,
                "p": [self.p_lower, self.p_upper, self.p],
                "ci_low": self.ci[0],
                "ci_high": self.ci[1],
                "verdict": self.verdict,
            }
        )


def tost_paired(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    bounds: float | tuple[float, float],
    standardised: bool = False,
    alpha: float = 0.05,
) -> Equivalence:
    """Test whether pairs differ by less than matters.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Finite numbers of the same raters or items.
    bounds : float or tuple of float
        Lower and upper bound of what does not matter; one number for both sides.
    standardised : bool
        Whether the bounds are in standard deviations of the differences (d_z) instead of units of the values.
    alpha : float
        Level, between 0 and .5.

    Returns
    -------
    Equivalence
        The two one-sided tests, the usual test, and the verdict.

    Raises
    ------
    DataError
        If a value is not a finite number, the two differ in length, or bounds or level are out of range.
    InsufficientDataError
        If there are fewer than two pairs or all differences are the same.

    References
    ----------
    Schuirmann (1987), Journal of Pharmacokinetics and Biopharmaceutics 15:657; Lakens (2017), Social Psychological and
    Personality Science 8:355.
    """
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"x has {xs.size} values and y has {ys.size}, but pairs are needed.")
    scale = np.concatenate([xs, ys])
    return _of_one(xs - ys, scale, ("paired", "pairs"), bounds=bounds, standardised=standardised, alpha=alpha)


def tost_one_sample(
    x: npt.ArrayLike,
    *,
    reference: float = 0.0,
    bounds: float | tuple[float, float],
    standardised: bool = False,
    alpha: float = 0.05,
) -> Equivalence:
    """Test whether a mean differs from a value by less than matters.

    Parameters
    ----------
    x : array_like, shape (n,)
        Finite numbers.
    reference : float
        The value, in units of x; the difference that is reported is the mean less this.
    bounds, standardised, alpha
        As in `tost_paired`; standardised bounds are in standard deviations of x.

    Returns
    -------
    Equivalence
        The two one-sided tests, the usual test, and the verdict.

    Raises
    ------
    DataError, InsufficientDataError
        As `tost_paired`.

    References
    ----------
    As `tost_paired`.
    """
    xs = finite_vector(x, name="x")
    origin = float(finite_vector([reference], name="reference")[0])
    scale = np.append(xs, origin)
    return _of_one(xs - origin, scale, ("one sample", "values"), bounds=bounds, standardised=standardised, alpha=alpha)


def tost_independent(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    bounds: float | tuple[float, float],
    standardised: bool = False,
    alpha: float = 0.05,
) -> Equivalence:
    """Test whether two groups differ by less than matters, without supposing equal variances (Welch).

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers, two or more on each side.
    bounds, standardised, alpha
        As in `tost_paired`; standardised bounds are in units of the root of the mean of both variances.

    Returns
    -------
    Equivalence
        The two one-sided tests, the usual test, and the verdict.

    Raises
    ------
    DataError
        If a value is not a finite number, or bounds or level are out of range.
    InsufficientDataError
        If a group has fewer than two values or values vary in no group.

    References
    ----------
    As `tost_paired`; degrees of freedom by Welch (1947), Biometrika 34:28.
    """
    found = moments(group_vectors({"x": x, "y": y}))
    if found.sizes.min() < 2:
        raise InsufficientDataError("Each group needs two values or more, for its variance.")
    if float(found.squares.sum()) <= found.negligible:
        raise InsufficientDataError("The values vary in no group, so the difference cannot be tested.")
    variances = found.squares / (found.sizes - 1)
    parts = variances / found.sizes
    total = float(parts.sum())
    # As shares of their sum, so that no square of a square can overflow.
    df = 1 / float(((parts / total) ** 2 / (found.sizes - 1)).sum())
    return _judged(
        "independent",
        float(found.offsets[0] - found.offsets[1]),
        (math.sqrt(total), math.sqrt(float(variances.mean())), df),
        bounds=bounds,
        standardised=standardised,
        alpha=alpha,
    )


def _of_one(
    values: npt.NDArray[np.float64],
    scale: npt.NDArray[np.float64],
    words: tuple[str, str],
    *,
    bounds: float | tuple[float, float],
    standardised: bool,
    alpha: float,
) -> Equivalence:
    design, what = words
    n = values.size
    if n < 2:
        raise InsufficientDataError(f"The test needs two {what} or more; there {'is one' if n else 'are none'}.")
    mean, spread = centred(values)
    if is_constant(scale, spread):
        raise InsufficientDataError("All differences are the same, so there is no error by which to test them.")
    sd = standard_deviation(spread)
    return _judged(
        design, mean, (sd / math.sqrt(n), sd, float(n - 1)), bounds=bounds, standardised=standardised, alpha=alpha
    )


def _judged(
    design: str,
    difference: float,
    spread: tuple[float, float, float],
    *,
    bounds: float | tuple[float, float],
    standardised: bool,
    alpha: float,
) -> Equivalence:
    if not 0 < alpha < 0.5:
        raise DataError(f"alpha is {alpha}, but must lie between 0 and .5.")
    se, sd, df = spread
    low, high = _limits(bounds)
    if standardised:
        low, high = low * sd, high * sd
    t_lower, t_upper, t = (difference - low) / se, (difference - high) / se, difference / se
    p_lower, p_upper = float(special.stdtr(df, -t_lower)), float(special.stdtr(df, t_upper))
    p = 2 * float(special.stdtr(df, -abs(t)))
    half = float(special.stdtrit(df, 1 - alpha)) * se
    equivalent, different = max(p_lower, p_upper) <= alpha, p <= alpha
    verdicts: dict[tuple[bool, bool], Verdict] = {
        (True, False): "equivalent",
        (False, True): "different",
        (True, True): "both",
        (False, False): "inconclusive",
    }
    return Equivalence(
        design=design,
        difference=difference,
        se=se,
        df=df,
        bounds=(low, high),
        t_lower=t_lower,
        t_upper=t_upper,
        p_lower=p_lower,
        p_upper=p_upper,
        t=t,
        p=p,
        alpha=alpha,
        ci=(difference - half, difference + half),
        verdict=verdicts[equivalent, different],
        flags=(_ESTIMATED,) if standardised else (),
    )


def _limits(bounds: float | tuple[float, float]) -> tuple[float, float]:
    ends = finite_vector(np.atleast_1d(np.asarray(bounds)), name="bounds")
    low, high = (-float(ends[0]), float(ends[0])) if ends.size == 1 else (float(ends[0]), float(ends[-1]))
    if ends.size > 2 or not low < high:
        raise DataError(f"The bounds are {bounds}, but must be a positive number, or a lower and a higher one.")
    return low, high
