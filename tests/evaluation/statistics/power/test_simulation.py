import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats.proportion import proportion_confint

from evaluation.errors import DataError
from evaluation.statistics.power.closed_form import correlation_power
from evaluation.statistics.power.crossed import crossed_power
from evaluation.statistics.power.crossed_design import ASSIGNMENTS, TESTS, CrossedDesign, VarianceComponents
from evaluation.statistics.power.simulation import simulate_correlation_power, simulate_power, wilson

USUAL = VarianceComponents(
    rater_sd=0.4, item_sd=0.3, residual_sd=0.7, rater_condition_sd=0.2, item_condition_sd=0.3, rater_item_sd=0.2
)
DESIGNS = [CrossedDesign(raters=15, items=18, conditions=3, assignment=assignment) for assignment in ASSIGNMENTS]
MEANS = [2.8, 3.0, 3.25]


@pytest.mark.parametrize("means", [MEANS, [3.0, 3.0, 3.0]], ids=["effect", "nothing"])
@pytest.mark.parametrize("design", DESIGNS, ids=ASSIGNMENTS)
def test_simulation_and_closed_form_agree(design, means):
    found = simulate_power(design, means, USUAL, seed=3, replications=1500, scale=None, confidence=0.999)
    for test in TESTS:
        expected = crossed_power(design, means, USUAL, test=test).power
        share = found.tests[test]
        assert share.low - 0.005 < expected < share.high + 0.005, test


def test_rounding_to_the_scale_changes_little_in_its_middle():
    plain = simulate_power(DESIGNS[0], MEANS, USUAL, seed=4, replications=1500, scale=None, confidence=0.999)
    rounded = simulate_power(DESIGNS[0], MEANS, USUAL, seed=5, replications=1500, confidence=0.999)
    assert rounded.flags == ()
    for test in TESTS:
        assert rounded.tests[test].low < plain.tests[test].high
        assert plain.tests[test].low < rounded.tests[test].high


def test_the_ends_of_the_scale_cost_power_and_are_flagged():
    middle = simulate_power(DESIGNS[1], [2.8, 3.0, 3.3], USUAL, seed=1, replications=500)
    end = simulate_power(DESIGNS[1], [4.7, 4.9, 5.2], USUAL, seed=1, replications=500)
    assert end.tests["quasi_f"].value < middle.tests["quasi_f"].value - 0.1
    assert "outside of the scale" in end.flags[0]
    (flag,) = simulate_power(DESIGNS[1], [4.4, 4.6, 4.8], USUAL, seed=1, replications=100).flags
    assert "are cut off" in flag
    fine = dataclasses.replace(USUAL, residual_sd=0.1)
    assert "rounding alone" in simulate_power(DESIGNS[1], MEANS, fine, seed=1, replications=100).flags[-1]


def test_both_tests_are_significant_no_more_often_than_either():
    tests = simulate_power(DESIGNS[0], MEANS, USUAL, seed=2, replications=300).tests
    assert tests["both"].found <= min(tests["by_item"].found, tests["by_rater"].found)


def test_the_same_seed_gives_the_same_studies():
    whole = simulate_power(DESIGNS[2], MEANS, USUAL, seed=7, replications=200)
    assert simulate_power(DESIGNS[2], MEANS, USUAL, seed=7, replications=200).tests == whole.tests
    assert simulate_power(DESIGNS[2], MEANS, USUAL, seed=8, replications=200).tests != whole.tests


def test_a_study_in_which_nothing_differs_finds_nothing():
    still = VarianceComponents(rater_sd=0, item_sd=0, residual_sd=0.01)
    found = simulate_power(DESIGNS[0], [3, 3, 3], still, seed=1, replications=20)
    assert all(share.found == 0 for share in found.tests.values())
    certain = simulate_power(DESIGNS[0], [1, 3, 5], still, seed=1, replications=20)
    assert all(share.found == 20 for share in certain.tests.values())


@settings(max_examples=15)
@given(
    assignment=st.sampled_from(ASSIGNMENTS),
    conditions=st.integers(2, 4),
    effect=st.floats(0, 4),
    sd=st.floats(0, 3),
    residual=st.floats(0.01, 3),
    seed=st.integers(0),
)
def test_nothing_breaks_it(*, assignment, conditions, effect, sd, residual, seed):
    design = CrossedDesign(raters=2 * conditions, items=2 * conditions, conditions=conditions, assignment=assignment)
    components = VarianceComponents(rater_sd=sd, item_sd=sd, residual_sd=residual, item_condition_sd=sd)
    found = simulate_power(design, np.linspace(1, 1 + effect, conditions), components, seed=seed, replications=20)
    for share in found.tests.values():
        assert 0 <= share.low <= share.value <= share.high <= 1
    assert found.to_frame()["test"].tolist() == list(TESTS)
    assert found.summary().startswith("In ")


@pytest.mark.parametrize(("found", "of"), [(0, 100), (37, 100), (100, 100), (5, 7)])
def test_wilson(found, of):
    share = wilson(found, of)
    assert (share.low, share.high) == pytest.approx(proportion_confint(found, of, method="wilson"), abs=1e-12)


def test_correlations():
    share = simulate_correlation_power(0.569, 14, seed=1, replications=4000, confidence=0.999)
    assert share.low < correlation_power(0.569, 14).power < share.high
    nothing = simulate_correlation_power(0, 20, seed=1, replications=4000, confidence=0.999)
    assert nothing.low < 0.05 < nothing.high


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"means": [1, 2]}, "2 means but 3"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 1.5}, "seed is 1.5"),
        ({"replications": 0}, "replications is 0"),
        ({"replications": 2_000_000}, "2000000 replications"),
        ({"scale": (5, 1)}, "lowest point"),
        ({"alpha": 0}, "alpha is 0"),
        ({"confidence": 1}, "confidence is 1"),
        ({"design": CrossedDesign(raters=10_000, items=1000, conditions=3)}, "closed form has no such limit"),
        ({"design": CrossedDesign(raters=1000, items=1000, conditions=3)}, "333 replications at most"),
    ],
)
def test_bad_input(change, message):
    arguments = {"design": DESIGNS[0], "means": MEANS, "components": USUAL, "seed": 1, **change}
    with pytest.raises(DataError, match=message):
        simulate_power(**arguments)


def test_bad_correlations():
    for arguments, message in (((1, 10), "correlation is 1"), ((0.1, 2), "n is 2")):
        with pytest.raises(DataError, match=message):
            simulate_correlation_power(*arguments, seed=1)
    with pytest.raises(DataError, match="more than all"):
        wilson(3, 2)
