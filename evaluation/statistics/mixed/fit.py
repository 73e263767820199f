"""The search for the variances of a linear mixed model.

Fisher scoring comes first: it is exact in one step where the design is balanced. Then follow Newton's steps on theta
with the exact Hessian, whose negative curvatures are taken by their size and whose length is limited, so that each
lowers the deviance. As the deviance is smooth and even in every column of the covariance factors, a variance of zero
is found as any other optimum and afterwards set to exactly zero.
"""

from dataclasses import dataclass

import numpy as np

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.mixed.covariance import CovarianceStructure
from evaluation.statistics.mixed.deviance import EXPLAINED, Derivatives, ProfiledDeviance, Solution

_SCORING_STEPS = 8
_NEWTON_STEPS = 200
# The deviance lies less than this above its minimum when the search ends.
_TOLERANCE = 1e-11
# What a step may be expected to gain and, for rounding, does not.
_ROUNDED = 1e-7
# With less than this share of the variance, the residual is rounding.
_LEAST_RESIDUAL = 1e-9
# Scoring ends when a step lowers the deviance by less.
_NEAR = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """The parameters that minimise the deviance.

    Attributes
    ----------
    solution : Solution
        The deviance there.
    derivatives : Derivatives
        Its derivatives there.
    singular : bool
        Whether a variance is zero, or a covariance matrix lacks rank.
    converged : bool
        Whether the search ended at a minimum.
    """

    solution: Solution
    derivatives: Derivatives
    singular: bool
    converged: bool


def minimise(profile: ProfiledDeviance) -> Optimum:
    """Return the minimum of the deviance.

    Raises
    ------
    InsufficientDataError
        If the data cannot tell the variances apart, or leave no residual variance.
    """
    ones = [structure.theta(_unit(structure), floor=0) for structure in profile.structures]
    solution = profile.solve(np.concatenate(ones))
    found = profile.differentiate(solution)
    _check_separable(profile, solution, found)
    solution, found = _score(profile, solution, found)
    solution, found, converged = _newton(profile, solution, found)
    solution, found = _at_boundary(profile, solution, found)
    if solution.rss < _LEAST_RESIDUAL * profile.data.yy:
        raise InsufficientDataError(EXPLAINED)
    singular = any(
        structure.rank_deficient(solution.theta[part])
        for structure, part in zip(profile.structures, profile.parts, strict=True)
    )
    return Optimum(solution=solution, derivatives=found, singular=singular, converged=converged)


def _at_boundary(profile: ProfiledDeviance, solution: Solution, found: Derivatives) -> tuple[Solution, Derivatives]:
    """Return the solution with the smallest variances exactly zero, unless that is worse; in canonical form."""
    theta = np.concatenate(
        [
            structure.without_small(solution.theta[part], limit=1e-4 / _per_level(profile, place))
            for place, (structure, part) in enumerate(zip(profile.structures, profile.parts, strict=True))
        ]
    )
    if np.allclose(theta, solution.theta, rtol=1e-12, atol=0):
        return solution, found
    trial = profile.solve(theta)
    if trial.deviance > solution.deviance + 1e-7:
        return solution, found
    return trial, profile.differentiate(trial)


def _unit(structure: CovarianceStructure) -> FloatArray:
    """Return the coefficients of the identity (of a compound covariance: both parts 1)."""
    return np.ones(2) if structure.compound else np.trace(structure.basis, axis1=1, axis2=2).clip(max=1)


def _per_level(profile: ProfiledDeviance, place: int) -> float:
    return profile.data.n / profile.data.levels[place]


def _check_separable(profile: ProfiledDeviance, solution: Solution, found: Derivatives) -> None:
    """Raise InsufficientDataError if one variance, the residual one with them, does what others do."""
    system, _ = _scoring_system(profile, solution, found)
    scale = np.sqrt(np.maximum(np.diag(system), 0))
    size = np.array([*np.repeat(1.0, len(scale) - 1), profile.nu])
    weak = scale**2 <= 1e-9 * size
    scaled = system / np.outer(np.where(weak, 1, scale), np.where(weak, 1, scale))
    if weak.any() or np.linalg.eigvalsh(scaled)[0] < 1e-10:
        raise InsufficientDataError(
            "The data cannot tell the variances of the random terms from each other, from the residual or from the "
            "fixed effects; leave out a term whose levels coincide with those of another, with the conditions or with "
            "the rows."
        )


def _scoring_system(profile: ProfiledDeviance, solution: Solution, found: Derivatives) -> tuple[FloatArray, FloatArray]:
    """Return the equations whose solution are the variances, the residual one last (Fisher scoring, absolute scale)."""
    tau = profile.tau(solution.theta)
    with_residual = found.trace - found.information @ tau
    residual = profile.nu - tau @ found.trace - tau @ with_residual
    system = np.block([[found.information, with_residual[:, None]], [with_residual[None], np.array([[residual]])]])
    return system, np.append(found.quadratic, solution.rss - tau @ found.quadratic)


def _score(profile: ProfiledDeviance, solution: Solution, found: Derivatives) -> tuple[Solution, Derivatives]:
    for _ in range(_SCORING_STEPS):
        try:
            *variances, residual = np.linalg.solve(*_scoring_system(profile, solution, found))
        except np.linalg.LinAlgError:
            break
        scale = solution.rss / profile.nu
        tau = np.array(variances) / max(residual, 1e-3 * scale)
        theta = np.concatenate(
            [
                structure.theta(tau[part], floor=1e-2 / _per_level(profile, place))
                for place, (structure, part) in enumerate(zip(profile.structures, profile.parts, strict=True))
            ]
        )
        trial = profile.solve(theta)
        gain = solution.deviance - trial.deviance
        if gain <= 0:
            break
        solution, found = trial, profile.differentiate(trial)
        if gain < _NEAR:
            break
    return solution, found


def _newton(profile: ProfiledDeviance, solution: Solution, found: Derivatives) -> tuple[Solution, Derivatives, bool]:
    radius = 0.5 * (float(np.linalg.norm(solution.theta)) + 0.1)
    gradient, hessian = profile.gradient(solution, found)
    for _ in range(_NEWTON_STEPS):
        values, vectors = np.linalg.eigh(hessian)
        sizes = np.maximum(np.abs(values), 1e-10 * max(np.abs(values).max(), 1e-300))
        slopes = vectors.T @ gradient
        expected = float(slopes @ (slopes / sizes)) / 2
        if expected < _TOLERANCE:
            if values[0] >= -1e-6 * sizes.max():
                return solution, found, True
            # A saddle: both ways along the negative curvature lead down.
            step = vectors[:, 0] * radius
        else:
            step = -vectors @ (slopes / sizes)
        length = float(np.linalg.norm(step))
        step *= min(1.0, radius / length)
        trial = profile.solve(solution.theta + step)
        noise = 1e-14 * (abs(solution.deviance) + profile.nu)
        if trial.deviance > solution.deviance + noise:
            radius = 0.25 * min(radius, length)
            if expected < _ROUNDED:
                return solution, found, True
            if radius < 1e-12 * (1 + float(np.linalg.norm(solution.theta))):
                break
            continue
        radius = max(radius, 2 * length)
        solution, found = trial, profile.differentiate(trial)
        gradient, hessian = profile.gradient(solution, found)
    return solution, found, False
