import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.text.syllabification import syllable_count, written_syllables


@pytest.mark.parametrize(
    "parted",
    [
        *("beau-ti-ful", "mid-dle", "ta-bles", "cre-ate", "sci-ence", "re-ci-pe", "Vic-to-ri-a", "some-thing"),
        *("hap-pened", "wan-ted", "walked", "queen-ly", "har-bour", "at-trac-tion", "pho-to-graph", "mis-ter"),
        *("qui-et", "U-S-A", "be-ing"),
    ],
)
def test_letters_of_syllables(parted):
    assert written_syllables(parted.replace("-", ""), parted.count("-") + 1) == parted.split("-")


def test_what_cannot_be_parted_is_left_empty():
    assert written_syllables("rhythm", 2) == ["", ""]


@given(st.text("abcdeghilnoqrstuwy'é", min_size=1), st.integers(1, 6))
def test_syllables_are_the_word(word, count):
    parts = written_syllables(word, count)
    assert len(parts) == count
    assert "".join(parts) in (word, "")
    assert all(parts) or not any(parts)
    assert syllable_count(word) >= 1
