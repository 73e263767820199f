import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.pad_pep import MODEL_NAMES, LinearModel, QuadraticModel, TableModel, load_model, word_table
from synth.pad import emotion_words

points = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=1, max_size=5).map(np.array)


@pytest.mark.parametrize("name", MODEL_NAMES)
@given(pad=points)
def test_predictions_are_bounded_and_one_row_each(name, pad):
    pep = load_model(name).predict(pad)
    assert pep.shape == (len(pad), 9)
    assert (np.abs(pep) <= 1.0).all()


@pytest.mark.parametrize("name", MODEL_NAMES)
@given(pad=points)
def test_a_row_does_not_depend_on_the_others(name, pad):
    model = load_model(name)
    np.testing.assert_allclose(model.predict(pad)[-1:], model.predict(pad[-1:]), atol=1e-12)


def test_the_table_is_exact_at_its_words_and_neutral():
    words, pad, pep = word_table()
    assert list(words) == list(emotion_words())
    np.testing.assert_allclose(load_model("table").predict(pad), pep, atol=1e-9)
    assert not load_model("table").predict(np.zeros((1, 3))).any()


def test_the_words_are_distinct_expressions():
    _, _, pep = word_table()
    distances = np.linalg.norm(pep[:, None] - pep[None], axis=2)
    assert distances[~np.eye(14, dtype=bool)].min() > 0.3


@given(st.tuples(*[st.floats(-0.9, 0.9)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_the_table_is_smooth(point, step):
    # Sad and Anxious, 0.03 apart, differ by 0.7 in one PEP: no place is much steeper than that.
    model = load_model("table")
    here, there = model.predict(np.array([point, np.array(point) + 1e-4 * np.array(step)]))
    assert np.abs(there - here).max() < 1e-2


def test_the_table_goes_on_beyond_its_words():
    happy = np.array([emotion_words()["Happy"].as_tuple()])
    model = load_model("table")
    assert model.predict(1.5 * happy)[0, 7] > model.predict(happy)[0, 7]
    assert model.predict(np.array([[0.9, 0.4, 0.4]]))[0, 7] > 0.8
    assert model.predict(np.array([[-0.9, 0.3, 0.2]]))[0, 7] < -0.6


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
    errors = {name: np.mean((load_model(name).predict(pad) - pep) ** 2) for name in MODEL_NAMES}
    assert errors["table"] < errors["quadratic"] < errors["linear"] < np.mean((pep - pep.mean(axis=0)) ** 2)


def test_digests_tell_kind_and_training_set_apart():
    _, pad, pep = word_table()
    changed = pep.copy()
    changed[3, 4] += 0.01
    kinds = (TableModel, LinearModel, QuadraticModel)
    digests = [kind.fit(pad, values).digest for kind in kinds for values in (pep, changed)]
    assert len(set(digests)) == 6
    assert TableModel.fit(pad, pep).digest == load_model("table").digest


def test_wrong_input_is_refused():
    with pytest.raises(SpecError, match="no PAD to PEP model 'cubic'"):
        load_model("cubic")
    with pytest.raises(SpecError, match=r"1\.2 in row 1"):
        load_model("linear").predict(np.array([[0, 0, 0], [0, 1.2, 0]]))
    with pytest.raises(SpecError, match=r"\(N, 3\)"):
        load_model("table").predict(np.zeros(3))
    with pytest.raises(SpecError, match="same PAD"):
        TableModel.fit(np.full((2, 3), 0.5), np.zeros((2, 9)))
    with pytest.raises(SpecError, match="pairs"):
        LinearModel.fit(np.zeros((2, 3)), np.zeros((3, 9)))
