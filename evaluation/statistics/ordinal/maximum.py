"""Maximum likelihood of cumulative-logit mixed models."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import optimize

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.ordinal.data import Predictors, Rows
from evaluation.statistics.ordinal.fit import FixedFit, fit_fixed, inverse
from evaluation.statistics.ordinal.laplace import MixedLikelihood
from evaluation.statistics.threads import one_thread

NO_SD = 1e-2
"""A standard deviation of intercepts, in logits, that is no more than this is on its boundary, 0."""

# The search for standard deviations ends at the first and the last; beyond the second no estimate can be trusted.
_SMALLEST_SD, _UNTRUE_SD, _LARGEST_SD = 1e-3, 20.0, 30.0
# Variances are searched for on the scale log(1 + variance / this): near 0 the likelihood is a straight line in the
# variance, so that the boundary is no trap, and far from 0 it changes with the variance's logarithm.
_BEND = 0.1
_LARGEST_LOG_GAP, _SMALLEST_LOG_GAP = 5.0, -25.0
_STEP = 1e-4
_MOST_POLISHINGS = 5
# Twice what the last Newton step gained; what is left after it is about the square of that.
_AT_REST = 1e-6
# A standard deviation of nothing may cost this much of the log-likelihood.
_NO_LOSS = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedFit(FixedFit):
    """Estimates of a mixed model, with the log-likelihood as approximated.

    Attributes
    ----------
    sds : numpy.ndarray, shape (factors,)
        Standard deviations of the random intercepts, in the order of the rows' factors; 0 on the boundary.
    """

    sds: FloatArray


class _Problem:
    """The likelihood in parameters without constraints but bounds.

    Of each set of thresholds the first and the logarithms of the gaps, coefficients, and log(1 + variance / _BEND).
    """

    def __init__(self, rows: Rows, nodes: int) -> None:
        self.likelihood = MixedLikelihood(rows, nodes=nodes)
        self.sets, self.cuts, self.p = rows.sets, rows.cuts, rows.x.shape[1]
        self.total = rows.sets * rows.cuts

    def parameters(self, thresholds: FloatArray, coefficients: FloatArray, sds: FloatArray) -> FloatArray:
        table = thresholds.reshape(self.sets, self.cuts).copy()
        table[:, 1:] = np.log(np.diff(table, axis=1))
        return np.concatenate([table.ravel(), coefficients, np.log1p(sds**2 / _BEND)])

    def natural(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        table = parameters[: self.total].reshape(self.sets, self.cuts).copy()
        table[:, 1:] = np.exp(table[:, 1:])
        rest = parameters[self.total :]
        return np.cumsum(table, axis=1).ravel(), rest[: self.p], np.sqrt(_BEND * np.expm1(rest[self.p :]))

    def _gaps(self, parameters: FloatArray) -> FloatArray:
        # First thresholds are not logarithms and count as they are.
        table = parameters[: self.total].reshape(self.sets, self.cuts).copy()
        table[:, 0] = 0
        return np.exp(table)

    def change(self, parameters: FloatArray) -> FloatArray:
        """Return the derivatives of thresholds and coefficients in the parameters, row by row."""
        table = self._gaps(parameters)
        matrix = np.eye(self.total + self.p, parameters.size)
        for one in range(self.sets):
            block = slice(one * self.cuts, (one + 1) * self.cuts)
            matrix[block, block] = np.tril(np.ones((self.cuts, self.cuts))) * table[one]
        return matrix

    def value_and_slope(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Return the log-likelihood and its slope, both with the sign turned."""
        thresholds, coefficients, sds = self.natural(parameters)
        value, of_thresholds, of_coefficients, of_logs = self.likelihood.value_and_slope(thresholds, coefficients, sds)
        of_sds = of_logs * (sds**2 + _BEND) / (2 * sds**2)
        table = self._gaps(parameters)
        above = np.cumsum(of_thresholds.reshape(self.sets, self.cuts)[:, ::-1], axis=1)[:, ::-1]
        return -value, -np.concatenate([(above * table).ravel(), of_coefficients, of_sds])

    def curvature(self, parameters: FloatArray, free: npt.NDArray[np.bool_]) -> FloatArray:
        """Return the negative Hessian in the free parameters, from central differences of the slope."""
        columns = []
        for k in np.flatnonzero(free):
            step = np.zeros(parameters.size)
            step[k] = _STEP
            above, below = self.value_and_slope(parameters + step)[1], self.value_and_slope(parameters - step)[1]
            columns.append((above - below)[free])
        matrix = np.array(columns) / (2 * _STEP)
        return (matrix + matrix.T) / 2


def fit_mixed(rows: Rows, fixed: Predictors, *, nodes: int = 1, names: tuple[str, ...] = ()) -> MixedFit:
    """Return the maximum-likelihood estimates.

    Parameters
    ----------
    rows : Rows
        The data with their random factors.
    fixed : Predictors
        The predictors of the rows, for messages.
    nodes : int
        As in `MixedLikelihood`.
    names : tuple of str
        Names of the factors, for messages.

    Raises
    ------
    InsufficientDataError
        If the answers are separated perfectly, or a standard deviation exceeds 20 logits.
    """
    # The matrices are small: threads would cost more than they help.
    with one_thread():
        without = fit_fixed(rows, fixed)
        order = sorted(range(len(rows.factors)), key=lambda f: -int(rows.factors[f].max()))
        best: MixedFit | None = None
        while order:
            found = _maximise(rows.with_factors([rows.factors[f] for f in order]), without, nodes)
            if best is not None and found.log_likelihood < best.log_likelihood - _NO_LOSS:
                return best
            _refuse_growth([names[f] for f, sd in zip(order, found.sds, strict=True) if sd > _UNTRUE_SD])
            sds = np.zeros(len(rows.factors))
            sds[order] = found.sds
            best = replace(found, sds=sds)
            vanishing = [f for f in order if sds[f] <= NO_SD]
            if not vanishing:
                return best
            order = [f for f in order if f not in vanishing]
    if best is not None and without.log_likelihood < best.log_likelihood - _NO_LOSS:
        return best
    return MixedFit(**vars(without), sds=np.zeros(len(rows.factors)))


def _refuse_growth(names: list[str]) -> None:
    if names:
        raise InsufficientDataError(
            f"The standard deviation of the intercepts of {' and of '.join(names)} exceeds {_UNTRUE_SD:g} logits: "
            "their levels separate the answers (almost) perfectly, so that there are no estimates to be trusted."
        )


def _maximise(rows: Rows, start: FixedFit, nodes: int) -> MixedFit:
    problem = _Problem(rows, nodes)
    factors = len(rows.factors)
    # What integrating intercepts of variance 1 out does to a logit is to shrink it by about this much (Zeger, Liang and
    # Albert, 1988, Biometrics 44:1049).
    stretch = math.sqrt(1 + (16 * math.sqrt(3) / (15 * math.pi)) ** 2 * factors)
    first = problem.parameters(start.thresholds * stretch, start.coefficients * stretch, np.ones(factors))
    lows, highs = np.full(first.size, -np.inf), np.full(first.size, np.inf)
    gaps = np.arange(problem.total)[np.arange(problem.total) % problem.cuts > 0]
    lows[gaps], highs[gaps] = _SMALLEST_LOG_GAP, _LARGEST_LOG_GAP
    lows[problem.total + problem.p :] = math.log1p(_SMALLEST_SD**2 / _BEND)
    highs[problem.total + problem.p :] = math.log1p(_LARGEST_SD**2 / _BEND)
    total_weight = float(rows.weight.sum())
    units = np.full(first.size, 1 / math.sqrt(total_weight))
    units[problem.total + problem.p :] = [1 / math.sqrt(int(code.max()) + 1) for code in rows.factors]

    def scaled(parameters: FloatArray) -> tuple[float, FloatArray]:
        value, slope = problem.value_and_slope(parameters * units)
        return value, slope * units

    found = optimize.minimize(
        scaled,
        np.clip(first, lows, highs) / units,
        jac=True,
        method="L-BFGS-B",
        bounds=optimize.Bounds(lows / units, highs / units),
        options={"maxiter": 500, "maxfun": 2000, "maxcor": 30, "ftol": 1e-12, "gtol": 1e-5},
    )
    return _polish(problem, found.x * units, lows, highs)


def _polish(problem: _Problem, parameters: FloatArray, lows: FloatArray, highs: FloatArray) -> MixedFit:
    """Take Newton steps from where the search ended, and return the estimates with their covariance."""
    value, slope = problem.value_and_slope(parameters)
    # On its boundary a standard deviation stays where it is.
    free = np.ones(parameters.size, dtype=bool)
    sds = problem.natural(parameters)[2]
    free[problem.total + problem.p :] = (sds > NO_SD) & (sds < _UNTRUE_SD)
    converged, definite = False, False
    covariance = np.empty((0, 0))
    for _ in range(_MOST_POLISHINGS):
        covariance, definite = inverse(problem.curvature(parameters, free))
        if not definite:
            break
        step = np.zeros(parameters.size)
        step[free] = -covariance @ slope[free]
        gain = float(-slope @ step)
        trial = np.clip(parameters + step, lows, highs)
        found = problem.value_and_slope(trial)
        if found[0] <= value + _NO_LOSS:
            parameters, (value, slope) = trial, found
        converged = gain < _AT_REST
        if converged:
            break
    thresholds, coefficients, found_sds = problem.natural(parameters)
    change = problem.change(parameters)[:, free]
    return MixedFit(
        thresholds=thresholds,
        coefficients=coefficients,
        covariance=change @ covariance @ change.T,
        log_likelihood=-value,
        converged=converged and definite,
        sds=found_sds,
    )
