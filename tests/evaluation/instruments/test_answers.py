import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.instruments.answers import ItemError, is_missing, one_of, shown


@given(st.lists(st.integers(-999, 999), min_size=1, unique=True), st.data())
def test_each_answer_offered_is_read_from_text_and_from_json(values, data):
    value = data.draw(st.sampled_from(values))
    assert one_of(value, values) == one_of(str(value), values) == value


@given(st.lists(st.integers(-99, 99), min_size=1, unique=True), st.integers(-120, 120))
def test_others_are_refused_with_those_offered(values, other):
    if other in values:
        return
    with pytest.raises(ItemError, match=f"{other} is not one of the answers offered") as caught:
        one_of(other, values)
    gaps = len(values) < max(values) - min(values) + 1
    expected = (
        "one of " + ", ".join(map(str, values)) if gaps else f"a whole number from {min(values)} to {max(values)}"
    )
    assert caught.value.right == expected


def test_zero_is_an_answer_and_nothing_is_none():
    assert one_of("0", [0, 1]) == one_of(0, [0, 1]) == 0
    assert [is_missing(raw) for raw in (None, "", 0, "0", False, [])] == [True, True, False, False, False, False]


def test_long_answers_are_cut_off_in_messages():
    assert shown("abc") == "'abc'"
    assert len(shown("x" * 1000)) == 60
    assert shown(10**5000) == "the number"
