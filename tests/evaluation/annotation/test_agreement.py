import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from evaluation.annotation.agreement import round_agreement
from evaluation.annotation.missing import array_with_gaps, known_deviation
from evaluation.errors import DataError
from evaluation.statistics.agreement.annotation import annotation_agreement, deviation

seeds = st.integers(0, 2**32)
NOTHING = math.nan


def with_gaps(seed, samples, raters, missing):
    rng = np.random.default_rng(seed)
    ratings = rng.normal(size=(samples, 1, 2)) + rng.normal(size=(samples, raters, 2))
    ratings[rng.random(ratings.shape) < missing] = NOTHING
    return ratings


@given(seeds, st.integers(3, 15), st.integers(2, 5))
def test_of_complete_ratings_it_is_annotation_agreement(seed, samples, raters):
    ratings = with_gaps(seed, samples, raters, 0)
    found, expected = round_agreement(ratings, dimensions="PA"), annotation_agreement(ratings, dimensions="PA")
    assert (found.samples, found.raters, found.missing) == (samples, raters, 0)
    for name in "PA":
        assert found[name].sd == pytest.approx(expected[name].sd)
        assert found[name].pairwise_r == pytest.approx(expected[name].pairwise_r)
        assert found[name].largest_p == pytest.approx(expected[name].largest_p)
        assert found[name].flags == ()
        assert found[name].summary() == expected[name].summary()


@given(seeds, st.integers(1, 15), st.integers(1, 6), st.sampled_from([0.1, 0.3, 0.6]))
def test_with_gaps_it_is_scipy_pair_by_pair(seed, samples, raters, missing):
    ratings = with_gaps(seed, samples, raters, missing)
    found = round_agreement(ratings, dimensions="PA")
    for place, name in enumerate("PA"):
        table = ratings[:, :, place]
        results = []
        for i in range(raters):
            for j in range(i):
                both = ~np.isnan(table[:, [i, j]]).any(axis=1)
                if both.sum() >= 3:
                    results.append(stats.pearsonr(table[both, i], table[both, j]))
                    assert found[name].correlations[i, j] == pytest.approx(results[-1].statistic, abs=1e-9)
                    assert found[name].p_values[j, i] == pytest.approx(results[-1].pvalue, rel=1e-5, abs=1e-9)
                else:
                    assert math.isnan(found[name].correlations[i, j])
        assert found[name].pairs == len(results)
        if results:
            assert found[name].pairwise_r == pytest.approx(np.mean([one.statistic for one in results]), abs=1e-9)
            assert found[name].largest_p == pytest.approx(max(one.pvalue for one in results), rel=1e-5, abs=1e-9)
        else:
            assert found[name].pairwise_r is None
        rows = [row[~np.isnan(row)] for row in table]
        spreads = [np.std(row, ddof=1) for row in rows if row.size >= 2]
        assert found[name].sd_samples == len(spreads)
        assert found[name].sd == (pytest.approx(np.mean(spreads)) if spreads else None)


class TestFlags:
    def test_one_rater(self):
        found = round_agreement([[[1], [NOTHING]], [[2], [NOTHING]], [[3], [NOTHING]]], dimensions=["P"])
        assert (found.samples, found.raters, found.missing) == (3, 1, 0)
        assert (found["P"].sd, found["P"].pairwise_r, found["P"].largest_p) == (None, None, None)
        assert found["P"].flags == (
            "no sample has two ratings, so there is no SD",
            "fewer than two raters, so there is no correlation",
        )

    def test_nobody(self):
        for empty in (np.empty((0, 3, 1)), np.empty((3, 0, 1)), np.full((3, 2, 1), NOTHING)):
            found = round_agreement(empty, dimensions=["P"])
            assert (found.samples, found.raters, found.missing) == (0, 0, 0)
            assert len(found["P"].flags) == 2
            assert "nothing can be computed" in found.summary()

    def test_constant_raters_are_named_and_left_out(self):
        ratings = np.array([[1, 5, 2, NOTHING], [2, 5, 4, 3], [3, 5, NOTHING, 1], [5, 5, 7, 2], [1, 5, 1, 4]])
        found = round_agreement(ratings[:, :, None], dimensions=["P"])["P"]
        assert found.constant_raters == (2,)
        assert (found.pairs, found.possible_pairs) == (3, 6)
        assert np.isnan(found.correlations[1]).all()
        assert found.flags == (
            "3 of 6 pairs of raters have no correlation, since one does not vary or they share fewer than 3 samples",
            "raters who gave one rating throughout: 2",
        )

    def test_fresh_raters_who_share_too_few_samples(self):
        # Each of six raters rated two of the six samples.
        ratings = np.full((6, 6, 1), NOTHING)
        for rater in range(6):
            ratings[[rater, (rater + 1) % 6], rater] = [[rater], [rater + 2.0]]
        found = round_agreement(ratings, dimensions=["P"])
        assert found["P"].sd is not None
        assert found["P"].pairwise_r is None
        assert found["P"].flags[0].startswith("15 of 15 pairs")
        assert found.missing == 24

    def test_two_samples_have_a_deviation_and_no_correlation(self):
        found = round_agreement([[[1], [2]], [[3], [5]]], dimensions=["P"])["P"]
        assert found.sd == pytest.approx((math.sqrt(0.5) + math.sqrt(2)) / 2)
        assert (found.pairwise_r, found.pairs, found.possible_pairs) == (None, 0, 1)


def test_the_frame_and_the_sentence():
    ratings = np.array([[1, 2, NOTHING], [2, 4, 1], [3, 6, 4], [4, 8, 3], [NOTHING, 1, 2]])[:, :, None]
    found = round_agreement(ratings, dimensions=["P"])
    row = found.to_frame().iloc[0]
    assert (row["dimension"], row["samples"], row["raters"], row["pairs"]) == ("P", 5, 3, 3)
    assert (row["sd"], row["pairwise_r"], row["flags"]) == (found["P"].sd, found["P"].pairwise_r, "")
    assert found.summary().startswith("5 samples, 3 raters, 2 ratings missing\nP: SD = ")
    nothing = round_agreement(np.empty((0, 3, 1)), dimensions=["P"]).to_frame().iloc[0]
    assert math.isnan(nothing["sd"])
    assert math.isnan(nothing["pairwise_r"])


class TestKnownDeviation:
    @given(seeds, st.integers(0, 10), st.integers(0, 5), st.sampled_from([0, 0.3, 0.8]))
    def test_it_is_over_those_that_are_there(self, seed, samples, raters, missing):
        ratings = with_gaps(seed, samples, raters, missing)
        found = known_deviation(ratings)
        assert found.shape == (samples, 2)
        for i, k in np.ndindex(samples, 2):
            there = ratings[i, ~np.isnan(ratings[i, :, k]), k]
            expected = np.std(there, ddof=1) if there.size >= 2 else NOTHING
            assert found[i, k] == pytest.approx(expected, nan_ok=True)

    def test_who_agree_have_none(self):
        assert known_deviation([[[0.1], [None], [0.1]]]).tolist() == [[0]]
        complete = np.random.default_rng(1).normal(size=(5, 3, 2))
        assert (known_deviation(complete) == deviation(complete)).all()


def test_bad_ratings():
    with pytest.raises(DataError, match="samples x raters x dimensions"):
        array_with_gaps([[1, 2]])
    with pytest.raises(DataError, match="not all numbers"):
        array_with_gaps([[["a"]]])
    with pytest.raises(DataError, match="missing or infinite"):
        array_with_gaps([[[math.inf], [NOTHING]]])
    with pytest.raises(DataError, match="1 dimensions, but 3 names"):
        round_agreement([[[1], [2]]])
    with pytest.raises(DataError, match="no dimension 'V'; there are P"):
        round_agreement([[[1], [2]]], dimensions=["P"])["V"]
