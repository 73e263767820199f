import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.head.amplitude import AmplitudeModel, default_model, printed_sample
from synth.head.published import published_counts, published_statistics

CLASSES = np.array([(0, -0.5), (0, 0), (0, 0.5), (1, 0), (1, 0.5), (1, 1)], dtype=float)
C = np.arange(1.0, 19.0).reshape(6, 3)


def eq_2(P, A, c):
    """Eq. 2 as the paper writes it."""
    return P * (c[0] * A**2 + c[1] * A + c[2]) + (1 - P) * (c[3] * A**2 + c[4] * A + c[5])


def test_known_coefficients_are_found():
    rng = np.random.default_rng(1)
    P, A = rng.uniform(0, 1, 60), rng.uniform(-0.5, 1, 60)
    model = AmplitudeModel.fit(P, A, np.array([eq_2(p, a, C) for p, a in zip(P, A, strict=True)]))
    np.testing.assert_allclose(model.coefficients, C, rtol=1e-10)
    np.testing.assert_allclose(model.explained, 1.0)
    np.testing.assert_allclose(model.residual_sd, 0.0, atol=1e-10)
    np.testing.assert_allclose(model.predict([0.3], [0.7])[0], eq_2(0.3, 0.7, C))


def test_six_classes_are_met_exactly():
    amplitudes = np.arange(18.0).reshape(6, 3)
    model = AmplitudeModel.fit(CLASSES[:, 0], CLASSES[:, 1], amplitudes)
    np.testing.assert_allclose(model.predict(CLASSES[:, 0], CLASSES[:, 1]), amplitudes, atol=1e-12)
    assert model.residual_sd.tolist() == [0, 0, 0]


def test_least_squares_agrees_with_the_normal_equations():
    rng = np.random.default_rng(2)
    P, A = rng.integers(0, 2, 40).astype(float), rng.choice([-0.5, 0.0, 0.5, 1.0], 40)
    y = rng.uniform(0, 10, (40, 3))
    X = np.stack([P * A**2, P * A, P, (1 - P) * A**2, (1 - P) * A, 1 - P], axis=1)
    model = AmplitudeModel.fit(P, A, y)
    np.testing.assert_allclose(model.coefficients, np.linalg.solve(X.T @ X, X.T @ y), rtol=1e-8)
    rest = y - X @ model.coefficients
    np.testing.assert_allclose(model.residual_sd, np.sqrt((rest**2).sum(axis=0) / 34))


@pytest.mark.parametrize(
    ("P", "A", "message"),
    [
        # The classes of Table 1 without silence.
        (
            [0, 0, 1, 1, 1] * 5,
            [0, 0.5, 0, 0.5, 1] * 5,
            "only 5 of the 6 .* where P is 0, three .* but there are 0, 0.5",
        ),
        ([0, 0, 0, 1, 1] * 5, [-0.5, 0, 0.5, 0, 1] * 5, "only 5 of the 6 .* where P is 1, three .* but there are 0, 1"),
        ([0] * 9, [-0.5, 0, 0.5] * 3, "only 3 of the 6 .* where P is 1, .* there are none"),
        ([0.5] * 9, [-0.5, 0, 0.5] * 3, "at least two values of P"),
        ([], [], "these 0 amplitudes determine only 0"),
    ],
)
def test_words_that_do_not_determine_the_coefficients_are_refused(P, A, message):
    with pytest.raises(SpecError, match=message):
        AmplitudeModel.fit(P, A, np.ones((len(P), 3)))


@pytest.mark.parametrize(
    ("P", "A", "amplitudes", "message"),
    [
        ([0.0], [0.0, 1.0], np.ones((1, 3)), "both must be"),
        ([2.0], [0.0], np.ones((1, 3)), "P is 2"),
        ([0.0], [np.nan], np.ones((1, 3)), "A is nan"),
        ([0.0], [0.0], np.ones((1, 2)), r"must be \(1, 3\)"),
        ([0.0], [0.0], -np.ones((1, 3)), "negative or not finite"),
        ([0.0], [0.0], np.full((1, 3), np.inf), "negative or not finite"),
    ],
)
def test_malformed_data_are_refused(P, A, amplitudes, message):
    with pytest.raises(SpecError, match=message):
        AmplitudeModel.fit(P, A, amplitudes)


def test_the_generated_words_have_the_printed_statistics():
    sample, table = printed_sample(), published_statistics()
    words = sample.amplitudes[sample.spoken]
    np.testing.assert_allclose(words.mean(axis=0), table.amp_mean, rtol=1e-9)
    np.testing.assert_allclose(words.std(axis=0, ddof=1), table.amp_sd, rtol=1e-9)
    for (P, A), n in published_counts().items():
        assert np.sum((sample.P == P) & (sample.A == A)) == n
    assert set(zip(sample.P[~sample.spoken], sample.A[~sample.spoken], strict=True)) == {(0.0, -0.5)}
    assert (sample.amplitudes > 0.0).all()


def test_the_assumed_trend_explains_the_stated_share():
    sample = printed_sample()
    words = sample.spoken
    fitted = default_model().predict(sample.P[words], sample.A[words])
    np.testing.assert_allclose(
        fitted.var(axis=0, ddof=1) / published_statistics().amp_sd ** 2, [0.25, 0.25, 0.25], rtol=1e-6
    )


def test_amp_rises_with_arousal_on_every_axis():
    # MTAP 2013, section 3.2, on Fig. 6.
    for P, arousals in ((0.0, [-0.5, 0.0, 0.5, 1.0]), (1.0, [0.0, 0.5, 1.0])):
        rows = default_model().predict([P] * len(arousals), arousals)
        assert (np.diff(rows, axis=0) > 0.0).all()
        # And pitch moves most at every class.
        assert (rows[:, 0] > rows[:, 1:].max(axis=1)).all()


def test_derogatory_words_move_as_neutral_ones_unless_asked():
    model = AmplitudeModel.fit(CLASSES[:, 0], CLASSES[:, 1], np.repeat([[2.0], [3], [4], [6], [9], [12]], 3, axis=1))
    np.testing.assert_allclose(model.predict([-1.0, -0.4], [0.5, 0.5]), 4.0)
    # Twice the neutral parabola less the commendatory one: 2 * 4 - 9 is below 0.
    np.testing.assert_allclose(model.predict([-1.0], [0.5], extrapolate=True), 0.0)
    np.testing.assert_allclose(model.predict([-0.2], [0.5], extrapolate=True), 1.2 * 4 - 0.2 * 9)


@given(P=st.floats(-1, 1), A=st.floats(-1, 1), extrapolate=st.booleans())
def test_amplitudes_are_never_negative(P, A, extrapolate):
    amp = default_model().predict([P], [A], extrapolate=extrapolate)
    assert amp.shape == (1, 3)
    assert (amp >= 0.0).all()
    assert (amp < 30.0).all()
