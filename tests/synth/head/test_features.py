import numpy as np
import pytest

from synth.errors import SpecError
from synth.head.features import extreme_distance, extreme_points, frame_statistics, word_features
from synth.head.published import example_sentence
from synth.head.trajectory import head_motion


def wave(period: int, cycles: int, phase: int = 0) -> np.ndarray:
    return 3.0 * np.cos(2 * np.pi * (np.arange(period * cycles) - phase) / period) - 5.0


def test_features_of_a_known_wave():
    angles = wave(20, 3, phase=4)
    found = word_features(angles, [[0, 20], [20, 40], [40, 60], [1, 5]])
    assert found.peak_frame.tolist() == [4, 24, 44, 4]
    assert found.valley_frame.tolist() == [14, 34, 54, 1]
    np.testing.assert_allclose(found.peak[:3], -2.0)
    np.testing.assert_allclose(found.valley[:3], -8.0)
    np.testing.assert_allclose(found.amp[:3], 6.0)
    np.testing.assert_allclose(found.avg[:3], -5.0)
    np.testing.assert_allclose(found.avg[3], angles[1:5].mean())


def test_three_axes_are_three_trajectories():
    angles = np.stack([wave(20, 2), wave(10, 4), np.zeros(40)], axis=1)
    found = word_features(angles, np.array([[0, 20], [20, 40]]))
    assert found.amp.shape == (2, 3)
    np.testing.assert_allclose(found.amp, [[6, 6, 0]] * 2)
    for axis in range(3):
        alone = word_features(angles[:, axis], [[0, 20], [20, 40]])
        np.testing.assert_array_equal(found.peak_frame[:, axis], alone.peak_frame)


def test_amp_and_avg_of_synthetic_words_are_found_again():
    words = example_sentence(syllable_s=0.32)  # words of an even number of frames hold peak and valley exactly
    motion = head_motion(words, rng=np.random.default_rng(0), transition_s=0.0)
    found = word_features(motion.angles, [[unit.start, unit.stop] for unit in motion.units])
    np.testing.assert_allclose(found.amp, [unit.amp for unit in motion.units], rtol=0.01)
    np.testing.assert_allclose(found.avg, [unit.avg for unit in motion.units], atol=1e-9)
    np.testing.assert_array_equal(found.peak_frame, [unit.peak for unit in motion.units])


def test_extreme_points_of_a_sinusoid_are_half_a_period_apart():
    angles = wave(30, 4, phase=10)
    assert extreme_points(angles).tolist() == [10, 25, 40, 55, 70, 85, 100, 115]
    assert extreme_distance(angles) == 15.0


def test_extrema_near_the_mean_do_not_count():
    # Standard deviation of the sum is about 2.1; the ripple has extrema everywhere, most of them nearer than that.
    t = np.arange(300)
    angles = 3.0 * np.sin(2 * np.pi * t / 100) + 0.4 * np.sin(2 * np.pi * t / 10)
    far, all_of_them = extreme_points(angles), extreme_points(angles, deviations=0.0)
    assert set(far) < set(all_of_them)
    assert (np.abs(angles[far] - angles.mean()) >= angles.std()).all()
    # The threshold is inclusive: +1 and -1 lie exactly one deviation from 0.
    assert extreme_points([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]).tolist() == [1, 2, 3, 4]


def test_plateaus_count_once_and_rest_has_no_extremes():
    assert extreme_points([0, 0, 5, 5, 5, 0, 0, 0, 0, 0]).tolist() == [3]
    assert extreme_distance([0, 0, 5, 5, 5, 0, 0, 0, 0, 0]) is None
    assert extreme_points(np.zeros(10)).size == 0


def test_frame_statistics_by_hand():
    found = frame_statistics(np.array([[1.0, 0, 2], [3.0, 0, 2], [5.0, 0, -4]]))
    assert found.mean.tolist() == [3, 0, 0]
    np.testing.assert_allclose(found.sd, [2, 0, np.sqrt(12)])
    assert found.range.tolist() == [4, 0, 6]


@pytest.mark.parametrize(
    ("angles", "bounds", "message"),
    [
        ([], [[0, 1]], "at least one frame"),
        (np.zeros((4, 2)), [[0, 1]], "shape"),
        ([0.0, np.nan], [[0, 1]], "angle of frame 1"),
        ([0.0, 1.0], [], "at least one row"),
        ([0.0, 1.0], [[0.0, 1.0]], "whole numbers"),
        ([0.0, 1.0], [[0, 3]], "word 0 goes from frame 0 to 3"),
        ([0.0, 1.0], [[0, 2], [1, 1]], "word 1 goes from frame 1 to 1"),
        ([0.0, 1.0], [[-1, 1]], "within 0 to 2"),
    ],
)
def test_malformed_trajectories_and_bounds_are_refused(angles, bounds, message):
    with pytest.raises(SpecError, match=message):
        word_features(angles, bounds)


def test_extreme_points_need_one_axis_and_statistics_two_frames():
    with pytest.raises(SpecError, match="one axis"):
        extreme_points(np.zeros((5, 3)))
    with pytest.raises(SpecError, match="deviations"):
        extreme_points(np.zeros(5), deviations=-1.0)
    with pytest.raises(SpecError, match="at least two"):
        frame_statistics([1.0])
