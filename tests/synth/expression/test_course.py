import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.course import Course, blink_track, expression_track, minimum_jerk
from synth.fap.table import FAP_COUNT, column

COURSE = Course(fps=25, neutral_s=0.4, onset_s=0.5, hold_s=1.6)
APEX = np.arange(1.0, FAP_COUNT + 1)


def _blinks(course, seed, apex=None):
    expression = expression_track(np.zeros(FAP_COUNT) if apex is None else apex, course)
    return expression, blink_track(expression, course, np.random.default_rng(seed))


def test_minimum_jerk_starts_and_ends_at_rest():
    p = np.linspace(0, 1, 1001)
    way = minimum_jerk(p)
    assert way[0] == 0.0
    assert way[500] == pytest.approx(0.5)
    assert way[-1] == pytest.approx(1.0)
    speed = np.gradient(way, p)
    assert speed[0] < 1e-3
    assert speed[-1] < 1e-3
    # Flash and Hogan 1985: the peak speed is 15/8 of the mean.
    assert speed.max() == pytest.approx(15 / 8, rel=1e-3)


@given(st.floats(-1e3, 1e3))
def test_minimum_jerk_stays_between(p):
    assert 0.0 <= minimum_jerk(np.array(p)) <= 1.0


def test_neutral_then_onset_then_hold():
    track = expression_track(APEX, COURSE)
    assert track.shape == (62, FAP_COUNT)
    share = track[:, 10] / APEX[10]
    assert not share[:11].any()
    assert (np.diff(share[10:23]) > 0).all()
    np.testing.assert_allclose(share[23:], 1.0)


def test_without_onset_the_expression_is_there_at_once():
    track = expression_track(APEX, Course(fps=10, neutral_s=0.5, onset_s=0.0, hold_s=0.5))
    np.testing.assert_array_equal(track[:, 0], [0.0] * 5 + [1.0] * 5)


@given(st.integers(0, 10**6))
def test_a_blink_closes_the_eyes_in_the_hold_and_opens_them_again(seed):
    apex = np.zeros(FAP_COUNT)
    apex[[column(19), column(20)]], apex[[column(21), column(22)]] = -400.0, -100.0
    expression, blink = _blinks(Course(fps=100, neutral_s=0.4, onset_s=0.5, hold_s=2.0), seed, apex)
    gap = 1024 - (expression + blink)[:, column(19)] - (expression + blink)[:, column(21)]
    assert not blink[:91].any()
    assert not blink[-1].any()
    assert gap.min() == pytest.approx(0.0, abs=5.0)
    assert gap[-1] == pytest.approx(1524.0)
    np.testing.assert_array_equal(blink[:, column(19)], blink[:, column(20)])


def test_closed_eyes_do_not_blink():
    apex = np.zeros(FAP_COUNT)
    apex[[column(19), column(20)]] = 1100.0
    _, blink = _blinks(COURSE, 3, apex)
    assert not blink.any()


def test_a_short_hold_has_no_blink_and_a_long_one_has_several():
    _, none = _blinks(Course(fps=25, neutral_s=0.4, onset_s=0.5, hold_s=0.6), 1)
    _, many = _blinks(Course(fps=25, neutral_s=0.4, onset_s=0.5, hold_s=20.0), 1)
    assert not none.any()
    starts = np.flatnonzero(np.diff((many[:, column(19)] > 0).astype(int)) == 1)
    assert 4 <= len(starts) <= 8
    assert np.diff(starts).min() >= 2.5 * 25 - 1


def test_the_seed_decides_when():
    assert np.array_equal(_blinks(COURSE, 5)[1], _blinks(COURSE, 5)[1])
    assert not np.array_equal(_blinks(COURSE, 5)[1], _blinks(COURSE, 6)[1])


@pytest.mark.parametrize("rest", [0.0, 0.3])
def test_with_an_offset_the_expression_goes_to_its_rest(rest):
    course = Course(fps=50, neutral_s=0.2, onset_s=0.4, hold_s=1.0, offset_s=0.6)
    share = expression_track(APEX, course, rest=rest)[:, 10] / APEX[10]
    assert len(share) == 110
    np.testing.assert_allclose(share[30:81], 1.0)
    assert (np.diff(share[80:]) < 0).all()
    assert share[-1] == pytest.approx(rest, abs=0.01)
    assert np.abs(np.diff(share)).max() < 0.1


@pytest.mark.parametrize("rest", [-0.1, 1.1, float("nan")])
def test_an_impossible_rest_is_refused(rest):
    with pytest.raises(SpecError, match="rest"):
        expression_track(APEX, COURSE, rest=rest)
