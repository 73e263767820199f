import numpy as np
import pytest
from scipy import optimize

from evaluation.statistics.mixed.covariance import compound_symmetric, unstructured
from evaluation.statistics.mixed.deviance import ProfiledDeviance
from evaluation.statistics.mixed.fit import minimise
from evaluation.statistics.mixed.moments import Grouping, moments

N = 60


def problem(kind, *, reml, seed=0):
    """A profiled deviance, and the same computed from matrices of all values, without any elimination."""
    rng = np.random.default_rng(seed)
    first, second, third = (rng.integers(0, levels, N) for levels in (7, 5, 4))
    X = np.column_stack([np.ones(N), rng.normal(size=N)])
    slope = np.column_stack([np.ones(N), rng.normal(size=N)])
    indicators = np.eye(3)[rng.integers(0, 3, N)]
    terms = {
        "crossed": [(first, None, unstructured(1)), (second, None, unstructured(1))],
        "slopes": [(second, None, unstructured(1)), (first, slope, unstructured(2))],
        "alone": [(first, slope, unstructured(2))],
        "three": [
            (first, indicators, compound_symmetric(3)),
            (second, slope, unstructured(2)),
            (third, None, unstructured(1)),
        ],
    }[kind]
    y = rng.normal(size=N) + rng.normal(size=7)[first] + X @ [1, 2]
    groupings = [Grouping(codes=codes, levels=codes.max() + 1, design=design) for codes, design, _ in terms]
    data = moments(groupings, X, y)
    profile = ProfiledDeviance(data, [terms[place][2] for place in data.order], reml=reml)
    columns = [
        (codes[:, None] == codes, np.ones((N, 1)) if design is None else design)
        for codes, design, _ in (terms[place] for place in data.order)
    ]

    def dense(theta):
        H = np.eye(N)
        for (same, design), structure, part in zip(columns, profile.structures, profile.parts, strict=True):
            H += same * (design @ structure.covariance(theta[part]) @ design.T)
        XHX = X.T @ np.linalg.solve(H, X)
        beta = np.linalg.solve(XHX, X.T @ np.linalg.solve(H, y))
        rss = (y - X @ beta) @ np.linalg.solve(H, y - X @ beta)
        nu = N - 2 if reml else N
        determinant = np.linalg.slogdet(H)[1] + (np.linalg.slogdet(XHX)[1] if reml else 0)
        return determinant + nu * (1 + np.log(2 * np.pi * rss / nu))

    return profile, dense


@pytest.mark.parametrize("reml", [True, False])
@pytest.mark.parametrize("kind", ["crossed", "slopes", "alone", "three"])
def test_deviance_and_its_derivatives(kind, reml):
    profile, dense = problem(kind, reml=reml)
    theta = np.random.default_rng(1).uniform(0.3, 1.5, profile.parts[-1].stop)
    solution = profile.solve(theta)
    assert solution.deviance == pytest.approx(dense(theta), rel=1e-12)
    found = profile.differentiate(solution)
    gradient, hessian = profile.gradient(solution, found)
    assert gradient == pytest.approx(optimize.approx_fprime(theta, dense, 1e-7), abs=1e-4)

    def at(step):
        moved = profile.solve(theta + step)
        return moved, profile.differentiate(moved)

    slopes = np.tensordot(profile.jacobian(theta).T, found.unscaled_slopes, axes=1)
    for place, step in enumerate(1e-5 * np.eye(theta.size)):
        above, below = at(step), at(-step)
        numeric = (profile.gradient(*above)[0] - profile.gradient(*below)[0]) / 2e-5
        assert hessian[place] == pytest.approx(numeric, rel=1e-6, abs=1e-6)
        numeric = (above[1].unscaled - below[1].unscaled) / 2e-5
        assert slopes[place] == pytest.approx(numeric, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("reml", [True, False])
@pytest.mark.parametrize("kind", ["crossed", "slopes", "three"])
def test_no_other_search_finds_a_lower_deviance(kind, reml):
    profile, dense = problem(kind, reml=reml, seed=2)
    found = minimise(profile)
    assert found.converged
    starts = np.random.default_rng(3).uniform(0.05, 1.5, (2, found.solution.theta.size))
    others = [optimize.minimize(dense, start, method="L-BFGS-B").fun for start in starts]
    assert found.solution.deviance <= min(others) + 1e-7
    assert found.solution.deviance == pytest.approx(min(others), abs=1e-4)


def test_covariances_come_back():
    T = np.array([[2.0, -1.0], [-1.0, 1.5]])
    structure = unstructured(2)
    theta = structure.theta(T[np.tril_indices(2)], floor=0)
    assert structure.covariance(theta) == pytest.approx(T)
    factor = structure.factor(theta)
    assert factor @ factor.T == pytest.approx(T)
    assert not structure.rank_deficient(theta)
    flat = structure.without_small(structure.theta(np.array([1.0, 1.0, 1.0 + 1e-9]), floor=0), limit=1e-6)
    assert structure.rank_deficient(flat)
    compound = compound_symmetric(3)
    factor = compound.factor(np.array([0.5, -2.0]))
    assert factor @ factor.T == pytest.approx(0.25 + 4 * np.eye(3))
    assert compound.theta(np.array([0.25, -1.0]), floor=0.01) == pytest.approx([0.5, 0.1])
