import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.bootstrap_mean import bca_intervals
from evaluation.statistics.bounded_interval import binomial_interval, bounded_interval, bounded_table

METHODS = ("binomial", "wilson", "bootstrap")
votes = st.lists(st.integers(1, 5), min_size=1, max_size=30)


def by_enumeration(values, confidence=0.95):
    """BCa limits from all resamples there are."""
    values = np.array(values, dtype=float)
    rest, n = values - values.mean(), values.size
    means = np.sort(np.round([np.mean(one) for one in itertools.product(rest, repeat=n)], 9))
    correction = stats.norm.ppf(np.mean(means < 0) + np.mean(means == 0) / 2)
    acceleration = (rest**3).sum() / (6 * (rest**2).sum() ** 1.5)
    limits = []
    for tail in ((1 - confidence) / 2, (1 + confidence) / 2):
        z = correction + stats.norm.ppf(tail)
        level = stats.norm.cdf(correction + z / (1 - acceleration * z))
        limits.append(values.mean() + means[math.ceil(level * means.size) - 1])
    return limits


class TestBinomial:
    def test_against_scipys_proportions(self):
        # 12 ratings of 1 to 5 sum to 40: 28 of 48 trials.
        ratings = [3] * 8 + [4] * 4
        for method, name in (("binomial", "exact"), ("wilson", "wilson")):
            found = bounded_interval(ratings, low=1, high=5, method=method)
            expected = stats.binomtest(28, 48).proportion_ci(method=name)
            assert found.ci == pytest.approx((1 + 4 * expected.low, 1 + 4 * expected.high))

    def test_at_the_end_of_the_scale_it_has_width_and_stays_inside(self):
        found = bounded_interval([5] * 20, low=1, high=5)
        # Clopper and Pearson's limit for 80 of 80 successes is (alpha / 2)^(1 / 80).
        assert found.ci == pytest.approx((1 + 4 * 0.025 ** (1 / 80), 5))
        assert found.apa() == "M = 5.00, SD = 0.00, n = 20, 95% CI [4.82, 5.00] by binomial (Clopper-Pearson)"
        assert found.flags == ()

    def test_ratings_that_vary_more_are_flagged_and_trials_mend_it(self):
        ratings = [0, 100] * 10 + [50, 20, 80]
        found = bounded_interval(ratings, low=0, high=100)
        assert "more than those of 100 Bernoulli trials" in found.summary()
        wider = bounded_interval(ratings, low=0, high=100, trials=1)
        assert not wider.flags
        assert wider.ci[1] - wider.ci[0] > 5 * (found.ci[1] - found.ci[0])

    def test_the_truth_is_covered_often_enough(self):
        rng = np.random.default_rng(4)
        means = 1 + rng.binomial(4, 0.9, size=(4000, 15)).mean(axis=1)
        limits = binomial_interval(means, np.full(4000, 15), low=1, high=5, trials=4)
        assert ((limits[:, 0] <= 4.6) & (limits[:, 1] >= 4.6)).mean() >= 0.95

    @given(votes, st.floats(-50, 50), st.floats(0.1, 20))
    def test_units_do_not_matter(self, ratings, shift, scale):
        one = bounded_interval(ratings, low=1, high=5)
        ends = shift + scale, shift + 5 * scale
        moved = np.clip(shift + scale * np.array(ratings), *ends)
        two = bounded_interval(moved, low=ends[0], high=ends[1], trials=4)
        assert [(limit - shift) / scale for limit in two.ci] == pytest.approx(one.ci, abs=1e-6)


class TestBootstrap:
    @pytest.mark.parametrize("ratings", [[5, 5, 4, 1, 5, 2], [1, 2, 4, 4, 5], [0.25, 1.5, 1.75, 3, 0.5]])
    def test_steps_against_all_resamples(self, ratings):
        found = bounded_interval(ratings, low=0, high=5, method="bootstrap")
        assert found.ci == pytest.approx(by_enumeration(ratings))

    def test_without_steps_it_draws(self):
        ratings = np.random.default_rng(1).beta(5, 1, size=25)
        found = bounded_interval(
            ratings, low=0, high=1, method="bootstrap", rng=np.random.default_rng(2), resamples=20_000
        )
        expected = stats.bootstrap((ratings,), np.mean, method="BCa", n_resamples=20_000, rng=np.random.default_rng(3))
        assert found.ci == pytest.approx(tuple(expected.confidence_interval), abs=0.003)
        again = bounded_interval(
            ratings, low=0, high=1, method="bootstrap", rng=np.random.default_rng(2), resamples=20_000
        )
        assert again == found
        with pytest.raises(DataError, match="needs a generator"):
            bounded_interval(ratings, low=0, high=1, method="bootstrap")

    def test_many_ratings_follow_the_normal(self):
        ratings = np.random.default_rng(1).integers(1, 6, 200_000)
        found = bounded_interval(ratings, low=1, high=5, method="bootstrap")
        half = 1.959964 * ratings.std() / math.sqrt(ratings.size)
        assert found.ci == pytest.approx((ratings.mean() - half, ratings.mean() + half), abs=2e-5)

    def test_ratings_that_do_not_vary_are_flagged(self):
        found = bounded_interval([4, 4, 4], low=1, high=5, method="bootstrap")
        assert found.ci == (4, 4)
        assert "All 3 ratings are the same" in found.flags[0]

    def test_groups_do_not_touch_each_other(self):
        rng = np.random.default_rng(5)
        values, group = rng.integers(1, 8, 400).astype(float), rng.integers(0, 9, 400)
        together = bca_intervals(values, group, 9)
        for one in range(9):
            own = values[group == one]
            alone = bca_intervals(own, np.zeros(own.size, dtype=np.intp), 1)[0]
            assert together[one] == pytest.approx(alone)


class TestTable:
    def test_each_group_as_the_function_says(self):
        rng = np.random.default_rng(1)
        frame = pd.DataFrame(
            {"c": rng.choice(["b", "a"], 90), "s": rng.integers(0, 4, 90), "v": rng.integers(1, 6, 90).astype(float)}
        )
        frame.loc[3, "v"] = math.nan
        for method in METHODS:
            found = bounded_table(frame, score="v", by=["c", "s"], low=1, high=5, method=method).to_frame()
            assert list(found.columns) == ["c", "s", "n", "mean", "sd", "ci_low", "ci_high"]
            for row in found.itertuples():
                own = frame[(frame.c == row.c) & (frame.s == row.s)].v.dropna()
                one = bounded_interval(own, low=1, high=5, method=method)
                assert (row.n, row.mean, row.sd) == (one.n, pytest.approx(one.mean), pytest.approx(one.sd))
                assert (row.ci_low, row.ci_high) == pytest.approx(one.ci)

    def test_single_ratings_and_no_ratings(self):
        found = bounded_table(pd.DataFrame({"c": [1, 2], "v": [3, 4]}), score="v", by=["c"], low=1, high=5)
        assert found.table["sd"].isna().all()
        assert found.table[["ci_low", "ci_high"]].notna().all(axis=None)
        empty = bounded_table(pd.DataFrame({"c": [], "v": []}), score="v", by=["c"], low=1, high=5)
        assert empty.apa() == "Means of 0 groups, 95% CI by binomial (Clopper-Pearson)"

    @pytest.mark.parametrize("method", METHODS)
    def test_a_thousand_groups_take_milliseconds(self, method):
        from time import perf_counter

        rng = np.random.default_rng(1)
        frame = pd.DataFrame({"c": np.repeat(np.arange(1000), 30), "v": rng.integers(1, 6, 30_000)})
        start = perf_counter()
        bounded_table(frame, score="v", by=["c"], low=1, high=5, method=method)
        assert perf_counter() - start < 0.5


@pytest.mark.filterwarnings("error")
@settings(deadline=None)
@given(votes, st.sampled_from(METHODS), st.sampled_from([0.5, 0.95, 0.9999]))
def test_the_interval_holds_the_mean_and_stays_on_the_scale(ratings, method, confidence):
    found = bounded_interval(ratings, low=1, high=5, method=method, confidence=confidence)
    assert 1 <= found.ci[0] <= found.ci[1] <= 5
    if method != "bootstrap":
        assert found.ci[0] <= found.mean + 1e-12
        assert found.mean - 1e-12 <= found.ci[1]
        assert found.ci[0] < found.ci[1]


@pytest.mark.parametrize("method", METHODS)
def test_bad_input(method):
    with pytest.raises(InsufficientDataError, match="no ratings"):
        bounded_interval([], low=1, high=5, method=method)
    with pytest.raises(DataError, match="not on the scale"):
        bounded_interval([1, 6], low=1, high=5, method=method)
    with pytest.raises(DataError, match="missing or infinite"):
        bounded_interval([1, math.nan], low=1, high=5, method=method)
    with pytest.raises(DataError, match="higher end"):
        bounded_interval([1, 2], low=5, high=1, method=method)
    with pytest.raises(DataError, match="trials"):
        bounded_interval([1, 2], low=1, high=5, method=method, trials=0)
    with pytest.raises(DataError, match="between 0 and 1"):
        bounded_interval([1, 2], low=1, high=5, method=method, confidence=95)
    with pytest.raises(DataError, match="resamples"):
        bounded_interval([1, 2], low=1, high=5, method="bootstrap", resamples=5)
    with pytest.raises(DataError, match="must be one of"):
        bounded_interval([1, 2], low=1, high=5, method="t")
    with pytest.raises(DataError, match="no column x"):
        bounded_table(pd.DataFrame({"c": [1]}), score="x", by=["c"], low=1, high=5, method=method)


@pytest.mark.parametrize("method", METHODS)
def test_a_scale_beyond_all_squares_is_refused(method):
    with pytest.raises(DataError, match="the scale: a value exceeds 1e"):
        bounded_interval([5.0], low=0, high=1e300, method=method)


def test_the_bootstrap_does_not_leave_the_scale_by_rounding():
    assert bounded_interval([1, 1, 3], low=1, high=5, method="bootstrap", confidence=0.5).ci[0] == 1
