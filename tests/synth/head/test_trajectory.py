import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, column
from synth.head.amplitude import default_model
from synth.head.published import AXES, example_sentence, published_statistics
from synth.head.trajectory import KINDS, head_motion, head_track, sinusoid
from synth.head.words import ProsodicWord, Syllable, evenly


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def one_word(*parts: tuple[str, int | None, bool], P: float = 0.0, A: float = 0.5) -> ProsodicWord:
    return ProsodicWord("word", 0.0, 1.2, P, A, evenly(parts, 0.0, 1.2))


def test_eq_1():
    # Worked by hand for T = 4, t_peak = 2: the sine runs 0, 1, 0, -1.
    np.testing.assert_allclose(sinusoid([1, 2, 3, 4], 4, 2, amp=6.0, avg=-1.0), [-1, 2, -1, -4], atol=1e-12)


@given(period=st.integers(2, 200), peak=st.integers(1, 200), amp=st.floats(0, 40), avg=st.floats(-20, 20))
def test_a_cycle_has_its_peak_and_mean(period, peak, amp, avg):
    peak = 1 + (peak - 1) % period
    cycle = sinusoid(np.arange(1, period + 1), period, peak, amp=amp, avg=avg)
    assert cycle[peak - 1] == pytest.approx(avg + amp / 2)
    assert cycle.mean() == pytest.approx(avg, abs=1e-9)
    assert cycle.max() <= cycle[peak - 1] + 1e-9
    if period % 2 == 0:
        assert np.ptp(cycle) == pytest.approx(amp, abs=1e-9)


@pytest.mark.parametrize(
    ("parts", "rule", "syllable"),
    [
        ([("a", 4, False), ("b", 4, False), ("c", 1, True), ("d", 4, True)], "stressed", 2),
        ([("a", 1, False), ("b", 4, False), ("c", 2, False), ("d", 4, False)], "falling", 1),
        ([("a", 1, False), ("b", 2, False), ("c", 3, False), ("d", 5, False)], "first", 0),
        ([("un", None, False), ("be", None, False), ("liev", None, True), ("able", None, False)], "stressed", 2),
        ([], "first", None),
    ],
)
def test_the_rules_place_the_peak(parts, rule, syllable):
    word = one_word(*parts) if parts else ProsodicWord("word", 0.0, 1.2, 0.0, 0.5)
    motion = head_motion([word], rng=rng(), placed_axes=AXES)
    (unit,) = motion.units
    # Thirty frames, of which the third syllable has frames 15 to 22.
    centre = 14 if syllable is None else (3, 11, 18, 26)[syllable]
    assert unit.rule == rule
    assert unit.peak == (centre, centre, centre)
    np.testing.assert_array_equal(motion.angles.argmax(axis=0), centre)


def test_a_word_follows_eq_1_and_eq_2_exactly():
    word = one_word(("最", 4, True), ("好", 3, False), P=1.0, A=1.0)
    motion = head_motion([word], rng=rng(3))
    (unit,) = motion.units
    np.testing.assert_allclose(unit.amp, default_model().predict([1.0], [1.0])[0])
    t = np.arange(1, 31)
    for axis in range(3):
        amp, avg, peak = unit.amp[axis], unit.avg[axis], unit.peak[axis] + 1
        expected = 0.5 * amp * np.sin(2 * np.pi / 30 * (t - peak) + np.pi / 2) + avg
        np.testing.assert_allclose(motion.angles[:, axis], expected, atol=1e-12)


def test_positive_pitch_is_down():
    track = head_track([[10.0, -20.0, 5.0]])
    expected = np.radians([10.0, -20.0, 5.0]) * 1e5
    np.testing.assert_allclose(track[0, [column(48), column(49), column(50)]], expected)
    assert track.shape == (1, FAP_COUNT)
    assert np.count_nonzero(track) == 3


def test_silence_moves_less_than_speech_and_is_told():
    words = example_sentence()
    motion = head_motion(words, rng=rng(), duration_s=words[-1].end_s + 0.5)
    silent = [unit for unit in motion.units if unit.rule == "silence"]
    assert [(unit.text, unit.P, unit.A) for unit in silent] == [("", 0.0, -0.5)] * 4
    np.testing.assert_allclose(silent[0].amp, default_model().predict([0.0], [-0.5])[0])
    assert max(unit.amp[0] for unit in silent) < min(unit.amp[0] for unit in motion.units if unit.text)
    assert [unit.rule for unit in motion.units if unit.text].count("stressed") == 1
    json.dumps(motion.lineage(), allow_nan=False)


def test_avg_has_the_distribution_of_table_3():
    words = [ProsodicWord("word", float(k), k + 1.0, 0.0, 0.5) for k in range(4000)]
    avg = np.array([unit.avg for unit in head_motion(words, rng=rng(1)).units])
    table = published_statistics()
    np.testing.assert_allclose(avg.mean(axis=0), table.avg_mean, atol=4 * 3.48 / np.sqrt(4000))
    np.testing.assert_allclose(avg.std(axis=0), table.avg_sd, rtol=0.05)
    # About 5 % of normal values lie beyond two deviations; of evenly drawn ones none do.
    beyond = np.mean(np.abs(avg - table.avg_mean) > 2 * table.avg_sd, axis=0)
    np.testing.assert_allclose(beyond, 0.0455, atol=0.015)


def test_the_random_kind_stays_within_table_3_and_ignores_the_text():
    calm = [ProsodicWord("word", float(k), k + 1.0, 0.0, 0.0) for k in range(3000)]
    wild = [
        ProsodicWord("word", k, k + 1.0, 1.0, 1.0, (Syllable("最", k, k + 0.3, 4, True),))
        for k in map(float, range(3000))
    ]
    motion, other = (head_motion(words, rng=rng(2), kind="random") for words in (calm, wild))
    np.testing.assert_array_equal(motion.angles, other.angles)
    table = published_statistics()
    amp, avg = (np.array([getattr(unit, name) for unit in motion.units]) for name in ("amp", "avg"))
    for found, mean, sd in ((amp, table.amp_mean, table.amp_sd), (avg, table.avg_mean, table.avg_sd)):
        assert (np.abs(found - mean) <= sd).all()
        np.testing.assert_allclose(found.std(axis=0), sd / np.sqrt(3), rtol=0.05)
    places = np.array([unit.peak[0] - unit.start for unit in motion.units])
    assert set(places) == set(range(25))
    assert {unit.rule for unit in motion.units} == {"random"}


def test_the_static_head_rests():
    motion = head_motion(example_sentence(), rng=rng(), kind="static")
    assert motion.angles.shape[1] == 3
    assert not motion.angles.any()
    assert motion.units == ()
    assert motion.largest_speed.tolist() == [0, 0, 0]


def test_axes_are_nearly_independent_unless_all_are_placed():
    # MTAP 2013, section 3.3: correlations between the axes are below 0.3.
    def mean_correlations(**options):
        found = [np.corrcoef(head_motion(example_sentence(), rng=rng(seed), **options).angles.T) for seed in range(40)]
        return np.mean(found, axis=0)[np.triu_indices(3, 1)]

    assert (np.abs(mean_correlations()) < 0.12).all()
    assert (mean_correlations(placed_axes=AXES) > 0.3).all()


def test_many_sentences_have_the_papers_statistics_at_frame_level():
    # Table 3 prints SD 4.70, 2.19, 2.41, of which Amp and Avg tell nothing directly.
    sd = np.mean([head_motion(example_sentence(), rng=rng(seed)).angles.std(axis=0) for seed in range(60)], axis=0)
    np.testing.assert_allclose(sd, published_statistics().angle_sd, rtol=0.1)


def test_smoothing_touches_only_the_boundaries():
    raw, smooth = (head_motion(example_sentence(), rng=rng(5), transition_s=width) for width in (0.0, None))
    starts = np.array([unit.start for unit in raw.units[1:]])
    changed = np.flatnonzero((raw.angles != smooth.angles).any(axis=1))
    assert len(changed) > 0
    assert {int((frame - starts)[np.abs(frame - starts).argmin()]) for frame in changed} <= {-2, -1, 0, 1}
    np.testing.assert_allclose(smooth.angles[starts[0]], raw.angles[starts[0] - 2 : starts[0] + 3].mean(axis=0))


@pytest.mark.parametrize("seed", range(5))
def test_no_step_is_larger_than_eq_1_and_the_average_imply(seed):
    raw, smooth = (head_motion(example_sentence(), rng=rng(seed), transition_s=width) for width in (0.0, None))
    steps = np.abs(np.diff(raw.angles, axis=0))
    starts = [unit.start - 1 for unit in raw.units[1:]]
    jump, inside = steps[starts].max(axis=0), np.delete(steps, starts, axis=0).max(axis=0)
    # Two frames before a boundary the average reaches one frame across: (4 + 3) / 5 steps of a cycle and 1/5 jump.
    assert (np.abs(np.diff(smooth.angles, axis=0)) <= jump / 5 + 1.4 * inside + 1e-9).all()
    amp = np.array([unit.amp for unit in raw.units])
    frames = np.array([[unit.stop - unit.start] for unit in raw.units])
    assert (inside <= (amp * np.sin(np.pi / frames)).max(axis=0) + 1e-9).all()


def test_the_average_is_five_frames_at_25_and_as_long_elsewhere():
    for fps, half in ((25, 2), (50, 4), (30, 2), (60, 6)):
        words = [ProsodicWord("a", 0.0, 2.0, 0.0, 0.5), ProsodicWord("b", 2.0, 4.0, 0.0, 0.5)]
        raw, smooth = (head_motion(words, rng=rng(1), fps=fps, transition_s=width) for width in (0.0, None))
        changed = np.flatnonzero((raw.angles != smooth.angles).any(axis=1))
        assert (changed[0], changed[-1]) == (2 * fps - half, 2 * fps + half - 1)


def test_a_glide_has_a_fraction_of_the_acceleration():
    def largest(transition):
        found = [head_motion(example_sentence(), rng=rng(seed), transition=transition).angles for seed in range(20)]
        return np.median([np.abs(np.diff(angles, 2, axis=0)).max() for angles in found])

    assert largest("glide") < 0.5 * largest("average")


def test_a_limit_of_speed_lowers_amp_in_short_words_only():
    words = [ProsodicWord("short", 0.0, 0.2, 0.0, 0.5), ProsodicWord("long word", 0.2, 1.6, 0.0, 0.5)]
    free, slow = (head_motion(words, rng=rng(), transition_s=0.0, max_speed=limit) for limit in (None, 60.0))
    assert slow.units[0].amp[0] == pytest.approx(60.0 * 5 / (np.pi * 25))
    assert slow.units[0].amp[0] < free.units[0].amp[0]
    assert slow.units[1] == free.units[1]


words_lists = st.lists(
    st.tuples(st.floats(0, 0.6), st.floats(0.03, 1.5), st.floats(-1, 1), st.floats(-1, 1), st.integers(1, 5)),
    min_size=1,
    max_size=8,
)


@settings(deadline=None)
@given(
    rows=words_lists,
    kind=st.sampled_from(KINDS),
    fps=st.sampled_from([10, 25, 29.97, 60]),
    transition=st.sampled_from(["average", "glide"]),
    seed=st.integers(0, 99),
)
def test_any_words_move_the_head_without_jumps(rows, kind, fps, transition, seed):
    words, now = [], 0.0
    for gap, length, P, A, tone in rows:
        start = now + gap
        now = start + length
        words.append(ProsodicWord("w", start, now, P, A, (Syllable("w", start, now, tone),)))
    options = {"kind": kind, "fps": fps, "duration_s": now + 0.3}
    motion, raw = (
        head_motion(words, rng=rng(seed), transition=transition, transition_s=width, **options) for width in (None, 0.0)
    )
    again = head_motion(words, rng=rng(seed), transition=transition, **options)
    np.testing.assert_array_equal(motion.angles, again.angles)
    assert np.isfinite(motion.angles).all()
    assert len(motion.angles) == int(np.ceil((now + 0.3) * fps - 1e-4))
    # A passage only ever mixes what the units' cycles reach.
    reach = [np.add(unit.avg, 0.5 * np.array(unit.amp)) for unit in raw.units] or [np.zeros(3)]
    depth = [np.subtract(unit.avg, 0.5 * np.array(unit.amp)) for unit in raw.units] or [np.zeros(3)]
    assert (motion.angles <= np.max(reach, axis=0) + 1e-9).all()
    assert (motion.angles >= np.min(depth, axis=0) - 1e-9).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "nodding"}, "no kind 'nodding'; there are prosodic, random, static"),
        ({"fps": 0}, "fps is 0"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"duration_s": 0.5}, "ends at 14.4"),
        ({"duration_s": 1e9}, "duration_s is"),
        ({"transition": "cut"}, "no transition 'cut'"),
        ({"transition_s": -1}, "transition_s is -1"),
        ({"max_speed": 0}, "max_speed is 0"),
        ({"placed_axes": ("tilt",)}, "no axis 'tilt'"),
        ({"words": []}, "there are no words"),
    ],
)
def test_malformed_requests_are_refused(options, message):
    words = options.pop("words", example_sentence()) if "words" in options else example_sentence()
    with pytest.raises(SpecError, match=message):
        head_motion(words, rng=rng(), **options)


def test_silence_alone_is_one_slow_cycle():
    motion = head_motion([], rng=rng(), duration_s=2.0)
    assert [(unit.rule, unit.start, unit.stop, unit.peak[0]) for unit in motion.units] == [("silence", 0, 50, 24)]


@pytest.mark.parametrize(("angles", "message"), [(np.zeros((3, 2)), "shape"), ([[np.nan, 0, 0]], "finite")])
def test_tracks_need_sound_angles(angles, message):
    with pytest.raises(SpecError, match=message):
        head_track(angles)
