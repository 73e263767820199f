"""Linear regression."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import linalg, special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import (
    FloatArray,
    centred,
    check_confidence,
    check_squares,
    finite_vector,
    is_constant,
)
from evaluation.statistics.groups import EPSILON, column_names, upper_tail
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.regression.least_squares import Factors, factorise, solve
from evaluation.statistics.result import Result

_EXACT = "The model reproduces y to rounding, so there is no error by which to judge the estimates."


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearFit(Result):
    """A linear model y = X b + error, fitted by least squares.

    Attributes
    ----------
    names : tuple of str
        Names of the columns of X.
    estimates, se : numpy.ndarray, shape (p,)
        Coefficients and their standard errors, in units of y per unit of the column.
    t, p : numpy.ndarray, shape (p,)
        Ratio of both, and the two-sided probability of one as far from 0 if the coefficient were 0; NaN if the model
        reproduces y exactly, which the flags say.
    ci : numpy.ndarray, shape (p, 2)
        Interval of each coefficient.
    confidence : float
        Confidence of the intervals.
    covariance : numpy.ndarray, shape (p, p)
        Covariances of the estimates.
    R2, R2_adjusted : float
        Share of the variation of y that the model explains, and its estimate for the population. Variation is that
        around the mean if a constant is among the columns or a combination of them, and else that around 0.
    F : float or None
        Ratio of variances that tests the whole model; None if there is only a constant.
    F_p : float or None
        Probability of an F at least as large if all coefficients (but that of the constant) were 0.
    df_model, df_residual : int
        Degrees of freedom of F.
    rss : float
        Sum of squared residuals.
    sigma : float
        Standard deviation of the error, sqrt(rss / df_residual).
    has_constant : bool
        Whether variation is that around the mean.
    residuals : numpy.ndarray, shape (n,)
        y less what the model says.
    """

    names: tuple[str, ...]
    estimates: FloatArray
    se: FloatArray
    t: FloatArray
    p: FloatArray
    ci: FloatArray
    confidence: float
    covariance: FloatArray
    R2: float
    R2_adjusted: float
    F: float | None
    F_p: float | None
    df_model: int
    df_residual: int
    rss: float
    sigma: float
    has_constant: bool
    residuals: FloatArray

    @property
    def n(self) -> int:
        """Number of rows."""
        return int(self.residuals.size)

    def apa(self) -> str:
        """Return the result as a sentence: the whole model, then each coefficient."""
        parts = [f"R² = {wording.share(self.R2)}"]
        if self.F is not None and self.F_p is not None:
            ratio = wording.number(self.F) if math.isfinite(self.F) else "∞"
            parts.append(f"F({self.df_model}, {self.df_residual}) = {ratio}, {wording.p_value(self.F_p)}")
        coefficients = (self._written(place) for place in range(len(self.names)))
        return f"{', '.join(parts)}; {'; '.join(coefficients)}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each coefficient."""
        return pd.DataFrame(
            {
                "term": list(self.names),
                "estimate": self.estimates,
                "se": self.se,
                "t": self.t,
                "df": self.df_residual,
                "p": self.p,
                "ci_low": self.ci[:, 0],
                "ci_high": self.ci[:, 1],
            }
        )

    def _written(self, place: int) -> str:
        text = f"{self.names[place]}: b = {written(self.estimates[place])}"
        if self.sigma == 0:
            return text
        low, high = (written(end) for end in self.ci[place])
        test = f"t({self.df_residual}) = {wording.number(self.t[place])}, {wording.p_value(self.p[place])}"
        return f"{text}, {100 * self.confidence:g}% CI [{low}, {high}], {test}"


@dataclass(frozen=True, kw_only=True, eq=False)
class SimpleRegression(LinearFit):
    """A straight line, y = intercept + slope x + error."""

    @property
    def intercept(self) -> float:
        """Value of the line at x = 0, in units of y."""
        return float(self.estimates[0])

    @property
    def slope(self) -> float:
        """Rise of the line, in units of y per unit of x."""
        return float(self.estimates[1])

    @property
    def se_intercept(self) -> float:
        """Standard error of the intercept."""
        return float(self.se[0])

    @property
    def se_slope(self) -> float:
        """Standard error of the slope."""
        return float(self.se[1])


def linear_fit(
    X: npt.ArrayLike, y: npt.ArrayLike, *, names: Sequence[object] | None = None, confidence: float = 0.95
) -> LinearFit:
    """Fit a linear model by least squares.

    Parameters
    ----------
    X : array_like, shape (n, p)
        Predictors; a constant is a column of ones, which is not added.
    y : array_like, shape (n,)
        Finite numbers.
    names : sequence, optional
        Names of the columns; left out, "1", "2" and so on.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    LinearFit
        Coefficients with standard errors, tests and intervals; R², F and the residuals.

    Raises
    ------
    DataError
        If a value is not a finite number, rows differ in number, names do not fit or `confidence` is not between 0
        and 1.
    InsufficientDataError
        If there are not more rows than columns, y does not vary, or a column is a combination of those before it.

    Notes
    -----
    Solved by QR with iterative refinement (`regression.least_squares.solve`): the certified digits of
    Longley's data and of Wampler's polynomials (NIST StRD) come out.

    References
    ----------
    Gauss (1823), Theoria combinationis observationum; tests by Fisher (1922), J. R. Stat. Soc. 85:597.
    """
    check_confidence(confidence)
    table, target, titles = _checked(X, y, names)
    return LinearFit(**_fitted(table, target, titles, confidence))


def simple_regression(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> SimpleRegression:
    """Fit a straight line by least squares.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers, three or more.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    SimpleRegression
        Slope and intercept with standard errors, tests and intervals.

    Raises
    ------
    DataError
        If a value is not a finite number, the two differ in length or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than three pairs, or x or y does not vary.

    References
    ----------
    As `linear_fit`.
    """
    check_confidence(confidence)
    xs = finite_vector(x, name="x")
    if xs.size and is_constant(xs, xs - xs[0]):
        raise InsufficientDataError(f"All {xs.size} values of x are the same, so no line is determined.")
    table, target, titles = _checked(np.column_stack([np.ones(xs.size), xs]), y, ("intercept", "x"))
    return SimpleRegression(**_fitted(table, target, titles, confidence))


def written(value: float) -> str:
    """Return a number of any size with three digits or more, for instance ``-0.0358`` or ``1829.15``."""
    return wording.number(value) if value == 0 or 0.995 <= abs(value) < 1e6 else f"{value:#.3g}"


def _checked(
    X: npt.ArrayLike, y: npt.ArrayLike, names: Sequence[object] | None
) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
    table = finite_array(X, axes=("rows", "columns"), name="X")
    target = finite_vector(y, name="y")
    n, p = table.shape
    if target.size != n:
        raise DataError(f"X has {n} rows and y has {target.size} values, but a regression needs as many of both.")
    titles = column_names(None if names is None else [str(name) for name in names], p)
    for name, column in zip((*titles, "y"), (*table.T, target), strict=True):
        check_squares(column, name=name)
    if p < 1 or n <= p:
        raise InsufficientDataError(f"A regression needs a column, and more rows than columns; there are {n} x {p}.")
    return table, target, titles


def _fitted(table: FloatArray, target: FloatArray, names: tuple[str, ...], confidence: float) -> dict[str, Any]:
    n, p = table.shape
    factors = factorise(table)
    lost = factors.dependent_column()
    if lost is not None:
        raise InsufficientDataError(
            f"The column {names[lost]} is zero or a combination of those before it, so its coefficient is not "
            "determined; leave it out."
        )
    has_constant, total = _variation(target, factors)
    solution = solve(factors, target)
    rss = float(solution.residuals @ solution.residuals)
    rounding = 4 * EPSILON * float(np.abs(target).max())
    if float(np.abs(solution.residuals).max()) <= rounding:
        rss = 0.0
    df_model, df_residual = p - has_constant, n - p
    variance = rss / df_residual
    covariance = variance * solution.inverse
    se = math.sqrt(variance) * np.sqrt(np.diagonal(solution.inverse))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = solution.coefficients / se if rss > 0 else np.full(p, math.nan)
    half = special.stdtrit(df_residual, (1 + confidence) / 2) * se
    F = None
    if df_model:
        F = max(total - rss, 0.0) / df_model / variance if rss > 0 else math.inf
    fields = {
        "estimates": solution.coefficients,
        "se": se,
        "t": t,
        "p": 2 * special.stdtr(df_residual, -np.abs(t)),
        "ci": np.column_stack([solution.coefficients - half, solution.coefficients + half]),
        "covariance": covariance,
        "residuals": solution.residuals,
    }
    for array in fields.values():
        array.flags.writeable = False
    return {
        **fields,
        "names": names,
        "confidence": confidence,
        "R2": max(0.0, 1 - rss / total),
        "R2_adjusted": 1 - (rss / df_residual) / (total / (n - has_constant)),
        "F": F,
        "F_p": None if F is None else upper_tail(F, df_model, df_residual),
        "df_model": df_model,
        "df_residual": df_residual,
        "rss": rss,
        "sigma": math.sqrt(variance),
        "has_constant": has_constant,
        "flags": (_EXACT,) if rss == 0 else (),
    }


def _variation(target: FloatArray, factors: Factors) -> tuple[bool, float]:
    """Return whether a constant is a combination of the columns, and the variation of y to be explained."""
    ones = np.ones(target.size)
    rest = ones - factors.Q @ (factors.Q.T @ ones)
    has_constant = bool(linalg.norm(rest) <= 1e-9 * math.sqrt(target.size))
    differences = centred(target)[1] if has_constant else target
    if is_constant(target, differences) if has_constant else not target.any():
        raise InsufficientDataError("y does not vary, so there is nothing to explain.")
    return has_constant, float(differences @ differences)
