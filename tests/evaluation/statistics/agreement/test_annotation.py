import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.annotation import annotation_agreement, deviation

seeds = st.integers(0, 2**32)

# Three raters, four items, one dimension; the correlations are 1 (1 and 2), 0.6 (1 and 3) and 0.6 (2 and 3).
BY_HAND = np.array([[1, 2, 2], [2, 4, 1], [3, 6, 4], [4, 8, 3]], dtype=float)[:, :, None]


def test_by_hand():
    found = annotation_agreement(BY_HAND, dimensions=["P"])["P"]
    assert found.correlations == pytest.approx(np.array([[1, 1, 0.6], [1, 1, 0.6], [0.6, 0.6, 1]]))
    assert found.pairwise_r == pytest.approx((1 + 0.6 + 0.6) / 3)
    variances = [1 / 3, 7 / 3, 7 / 3, 7]
    assert found.sd == pytest.approx(np.mean(np.sqrt(variances)))
    assert (found.items, found.raters, found.constant_raters) == (4, 3, ())


def test_the_sentence_and_the_frame():
    found = annotation_agreement(BY_HAND, dimensions=["P"])
    assert found.apa() == found.summary() == "P: SD = 1.57, mean pairwise r = .73 (largest p = .400)"
    row = found.to_frame().iloc[0]
    assert (row["dimension"], row["items"], row["pairwise_r"]) == ("P", 4, found["P"].pairwise_r)


@given(seeds, st.integers(3, 20), st.integers(2, 6))
def test_it_agrees_with_scipy_pair_by_pair(seed, items, raters):
    rng = np.random.default_rng(seed)
    ratings = rng.normal(size=(items, 1, 3)) + rng.normal(size=(items, raters, 3))
    found = annotation_agreement(ratings)
    for place, name in enumerate("PAD"):
        pairs = [(i, j) for i in range(raters) for j in range(i)]
        expected = [stats.pearsonr(ratings[:, i, place], ratings[:, j, place]) for i, j in pairs]
        agreement = found[name]
        assert agreement.pairwise_r == pytest.approx(np.mean([one.statistic for one in expected]), abs=1e-12)
        assert agreement.largest_p == pytest.approx(max(one.pvalue for one in expected), rel=1e-6, abs=1e-12)
        assert agreement.sd == pytest.approx(np.std(ratings[:, :, place], axis=1, ddof=1).mean())


@given(seeds, st.floats(0.1, 10), st.floats(-5, 5))
def test_the_order_of_raters_and_the_scale_of_one_of_them_do_not_matter_to_r(seed, scale, shift):
    rng = np.random.default_rng(seed)
    ratings = rng.normal(size=(10, 4, 1))
    other = ratings[:, ::-1].copy()
    other[:, 1] = scale * other[:, 1] + shift
    one, two = (annotation_agreement(values, dimensions=["x"])["x"] for values in (ratings, other))
    assert two.pairwise_r == pytest.approx(one.pairwise_r, abs=1e-10)


def test_raters_who_agree_completely():
    item = np.random.default_rng(1).normal(size=(6, 1, 3)) + 0.1
    found = annotation_agreement(np.repeat(item, 5, axis=1))
    assert found["D"].sd == 0
    assert found["D"].pairwise_r == pytest.approx(1)
    assert found["D"].largest_p == pytest.approx(0, abs=1e-20)
    assert "each pair p < .001" in found.summary()


class TestConstantRaters:
    def test_they_are_named_and_their_pairs_left_out(self):
        constant = np.full((4, 1, 1), 0.5)
        found = annotation_agreement(np.concatenate([BY_HAND[:, :2], constant, BY_HAND[:, 2:]], axis=1), dimensions="P")
        agreement = found["P"]
        assert agreement.constant_raters == (3,)
        assert agreement.pairwise_r == pytest.approx((1 + 0.6 + 0.6) / 3)
        assert np.isnan(agreement.correlations[2]).all()
        assert agreement.summary().endswith("raters who gave one rating throughout, left out of r: 3.")
        assert found.flags == agreement.flags
        # The deviation is over all raters, the constant one among them.
        assert agreement.sd == pytest.approx(
            np.std([[1, 2, 0.5, 2], [2, 4, 0.5, 1], [3, 6, 0.5, 4], [4, 8, 0.5, 3]], axis=1, ddof=1).mean()
        )

    def test_with_fewer_than_two_others_there_is_no_correlation(self):
        ratings = np.zeros((4, 2, 1))
        ratings[:, 1, 0] = [1, 2, 3, 4]
        found = annotation_agreement(ratings, dimensions=["P"])
        assert found["P"].pairwise_r is None
        assert found["P"].largest_p is None
        assert "fewer than two raters vary" in found.summary()
        assert math.isnan(found.to_frame().iloc[0]["pairwise_r"])


def test_deviation():
    assert deviation([[[0.1, 1], [0.1, 2]], [[0.3, 5], [0.3, 5]]]) == pytest.approx(
        np.array([[0, math.sqrt(0.5)], [0, 0]])
    )
    assert (deviation(np.full((3, 4, 2), 0.1)) == 0).all()
    assert deviation(np.empty((0, 4, 2))).shape == (0, 2)


def test_bad_input():
    ratings = np.random.default_rng(1).normal(size=(6, 3, 3))
    with pytest.raises(DataError, match="items x raters x dimensions"):
        annotation_agreement(ratings[:, :, 0])
    with pytest.raises(DataError, match="3 dimensions, but 2 names"):
        annotation_agreement(ratings, dimensions=["P", "A"])
    with pytest.raises(DataError, match="missing or infinite"):
        annotation_agreement(np.where(ratings == ratings[2, 1, 0], math.nan, ratings))
    with pytest.raises(DataError, match="no dimension 'V'; there are P, A, D"):
        annotation_agreement(ratings)["V"]
    with pytest.raises(InsufficientDataError, match="there are 2 items and 3 raters"):
        annotation_agreement(ratings[:2])
    with pytest.raises(InsufficientDataError, match="there are 6 items and 1 raters"):
        annotation_agreement(ratings[:, :1])
    with pytest.raises(InsufficientDataError, match="at least two raters"):
        deviation(ratings[:, :1])
