import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.expression.inverse import PepPadModel
from synth.expression.validation import Split, random_split


def samples(noise=0.0, *, count=120, peps=4):
    rng = np.random.default_rng(11)
    pep = rng.uniform(-1, 1, (count, peps))
    (squares, slopes), offset = rng.uniform(-0.1, 0.1, (2, peps, 3)), np.array([0.05, -0.1, 0.0])
    pad = pep**2 @ squares + pep @ slopes + offset + noise * rng.normal(size=(count, 3))
    return pep, np.clip(pad, -1, 1), np.vstack([squares, slopes, offset])


def split_of(count):
    return random_split(count, rng=np.random.default_rng(2))


def test_the_polynomial_is_found_again():
    # ACII 2007, Eq. 3, turned round.
    pep, pad, coefficients = samples()
    model = PepPadModel.fit(pep, pad, split_of(len(pep)))
    np.testing.assert_allclose(model.coefficients, coefficients, atol=1e-12)
    np.testing.assert_allclose(model.predict(pep), pad, atol=1e-12)
    np.testing.assert_allclose(model.rmse, 0.0, atol=1e-12)
    np.testing.assert_allclose(model.correlation, 1.0)


def test_the_error_is_that_of_the_noise():
    pep, pad, _ = samples(0.1, count=3000)
    model = PepPadModel.fit(pep, pad, split_of(len(pep)))
    np.testing.assert_allclose(model.rmse, 0.1, rtol=0.05)


def test_the_error_is_cross_validated():
    pep, pad, _ = samples(0.2)
    pad, pep = pad[:60], pep[:60]
    split = split_of(60)
    found = np.full_like(pad, np.nan)
    terms = np.hstack([pep**2, pep, np.ones((60, 1))])
    for k, rows in enumerate(split.folds):
        others = np.concatenate([own for j, own in enumerate(split.folds) if j != k])
        found[rows] = np.clip(terms[rows] @ np.linalg.lstsq(terms[others], pad[others], rcond=None)[0], -1, 1)
    seen = np.concatenate(split.folds)
    model = PepPadModel.fit(pep, pad, split)
    np.testing.assert_allclose(model.rmse, np.sqrt(np.mean((found[seen] - pad[seen]) ** 2, axis=0)))
    for k in range(3):
        assert model.correlation[k] == pytest.approx(np.corrcoef(found[seen, k], pad[seen, k])[0, 1])
    # It is larger than the error on what the model was fitted to.
    assert (model.rmse > np.sqrt(np.mean((model.predict(pep) - pad) ** 2, axis=0))).all()


@given(arrays(np.float64, (3, 4), elements=st.floats(-5.0, 5.0)))
def test_predictions_are_pad_values(pep):
    model = PepPadModel(np.ones((9, 3)), np.zeros(3), np.zeros(3))
    assert (np.abs(model.predict(pep)) <= 1.0).all()
    # A stronger face than any known says no more than the strongest.
    np.testing.assert_array_equal(model.predict(pep), model.predict(np.clip(pep, -1, 1)))


def test_a_dimension_that_does_not_vary_has_no_correlation():
    pep, pad, _ = samples(0.1)
    pad[:, 2] = 0.25
    model = PepPadModel.fit(pep, pad, split_of(len(pep)))
    assert np.isnan(model.correlation).tolist() == [False, False, True]
    assert model.rmse[2] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(model.predict(pep)[:, 2], 0.25)


def test_the_digest_is_that_of_the_coefficients():
    one = PepPadModel(np.ones((9, 3)), np.zeros(3), np.zeros(3))
    same, other = PepPadModel(np.ones((9, 3)), np.ones(3), np.ones(3)), PepPadModel(np.ones((7, 3)), *np.zeros((2, 3)))
    assert one.digest == same.digest != other.digest


def test_wrong_input_is_refused():
    pep, pad, _ = samples()
    split = split_of(len(pep))
    with pytest.raises(SpecError, match="pairs"):
        PepPadModel.fit(pep[:-1], pad, split)
    with pytest.raises(SpecError, match="finite"):
        PepPadModel.fit(np.where(pep > 0.9, np.nan, pep), pad, split)
    with pytest.raises(SpecError, match="not a number"):
        PepPadModel.fit(pep, np.full_like(pad, np.nan), split)
    with pytest.raises(SpecError, match="no folds"):
        PepPadModel.fit(pep, pad, Split(()))
    model = PepPadModel.fit(pep, pad, split)
    with pytest.raises(SpecError, match="3 PEPs given, but the model takes 4"):
        model.predict(pep[:, :3])
    with pytest.raises(SpecError, match="finite"):
        model.predict(np.full((1, 4), np.inf))
    with pytest.raises(SpecError, match=r"\(4,\)"):
        model.predict(pep[0])


@pytest.mark.parametrize(
    ("coefficients", "rmse", "message"),
    [
        (np.ones((8, 3)), np.zeros(3), "2 K"),
        (np.ones((9, 2)), np.zeros(3), "2 K"),
        (np.full((9, 3), np.nan), np.zeros(3), "finite"),
        (np.ones(9), np.zeros(3), "2 K"),
        (np.ones((9, 3)), np.zeros(2), "rmse"),
    ],
)
def test_wrong_coefficients_are_refused(coefficients, rmse, message):
    with pytest.raises(SpecError, match=message):
        PepPadModel(coefficients, rmse, np.zeros(3))
