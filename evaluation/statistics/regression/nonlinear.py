"""Nonlinear regression."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import linalg, optimize, special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, check_confidence, finite_vector
from evaluation.statistics.groups import EPSILON, column_names
from evaluation.statistics.regression.derivatives import complex_step, differences
from evaluation.statistics.regression.linear import written
from evaluation.statistics.result import Result

Model = Callable[..., Any]

# The steepest way down the fitted surface may explain no more than this share of the residuals.
_CONVERGED = 1e-6
# Of small residuals, rounding of y and of the model alone can be more than that.
_ROUNDING = 8 * EPSILON
_EXACT_TO = 64 * EPSILON
_FAR_OFF = 1e100
_TOLERANCE = 1e-15


class _Problem(NamedTuple):
    residuals: Callable[[FloatArray], FloatArray]
    jacobian: Callable[[FloatArray], FloatArray]
    names: tuple[str, ...]
    size: float


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearFit(Result):
    """A model y = f(x; b1, b2, …) + error, fitted by least squares.

    Attributes
    ----------
    names : tuple of str
        Names of the parameters.
    estimates, se : numpy.ndarray, shape (p,)
        Parameters and their standard errors, from the Jacobian at the solution.
    ci : numpy.ndarray, shape (p, 2)
        Interval of each parameter (Wald's, by t), which holds as far as the model is nearly linear in its parameters
        over the width of the interval.
    confidence : float
        Confidence of the intervals.
    covariance : numpy.ndarray, shape (p, p)
        Covariances of the estimates.
    rss : float
        Sum of squared residuals.
    sigma : float
        Standard deviation of the error, sqrt(rss / df_residual).
    df_residual : int
        Values less parameters.
    relative_offset : float
        How far from a minimum the search ended: the part of the residuals along the fitted surface over the part
        across it (Bates and Watts); 0 is a minimum.
    derivatives : str
        ``given``, ``complex step`` or ``differences``: where the Jacobian came from.
    residuals : numpy.ndarray, shape (n,)
        y less what the model says.
    """

    names: tuple[str, ...]
    estimates: FloatArray
    se: FloatArray
    ci: FloatArray
    confidence: float
    covariance: FloatArray
    rss: float
    sigma: float
    df_residual: int
    relative_offset: float
    derivatives: str
    residuals: FloatArray

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``b1 = 238.94 (SE = 2.71, 95% CI [233.04, 244.84])``."""
        parts = []
        for place, name in enumerate(self.names):
            low, high = (written(end) for end in self.ci[place])
            limits = f"SE = {written(self.se[place])}, {100 * self.confidence:g}% CI [{low}, {high}]"
            parts.append(f"{name} = {written(self.estimates[place])} ({limits})")
        return f"{', '.join(parts)}; residual SD = {written(self.sigma)}, df = {self.df_residual}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each parameter."""
        return pd.DataFrame(
            {
                "parameter": list(self.names),
                "estimate": self.estimates,
                "se": self.se,
                "df": self.df_residual,
                "ci_low": self.ci[:, 0],
                "ci_high": self.ci[:, 1],
            }
        )


def nonlinear_fit(
    model: Model,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    start: npt.ArrayLike,
    *,
    jacobian: Model | None = None,
    names: Sequence[object] | None = None,
    confidence: float = 0.95,
) -> NonlinearFit:
    """Fit a model that is not linear in its parameters, by Levenberg and Marquardt's method.

    Parameters
    ----------
    model : callable
        ``model(x, b1, b2, …)`` returns an array of shape (n,). If it also takes complex parameters (numpy's functions
        do), derivatives are exact.
    x : array_like, shape (n, …)
        What the model is a function of; it gets this array as it is.
    y : array_like, shape (n,)
        Finite numbers.
    start : array_like, shape (p,)
        Parameters to start from; what is not 0 is also taken as their order of size.
    jacobian : callable, optional
        ``jacobian(x, b1, b2, …)`` returns the derivatives of the model by its parameters, shape (n, p). Left out, they
        are formed by the complex step or, where the model does not take complex numbers, by differences of sixth order.
    names : sequence, optional
        Names of the parameters; left out, "b1", "b2" and so on.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    NonlinearFit
        The parameters of a minimum, which need not be the only one, with standard errors and intervals.

    Raises
    ------
    DataError
        If a value is not a finite number, the model does not return as many numbers as there are values, or no minimum
        is found from this start.
    InsufficientDataError
        If there are not more values than parameters, or the data do not determine a parameter.

    References
    ----------
    Marquardt (1963), J. SIAM 11:431, as implemented in MINPACK (Moré, 1978); convergence by Bates and Watts (1981),
    Technometrics 23:179; standard errors by Seber and Wild (1989), Nonlinear Regression, section 2.1.
    """
    check_confidence(confidence)
    places, target = np.asarray(x), finite_vector(y, name="y")
    first = finite_vector(start, name="start")
    p = first.size
    titles = column_names([f"b{number}" for number in range(1, p + 1)] if names is None else list(map(str, names)), p)
    if p < 1 or target.size <= p:
        raise InsufficientDataError(
            f"A model needs a parameter, and more values than parameters; there are {target.size} and {p}."
        )
    problem, derivatives = _problem(model, jacobian, (places, target, first), titles)
    with np.errstate(all="ignore"):
        solution = _minimum(problem, first)
        offset, inverse = _judge(problem, solution)
    residuals = problem.residuals(solution)
    return _described(problem, solution, -residuals, inverse, offset=offset, derivatives=derivatives, level=confidence)


def _described(
    problem: _Problem,
    solution: FloatArray,
    residuals: FloatArray,
    inverse: FloatArray,
    *,
    offset: float,
    derivatives: str,
    level: float,
) -> NonlinearFit:
    df = residuals.size - solution.size
    rss = float(residuals @ residuals)
    covariance = rss / df * inverse
    se = np.sqrt(np.diagonal(covariance))
    half = special.stdtrit(df, (1 + level) / 2) * se
    exact = float(np.abs(residuals).max()) <= _EXACT_TO * problem.size
    flags = ["The model reproduces y to rounding, so standard errors are those of rounding."] if exact else []
    if offset > _CONVERGED:
        flags.append("The residuals are so small that rounding costs the standard errors digits.")
    ci = np.column_stack([solution - half, solution + half])
    for array in (solution, se, ci, covariance, residuals):
        array.flags.writeable = False
    return NonlinearFit(
        names=problem.names,
        estimates=solution,
        se=se,
        ci=ci,
        confidence=level,
        covariance=covariance,
        rss=rss,
        sigma=math.sqrt(rss / df),
        df_residual=df,
        relative_offset=offset,
        derivatives=derivatives,
        residuals=residuals,
        flags=tuple(flags),
    )


def _problem(
    model: Model, jacobian: Model | None, data: tuple[npt.NDArray[Any], FloatArray, FloatArray], names: tuple[str, ...]
) -> tuple[_Problem, str]:
    x, y, start = data
    n, p = y.size, start.size

    def values(parameters: npt.NDArray[Any]) -> npt.NDArray[Any]:
        found = np.asarray(model(x, *parameters))
        if found.shape != (n,):
            raise DataError(f"The model returned the shape {found.shape}, but y has {n} values.")
        if np.iscomplexobj(found) and not np.iscomplexobj(parameters):
            return np.where(found.imag == 0, found.real, math.nan)
        return found

    def residuals(parameters: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            found = values(parameters) - y
        # What cannot be computed is a bad fit, from which the search turns back.
        return np.where(np.isfinite(found), found, _FAR_OFF)

    with np.errstate(all="ignore"):
        if not np.isfinite(values(start)).all():
            raise DataError("The model has no finite values at the start; start elsewhere.")
        derivative, source = _derivative(values, start)
    if jacobian is not None:
        derivative, source = (lambda parameters: np.asarray(jacobian(x, *parameters), dtype=float)), "given"

    def finite_jacobian(parameters: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            found = derivative(parameters)
        if found.shape != (n, p):
            raise DataError(f"The jacobian returned the shape {found.shape}, but must return ({n}, {p}).")
        return np.where(np.isfinite(found), found, 0.0)

    return _Problem(residuals, finite_jacobian, names, float(np.abs(y).max())), source


def _derivative(
    values: Callable[[npt.NDArray[Any]], npt.NDArray[Any]], start: FloatArray
) -> tuple[Callable[[FloatArray], FloatArray], str]:
    sizes = np.where(start == 0, 1.0, np.abs(start))

    def by_differences(parameters: FloatArray) -> FloatArray:
        return differences(values, parameters, sizes=sizes)

    exact = complex_step(values, start)
    if exact is not None:
        # A model may take complex numbers and lose their imaginary part on the way, as abs and max do.
        near = by_differences(start)
        scale = np.abs(near).max(axis=0) + EPSILON
        if (np.abs(exact - near).max(axis=0) <= 1e-3 * scale).all():
            return (lambda parameters: _exact_or(values, parameters, by_differences)), "complex step"
    return by_differences, "differences"


def _exact_or(
    values: Callable[[npt.NDArray[Any]], npt.NDArray[Any]],
    parameters: FloatArray,
    other: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    exact = complex_step(values, parameters)
    return other(parameters) if exact is None else exact


def _minimum(problem: _Problem, start: FloatArray) -> FloatArray:
    sizes = np.where(start == 0, 1.0, np.abs(start))
    for method, scale in (("lm", "jac"), ("lm", sizes), ("trf", "jac")):
        found = optimize.least_squares(
            problem.residuals,
            start,
            jac=problem.jacobian,
            method=method,
            x_scale=scale,
            ftol=_TOLERANCE,
            xtol=_TOLERANCE,
            gtol=_TOLERANCE,
            max_nfev=5000,
        )
        solution = _polished(problem, np.asarray(found.x, dtype=float))
        offset, rounding = _offset(problem, solution)
        if offset <= max(_CONVERGED, rounding):
            return solution
    # Parameters that stand for each other keep the search from ending; then that is what to say.
    _judge(problem, solution)
    raise DataError("No minimum was found from this start; start nearer to the solution.")


def _polished(problem: _Problem, parameters: FloatArray) -> FloatArray:
    """Take Gauss and Newton's full steps as long as they lead nearer to the minimum."""
    offset, _ = _offset(problem, parameters)
    for _ in range(10):
        J, sizes = _unit_columns(problem.jacobian(parameters))
        step = linalg.lstsq(J, problem.residuals(parameters), check_finite=False)[0] / sizes
        tried = parameters - step
        reached, _ = _offset(problem, tried)
        if not reached < offset:
            break
        parameters, offset = tried, reached
    return parameters


def _offset(problem: _Problem, parameters: FloatArray) -> tuple[float, float]:
    """Return the relative offset, and how large one rounding alone can make."""
    residuals = problem.residuals(parameters)
    size = float(np.abs(residuals).max())
    if size <= _EXACT_TO * problem.size:
        return 0.0, 0.0
    n, p = residuals.size, parameters.size
    Q = linalg.qr(_unit_columns(problem.jacobian(parameters))[0], mode="economic", check_finite=False)[0]
    along = Q @ (Q.T @ residuals)
    across = float(linalg.norm(residuals - along))
    if not (size < _FAR_OFF and across > 0):
        return math.inf, 0.0
    unit = math.sqrt((n - p) / p) / across
    return float(linalg.norm(along)) * unit, _ROUNDING * problem.size * math.sqrt(n) * unit


def _judge(problem: _Problem, parameters: FloatArray) -> tuple[float, FloatArray]:
    """Return the relative offset at the solution and the inverse of JᵀJ."""
    J, sizes = _unit_columns(problem.jacobian(parameters))
    R = linalg.qr(J, mode="economic", check_finite=False)[1]
    lost = np.flatnonzero(np.abs(np.diagonal(R)) <= 1e-12 * math.sqrt(len(J)))
    if lost.size:
        raise InsufficientDataError(
            f"The data do not determine the parameter {problem.names[lost[0]]}: it has no effect of its own at the "
            "solution."
        )
    opposite = linalg.solve_triangular(R, np.eye(parameters.size)) / sizes[:, None]
    return _offset(problem, parameters)[0], opposite @ opposite.T


def _unit_columns(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    largest = np.abs(J).max(axis=0)
    largest = np.where(largest > 0, largest, 1.0)
    norms = largest * linalg.norm(J / largest, axis=0)
    sizes = np.where(norms > 0, norms, 1.0)
    return J / sizes, sizes
