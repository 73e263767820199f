import numpy as np
import pytest

from synth.errors import SpecError
from synth.head.smoothing import glide, moving_average


def test_a_jump_becomes_five_equal_steps():
    jump = np.repeat([0.0, 10.0], 10)
    found = moving_average(jump, [10], window=5)
    np.testing.assert_allclose(np.diff(found)[7:12], 2.0)
    np.testing.assert_allclose(np.delete(np.diff(found), range(7, 12)), 0.0, atol=1e-12)


def test_only_frames_near_a_boundary_change():
    wave = np.sin(np.arange(40.0))[:, None] * [1.0, 2.0, 3.0]
    found = moving_average(wave, [0, 20, 39], window=5)
    assert np.flatnonzero((found != wave).any(axis=1)).tolist() == [0, 1, 18, 19, 20, 21, 37, 38, 39]
    np.testing.assert_allclose(found[18], wave[16:21].mean(axis=0))
    # The ends are taken to go on.
    np.testing.assert_allclose(found[0], (3 * wave[0] + wave[1] + wave[2]) / 5)
    np.testing.assert_array_equal(moving_average(wave, [20], window=1), wave)


@pytest.mark.parametrize("window", [0, 4, -1, 5.0, True])
def test_windows_are_odd(window):
    with pytest.raises(SpecError, match="odd number"):
        moving_average(np.zeros(9), [4], window=window)


def line(height: float):
    return lambda first, stop: np.full((stop - first, 3), height)


def test_a_glide_rises_by_minimum_jerk_within_its_width():
    found = glide([line(0.0), line(10.0)], [0, 20, 40], width=10)
    assert found.shape == (40, 3)
    p = (np.arange(10) + 0.5) / 10
    np.testing.assert_allclose(found[15:25, 1], 10 * (10 * p**3 - 15 * p**4 + 6 * p**5))
    assert (found[:15] == 0.0).all()
    assert (found[25:] == 10.0).all()


def test_glides_do_not_meet_in_short_units():
    found = glide([line(0.0), line(1.0), line(0.0)], [0, 20, 24, 44], width=30)
    assert (found[:18] == 0.0).all()
    assert (found[26:] == 0.0).all()
    assert found.max() > 0.8
    # Units of one frame leave no room.
    assert glide([line(0.0), line(1.0)], [0, 1, 2], width=10)[:, 0].tolist() == [0.0, 1.0]
    assert glide([line(0.0), line(1.0)], [0, 5, 9], width=0)[:, 0].tolist() == [0.0] * 5 + [1.0] * 4
