import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.rater_model import (
    LEAST_RATINGS,
    deviations,
    leave_one_out_correlation,
    range_counts,
    rater_model,
)

CASES = json.loads((Path(__file__).parents[2] / "data" / "p910_cases.json").read_text(encoding="utf-8"))
seeds = st.integers(0, 2**32)
FUNCTIONS = (rater_model, range_counts, leave_one_out_correlation, deviations)


def published(name):
    rows = CASES[name]["ratings"]
    return np.array([[np.nan if one == "-" else float(one) for one in row] for row in rows]), CASES[name]["expected"]


def simulated(seed, items=60, raters=8, missing=0.0):
    rng = np.random.default_rng(seed)
    quality, bias = rng.uniform(1, 5, items), rng.normal(0, 0.5, raters)
    ratings = quality[:, None] + bias + rng.uniform(0.3, 1, raters) * rng.normal(size=(items, raters))
    ratings[rng.random(ratings.shape) < missing] = np.nan
    return ratings


class TestRaterModel:
    def test_the_public_data_set(self):
        ratings, expected = published("nflx")
        found = rater_model(ratings)
        assert found.quality[:3] == pytest.approx(expected["mle_first3"], rel=1e-6)
        assert found.quality.var() == pytest.approx(expected["mle_var"], rel=1e-6)
        assert found.bias.var() == pytest.approx(expected["bias_var"], rel=1e-6)
        assert found.inconsistency.mean() == pytest.approx(expected["inconsistency_mean"], rel=1e-6)
        assert found.inconsistency.var() == pytest.approx(expected["inconsistency_var"], rel=1e-6)
        assert found.converged

    def test_with_a_missing_rating_and_five_random_raters(self):
        ratings, expected = published("nflx_random_raters")
        found = rater_model(ratings)
        assert found.bias == pytest.approx(np.array(expected["bias"]), abs=2e-8)
        assert found.inconsistency == pytest.approx(np.array(expected["inconsistency"]), abs=2e-8)
        assert found.quality[:3] == pytest.approx(expected["quality_first3"], abs=2e-8)
        assert found.quality[-1] == pytest.approx(expected["quality_last"], abs=2e-8)
        assert set(np.argsort(found.inconsistency)[-5:]) == {0, 1, 2, 3, 4}

    @settings(deadline=None)
    @given(seeds, st.floats(-3, 3), st.sampled_from([0.0, 0.3]))
    def test_a_constant_added_to_one_rater_is_bias_alone(self, seed, constant, missing):
        # Of few raters the model takes one for the truth, which may be another for the slightest reason.
        ratings = simulated(seed, items=40, raters=40, missing=missing)
        shifted = ratings.copy()
        shifted[:, 2] += constant
        one, two = rater_model(ratings), rater_model(shifted)
        assume(one.largest_weight < 0.7)
        others = np.full(40, -constant / 40)
        others[2] += constant
        assert two.bias == pytest.approx(one.bias + others, abs=1e-5)
        assert two.inconsistency == pytest.approx(one.inconsistency, abs=1e-5)

    @settings(deadline=None)
    @given(seeds, st.sampled_from([0.0, 0.4]))
    def test_the_order_of_raters_and_items_does_not_matter(self, seed, missing):
        ratings = simulated(seed, missing=missing)
        rng = np.random.default_rng(seed)
        items, raters = rng.permutation(60), rng.permutation(8)
        one, two = rater_model(ratings), rater_model(ratings[np.ix_(items, raters)])
        assert two.bias == pytest.approx(one.bias[raters], abs=1e-6)
        assert two.inconsistency == pytest.approx(one.inconsistency[raters], abs=1e-6)
        assert two.quality == pytest.approx(one.quality[items], abs=1e-6, nan_ok=True)

    @settings(deadline=None)
    @given(seeds, st.sampled_from([0.0, 0.4]))
    def test_the_solution_is_stationary(self, seed, missing):
        ratings = simulated(seed, missing=missing)
        found = rater_model(ratings)
        assume(found.converged)
        assert np.nanmean(ratings - found.quality[:, None], axis=0) == pytest.approx(found.bias, abs=1e-6)
        rest = ratings - found.bias
        weights = np.where(np.isnan(ratings), 0, 1 / (found.inconsistency**2 + 1e-8))
        quality = (np.nan_to_num(rest) * weights).sum(axis=1) / np.maximum(weights.sum(axis=1), 1e-300)
        seen = weights.sum(axis=1) > 0
        assert quality[seen] == pytest.approx(found.quality[seen], abs=1e-5)
        residuals = ratings - found.quality[:, None] - found.bias
        assert np.sqrt(np.nanmean(residuals**2, axis=0)) == pytest.approx(found.inconsistency, rel=0.1)

    def test_simulated_raters_are_recovered(self):
        rng = np.random.default_rng(5)
        bias = np.array([-1, 0, 0.5, 0, 0.5, 0, -0.5, 0.5, 0, 0, 0, 0])
        spread = np.array([0.4, 0.4, 0.6, 0.8, 0.4, 0.5, 0.6, 0.6, 0.7, 0.8, 0.4, 0.5])
        ratings = rng.uniform(1, 5, (5000, 1)) + bias + spread * rng.normal(size=(5000, 12))
        ratings[rng.random(ratings.shape) < 0.1] = np.nan
        found = rater_model(ratings)
        assert found.bias == pytest.approx(bias, abs=0.05)
        assert found.inconsistency == pytest.approx(spread, abs=0.08)
        assert found.largest_weight < 0.4

    def test_among_few_raters_the_best_is_taken_for_the_truth_and_that_is_told(self):
        rng = np.random.default_rng(5)
        ratings = rng.uniform(1, 5, (500, 1)) + np.array([0.2, 0.5, 0.6, 0.8]) * rng.normal(size=(500, 4))
        found = rater_model(ratings)
        assert found.largest_weight > 0.99
        assert found.inconsistency[0] < 0.01
        assert found.bias == pytest.approx(ratings.mean(axis=0) - ratings.mean())

    def test_a_large_common_part_costs_no_digits(self):
        ratings = simulated(3)
        one, two = rater_model(ratings), rater_model(ratings + 1e6)
        assert two.bias == pytest.approx(one.bias, abs=1e-6)
        assert two.inconsistency == pytest.approx(one.inconsistency, abs=1e-6)

    def test_groups_that_share_nothing_are_judged_apart(self):
        one, two = simulated(1, items=30, raters=4), simulated(2, items=20, raters=5)
        both = np.full((50, 9), np.nan)
        both[:30, ::2][:, :4], both[30:, [1, 3, 5, 7, 8]] = one, two
        found = rater_model(both)
        assert found.group.tolist() == [0, 1, 0, 1, 0, 1, 0, 1, 1]
        assert found.bias[::2][:4] == pytest.approx(rater_model(one).bias, abs=1e-6)
        assert found.inconsistency[[1, 3, 5, 7, 8]] == pytest.approx(rater_model(two).inconsistency, abs=1e-6)
        assert found.quality == pytest.approx(
            np.concatenate([rater_model(one).quality, rater_model(two).quality]), abs=1e-6
        )

    def test_raters_with_too_few_ratings_change_nothing(self):
        ratings = simulated(4)
        few = np.full((60, 1), np.nan)
        few[: LEAST_RATINGS - 1] = 5
        found, without = rater_model(np.hstack([ratings, few])), rater_model(ratings)
        assert found.bias[:-1] == pytest.approx(without.bias)
        assert math.isnan(found.bias[-1])
        assert math.isnan(found.inconsistency[-1])
        assert found.group[-1] == -1

    def test_items_of_one_rater_change_nothing_but_have_a_quality(self):
        ratings = simulated(4)
        alone = np.full((2, 8), np.nan)
        alone[0, 3] = 4.0
        found, without = rater_model(np.vstack([ratings, alone])), rater_model(ratings)
        assert found.inconsistency == pytest.approx(without.inconsistency)
        assert found.quality[-2] == pytest.approx(4 - without.bias[3])
        assert math.isnan(found.quality[-1])

    def test_raters_who_agree_but_for_a_constant(self):
        found = rater_model(np.array([[1.0, 2, 3], [2, 3, 4], [5, 6, 7], [3, 4, 5]]))
        assert found.bias == pytest.approx([-1, 0, 1])
        assert found.inconsistency == pytest.approx([0, 0, 0], abs=1e-12)
        assert found.quality == pytest.approx([2, 3, 6, 4])

    @pytest.mark.parametrize(
        "ratings", [np.ones((2, 5)), np.ones((5, 1)), np.full((4, 4), np.nan), np.where(np.eye(4), 3.0, np.nan)]
    )
    def test_too_little(self, ratings):
        with pytest.raises(InsufficientDataError, match="in common"):
            rater_model(ratings)


def bt500_by_loops(ratings):
    """Counts with exact fractions, one score at a time; ratings are whole numbers, None where missing."""
    above, below = [0] * len(ratings[0]), [0] * len(ratings[0])
    for row in ratings:
        there = [(rater, Fraction(int(score))) for rater, score in enumerate(row) if score is not None]
        if len(there) < 2:
            continue
        mean = sum(score for _, score in there) / len(there)
        second = sum((score - mean) ** 2 for _, score in there) / len(there)
        fourth = sum((score - mean) ** 4 for _, score in there) / len(there)
        if second == 0:
            continue
        variance = second * len(there) / (len(there) - 1)
        factor = 4 if 2 <= fourth / second**2 <= 4 else 20
        for rater, score in there:
            if (score - mean) ** 2 >= factor * variance:
                if score > mean:
                    above[rater] += 1
                else:
                    below[rater] += 1
    return above, below


class TestRangeCounts:
    @settings(deadline=None)
    @given(seeds, st.integers(2, 30), st.sampled_from([0.0, 0.2]), st.sampled_from([5, 9, 100]))
    def test_against_loops(self, seed, raters, missing, scale):
        rng = np.random.default_rng(seed)
        ratings = np.round(np.clip(rng.normal(scale / 2, scale / 6, (12, raters)), 1, scale))
        ratings[rng.random(ratings.shape) < 0.05] = scale
        ratings[rng.random(ratings.shape) < missing] = np.nan
        above, below = bt500_by_loops([[None if np.isnan(x) else x for x in row] for row in ratings])
        found = range_counts(ratings)
        assert (found.above.tolist(), found.below.tolist()) == (above, below)
        assert found.presentations.tolist() == (~np.isnan(ratings)).sum(axis=0).tolist()

    def test_by_hand(self):
        # Mean 3.25, SD 1.035, kurtosis 3.00: the 1 is 2.17 SD below.
        usual = [4, 3, 4, 3, 4, 3, 4, 1]
        found = range_counts([usual, [3] * 8])
        assert found.below.tolist() == [0] * 7 + [1]
        assert found.above.tolist() == [0] * 8
        assert found.share[-1] == 0.5
        assert found.asymmetry[-1] == 1
        assert math.isnan(found.asymmetry[0])

    def test_a_peak_needs_more(self):
        # Kurtosis 13.1 asks for the root of 20 (4.47) deviations; the lone 5 among 14 ones is 3.61 away, so it stays.
        assert range_counts([[1] * 14 + [5]]).above.sum() == 0
        # Among 29 ones it is 5.29 away.
        assert range_counts([[1] * 29 + [5]]).above.tolist() == [0] * 29 + [1]

    def test_nothing_rated(self):
        found = range_counts([[np.nan, 1, 2], [np.nan, 2, 2]])
        assert math.isnan(found.share[0])
        assert found.presentations[0] == 0

    @settings(deadline=None)
    @given(seeds, st.floats(-100, 100), st.floats(0.1, 10))
    def test_units_do_not_matter(self, seed, shift, scale):
        ratings = np.random.default_rng(seed).standard_t(4, size=(10, 15))
        one, two = range_counts(ratings), range_counts(shift + scale * ratings)
        assert (one.above.tolist(), one.below.tolist()) == (two.above.tolist(), two.below.tolist())


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


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("wrong", [[[1, math.inf], [2, 3]], [1, 2, 3], "no", [[1], [2, 3]], [[1e200, 2], [1, 2]]])
def test_what_is_no_table(function, wrong):
    with pytest.raises(DataError):
        function(wrong)


@pytest.mark.filterwarnings("error")
@settings(deadline=None)
@given(
    arrays.arrays(
        float,
        st.tuples(st.integers(0, 6), st.integers(0, 6)),
        elements=st.one_of(st.just(np.nan), st.integers(1, 5).map(float), st.floats(-1e6, 1e6)),
    )
)
def test_any_table_gives_a_result_or_says_why_not(ratings):
    for function in FUNCTIONS:
        try:
            found = function(ratings)
        except InsufficientDataError:
            continue
        if function is rater_model:
            assert (np.nan_to_num(found.inconsistency) >= 0).all()
            assert (np.isnan(found.bias) == (found.group < 0)).all()
            assert np.isfinite(found.largest_weight)
        elif function is leave_one_out_correlation:
            assert (np.abs(np.nan_to_num(found)) <= 1).all()


def test_a_million_ratings_take_no_time():
    """The plain program of the recommendation takes minutes for these; the limit here is generous."""
    from time import perf_counter

    ratings = simulated(1, items=1000, raters=1000, missing=0.3)
    start = perf_counter()
    for function in FUNCTIONS:
        function(ratings)
    assert perf_counter() - start < 10
