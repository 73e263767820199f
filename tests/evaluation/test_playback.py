import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.playback import FASTER, KINDS, SLACK_S, Playback, PlayEvent, summarise


def watch(*rows, duration_s=10.0) -> Playback:
    return summarise([PlayEvent(*row) for row in rows], duration_s=duration_s)


WHOLE = [("play", 0, 0), ("playing", 100, 0), ("pause", 10100, 10), ("ended", 10100, 10)]


class TestWhatWasPlayed:
    def test_once_through(self):
        found = watch(("play", 0, 0), ("playing", 100, 0), ("ended", 10100, 10))
        expected = (10, 1, 1, 0, 0, True)
        assert (found.played_s, found.share, found.plays, found.seeks, found.stalls, found.complete) == expected
        assert (found.max_rate, found.min_rate, found.hidden_s, found.dropped_frames) == (1, 1, 0, 0)

    def test_a_browser_pauses_before_the_end(self):
        assert watch(*WHOLE).share == 1

    def test_the_first_half(self):
        found = watch(("play", 0, 0), ("pause", 5000, 5))
        assert (found.played_s, found.share, found.plays, found.complete) == (5, 0.5, 0, False)

    def test_jumps_leave_gaps(self):
        found = watch(
            ("play", 0, 0), ("seeking", 2000, 2), ("seeked", 2050, 6), ("playing", 2060, 6), ("pause", 4060, 8)
        )
        assert (found.played_s, found.seeks) == (4, 1)

    def test_where_a_jump_led_was_not_played_even_if_the_page_says_so_too_early(self):
        found = watch(("play", 0, 0), ("seeking", 2000, 9), ("seeked", 2050, 9), ("pause", 3050, 10))
        assert found.played_s == 1

    def test_scrubbing_is_one_jump(self):
        found = watch(
            ("play", 0, 0), ("seeking", 1000, 1), ("seeking", 1010, 3), ("seeking", 1020, 5), ("seeked", 1100, 5)
        )
        assert (found.seeks, found.played_s) == (1, 1)

    def test_a_jump_whose_end_is_not_logged(self):
        found = watch(("play", 0, 0), ("seeking", 1000, 1), ("playing", 1100, 5), ("pause", 2100, 6))
        assert (found.seeks, found.played_s) == (1, 2)

    def test_to_play_again_from_the_end_is_no_jump(self):
        again = [("seeking", 11000, 10), ("play", 11001, 0), ("seeked", 11050, 0), ("playing", 11060, 0)]
        found = watch(*WHOLE[:2], ("ended", 10100, 10), *again, ("ended", 21060, 10))
        assert (found.played_s, found.plays, found.seeks) == (10, 2, 0)

    def test_to_go_back_from_the_end_to_the_middle_is_a_jump(self):
        found = watch(*WHOLE[:2], ("ended", 10100, 10), ("seeking", 11000, 10), ("seeked", 11050, 5))
        assert found.seeks == 1

    def test_paused_time_does_not_count(self):
        assert watch(("play", 0, 0), ("pause", 1000, 1), ("pause", 9000, 9)).played_s == 1

    def test_a_little_less_than_the_whole_is_complete(self):
        assert watch(("play", 0, 0.1), ("ended", 9800, 9.9)).complete
        assert not watch(("play", 0, 0), ("ended", 9600, 9.6)).complete
        assert not watch(("play", 0, 0), ("ended", 800, 0.8), duration_s=1).complete

    def test_an_end_in_the_middle_is_none(self):
        assert watch(("play", 0, 0), ("ended", 3000, 3)).plays == 0
        assert watch(("play", 0, 0), ("ended", 3000, 3), duration_s=None).plays == 1

    def test_a_loop_without_events_counts_what_is_known(self):
        assert watch(("play", 0, 0), ("frames", 4000, 4, 0), ("frames", 12000, 2, 0)).played_s == 4


class TestDuration:
    def test_unknown(self):
        found = watch(("play", 0, 0), ("pause", 5000, 5), duration_s=None)
        assert (found.played_s, found.share, found.complete) == (5, None, False)

    def test_the_page_is_asked_if_nobody_else_knows(self):
        rows = [("duration", 0, 0, 8.0), ("play", 0, 0), ("pause", 4000, 4)]
        assert watch(*rows, duration_s=None).share == 0.5
        assert watch(*rows).share == 0.4

    def test_the_page_cannot_make_it_shorter_than_what_was_played(self):
        rows = [("duration", 0, 0, 1.0), ("play", 0, 0), ("pause", 4000, 4)]
        assert watch(*rows, duration_s=None).played_s == 4

    @pytest.mark.parametrize("wrong", [0, -1, math.nan, math.inf])
    def test_no_duration(self, wrong):
        assert watch(*WHOLE, duration_s=wrong).share is None

    def test_what_lies_beyond_the_end_does_not_count(self):
        found = watch(("play", 0, 0), ("pause", 20000, 20))
        assert (found.played_s, found.share) == (10, 1)


class TestForgery:
    def test_faster_than_time(self):
        assert watch(("play", 0, 0), ("ended", 1000, 10)).played_s == 0

    def test_speed_is_allowed_for(self):
        found = watch(("ratechange", 0, 0, 2.0), ("play", 0, 0), ("ended", 5000, 10))
        assert (found.played_s, found.max_rate, found.min_rate) == (10, 2, 2)

    def test_two_speeds(self):
        found = watch(("play", 0, 0), ("ratechange", 2000, 2, 0.5), ("pause", 6000, 4))
        assert (found.played_s, found.max_rate, found.min_rate) == (4, 1, 0.5)

    def test_speeds_that_no_browser_has_are_not_believed(self):
        for rate in (0, -1, 1000, math.nan, math.inf, None):
            found = watch(("ratechange", 0, 0, rate), ("play", 0, 0), ("ended", 10, 10))
            assert (found.played_s, found.max_rate) == (0, 1)

    def test_tolerance(self):
        just = 2 * FASTER + SLACK_S
        assert watch(("play", 0, 0), ("pause", 2000, just)).played_s == pytest.approx(just)
        assert watch(("play", 0, 0), ("pause", 2000, just + 0.01)).played_s == 0

    def test_tolerances_do_not_add_up(self):
        rows = []
        for step in range(50):
            rows += [("play", step, step * 0.2), ("pause", step, (step + 1) * 0.2)]
        assert watch(*rows).played_s <= 2 * SLACK_S


class TestWaits:
    def test_at_the_start(self):
        found = watch(("play", 0, 0), ("waiting", 100, 0), ("playing", 1600, 0), ("ended", 11600, 10))
        assert (found.stalls, found.stalled_s, found.played_s) == (1, 1.5, 10)

    def test_in_the_middle_until_a_pause(self):
        found = watch(("play", 0, 0), ("waiting", 2000, 2), ("pause", 5000, 2))
        assert (found.stalls, found.stalled_s) == (1, 3)

    def test_the_clip_may_go_on_without_the_network(self):
        found = watch(("play", 0, 0), ("stalled", 2000, 2), ("pause", 5000, 5))
        assert (found.stalls, found.stalled_s, found.played_s) == (1, 0, 5)

    def test_both_events_of_one_wait_are_one(self):
        found = watch(("play", 0, 0), ("waiting", 1000, 1), ("stalled", 3000, 1), ("playing", 4000, 1))
        assert (found.stalls, found.stalled_s) == (1, 3)

    def test_positions_may_be_missing(self):
        found = watch(("play", 0, None), ("waiting", 1000, None), ("playing", 3000, None))
        assert (found.stalls, found.stalled_s) == (1, 2)

    def test_those_of_a_jump_are_not_counted(self):
        found = watch(("play", 0, 0), ("seeking", 1000, 1), ("waiting", 1010, 5), ("seeked", 2000, 5))
        assert (found.stalls, found.stalled_s, found.seeks) == (0, 0, 1)

    def test_those_while_paused_are_not_counted(self):
        assert watch(("stalled", 0, 0), ("visible", 5000, 0)).stalls == 0


def test_hidden_while_playing():
    rows = [("hidden", 0, 0), ("visible", 1000, 0), ("play", 1000, 0), ("hidden", 3000, 2), ("visible", 4500, 3.5)]
    assert watch(*rows, ("pause", 6000, 5)).hidden_s == 1.5


def test_hidden_and_never_seen_again():
    assert watch(("play", 0, 0), ("hidden", 1000, 1), ("pause", 3000, 3), ("play", 9000, 3)).hidden_s == 2


def test_dropped_frames_are_the_most_that_were_stated():
    assert (
        watch(("frames", 0, 0, 3), ("frames", 1, 0, 7), ("frames", 2, 0, 5), ("frames", 3, 0, -9)).dropped_frames == 7
    )


def test_after_an_error_nothing_is_played():
    assert watch(("play", 0, 0), ("error", 1000, 1), ("pause", 5000, 5)).played_s == 1


def test_the_order_of_the_log_does_not_matter():
    assert watch(*reversed([("play", 0, 0), ("pause", 3000, 3), ("play", 4000, 3), ("pause", 5000, 4)])).played_s == 4


def test_no_events():
    found = watch()
    assert (found.played_s, found.share, found.plays, found.max_rate, found.complete) == (0, 0, 0, 1, False)


wild = st.one_of(
    st.floats(), st.integers(), st.none(), st.booleans(), st.text(max_size=3), st.floats(0, 20), st.floats(0, 20_000)
)
nonsense = st.lists(st.builds(PlayEvent, st.sampled_from([*KINDS, "other", None, []]), wild, wild, wild), max_size=40)
sensible = st.lists(
    st.builds(PlayEvent, st.sampled_from(list(KINDS)), st.floats(0, 30_000), st.floats(0, 12), st.floats(0, 20)),
    max_size=60,
)


@settings(deadline=None)
@given(st.one_of(nonsense, sensible), st.one_of(st.none(), st.floats(), st.floats(0.1, 20)))
def test_any_events_give_a_valid_summary(events, duration):
    found = summarise(events, duration_s=duration)
    assert found.share is None or 0 <= found.share <= 1
    assert all(
        math.isfinite(value) and value >= 0
        for value in (found.played_s, found.stalled_s, found.hidden_s, found.dropped_frames, found.seeks, found.stalls)
    )
    assert 0 < found.min_rate <= found.max_rate <= 16
    times = [event.page_ms for event in events if isinstance(event.page_ms, float) and 0 <= event.page_ms <= 1e12]
    if all(isinstance(event.page_ms, float) for event in events):
        page_s = (max(times, default=0) - min(times, default=0)) / 1000
        assert found.hidden_s <= page_s * (1 + 1e-9)
        assert found.stalled_s <= page_s * (1 + 1e-9)
        assert found.played_s <= (page_s * 16 * FASTER + SLACK_S) * (1 + 1e-9)


def test_each_kind_is_understood():
    for kind in KINDS:
        assert watch((kind, 0, 0, 1.0)).played_s == 0


def log_of(sections, start_ms=0.0):
    """Plays sections (from, to) of the clip one after the other, with a pause of a second after each."""
    rows, now = [], start_ms
    for start, end in sections:
        rows += [("seeking", now, start), ("seeked", now, start), ("play", now, start)]
        now += (end - start) * 1000
        rows += [("pause", now, end)]
        now += 1000
    return rows


sections = st.lists(st.tuples(st.integers(0, 80), st.integers(1, 80)), min_size=1, max_size=6).map(
    lambda pairs: [(start / 8, min(10.0, (start + length) / 8)) for start, length in pairs if start < 80]
)


@settings(deadline=None)
@given(sections)
def test_the_union_of_what_was_played(sections):
    eighths = {eighth for start, end in sections for eighth in range(round(start * 8), round(end * 8))}
    assert watch(*log_of(sections)).played_s == pytest.approx(len(eighths) / 8)


@settings(deadline=None)
@given(sections)
def test_watching_twice_counts_once(sections):
    assert watch(*log_of(sections + sections)).played_s == pytest.approx(watch(*log_of(sections)).played_s)


@settings(deadline=None)
@given(st.floats(0.5, 10), st.floats(0.01, 0.99), st.floats(0, 60_000))
def test_a_pause_in_between_changes_nothing(end, part, wait):
    whole = watch(("play", 0, 0), ("pause", end * 1000, end))
    middle = end * part
    split = watch(
        ("play", 0, 0),
        ("pause", middle * 1000, middle),
        ("play", middle * 1000 + wait, middle),
        ("pause", end * 1000 + wait, end),
    )
    assert split.played_s == pytest.approx(whole.played_s)
    assert (split.complete, split.plays, split.stalls) == (whole.complete, whole.plays, whole.stalls)


ROWS = [(kind, at + place / 1000, media) for place, (kind, at, media) in enumerate(log_of([(0, 3), (2, 6), (9, 10)]))]


@settings(deadline=None)
@given(st.permutations(ROWS))
def test_the_log_may_come_in_any_order_of_its_times(rows):
    # Events of one time keep their order, so these have different ones.
    assert watch(*rows).played_s == pytest.approx(7, abs=1e-3)
