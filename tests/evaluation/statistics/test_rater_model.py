import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.bt500 import bt500_rejection
from evaluation.statistics.leave_one_out import leave_one_out
from evaluation.statistics.rater_model import (
    LEAST_RATINGS,
    deviations,
    leave_one_out_correlation,
    range_counts,
    rater_model,
)

CASES = json.loads((Path(__file__).parents[2] / "data" / "p910_cases.json").read_text(encoding="utf-8"))
# sureal 0.9.0, SubjectMLEModelProjectionSolver: quality_scores_std, observer_bias_std, observer_inconsistency_ci95 of
# the first video and the first subject.
SUREAL = {
    "quality_std": 0.11275373417,
    "bias_std": 0.06552436706,
    "inconsistency_ci": [0.50403395111, 0.68982891304],
}
seeds = st.integers(0, 2**32)
FUNCTIONS = (rater_model, range_counts, bt500_rejection, leave_one_out, leave_one_out_correlation, deviations)


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

    def test_errors_and_intervals_are_those_of_the_authors_program(self):
        ratings, _ = published("nflx")
        found = rater_model(ratings)
        assert found.quality_se == pytest.approx(np.full(79, SUREAL["quality_std"]), rel=1e-6)
        assert found.bias_se[0] == pytest.approx(SUREAL["bias_std"], rel=1e-6)
        assert found.inconsistency_ci[0] == pytest.approx(SUREAL["inconsistency_ci"], rel=1e-6)
        assert found.inconsistency_se == pytest.approx(found.inconsistency / math.sqrt(158))
        frame = found.to_frame()
        assert frame["parameter"].value_counts().to_dict() == {"quality": 79, "bias": 26, "inconsistency": 26}
        first = frame.iloc[0]
        assert (first.ci_low, first.ci_high) == pytest.approx(tuple(found.quality_ci[0]))
        assert found.quality_ci[0, 1] - found.quality[0] == pytest.approx(1.959964 * found.quality_se[0], rel=1e-6)
        assert found.summary() == (
            "Bias and inconsistency (ITU-T P.910) of 26 raters of 79 items: bias -0.48 to 0.81, SD = 0.30, "
            "inconsistency 0.45 to 0.88, M = 0.60, mean SE of a quality 0.113"
        )

    def test_intervals_of_qualities_cover_the_truth(self):
        rng = np.random.default_rng(7)
        quality, spread = rng.uniform(1, 5, (400, 1)), rng.uniform(0.4, 0.9, 60)
        ratings = quality + rng.normal(0, 0.4, 60) + spread * rng.normal(size=(400, 60))
        ratings[rng.random(ratings.shape) < 0.3] = np.nan
        found = rater_model(ratings)
        # Qualities are known up to the mean bias.
        low, high = (found.quality_ci - (found.quality - quality[:, 0]).mean()).T
        assert ((low <= quality[:, 0]) & (quality[:, 0] <= high)).mean() == pytest.approx(0.95, abs=0.03)

    def test_what_is_to_be_known_is_flagged(self):
        few = simulated(3, items=200, raters=3)
        assert any("collapsed" in flag for flag in rater_model(few).flags)
        assert any("not come to rest" in flag for flag in rater_model(simulated(3), steps=1).flags)
        apart = np.full((50, 6), np.nan)
        apart[:25, :3], apart[25:, 3:] = simulated(1, items=25, raters=3), simulated(2, items=25, raters=3)
        apart = np.vstack([np.hstack([apart, np.full((50, 1), np.nan)]), np.full((1, 7), np.nan)])
        text = rater_model(apart).summary()
        assert "2 groups" in text
        assert "1 of 7 raters" in text
        assert "1 of 51 items" in text

    def test_integers_and_lists_as_well(self):
        ratings = np.random.default_rng(1).integers(1, 6, (20, 6))
        for other in (ratings.tolist(), ratings.astype(float), np.asfortranarray(ratings)):
            assert rater_model(other).quality == pytest.approx(rater_model(ratings).quality, abs=1e-9)

    @pytest.mark.parametrize(
        "ratings", [np.ones((2, 5)), np.ones((5, 1)), np.full((4, 4), np.nan), np.where(np.eye(4), 3.0, np.nan)]
    )
    def test_too_little(self, ratings):
        with pytest.raises(InsufficientDataError, match="in common"):
            rater_model(ratings)


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
            assert (np.isnan(found.quality_se) == np.isnan(found.quality)).all()
            assert (~np.isnan(found.bias)).all() or found.flags
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
