import math
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments.emotion14 import EMOTION14
from evaluation.statistics.votes import votes, votes_of_counts

WORDS = {option.value: option.label["en"] for option in EMOTION14.items[0].options}


def test_counts_shares_and_the_majority():
    found = votes({1: "Happy", 2: "Sad", 3: "Angry"}, [1, 3, 1, 1])
    assert (found.counts, found.n, found.shares) == ((3, 0, 1), 4, (0.75, 0.0, 0.25))
    assert (found.majority, found.leading, found.absolute) == ("Happy", ("Happy",), True)
    assert found.summary() == "majority Happy (3 of 4, share .75)"


def test_most_votes_need_not_be_more_than_half():
    found = votes(WORDS, [9, 9, 10, 12])
    assert (found.majority, found.absolute) == ("Angry", False)


def test_a_tie_has_no_majority():
    found = votes(WORDS, [1, 1, 11, 11, 3])
    assert (found.majority, found.leading, found.absolute) == (None, ("Happy", "Optimistic"), False)
    assert found.summary() == "tie of Happy, Optimistic (2 of 5, share .40, each)"


def test_the_frame_has_a_row_for_every_word():
    frame = votes(WORDS, [1, 1, 3]).to_frame()
    assert frame["label"].tolist() == list(WORDS.values())
    assert frame["votes"].sum() == 3
    assert frame.loc[frame["leading"], "label"].tolist() == ["Happy"]
    assert frame["share"].sum() == pytest.approx(1)


@given(st.lists(st.sampled_from(sorted(WORDS)), min_size=1))
def test_as_counted_by_the_standard_library(values):
    found = votes(WORDS, values)
    ranked = Counter(values).most_common()
    assert max(found.counts) == ranked[0][1]
    assert set(found.leading) == {WORDS[value] for value, count in ranked if count == ranked[0][1]}
    assert (found.majority is None) == (len(found.leading) > 1)
    assert math.isclose(sum(found.shares), 1)


def test_bad_votes():
    with pytest.raises(InsufficientDataError, match="no votes"):
        votes(WORDS, [])
    with pytest.raises(DataError, match="a vote for 15, which is no category"):
        votes(WORDS, [1, 15])
    with pytest.raises(DataError, match="a vote for nan"):
        votes(WORDS, [float("nan")])
    with pytest.raises(DataError, match="same name"):
        votes({1: "Happy", 2: "Happy"}, [1])


# Jia et al. (2013), Tables 1 and 4: sentences by prosodic words, and by emotion.
@pytest.mark.parametrize(
    ("counts", "percent"),
    [([8, 50, 7, 17, 12], [8.5, 53.2, 7.4, 18.1, 12.8]), ([15, 26, 22, 31], [16.0, 27.7, 23.4, 33.0])],
)
def test_counts_of_the_paper(counts, percent):
    found = votes_of_counts([f"c{k}" for k in range(len(counts))], counts)
    assert found.n == 94
    assert [100 * share for share in found.shares] == pytest.approx(percent, abs=0.0501)
    assert found.apa() == found.summary()


def test_bad_counts():
    with pytest.raises(DataError, match="2 categories, but 1 counts"):
        votes_of_counts(["a", "b"], [1])
    with pytest.raises(DataError, match="whole number"):
        votes_of_counts(["a", "b"], [1, -1])
    with pytest.raises(DataError, match="whole number"):
        votes_of_counts(["a", "b"], [1, float("nan")])
    with pytest.raises(DataError, match="same name"):
        votes_of_counts(["a", "a"], [1, 1])
    with pytest.raises(InsufficientDataError, match="no votes"):
        votes_of_counts(["a", "b"], [0, 0])


@pytest.mark.parametrize("count", ["5.0", None, math.nan, 1j])
def test_counts_that_are_no_numbers(count):
    with pytest.raises(DataError, match="a has"):
        votes_of_counts(["a"], [count])
