import numpy as np
import pytest

from synth.errors import SpecError
from synth.expression.course import BLINK_S
from synth.expression.life import blink_starts, gaze_shifts, life_track
from synth.fap.table import FAP_COUNT, column
from synth.fap.units import ANGLE_UNIT

MINUTE = np.zeros((25 * 60, FAP_COUNT))
EYES = [column(fap) for fap in (23, 24, 25, 26)]
LIDS = [column(fap) for fap in (19, 20)]


def _life(face=MINUTE, seed=1, fps=25, **options):
    return life_track(face, fps=fps, rng=np.random.default_rng(seed), **options)


@pytest.mark.parametrize("rate", [15.0, 17.0, 26.0])
def test_blinks_come_at_the_rate_of_people(rate):
    counts = [len(blink_starts(60.0, rate=rate, rng=np.random.default_rng(seed))) for seed in range(300)]
    assert np.mean(counts) == pytest.approx(rate, rel=0.04)
    assert np.std(counts) > 1.0


def test_intervals_between_blinks_are_skewed_and_never_too_short():
    gaps = np.diff(blink_starts(6000.0, rng=np.random.default_rng(3)))
    assert gaps.min() >= 0.9
    assert np.median(gaps) < gaps.mean()
    assert gaps.mean() == pytest.approx(60 / 17, rel=0.05)


def test_no_blink_is_cut_off():
    for seed in range(100):
        starts = blink_starts(4.0, rng=np.random.default_rng(seed))
        assert all(0.0 <= start <= 4.0 - BLINK_S for start in starts)


def test_a_blink_closes_the_eyes_whatever_the_expression():
    face = MINUTE.copy()
    face[:, LIDS] = -300.0
    closed = (face + _life(face, fps=100))[:, LIDS]
    assert closed.max() == pytest.approx(1024.0, abs=5.0)
    assert (closed >= -300.0).all()


def test_shifts_of_gaze_are_small_and_fast_as_people_make_them():
    times = np.arange(0.0, 120.0, 0.001)
    track = gaze_shifts(times, rng=np.random.default_rng(4))
    np.testing.assert_array_equal(track[:, EYES[0]], track[:, EYES[1]])
    angle = np.degrees(np.hypot(track[:, EYES[0]], track[:, EYES[2]]) * ANGLE_UNIT)
    speed = np.abs(np.diff(angle)) * 1000
    moving = np.flatnonzero(np.diff((speed > 1e-9).astype(int)) == 1)
    assert 40 < len(moving) < 160
    for start in moving[::2]:
        size = angle[start + 100]
        assert 1.0 <= size <= 3.0
        # Minimum jerk peaks at 15/8 of the mean speed.
        assert speed[start : start + 60].max() == pytest.approx(1.875 * size / (0.021 + 0.0022 * size), rel=0.02)
    assert not track[:, [k for k in range(FAP_COUNT) if k not in EYES]].any()


def test_each_kind_is_switched_on_its_own():
    both, blinks, gaze = _life(), _life(gaze=False), _life(blinks=False)
    np.testing.assert_array_equal(both, blinks + gaze)
    assert blinks[:, LIDS].any()
    assert not blinks[:, EYES].any()
    assert gaze[:, EYES].any()
    assert not gaze[:, LIDS].any()
    assert not _life(blinks=False, gaze=False).any()


def test_the_seed_decides():
    np.testing.assert_array_equal(_life(seed=5), _life(seed=5))
    assert not np.array_equal(_life(seed=5), _life(seed=6))


def test_no_frames_have_no_life():
    assert _life(np.zeros((0, FAP_COUNT))).shape == (0, FAP_COUNT)


@pytest.mark.parametrize("options", [{"fps": 0}, {"rate": 0.0}, {"rate": 70.0}, {"rate": float("nan")}])
def test_impossible_lives_are_refused(options):
    with pytest.raises(SpecError, match="Life"):
        _life(**options)
