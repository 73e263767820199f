"""Comparisons of two means by Student's t."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, finite_vector
from evaluation.statistics.groups import EPSILON
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class TTest(Result):
    """A comparison of two means.

    Attributes
    ----------
    test : str
        ``paired``, ``Student`` or ``Welch``.
    t : float
        The statistic; infinite if the means differ and nothing else varies.
    df : float
        Degrees of freedom; of Welch's test no whole number as a rule.
    p : float
        Two-sided probability of a t at least as far from 0 if there were no difference.
    difference : float
        Mean of x less mean of y, in their units.
    ci : tuple of float
        Interval for the difference.
    confidence : float
        Confidence of the interval.
    d : float
        Cohen's d, the difference in standard deviations: of the differences (paired, Cohen's d_z), of both sides
        pooled (Student), or the root of the mean of both variances (Welch).
    n : tuple of int
        Numbers of values: of x and of y, or of pairs.
    """

    test: str
    t: float
    df: float
    p: float
    difference: float
    ci: tuple[float, float]
    confidence: float
    d: float
    n: tuple[int, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``Welch's t(17.78) = -1.86, p = .079, d = -0.83``.

        The difference and its interval stand before d.
        """
        freedom = f"{self.df:g}" if self.df == round(self.df) else wording.number(self.df)
        interval = wording.interval(*self.ci, confidence=self.confidence)
        name = {"paired": "Paired t", "Student": "t", "Welch": "Welch's t"}[self.test]
        ratio = f"{name}({freedom}) = {wording.number(self.t)}, {wording.p_value(self.p)}"
        return f"{ratio}, difference = {wording.number(self.difference)}, {interval}, d = {wording.number(self.d)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        values = {name: getattr(self, name) for name in ("test", "t", "df", "p", "difference", "confidence", "d")}
        ends = {"ci_low": self.ci[0], "ci_high": self.ci[1], "n": sum(self.n)}
        return pd.DataFrame({name: [value] for name, value in (values | ends).items()})


def paired_t(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> TTest:
    """Compare the means of two values of the same things.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    TTest
        t with n - 1 degrees of freedom, the interval and d_z.

    Raises
    ------
    DataError
        If a value is not a finite number, the two differ in length, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than two pairs or no pair differs.

    References
    ----------
    Student (1908), The probable error of a mean, Biometrika 6:1.
    """
    check_confidence(confidence)
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"The test needs pairs, but x has {xs.size} values and y has {ys.size}.")
    if xs.size < 2:
        raise InsufficientDataError(f"The test needs two pairs or more; there {'is one' if xs.size else 'are none'}.")
    n = xs.size
    difference, spread = centred(xs - ys)
    variance = float(spread @ spread) / (n - 1)
    scale = max(float(np.abs(xs).max()), float(np.abs(ys).max()))
    return _judged(
        "paired",
        difference,
        (variance, variance / n, n - 1),
        scale=scale,
        confidence=confidence,
        n=(n,),
    )


def student_t(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> TTest:
    """Compare the means of two groups of one variance.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    TTest
        t with n + m - 2 degrees of freedom, the interval and d in pooled standard deviations.

    Raises
    ------
    DataError
        If a value is not a finite number or `confidence` is not between 0 and 1.
    InsufficientDataError
        If a group is empty, both have one value, or all values are the same.

    References
    ----------
    Student (1908), Biometrika 6:1; Fisher (1925), Metron 5:90; Cohen (1988), Statistical Power Analysis for the
    Behavioral Sciences, 2nd ed., section 2.2.
    """
    check_confidence(confidence)
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    n, m = xs.size, ys.size
    if min(n, m) < 1 or n + m < 3:
        raise InsufficientDataError(f"The test needs values on both sides and three in all; there are {n} and {m}.")
    (difference, inner), scale = _two_sides(xs, ys)
    variance = (inner[0] + inner[1]) / (n + m - 2)
    return _judged(
        "Student",
        difference,
        (variance, variance * (1 / n + 1 / m), n + m - 2),
        scale=scale,
        confidence=confidence,
        n=(n, m),
    )


def welch_t(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> TTest:
    """Compare the means of two groups without supposing that their variances are equal.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers, two or more on each side.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    TTest
        t with Welch's degrees of freedom, the interval and d by the mean of both variances.

    Raises
    ------
    DataError
        If a value is not a finite number or `confidence` is not between 0 and 1.
    InsufficientDataError
        If a group has fewer than two values or all values are the same.

    References
    ----------
    Welch (1947), The generalization of 'Student's' problem, Biometrika 34:28; d by Delacre et al. (2021), Why Hedges'
    g*s based on the non-pooled standard deviation should be reported with Welch's t-test.
    """
    check_confidence(confidence)
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    n, m = xs.size, ys.size
    if min(n, m) < 2:
        raise InsufficientDataError(f"Welch's test needs two values or more on each side; there are {n} and {m}.")
    (difference, inner), scale = _two_sides(xs, ys)
    variances = inner[0] / (n - 1), inner[1] / (m - 1)
    squares = variances[0] / n, variances[1] / m
    error = squares[0] + squares[1]
    # As shares of their sum, so that no square of a square can overflow; all degrees of freedom if nothing varies.
    shares = (squares[0] / error, squares[1] / error) if error > 0 else (n / (n + m), m / (n + m))
    df = 1 / (shares[0] ** 2 / (n - 1) + shares[1] ** 2 / (m - 1))
    return _judged(
        "Welch",
        difference,
        ((variances[0] + variances[1]) / 2, error, df),
        scale=scale,
        confidence=confidence,
        n=(n, m),
    )


def _two_sides(xs: FloatArray, ys: FloatArray) -> tuple[tuple[float, tuple[float, float]], float]:
    """Return the difference of the means and both sums of squares; and the size of the largest value."""
    origin = float(xs[0])
    (mean_x, dx), (mean_y, dy) = centred(xs - origin), centred(ys - origin)
    largest = max(float(np.abs(xs).max()), float(np.abs(ys).max()))
    return (mean_x - mean_y, (float(dx @ dx), float(dy @ dy))), largest


def _judged(
    test: str,
    difference: float,
    spread: tuple[float, float, float],
    *,
    scale: float,
    confidence: float,
    n: tuple[int, ...],
) -> TTest:
    """Return the test of a difference with the variance of values, the variance of the mean, and their freedom."""
    variance, error, df = spread
    rounding = 4 * EPSILON * scale
    constant = variance <= rounding**2
    if constant and abs(difference) <= rounding:
        raise InsufficientDataError("There is neither a difference nor variance, so there is nothing to test.")
    if constant:
        t = d = math.copysign(math.inf, difference)
        flags: tuple[str, ...] = ("Nothing varies but the difference itself, so t and d are infinite.",)
        half = 0.0
    else:
        t, d, flags = difference / math.sqrt(error), difference / math.sqrt(variance), ()
        half = float(special.stdtrit(df, (1 + confidence) / 2)) * math.sqrt(error)
    return TTest(
        test=test,
        t=t,
        df=float(df),
        p=2 * float(special.stdtr(df, -abs(t))),
        difference=difference,
        ci=(difference - half, difference + half),
        confidence=confidence,
        d=d,
        n=n,
        flags=flags,
    )
