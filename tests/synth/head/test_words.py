import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.head.words import ProsodicWord, Syllable, evenly, units


def word(start_s: float, end_s: float, text: str = "word", **options) -> ProsodicWord:
    return ProsodicWord(text, start_s, end_s, **{"P": 1.0, "A": 0.5, **options})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"text": " "}, "text is ' '"),
        ({"start_s": -0.1}, "starts at -0.1 s"),
        ({"end_s": 0.0}, "must end after its start"),
        ({"end_s": math.nan}, "end_s is nan"),
        ({"start_s": "0"}, "start_s is '0'"),
        ({"P": 1.1}, "P is 1.1"),
        ({"A": math.inf}, "A is inf"),
        ({"A": True}, "A is True"),
        ({"syllables": (Syllable("a", 0.0, 0.6), Syllable("b", 0.5, 1.0))}, "'b' starts at 0.5 s, before 'a' ends"),
        ({"syllables": (Syllable("a", 0.5, 1.1),)}, "must lie inside the word, 0 to 1 s"),
    ],
)
def test_malformed_words_are_refused(change, message):
    with pytest.raises(SpecError, match=message):
        ProsodicWord(**{"text": "a", "start_s": 0.0, "end_s": 1.0, "P": 0.0, "A": 0.0, **change})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"text": ""}, "text is ''"),
        ({"tone": 6}, "tone is 6"),
        ({"tone": True}, "tone is True"),
        ({"stressed": 1}, "stressed"),
    ],
)
def test_malformed_syllables_are_refused(change, message):
    with pytest.raises(SpecError, match=message):
        Syllable(**{"text": "a", "start_s": 0.0, "end_s": 1.0, **change})


def test_words_and_pauses_share_the_frames():
    spoken = [word(0.4, 1.0, "one"), word(1.08, 1.4, "two"), word(2.0, 2.4, "three")]
    found = units(spoken, fps=25, frames=75)
    assert [(unit.word.text if unit.word else "", unit.start, unit.stop) for unit in found] == [
        ("", 0, 10),
        ("one", 10, 27),  # with the gap of two frames
        ("two", 27, 35),
        ("", 35, 50),
        ("three", 50, 60),
        ("", 60, 75),
    ]
    assert {(unit.P, unit.A) for unit in found if unit.word is None} == {(0.0, -0.5)}
    assert {(unit.P, unit.A) for unit in found if unit.word is not None} == {(1.0, 0.5)}


def test_short_gaps_at_both_ends_belong_to_words():
    (unit,) = units([word(0.1, 1.0)], fps=25, frames=27)
    assert (unit.start, unit.stop) == (0, 27)


def test_words_too_short_for_a_frame_are_left_out():
    found = units([word(0.0, 1.0), word(1.001, 1.002, "click"), word(1.01, 2.0)], fps=25, frames=50)
    assert [(unit.word.text, unit.frames) for unit in found] == [("word", 26), ("word", 24)]


@given(
    lengths=st.lists(st.tuples(st.floats(0.0, 0.7), st.floats(0.01, 1.5)), max_size=12),
    fps=st.sampled_from([10, 24, 25, 29.97, 60]),
    tail=st.integers(0, 30),
)
def test_every_frame_belongs_to_one_unit(lengths, fps, tail):
    spoken, now = [], 0.0
    for gap, length in lengths:
        spoken.append(word(now + gap, now + gap + length))
        now += gap + length
    frames = math.ceil(now * fps) + tail
    found = units(spoken, fps=fps, frames=frames)
    edges = [unit.start for unit in found] + [found[-1].stop] if found else [0, frames]
    assert edges[0] == 0
    assert edges[-1] == frames
    assert [unit.stop for unit in found] == edges[1:] if found else frames == 0
    assert all(unit.frames > 0 for unit in found)


def test_words_must_be_in_order_and_fit():
    with pytest.raises(SpecError, match=r"'b' starts at 0.5 s, before 'a' ends at 1 s"):
        units([word(0, 1, "a"), word(0.5, 2, "b")], fps=25, frames=100)
    with pytest.raises(SpecError, match=r"ends at 2 s, but the sequence is over after 1.6 s"):
        units([word(0, 2)], fps=25, frames=40)
    with pytest.raises(SpecError, match="not a prosodic word"):
        units(["word"], fps=25, frames=40)


def test_even_syllables_touch():
    found = evenly([("a", 4, False), ("b", None, True), ("c", 5, False)], 1.0, 2.2)
    assert [part.end_s for part in found[:-1]] == [part.start_s for part in found[1:]]
    assert (found[0].start_s, found[-1].end_s) == (1.0, 2.2)
    assert [part.falling for part in found] == [True, False, False]
