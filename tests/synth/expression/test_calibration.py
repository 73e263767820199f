import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.expression.calibration import LARGEST_GAIN, LEAST_RELIABILITY, CalibratedModel, Calibration
from synth.expression.pad_pep import LinearModel, QuadraticModel

SLOPES = np.array([[0.3, 0.1, 0.0], [0.0, 0.2, -0.2], [0.1, 0.0, 0.2]])


def samples(noise, *, count=200, seed=1):
    """PAD and PEPs of which the PAD explain a part; small, so that nothing is cut."""
    rng = np.random.default_rng(seed)
    pad = np.array([0.1, 0.2, -0.1]) + rng.uniform(-0.5, 0.5, (count, 3))
    return pad, pad @ SLOPES.T + 0.05 + noise * rng.normal(size=(count, 3))


def plain_calibration(**changes):
    return replace(Calibration(np.zeros(3), np.ones(3), np.zeros(3), np.ones(3)), **changes)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 0.3), st.integers(0, 1000))
def test_faces_vary_as_much_as_in_training(noise, seed):
    pad, pep = samples(noise, seed=seed)
    for model in (LinearModel.fit(pad, pep), QuadraticModel.fit(pad, pep)):
        found = Calibration.of(model, pad, pep)
        drawn, raw = (one.predict(pad).std(axis=0) for one in (CalibratedModel(model, found), model))
        free = found.gain < LARGEST_GAIN
        # Values above 1 would be cut; the samples are too small for that unless the gain is large.
        np.testing.assert_allclose(drawn[free], pep.std(axis=0)[free], rtol=0.02)
        assert (drawn[~free] <= LARGEST_GAIN * raw[~free] + 1e-12).all()
        assert (drawn >= raw - 1e-12).all()


def test_the_gain_is_that_of_the_standard_deviations():
    pad, pep = samples(0.05)
    model = LinearModel.fit(pad, pep)
    gain = Calibration.of(model, pad, pep).gain
    np.testing.assert_allclose(gain, pep.std(axis=0) / model.predict(pad).std(axis=0))
    # What PAD tells nothing about is not thrown about by chance.
    noise = np.random.default_rng(3).normal(size=pep.shape) * 0.1
    np.testing.assert_array_equal(
        Calibration.of(LinearModel.fit(pad, noise), pad, noise).gain, np.full(3, LARGEST_GAIN)
    )


def test_the_mean_face_stays():
    pad, pep = samples(0.2)
    model = LinearModel.fit(pad, pep)
    drawn = CalibratedModel(model, Calibration.of(model, pad, pep, reliability=np.array([0.9, 0.7, 0.6])))
    mean = pad.mean(axis=0)[None]
    np.testing.assert_allclose(drawn.predict(mean), pep.mean(axis=0)[None], atol=1e-12)


def test_neutral_stays_neutral_where_the_model_has_it_in_the_middle():
    pad, pep = samples(0.1)
    both = np.vstack([pad, -pad]), np.vstack([pep, -pep])
    model = LinearModel.fit(*both)
    drawn = CalibratedModel(model, Calibration.of(model, *both))
    np.testing.assert_allclose(drawn.predict(np.zeros((1, 3))), np.zeros((1, 3)), atol=1e-12)
    assert np.abs(drawn.predict(pad)).mean() > np.abs(model.predict(pad)).mean()


def test_error_of_the_raters_flattens_nothing():
    # Regression calibration: with inputs that are spread by one over the reliability, the true slopes come back.
    rng = np.random.default_rng(5)
    true = rng.uniform(-0.5, 0.5, (20000, 3))
    reliability = np.array([0.9, 0.7, 0.6])
    rated = true + rng.uniform(-0.5, 0.5, true.shape) * np.sqrt(1.0 / reliability - 1.0)
    pep = true @ SLOPES.T
    model = LinearModel.fit(rated, pep)
    assert (np.abs(model.T[SLOPES != 0]) < 0.93 * np.abs(SLOPES[SLOPES != 0])).all()
    found = Calibration.of(model, rated, pep, reliability=reliability)
    inputs_only = CalibratedModel(model, replace(found, gain=np.ones(3)))
    inner = np.abs(true).max(axis=1) < 0.3
    np.testing.assert_allclose(inputs_only.predict(true[inner]), pep[inner], atol=0.01)


def test_a_low_reliability_does_not_exaggerate_without_end():
    pad, pep = samples(0.1)
    found = Calibration.of(LinearModel.fit(pad, pep), pad, pep, reliability=np.array([0.0, 0.3, 0.8]))
    np.testing.assert_array_equal(found.reliability, [LEAST_RELIABILITY, LEAST_RELIABILITY, 0.8])


def test_a_pep_that_never_moves_stays():
    pad, pep = samples(0.1)
    pep[:, 1] = 0.0
    model = LinearModel.fit(pad, pep)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = Calibration.of(model, pad, pep)
    assert found.gain[1] == 1.0
    np.testing.assert_allclose(CalibratedModel(model, found).predict(pad)[:, 1], 0.0, atol=1e-12)


@given(arrays(np.float64, (4, 3), elements=st.floats(-1.0, 1.0)), st.floats(0.5, 1.0))
def test_faces_stay_within_bounds(pad, reliability):
    steep = LinearModel(T=3.0 * np.eye(3), V=np.zeros(3))
    drawn = CalibratedModel(steep, plain_calibration(reliability=np.full(3, reliability), gain=np.full(3, 2.0)))
    assert (np.abs(drawn.predict(pad)) <= 1.0).all()
    # Without anything to make up for, it is the model itself.
    np.testing.assert_array_equal(CalibratedModel(steep, plain_calibration()).predict(pad), steep.predict(pad))


def test_the_digest_stands_for_model_and_calibration():
    model = LinearModel(T=np.eye(3), V=np.zeros(3))
    other = LinearModel(T=np.eye(3), V=np.full(3, 0.1))
    changes = [{}, {"pad_mean": np.full(3, 0.1)}, {"reliability": np.full(3, 0.9)}, {"pep_mean": np.full(3, 0.1)}]
    made = [CalibratedModel(model, plain_calibration(**change)) for change in [*changes, {"gain": np.full(3, 1.1)}]]
    digests = {one.digest for one in [*made, CalibratedModel(other, plain_calibration())]} | {model.digest}
    assert len(digests) == 7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pad_mean": np.zeros(2)}, r"pad_mean, of shape \(2,\)"),
        ({"pad_mean": np.array([0.0, np.nan, 0.0])}, "pad_mean.*finite"),
        ({"reliability": np.zeros(3)}, "more than 0"),
        ({"reliability": np.full(3, 1.1)}, "at most 1"),
        ({"pep_mean": np.zeros((3, 1))}, "pep_mean"),
        ({"pep_mean": np.zeros(4)}, "gain"),
        ({"gain": np.full(3, 0.9)}, "at least 1"),
        ({"gain": np.full(3, np.inf)}, "gain.*finite"),
    ],
)
def test_wrong_numbers_are_refused(changes, message):
    with pytest.raises(SpecError, match=message):
        plain_calibration(**changes)


def test_wrong_samples_are_refused():
    pad, pep = samples(0.1)
    model = LinearModel.fit(pad, pep)
    with pytest.raises(SpecError, match="pairs"):
        Calibration.of(model, pad[:-1], pep)
    with pytest.raises(SpecError, match="no sample"):
        Calibration.of(model, pad[:0], pep[:0])
    with pytest.raises(SpecError, match="not a number"):
        Calibration.of(model, np.full_like(pad, np.nan), pep)
    with pytest.raises(SpecError, match="finite"):
        Calibration.of(model, pad, np.full_like(pep, np.nan))
    for reliability in (np.ones(2), np.array([0.9, np.nan, 0.9])):
        with pytest.raises(SpecError, match="reliability"):
            Calibration.of(model, pad, pep, reliability=reliability)
    drawn = CalibratedModel(model, Calibration.of(model, pad, pep))
    with pytest.raises(SpecError, match="row 0"):
        drawn.predict(np.array([[1.5, 0.0, 0.0]]))
