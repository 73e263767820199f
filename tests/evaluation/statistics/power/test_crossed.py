import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics.power.closed_form import one_way_power, paired_t_power, repeated_measures_power
from evaluation.statistics.power.crossed import crossed_power, power_table, required
from evaluation.statistics.power.crossed_design import ASSIGNMENTS, TESTS, CrossedDesign, VarianceComponents

USUAL = VarianceComponents(
    rater_sd=0.4, item_sd=0.3, residual_sd=0.7, rater_condition_sd=0.2, item_condition_sd=0.3, rater_item_sd=0.2
)
few = settings(max_examples=30)
sds = st.floats(0, 2)
components = st.builds(
    VarianceComponents,
    rater_sd=sds,
    item_sd=sds,
    residual_sd=st.floats(0.1, 2),
    rater_condition_sd=sds,
    item_condition_sd=sds,
    rater_item_sd=sds,
)


@st.composite
def designs(draw):
    conditions = draw(st.integers(2, 4))
    assignment = draw(st.sampled_from(ASSIGNMENTS))
    raters, items = draw(st.integers(2, 12)), draw(st.integers(2, 12))
    return CrossedDesign(
        raters=raters if assignment == "full" else raters * conditions,
        items=items * conditions if assignment == "latin_square" else items,
        conditions=conditions,
        assignment=assignment,
    )


def westfall(assignment, d, p, q, *, E, P, PS, PC, SC):
    """Power by Westfall, Kenny and Judd (2014): two conditions coded -1 and 1, variances adding up to 1."""
    if assignment == "full":
        squares = {"PC": (2 * q * PC + E, p - 1), "SC": (2 * p * SC + E, q - 1), "E": (E, (p - 1) * (q - 1))}
        ncp = d / 2 / math.sqrt(PC / p + SC / q + E / (2 * p * q))
    elif assignment == "latin_square":
        squares = {
            "PC": (q * PC + PS + E, p - 2),
            "SC": (p * SC + PS + E, q - 2),
            "E": (PS + E, (p - 2) * (q - 2)),
        }
        ncp = d / 2 / math.sqrt(PC / p + SC / q + (PS + E) / (p * q))
    else:
        # Of raters in one condition alone intercept and slope cannot be told apart: V_P is the whole of it.
        squares = {"P": (q * P + PS + E, p - 2), "SC": (p * SC + PS + E, q - 1), "E": (PS + E, (p - 2) * (q - 1))}
        ncp = d / 2 / math.sqrt(P / p + SC / q + (PS + E) / (p * q))
    signs = (1, 1, -1)
    total = sum(sign * square for sign, (square, _) in zip(signs, squares.values(), strict=True))
    df = total**2 / sum(square**2 / df for square, df in squares.values())
    critical = stats.t.isf(0.025, df)
    return stats.nct.sf(critical, df, ncp) + stats.nct.cdf(-critical, df, ncp)


@pytest.mark.parametrize("assignment", ASSIGNMENTS)
@pytest.mark.parametrize(("p", "q", "d"), [(30, 20, 0.5), (100, 16, 0.5), (12, 40, 0.3)])
def test_westfall_kenny_and_judd(assignment, p, q, d):
    # The standard case of their web page: shares of 30 % error, 20 % each participants and stimuli, 10 % each the rest.
    shares = {"E": 0.3, "P": 0.2, "PS": 0.1, "PC": 0.1, "SC": 0.1}
    expected = westfall(assignment, d, p, q, **shares)
    sd = VarianceComponents(
        rater_sd=math.sqrt(shares["P"]),
        item_sd=math.sqrt(0.2),
        residual_sd=math.sqrt(shares["E"]),
        rater_item_sd=math.sqrt(shares["PS"]),
        rater_condition_sd=0 if assignment == "between" else math.sqrt(2 * shares["PC"]),
        item_condition_sd=math.sqrt(2 * shares["SC"]),
    )
    design = CrossedDesign(raters=p, items=q, conditions=2, assignment=assignment)
    # Their P of a between design is that of the mean of p / 2 raters, as here.
    assert crossed_power(design, [0, d], sd).power == pytest.approx(expected, abs=1e-6)


def test_few_stimuli_set_a_limit_that_no_number_of_raters_passes():
    sd = dataclasses.replace(USUAL, item_condition_sd=0.5)
    design = CrossedDesign(raters=10, items=10, conditions=2)
    powers = [crossed_power(dataclasses.replace(design, raters=n), [3, 3.4], sd).power for n in (10, 100, 10**4, 10**6)]
    assert powers == sorted(powers)
    limit = paired_t_power(0.4 / math.sqrt(2 * 0.5**2), 10).power
    assert powers[-1] == pytest.approx(limit, abs=1e-4)
    assert limit < 0.8
    assert required("raters", design, [3, 3.4], sd) is None
    assert required("items", design, [3, 3.4], sd) is not None


@few
@given(st.integers(2, 20), st.integers(2, 20), st.integers(2, 4), st.floats(0, 1))
def test_by_item_is_repeated_measures_of_the_items_means(raters, items, conditions, effect):
    sd = dataclasses.replace(USUAL, rater_condition_sd=0.0)
    means = np.linspace(3, 3 + effect, conditions)
    noise = sd.item_condition_sd**2 + sd.residual_sd**2 / raters
    shared = sd.item_sd**2 + sd.rater_item_sd**2 / raters
    found = crossed_power(CrossedDesign(raters=raters, items=items, conditions=conditions), means, sd, test="by_item")
    expected = repeated_measures_power(
        float(np.std(means)) / math.sqrt(noise + shared), items, conditions, correlation=shared / (noise + shared)
    )
    assert found.df == (conditions - 1, (items - 1) * (conditions - 1))
    assert found.power == pytest.approx(expected.power, abs=1e-9)
    assert not found.flags


def test_items_as_independent_groups_are_just_that_if_items_have_nothing_of_their_own():
    sd = VarianceComponents(rater_sd=0.4, item_sd=0, residual_sd=0.7)
    design = CrossedDesign(raters=15, items=20, conditions=3)
    found = crossed_power(design, [2.9, 3, 3.1], sd, test="independent")
    f = float(np.std([2.9, 3, 3.1])) / (0.7 / math.sqrt(15))
    assert found.df == (2, 57)
    assert found.power == pytest.approx(one_way_power(f, 20, 3).power, abs=1e-9)


def test_each_test_holds_where_its_assumption_does_and_is_flagged_where_not():
    design = CrossedDesign(raters=15, items=20, conditions=3)
    nothing = [3.0, 3.0, 3.0]
    rates = {test: crossed_power(design, nothing, USUAL, test=test).power for test in TESTS}
    assert rates["quasi_f"] == pytest.approx(0.05, abs=1e-9)
    assert rates["by_item"] > 0.1
    assert rates["by_rater"] > 0.2
    assert rates["mixed_model"] > 0.4
    assert rates["independent"] < 0.05
    assert min(rates["by_item"], rates["by_rater"]) > rates["both"]
    (flag,) = crossed_power(design, nothing, USUAL, test="mixed_model").flags
    assert "leaves out a source of variance" in flag
    plain = VarianceComponents(rater_sd=0.4, item_sd=0.3, residual_sd=0.7)
    for test in ("by_item", "by_rater", "mixed_model"):
        found = crossed_power(design, nothing, plain, test=test)
        assert found.power == pytest.approx(0.05, abs=1e-9)
        assert found.flags == ()


@few
@given(designs(), components, st.floats(0, 4), st.sampled_from(TESTS), st.floats(0.001, 0.5))
def test_power_is_a_probability_whatever_is_planned(design, sd, effect, test, alpha):
    found = crossed_power(design, np.linspace(1, 1 + effect, design.conditions), sd, test=test, alpha=alpha)
    assert 0 <= found.power <= 1
    assert found.power >= found.false_positive_rate - 1e-6
    assert "power of" in found.summary()
    assert len(found.to_frame()) == 1


@few
@given(designs(), components, st.floats(0.01, 100), st.floats(-50, 50))
def test_units_and_origin_of_the_scale_do_not_matter(design, sd, factor, shift):
    means = np.linspace(0, 0.5, design.conditions)
    scaled = VarianceComponents(**{name: factor * value for name, value in sd.to_dict().items()})
    assert crossed_power(design, factor * means + shift, scaled).power == pytest.approx(
        crossed_power(design, means, sd).power, abs=1e-6
    )


@few
@given(designs(), components)
def test_more_raters_and_items_never_harm(design, sd):
    means = np.linspace(3, 3.3, design.conditions)
    more = dataclasses.replace(design, raters=3 * design.raters, items=3 * design.items)
    assert crossed_power(more, means, sd).power >= crossed_power(design, means, sd).power - 1e-6


@few
@given(designs(), components)
def test_degrees_of_freedom_add_up(design, sd):
    strata = design.strata(sd)
    raters = design.raters - 1 if design.assignment == "full" else design.raters - design.conditions
    left_out = 0 if design.assignment == "between" else raters
    assert sum(stratum.df for stratum in strata.values()) + left_out == design.ratings - 1


def test_the_fewest_raters_and_items():
    for assignment in ASSIGNMENTS:
        design = CrossedDesign(raters=60, items=30, conditions=3, assignment=assignment)
        for what, step in (("raters", design.rater_step), ("items", design.item_step)):
            number = required(what, design, [2.5, 3, 3.5], USUAL)
            assert number is not None
            assert number % step == 0
            enough = crossed_power(dataclasses.replace(design, **{what: number}), [2.5, 3, 3.5], USUAL)
            assert enough.power >= 0.8
            if number - step >= 2 * step:
                fewer = dataclasses.replace(design, **{what: number - step})
                assert crossed_power(fewer, [2.5, 3, 3.5], USUAL).power < 0.8


def test_a_table_has_each_combination():
    design = CrossedDesign(raters=10, items=10, conditions=2)
    table = power_table(design, [3, 3.5], USUAL, raters=[5, 10], items=[10, 20, 30])
    assert table.shape == (2, 3)
    assert table.loc[10, 20] == crossed_power(dataclasses.replace(design, items=20), [3, 3.5], USUAL).power


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: CrossedDesign(raters=1, items=10, conditions=2), "number of raters is 1"),
        (lambda: CrossedDesign(raters=5, items=1, conditions=2), "number of items is 1"),
        (lambda: CrossedDesign(raters=5, items=5, conditions=1), "number of conditions is 1"),
        (lambda: CrossedDesign(raters=5.5, items=5, conditions=2), "number of raters is 5.5"),
        (lambda: CrossedDesign(raters=7, items=9, conditions=3, assignment="latin_square"), "multiple of 3"),
        (lambda: CrossedDesign(raters=6, items=10, conditions=3, assignment="latin_square"), "10 items"),
        (lambda: CrossedDesign(raters=3, items=5, conditions=3, assignment="between"), "6 or more"),
        (lambda: CrossedDesign(raters=3, items=5, conditions=3, assignment="nested"), "must be one of full"),
        (lambda: VarianceComponents(rater_sd=-1, item_sd=0, residual_sd=1), "rater_sd is -1"),
        (lambda: VarianceComponents(rater_sd=0, item_sd=math.nan, residual_sd=1), "item_sd is nan"),
        (lambda: VarianceComponents(rater_sd=0, item_sd=0, residual_sd=0), "residual_sd is 0"),
    ],
)
def test_bad_designs(call, message):
    with pytest.raises(DataError, match=message):
        call()


@pytest.mark.parametrize(
    ("means", "options", "message"),
    [
        ([3, 4], {}, "2 means but 3 conditions"),
        ([3, math.inf, 4], {}, "missing or infinite"),
        ([3, 3, 4], {"test": "anova"}, "must be one of quasi_f"),
        ([3, 3, 4], {"alpha": 1}, "alpha is 1"),
    ],
)
def test_bad_questions(means, options, message):
    with pytest.raises(DataError, match=message):
        crossed_power(CrossedDesign(raters=10, items=10, conditions=3), means, USUAL, **options)
