import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.pad import PAD, emotion_words, nearest_word

inside = st.floats(-1.0, 1.0)
outside = st.one_of(st.floats(min_value=1.0, exclude_min=True), st.floats(max_value=-1.0, exclude_max=True))


@given(inside, inside, inside)
def test_values_in_range_are_kept(p, a, d):
    assert PAD(p, a, d).as_tuple() == (p, a, d)


@given(st.permutations([0, 1, 2]), outside, inside, inside)
def test_a_value_out_of_range_is_named(order, bad, good, fine):
    values = [(bad, good, fine)[k] for k in order]
    with pytest.raises(SpecError, match=f"PAD: {'PAD'[order.index(0)]} is .* from -1 to 1"):
        PAD(*values)


@pytest.mark.parametrize("bad", [math.nan, math.inf, "0.5", None, True])
def test_what_is_no_number_is_refused(bad):
    with pytest.raises(SpecError, match="A is"):
        PAD(0.0, bad, 0.0)


@pytest.mark.parametrize("bad", [[0.1, 0.2], [0, 0, 0, 0], "abc", None, {"P": 1, "A": 0, "D": 0}])
def test_parse_wants_three_numbers(bad):
    with pytest.raises(SpecError, match="three"):
        PAD.parse(bad)


def test_minus_zero_is_written_as_zero():
    assert str(PAD(-0.0, 0, -0.0)) == str(PAD(0, 0, 0))


def test_words_of_table_8():
    # MTAP 2013, Table 8: the count, the order, and values of the first, a middle and the last row.
    words = emotion_words()
    assert len(words) == 14
    assert next(iter(words)) == "Happy"
    assert words["Happy"].as_tuple() == (0.55, 0.24, 0.28)
    assert words["Angry"].as_tuple() == (-0.40, 0.22, 0.12)
    assert words["Dependent"].as_tuple() == (0.08, -0.16, -0.30)


def test_sums_of_table_8():
    # Column sums added up by hand from the printed table: one mistyped digit changes them.
    sums = [sum(getattr(pad, name) for pad in emotion_words().values()) for name in "PAD"]
    assert sums == pytest.approx([0.05, 1.00, 0.76])


def test_the_nearest_word_of_a_word_is_itself():
    assert all(nearest_word(pad) == word for word, pad in emotion_words().items())


def test_nearest_word_of_a_point_between():
    assert nearest_word(PAD(0.9, 0.5, 0.5)) == "Happy"
    assert nearest_word(PAD(-0.1, -0.9, -0.2)) == "Boring"
