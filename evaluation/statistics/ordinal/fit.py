"""Maximum likelihood of cumulative-logit models without random effects, by Newton's method."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize, special

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.ordinal.data import Predictors, Rows

_MOST_STEPS = 100
_MOST_HALVINGS = 40
# Twice the likelihood that the next step would gain.
_TOLERANCE = 1e-18
# By how much of itself a sum over all rows may seem to fall by rounding alone.
_ROUNDING = 1e-12
# Probabilities this far out on the logit scale make one ask whether the estimates are finite at all.
_SUSPICIOUS = 12.0
_LEAST_SLACK = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class FixedFit:
    """Estimates of a model without random effects.

    Attributes
    ----------
    thresholds, coefficients : numpy.ndarray, shapes (sets * cuts,) and (p,)
        Estimates, in the columns of `Predictors`.
    covariance : numpy.ndarray
        Inverse of the observed information, thresholds first.
    log_likelihood : float
        Its maximum.
    converged : bool
        Whether Newton's method came to rest.
    """

    thresholds: FloatArray
    coefficients: FloatArray
    covariance: FloatArray
    log_likelihood: float
    converged: bool


def gap_terms(rows: Rows, thresholds: FloatArray) -> tuple[float, FloatArray]:
    """Return what the distances of thresholds add to the log-likelihood, and the slope of that by threshold.

    The probability of an answer between a lower and an upper threshold is F(a) F(-c) (1 - exp(-(a - c))), where a and c
    are the thresholds less the linear predictor and F is the logistic function: nothing cancels, however far out they
    are, and only the last factor, which holds no predictor, joins the two.
    """
    gaps = np.diff(thresholds.reshape(rows.sets, rows.cuts), axis=1)
    if (gaps <= 0).any():
        return -np.inf, np.zeros(thresholds.size)
    slope = rows.inner * np.exp(-gaps) / -np.expm1(-gaps)
    value = float((rows.inner * np.log(-np.expm1(-gaps))).sum())
    by_threshold = np.pad(slope, ((0, 0), (1, 0))) - np.pad(slope, ((0, 0), (0, 1)))
    return value, by_threshold.ravel()


def log_likelihood(rows: Rows, thresholds: FloatArray, coefficients: FloatArray) -> float:
    """Return the log-likelihood; minus infinity if thresholds are out of order."""
    value, _ = gap_terms(rows, thresholds)
    if value == -np.inf:
        return value
    above, below = rows.bounds(thresholds, rows.x @ coefficients)
    return value + float(rows.weight @ (special.log_expit(above) + special.log_expit(-below)))


def first_thresholds(rows: Rows) -> FloatArray:
    """Return the thresholds of a model without predictors: logits of the cumulative shares."""
    total = rows.sets * rows.cuts
    places = np.append(np.arange(total), [0, 0]) // rows.cuts
    sets = np.where(rows.upper < total, places[np.minimum(rows.upper, total)], places[np.minimum(rows.lower, total)])
    answers = np.where(rows.upper < total, rows.upper - sets * rows.cuts, rows.cuts)
    counts = np.bincount(sets * (rows.cuts + 1) + answers, rows.weight, minlength=rows.sets * (rows.cuts + 1))
    below = np.cumsum(counts.reshape(rows.sets, rows.cuts + 1), axis=1)
    logits: FloatArray = special.logit(below[:, :-1] / below[:, -1:])
    return logits.ravel()


def slope_and_information(
    rows: Rows, thresholds: FloatArray, coefficients: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the slope of the log-likelihood and the observed information, thresholds first."""
    total, p = thresholds.size, coefficients.size
    above, below = rows.bounds(thresholds, rows.x @ coefficients)
    upper, lower = special.expit(-above), special.expit(below)
    _, gap_slope = gap_terms(rows, thresholds)

    def by_threshold(of_upper: FloatArray, of_lower: FloatArray) -> FloatArray:
        sums = np.bincount(rows.upper, of_upper, total + 2) + np.bincount(rows.lower, of_lower, total + 2)
        return sums[:total].astype(float)

    slope = np.empty(total + p)
    slope[:total] = by_threshold(rows.weight * upper, -rows.weight * lower) + gap_slope
    slope[total:] = rows.x.T @ (rows.weight * (lower - upper))
    curved_above, curved_below = rows.weight * upper * (1 - upper), rows.weight * lower * (1 - lower)
    information = np.zeros((total + p, total + p))
    information[np.arange(total), np.arange(total)] = by_threshold(curved_above, curved_below)
    for k, column in enumerate(rows.x.T):
        information[:total, total + k] = -by_threshold(curved_above * column, curved_below * column)
    information[total:, :total] = information[:total, total:].T
    information[total:, total:] = (rows.x.T * (curved_above + curved_below)) @ rows.x
    gaps = np.diff(thresholds.reshape(rows.sets, rows.cuts), axis=1)
    bend = np.pad(rows.inner * np.exp(-gaps) / np.expm1(-gaps) ** 2, ((0, 0), (1, 0))).ravel()
    places = np.flatnonzero(bend)
    information[places, places] += bend[places]
    information[places - 1, places - 1] += bend[places]
    information[places, places - 1] -= bend[places]
    information[places - 1, places] -= bend[places]
    return slope, information


def fit_fixed(rows: Rows, fixed: Predictors) -> FixedFit:
    """Return the maximum-likelihood estimates; every set of thresholds must see answers in every category.

    Raises
    ------
    InsufficientDataError
        If the estimates would be infinite because the answers are separated perfectly.
    """
    total = rows.sets * rows.cuts
    estimates = np.concatenate([first_thresholds(rows), np.zeros(rows.x.shape[1])])
    value = log_likelihood(rows, estimates[:total], estimates[total:])
    converged = False
    for _ in range(_MOST_STEPS):
        slope, information = slope_and_information(rows, estimates[:total], estimates[total:])
        step = _newton_step(information, slope)
        if step is None:
            break
        gain = float(slope @ step)
        for halving in range(_MOST_HALVINGS):
            trial = estimates + step / 2**halving
            risen = log_likelihood(rows, trial[:total], trial[total:])
            if risen >= value - _ROUNDING * abs(value):
                estimates, value = trial, risen
                break
        else:
            # Nothing rises any more: rounding decides.
            converged = gain <= 1e-10 * max(1.0, abs(value))
            break
        if gain <= _TOLERANCE * max(1.0, abs(value)):
            converged = True
            break
    above, below = rows.bounds(estimates[:total], rows.x @ estimates[total:])
    farthest = max(float(np.abs(bound[np.isfinite(bound)]).max(initial=0)) for bound in (above, below))
    if rows.sets == 1 and rows.x.shape[1] and (not converged or farthest > _SUSPICIOUS):
        _refuse_separation(rows, fixed)
    _, information = slope_and_information(rows, estimates[:total], estimates[total:])
    covariance, definite = inverse(information)
    return FixedFit(
        thresholds=estimates[:total],
        coefficients=estimates[total:],
        covariance=covariance,
        log_likelihood=value,
        converged=converged and definite,
    )


def inverse(information: FloatArray) -> tuple[FloatArray, bool]:
    """Return the inverse of an information matrix, all NaN if it has none, and whether it has one."""
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    try:
        factor = linalg.cho_factor(information / np.outer(scale, scale))
    except (linalg.LinAlgError, ValueError):
        return np.full_like(information, np.nan), False
    covariance = linalg.cho_solve(factor, np.eye(len(information))) / np.outer(scale, scale)
    return (covariance + covariance.T) / 2, True


def _newton_step(information: FloatArray, slope: FloatArray) -> FloatArray | None:
    try:
        step: FloatArray = linalg.cho_solve(linalg.cho_factor(information), slope)
    except (linalg.LinAlgError, ValueError):
        return None
    return step


def _refuse_separation(rows: Rows, fixed: Predictors) -> None:
    """Raise InsufficientDataError if the likelihood rises for ever in some direction.

    It does if the thresholds and coefficients can move so that no answer's upper bound falls, no lower bound rises, and
    something changes (Albert and Anderson, 1984, Biometrika 71:1, for logits; here for the two bounds of an answer).
    """
    constraints = _bound_changes(rows)
    p, total = rows.x.shape[1], rows.cuts
    found = optimize.linprog(
        -constraints.sum(axis=0), A_ub=-constraints, b_ub=np.zeros(len(constraints)), bounds=[(-1, 1)] * (total + p)
    )
    if found.x is None or -found.fun < _LEAST_SLACK:
        return
    moved = np.abs(fixed.mixing @ found.x[total:]) * np.linalg.norm(np.linalg.pinv(fixed.mixing), axis=0)
    names = [name for name, size in zip(fixed.names, moved, strict=True) if size > 1e-6 * moved.max()]
    raise InsufficientDataError(
        f"The answers are separated perfectly by {', '.join(names)}: the likelihood rises for ever, so that the "
        "estimates would be infinite; merge categories or leave the predictor out."
    )


def _bound_changes(rows: Rows) -> FloatArray:
    # Of answers with the same predictors, the lowest and the highest bind; thresholds must not change places either.
    total, p = rows.cuts, rows.x.shape[1]
    answers = np.where(rows.upper < total, rows.upper, total)
    _, place = np.unique(rows.x, axis=0, return_inverse=True)
    place = place.ravel()
    order = np.lexsort([answers, place])
    first = np.flatnonzero(np.diff(place[order], prepend=-1))
    lowest, highest = order[first], order[np.append(first[1:], len(order)) - 1]
    parts = [np.hstack([np.diff(np.eye(total), axis=0), np.zeros((total - 1, p))])]
    kept = lowest[answers[lowest] < total]
    parts.append(np.hstack([np.eye(total)[answers[kept]], -rows.x[kept]]))
    kept = highest[answers[highest] > 0]
    parts.append(np.hstack([-np.eye(total)[answers[kept] - 1], rows.x[kept]]))
    return np.vstack(parts)
