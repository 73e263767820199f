import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.annotation.consensus import consensus
from evaluation.errors import DataError, InsufficientDataError

NOTHING = math.nan


@st.composite
def tables(draw):
    """Labels of 1 to 15 samples by 2 to 6 raters, some missing, but not all."""
    raters = draw(st.integers(2, 6))
    row = st.lists(st.sampled_from([*"abcd", None]), min_size=raters, max_size=raters)
    labels = draw(st.lists(row, min_size=1, max_size=15))
    labels[0][0] = "a"
    return labels


@pytest.mark.parametrize(
    ("labels", "agree", "value"),
    [
        ([1, 1, 0], 2, 1),
        ([1, 1, 1], 2, 1),
        ([-1, 0, 1], 2, None),
        ([1, 1, 0], 3, None),
        ([0, 0, 0], 3, 0),
        # Two labels that are equally frequent: nobody prevails.
        ([1, 1, 0, 0], 2, None),
        ([1, 1, 0, -1], 2, 1),
        ([1, 1, 0, 0, -1], 2, None),
        ([1, 1, 0, 0, 0], 2, 0),
        ([1, 1, 0, 0, -1, -1], 2, None),
        # Missing labels agree with nothing, and not with each other.
        ([1, NOTHING, NOTHING], 2, None),
        ([1, NOTHING, 1], 2, 1),
        ([NOTHING, NOTHING, NOTHING], 2, None),
    ],
)
def test_when_there_is_a_consensus(labels, agree, value):
    found = consensus([labels], agree=agree)
    assert found.agreed.tolist() == [value is not None]
    assert found.disputed.tolist() == ([0] if value is None else [])
    assert found.share == (value is not None)
    assert found.values.tolist() == pytest.approx([math.nan if value is None else value], nan_ok=True)


@given(tables(), st.integers(2, 3))
def test_it_is_the_count_of_each_sample(labels, agree):
    if len(labels[0]) < agree:
        agree = 2
    found = consensus(labels, agree=agree)
    for place, row in enumerate(labels):
        ranking = Counter(label for label in row if label is not None).most_common()
        votes = ranking[0][1] if ranking else 0
        winners = [label for label, number in ranking if number == votes]
        agreed = votes >= agree and len(winners) == 1
        assert found.votes[place] == votes
        assert found.given[place] == sum(label is not None for label in row)
        assert found.agreed[place] == agreed
        assert found.values[place] == (winners[0] if agreed else None)
    assert found.disputed.tolist() == np.flatnonzero(~found.agreed).tolist()
    assert found.share == pytest.approx(found.agreed.mean())


@given(tables(), st.randoms())
def test_the_order_of_raters_does_not_matter(labels, random):
    order = list(range(len(labels[0])))
    random.shuffle(order)
    one, other = consensus(labels), consensus([[row[place] for place in order] for row in labels])
    assert one.values.tolist() == other.values.tolist()
    assert one.votes.tolist() == other.votes.tolist()


class TestItems:
    # P and A of three words by three raters; the raters agree on both of the first, on P alone of the second.
    LABELS = ([[1, 0], [1, 0.5], [0, 0.5]], [[0, 0], [0, 0.5], [0, 1]], [[-1, 1], [-1, 1], [-1, 1]])

    def test_one_disputed_item_disputes_the_sample(self):
        found = consensus(self.LABELS, items=["P", "A"])
        assert found.disputed.tolist() == [1]
        assert found.agreed.tolist() == [[True, True], [True, False], [True, True]]
        assert found.values == pytest.approx(np.array([[1, 0.5], [0, math.nan], [-1, 1]]), nan_ok=True)
        assert found.share == pytest.approx(2 / 3)
        assert found.summary() == (
            "At least 2 of 3 raters agree on 2 of 3 samples (67%); 1 are disputed. By item: P 100%, A 67%."
        )

    def test_the_frame(self):
        frame = consensus(self.LABELS, items=["P", "A"]).to_frame()
        assert frame["sample"].tolist() == [0, 0, 1, 1, 2, 2]
        assert frame["item"].tolist() == ["P", "A"] * 3
        assert frame["votes"].tolist() == [2, 2, 3, 1, 3, 3]
        assert frame["agreed"].tolist() == [True, True, True, False, True, True]
        assert math.isnan(frame["value"][3])

    def test_one_item_is_as_none(self):
        one, other = consensus([[1, 1, 0], [0, 1, 2]]), consensus([[[1], [1], [0]], [[0], [1], [2]]])
        assert one.values.shape == (2,)
        assert other.values.shape == (2, 1)
        assert one.summary() == other.summary()
        assert one.to_frame().equals(other.to_frame())


def test_the_papers_share():
    # 88 of the 94 prosodic words are the only number that is 94 % of them.
    labels = [[0, 1, 1]] * 88 + [[-1, 0, 1]] * 6
    assert consensus(labels).summary() == "At least 2 of 3 raters agree on 88 of 94 samples (94%); 6 are disputed."


def test_what_is_short_of_all_is_not_written_as_all():
    assert "(99.8%)" in consensus([[1, 1]] * 499 + [[1, 2]]).summary()
    assert "(100%)" in consensus([[1, 1]] * 500).summary()


def test_numbers_and_words_beside_each_other():
    assert consensus([["x", 1, 1], ["x", "x", None]]).values.tolist() == [1, "x"]


def test_bad_labels():
    with pytest.raises(DataError, match="must have samples x raters"):
        consensus([1, 2, 3])
    with pytest.raises(DataError, match="must have samples x raters"):
        consensus([[1, 2], [3]])
    with pytest.raises(DataError, match="agree is 1"):
        consensus([[1, 2]], agree=1)
    with pytest.raises(DataError, match="2 items, but 1 names"):
        consensus(np.zeros((1, 2, 2)), items=["P"])
    with pytest.raises(InsufficientDataError, match="1 samples, 2 raters"):
        consensus([[1, 2]], agree=3)
    with pytest.raises(InsufficientDataError, match="0 samples"):
        consensus(np.zeros((0, 3)))
