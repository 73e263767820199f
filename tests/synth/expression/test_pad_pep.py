import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.pad_pep import LinearModel, QuadraticModel
from synth.expression.word_table import word_table

KINDS = (LinearModel, QuadraticModel)
points = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=1, max_size=5).map(np.array)


@pytest.mark.parametrize("kind", KINDS)
@given(pad=points)
def test_predictions_are_bounded_and_one_row_each(kind, pad):
    model = kind.fit(*word_table()[1:])
    pep = model.predict(pad)
    assert pep.shape == (len(pad), 9)
    assert (np.abs(pep) <= 1.0).all()
    np.testing.assert_allclose(pep[-1:], model.predict(pad[-1:]), atol=1e-12)


def test_linear_is_the_affine_minimum_mean_square_estimator():
    # MTAP 2013, Eqs. 6 and 7, written out with covariances.
    rng = np.random.default_rng(7)
    pad = rng.uniform(-1, 1, (40, 3))
    pep = np.tanh(pad @ rng.normal(size=(3, 9))) * 0.3 + 0.1 * rng.normal(size=(40, 9)) * 0.1
    model = LinearModel.fit(pad, pep)
    both = np.cov(np.hstack([pep, pad]).T)
    T = both[:9, 9:] @ np.linalg.inv(both[9:, 9:])
    np.testing.assert_allclose(model.T, T, atol=1e-12)
    np.testing.assert_allclose(model.V, pep.mean(axis=0) - T @ pad.mean(axis=0), atol=1e-12)


def test_quadratic_finds_the_polynomial_again():
    # ACII 2007, Eq. 3: squares, linear terms and an offset, no mixed terms.
    rng = np.random.default_rng(8)
    pad = rng.uniform(-1, 1, (30, 3))
    alpha, beta, delta = rng.uniform(-0.1, 0.1, (3, 9)), rng.uniform(-0.1, 0.1, (3, 9)), rng.uniform(-0.1, 0.1, 9)
    model = QuadraticModel.fit(pad, pad**2 @ alpha + pad @ beta + delta)
    np.testing.assert_allclose(model.coefficients, np.vstack([alpha, beta, delta]), atol=1e-12)


def test_more_terms_fit_the_words_better():
    _, pad, pep = word_table()
    linear, quadratic = (np.mean((kind.fit(pad, pep).predict(pad) - pep) ** 2) for kind in KINDS)
    assert quadratic < linear < np.mean((pep - pep.mean(axis=0)) ** 2)


def test_a_dimension_that_does_not_vary_has_no_part():
    rng = np.random.default_rng(9)
    pad = rng.uniform(-1, 1, (30, 3)) * [1, 1, 0]
    model = LinearModel.fit(pad, 0.3 * pad[:, :1] - 0.2)
    np.testing.assert_allclose(model.T, [[0.3, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(model.V, [-0.2], atol=1e-12)


def test_digests_tell_kinds_and_numbers_apart():
    _, pad, pep = word_table()
    changed = pep.copy()
    changed[3, 4] += 0.01
    digests = [kind.fit(pad, values).digest for kind in KINDS for values in (pep, changed)]
    assert len(set(digests)) == 4


def test_wrong_input_is_refused():
    _, pad, pep = word_table()
    with pytest.raises(SpecError, match=r"1\.2 in row 1"):
        LinearModel.fit(pad, pep).predict(np.array([[0, 0, 0], [0, 1.2, 0]]))
    with pytest.raises(SpecError, match="pairs"):
        LinearModel.fit(np.zeros((2, 3)), np.zeros((3, 9)))
    with pytest.raises(SpecError, match="at least one"):
        QuadraticModel.fit(np.zeros((0, 3)), np.zeros((0, 9)))
    with pytest.raises(SpecError, match="finite"):
        LinearModel.fit(np.zeros((2, 3)), np.full((2, 9), np.nan))
