import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics.leave_one_out import deviations, leave_one_out, leave_one_out_correlation

seeds = st.integers(0, 2**32)


def simulated(seed, items=60, raters=8, missing=0.0):
    rng = np.random.default_rng(seed)
    quality, bias = rng.uniform(1, 5, items), rng.normal(0, 0.5, raters)
    ratings = quality[:, None] + bias + rng.uniform(0.3, 1, raters) * rng.normal(size=(items, raters))
    ratings[rng.random(ratings.shape) < missing] = np.nan
    return ratings


class TestLeaveOneOutCorrelation:
    @settings(deadline=None)
    @given(seeds, st.integers(2, 6), st.sampled_from([0.0, 0.3]))
    def test_against_loops(self, seed, raters, missing):
        ratings = simulated(seed, items=20, raters=raters, missing=missing)
        found = leave_one_out_correlation(ratings)
        for rater in range(raters):
            others = np.delete(ratings, rater, axis=1)
            rows = ~np.isnan(ratings[:, rater]) & (~np.isnan(others)).any(axis=1)
            expected = np.corrcoef(ratings[rows, rater], np.nanmean(others[rows], axis=1))[0, 1]
            assert found[rater] == pytest.approx(expected, abs=1e-9)

    def test_who_does_not_vary_has_none(self):
        found = leave_one_out_correlation([[1, 3, 2], [2, 3, 3], [3, 3, 1], [4, 3, 5]])
        assert math.isnan(found[1])
        assert not np.isnan(found[[0, 2]]).any()

    def test_two_items_are_too_few(self):
        assert np.isnan(leave_one_out_correlation([[1, 2], [2, 1]])).all()

    def test_perfect(self):
        assert leave_one_out_correlation([[1, 10], [2, 20], [3, 30]]) == pytest.approx([1, 1])


class TestDeviations:
    @settings(deadline=None)
    @given(seeds)
    def test_complete_ratings(self, seed):
        ratings = simulated(seed)
        assert deviations(ratings) == pytest.approx(ratings.mean(axis=0) - ratings.mean())

    def test_it_does_not_depend_on_which_items_a_rater_got(self):
        assert deviations([[1, 1, np.nan], [5, np.nan, 5], [np.nan, 3, 3]]) == pytest.approx([0, 0, 0])

    def test_items_rated_alone_tell_nothing(self):
        assert np.isnan(deviations([[1, np.nan], [np.nan, 2]])).all()


class TestLeaveOneOut:
    def test_p_and_interval_are_scipys(self):
        ratings = simulated(1, items=25, raters=5)
        found = leave_one_out(ratings, confidence=0.9)
        for rater in range(5):
            expected = stats.pearsonr(ratings[:, rater], np.delete(ratings, rater, axis=1).mean(axis=1))
            low, high = expected.confidence_interval(0.9)
            assert (found.r[rater], found.p[rater]) == pytest.approx((expected.statistic, expected.pvalue))
            assert (found.ci_low[rater], found.ci_high[rater]) == pytest.approx((low, high))
        assert found.to_frame()["n"].tolist() == [25] * 5
        assert found.apa().startswith("Correlation of 5 raters with the mean of the others: Mdn r = .")
        assert not found.flags

    def test_who_has_none_is_flagged(self):
        found = leave_one_out([[1, 3, 2], [2, 3, 3], [3, 3, 1]])
        assert math.isnan(found.p[1])
        assert found.flags[0].startswith("1 of 3 raters have no correlation")
        # Three items give no interval.
        assert np.isnan(found.ci_low).all()
        nobody = leave_one_out([[1, 1], [1, 1]])
        assert nobody.apa() == "None of 2 raters has a correlation with the mean of the others"

    def test_perfect_agreement(self):
        found = leave_one_out([[1, 10], [2, 20], [3, 30], [4, 40]])
        assert (found.ci_low.tolist(), found.ci_high.tolist()) == ([1, 1], [1, 1])

    def test_bad_confidence(self):
        with pytest.raises(DataError, match="between 0 and 1"):
            leave_one_out([[1, 2]], confidence=95)


def test_three_items_give_no_interval():
    found = leave_one_out([[5, 4], [3, 2], [2, 1.5]])
    assert np.isfinite(found.r).all() and np.isnan(found.ci_low).all()
    assert found.flags == ("2 of 2 raters have no interval: that needs four shared items.",)
