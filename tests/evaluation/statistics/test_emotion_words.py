import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import distance

from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments.emotion14 import EMOTION14
from evaluation.statistics.emotion_words import MTAP_2013_WORDS, nearest_words
from evaluation.study import load_bundled

SQUARE = {"a": (0, 0), "b": (1, 0), "c": (0, 1), "d": (1, 1)}


def test_the_table_is_that_of_the_bundled_study_and_the_instrument(case):
    stimuli = load_bundled("mtap-2013-reverse-pad").stimuli
    assert {one.label["en"]: tuple(one.clip["pad"]) for one in stimuli} == dict(MTAP_2013_WORDS)
    assert [option.label["en"] for option in EMOTION14.items[0].options] == list(MTAP_2013_WORDS)
    assert list(MTAP_2013_WORDS.values()) == [tuple(row) for row in case("mtap2013_table8")["data"]["input"]]


def test_each_word_is_nearest_to_itself():
    for metric in ("euclidean", "mahalanobis"):
        found = nearest_words(list(MTAP_2013_WORDS.values()), metric=metric)
        assert found.nearest == tuple((word,) for word in MTAP_2013_WORDS)
        assert found.distance == pytest.approx(np.zeros(14))
        assert not found.flags


def test_a_single_point():
    found = nearest_words([0.5, 0.2, 0.3])
    assert found.nearest == (("Optimistic",),)
    assert found.distance[0] == pytest.approx(math.hypot(0.01, 0.05))
    assert found.apa() == "Nearest word: Optimistic (Euclidean distance 0.05)"


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32))
def test_distances_are_scipys(seed):
    points = np.random.default_rng(seed).uniform(-1, 1, (4, 3))
    words = np.array(list(MTAP_2013_WORDS.values()))
    assert nearest_words(points).distances == pytest.approx(distance.cdist(points, words))
    spread = np.cov(points.T) + 0.1 * np.eye(3)
    for given_spread, used in ((None, np.cov(words.T)), (spread, spread)):
        found = nearest_words(points, metric="mahalanobis", covariance=given_spread)
        expected = distance.cdist(points, words, "mahalanobis", VI=np.linalg.inv(used))
        assert found.distances == pytest.approx(expected)
        assert found.nearest == tuple((found.words[k],) for k in expected.argmin(axis=1))


def test_ties():
    found = nearest_words([[0.5, 0], [0.9, 0.9], [0.5, 0.5]], SQUARE)
    assert found.nearest == (("a", "b"), ("d",), ("a", "b", "c", "d"))
    assert found.tied == (True, False, True)
    assert found.to_frame()["word"].tolist() == ["a/b", "d", "a/b/c/d"]
    assert found.flags == ("2 of 3 points are equally near to several words.",)
    assert found.apa() == "3 points are nearest to 4 of 4 words, at a mean Euclidean distance of 0.45"


def test_bad_input():
    with pytest.raises(DataError, match="no words"):
        nearest_words([0, 0], {})
    with pytest.raises(DataError, match="2 dimensions, but the words have 3"):
        nearest_words([0, 0])
    with pytest.raises(DataError, match="missing or infinite"):
        nearest_words([0, math.nan, 0])
    with pytest.raises(DataError, match="no points"):
        nearest_words(np.zeros((0, 3)))
    with pytest.raises(DataError, match="not all numbers"):
        nearest_words([0, 0], {"a": (0, 1), "b": (1,)})
    with pytest.raises(DataError, match="metric"):
        nearest_words([0, 0], SQUARE, metric="cosine")
    with pytest.raises(DataError, match="Mahalanobis distance alone"):
        nearest_words([0, 0], SQUARE, covariance=np.eye(2))
    with pytest.raises(DataError, match="symmetric"):
        nearest_words([0, 0], SQUARE, metric="mahalanobis", covariance=[[1, 0.5], [0, 1]])
    with pytest.raises(DataError, match="positive definite"):
        nearest_words([0, 0], SQUARE, metric="mahalanobis", covariance=[[1, 1], [1, 1]])
    with pytest.raises(InsufficientDataError, match="no spread"):
        nearest_words([0, 0], {"a": (0, 0), "b": (1, 1), "c": (2, 2)}, metric="mahalanobis")
