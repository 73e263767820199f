import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.least_squares import least_squares


def digits(found, certified):
    return -np.log10(np.maximum(np.abs(np.asarray(found) / np.asarray(certified) - 1.0), 1e-16)).min()


def test_longley(nist):
    # Certified to 15 digits; the condition number is 4.9e9, so that the best of float64 is about 11 to 12 digits.
    case = nist("Longley")
    found = least_squares(np.array(case["data"]["X_with_const"]), np.array(case["data"]["y"])[:, None])[:, 0]
    assert digits(found, case["expected"]["params"]) > 11


def test_wampler1(nist):
    case = nist("Wampler1")
    x, y = np.array(case["data"]["x"]), np.array(case["data"]["y"])
    found = least_squares(x[:, None] ** np.arange(6), y[:, None])[:, 0]
    assert digits(found, case["expected"]["params"]) > 12


def test_norris(nist):
    case = nist("Norris")
    x, y = np.array(case["data"]["x"]), np.array(case["data"]["y"])
    found = least_squares(np.column_stack([np.ones_like(x), x]), y[:, None])[:, 0]
    assert digits(found, [case["expected"]["intercept"], case["expected"]["slope"]]) > 13


@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 3))
def test_residuals_are_orthogonal_to_the_terms(seed, terms, values):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(12, terms)) * 10.0 ** rng.integers(-6, 6, terms)
    Y = rng.normal(size=(12, values))
    residual = Y - X @ least_squares(X, Y)
    assert np.abs((X / np.linalg.norm(X, axis=0)).T @ residual).max() < 1e-12


def test_a_redundant_term_gets_no_weight():
    rng = np.random.default_rng(1)
    x = rng.normal(size=(20, 2))
    X = np.column_stack([x, x.sum(axis=1), np.zeros(20)])
    Y = x @ [[2.0], [3.0]]
    found = least_squares(X, Y)
    assert (found == 0.0).sum() == 2
    np.testing.assert_allclose(X @ found, Y, atol=1e-12)


@pytest.mark.parametrize(
    ("terms", "values"),
    [(np.zeros((3, 2)), np.zeros((4, 1))), (np.zeros((0, 2)), np.zeros((0, 1))), (np.zeros(3), np.zeros(3))],
)
def test_wrong_shapes_are_refused(terms, values):
    with pytest.raises(SpecError, match=r"\(N, P\)"):
        least_squares(terms, values)


def test_values_that_are_not_finite_are_refused():
    with pytest.raises(SpecError, match="finite"):
        least_squares(np.ones((3, 1)), np.array([[1.0], [np.nan], [0.0]]))
