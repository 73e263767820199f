import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.mixed.models import RandomTerm, compare, mixed_model

CASES = json.loads((Path(__file__).parents[3] / "data" / "mixed_cases.json").read_text(encoding="utf-8"))


def table(case, key):
    """The values of a published table, and the number of each one's row and column."""
    values = np.array(CASES[case][key], dtype=float)
    rows, columns = np.indices(values.shape).reshape(2, -1)
    return values.ravel(), rows, columns


def sleep_models(**options):
    """The published model of reaction times, and the one without random slopes."""
    reaction, subject, day = table("sleepstudy", "reaction")
    fixed = pd.DataFrame({"(Intercept)": 1.0, "Days": day})
    full = mixed_model(reaction, fixed, [RandomTerm(name="Subject", labels=subject, design=fixed)], **options)
    return mixed_model(reaction, fixed, [RandomTerm(name="Subject", labels=subject)], **options), full


def test_random_intercepts_and_slopes_of_reaction_times():
    null, found = sleep_models()
    expected, rtol = CASES["sleepstudy"]["expected"], CASES["sleepstudy"]["rtol"]
    assert [one.estimate for one in found.fixed] == pytest.approx(expected["fixef"], rel=rtol)
    assert [one.se for one in found.fixed] == pytest.approx(expected["se"], rel=rtol)
    assert [one.df for one in found.fixed] == pytest.approx(expected["satt_df"], rel=1e-8)
    assert [one.sd for one in found.random] == pytest.approx([expected["sd_int"], expected["sd_slope"]], rel=1e-6)
    assert found.correlations[0].r == pytest.approx(expected["corr"], rel=1e-4)
    assert found.sigma == pytest.approx(expected["sigma"], rel=1e-6)
    assert found.loglik == pytest.approx(expected["loglik_reml"], abs=1e-9)
    test = found.f_test([[0, 1]], name="Days")
    assert pytest.approx(expected["days_F"], rel=rtol) == test.F
    assert test.apa() == "F(1, 17.0) = 45.85, p < .001"
    assert found.summary() == "Days: b = 10.47, SE = 1.55, t(17.0) = 6.77, p < .001, 95% CI [7.21, 13.73]"
    assert found.flags == ()
    assert found.converged
    # R prints AIC 1755.628 and BIC 1774.786 for this model.
    assert (found.aic, found.bic) == (pytest.approx(1755.628, abs=5e-4), pytest.approx(1774.786, abs=5e-4))
    assert compare(null, found).method == "REML"


def test_likelihood_ratio_of_random_slopes():
    null, full = sleep_models(method="ML")
    expected = CASES["sleepstudy"]["expected"]
    assert full.loglik == pytest.approx(expected["loglik_ml"], abs=1e-9)
    assert [one.sd for one in full.random] == pytest.approx([expected["sd_int_ml"], expected["sd_slope_ml"]], rel=1e-6)
    found = compare(null, full)
    assert found.chi2 == pytest.approx(expected["lrt_vs_intercept_only_chi2"], abs=1e-4)
    assert found.df == 2
    assert found.apa() == "χ²(2) = 42.14, p < .001"
    assert "the true p is smaller" in found.flags[0]
    assert list(found.to_frame()["loglik"]) == [null.loglik, full.loglik]


def test_crossed_plates_and_samples():
    diameter, plate, sample = table("penicillin", "diameter")
    terms = [RandomTerm(name="plate", labels=plate), RandomTerm(name="sample", labels=sample)]
    found = mixed_model(diameter, np.ones((diameter.size, 1)), terms, names=["intercept"])
    expected, rtol = CASES["penicillin"]["expected"], CASES["penicillin"]["rtol"]
    assert found.fixed[0].estimate == pytest.approx(expected["intercept"], rel=rtol)
    assert found.fixed[0].se == pytest.approx(expected["se"], rel=rtol)
    sds = {"plate": expected["sd_plate"], "sample": expected["sd_sample"]}
    assert {one.term: one.sd for one in found.random} == pytest.approx(sds, rel=1e-6)
    assert found.sigma == pytest.approx(expected["sigma"], rel=1e-6)
    assert found.loglik == pytest.approx(expected["loglik_reml"], abs=1e-9)
    assert found.groups == {"plate": 24, "sample": 6}
    assert sum(found.shares.values()) == pytest.approx(1)
    assert found.apa().startswith("intercept: b = 22.97")
    assert list(found.random_frame()["sd"]) == pytest.approx([*sds.values(), expected["sigma"]], rel=1e-6)


def test_batches_whose_variance_is_positive_and_exactly_zero():
    for case in ("dyestuff", "dyestuff2"):
        values, batch, _ = table(case, "yield")
        found = mixed_model(values, np.ones((30, 1)), [RandomTerm(name="batch", labels=batch)])
        expected = CASES[case]["expected"]
        assert -2 * found.loglik == pytest.approx(expected["reml"], abs=5e-5)
        assert found.fixed[0].estimate == pytest.approx(expected["intercept"], abs=5e-5)
        assert found.fixed[0].se == pytest.approx(expected["se"], abs=5e-3)
        assert found.sigma == pytest.approx(expected["sigma"], abs=5e-3)
        assert found.random[0].sd == pytest.approx(expected.get("sd", 0), abs=5e-3)
        assert found.singular == (case == "dyestuff2") == (found.random[0].sd == 0)
    assert found.flags == ("The fit is singular: the standard deviation of batch is estimated as 0.",)
    # What remains is a mean of independent values.
    assert found.fixed[0].df == pytest.approx(29, rel=1e-9)


def test_maximum_likelihood_of_batches():
    values, batch, _ = table("dyestuff", "yield")
    found = mixed_model(values, np.ones((30, 1)), [RandomTerm(name="batch", labels=batch)], method="ML")
    assert -2 * found.loglik == pytest.approx(327.3271, abs=5e-5)
    assert found.random[0].sd == pytest.approx(37.26, abs=5e-3)


def test_wine_has_no_variance_of_bottles():
    rating = np.array([[int(digit) for digit in row] for row in CASES["wine"]["rating"]], dtype=float)
    judge, bottle = np.indices(rating.shape).reshape(2, -1)
    fixed = np.column_stack([np.ones(72), bottle >= 4, bottle % 4 >= 2])
    terms = [RandomTerm(name="judge", labels=judge), RandomTerm(name="bottle", labels=bottle)]
    found = mixed_model(rating.ravel(), fixed, terms, names=["intercept", "warm", "contact"])
    # Without bottles the design is balanced, and the analysis of variance gives the estimates in closed form.
    left = rating - rating.mean(axis=1, keepdims=True)
    effects = [9 * 8 * (left[:, mask].mean() ** 2) for mask in (np.arange(8) >= 4, np.arange(8) % 4 >= 2)]
    within = (np.sum(left**2) - sum(effects)) / 61
    between = 8 * rating.mean(axis=1).var(ddof=1)
    assert found.sigma**2 == pytest.approx(within, rel=1e-9)
    assert [one.variance for one in found.random] == pytest.approx([(between - within) / 8, 0], rel=1e-6)
    assert found.random[1].sd == 0
    assert [one.df for one in found.fixed[1:]] == pytest.approx([61, 61], rel=1e-6)
    assert found.flags == ("The fit is singular: the standard deviation of bottle is estimated as 0.",)


def test_correlation_of_one_is_flagged():
    rng = np.random.default_rng(3)
    group = np.repeat(np.arange(12), 6)
    fixed = np.column_stack([np.ones(72), np.tile(np.arange(6.0), 12)])
    y = rng.normal(size=72) + (rng.normal(size=12) * 3)[group] * (1 + fixed[:, 1])
    term = RandomTerm(name="rater", labels=group, design=fixed, effects=["intercept", "slope"])
    found = mixed_model(y, fixed, [term])
    assert found.singular
    assert abs(found.correlations[0].r) == pytest.approx(1, abs=1e-6)
    assert found.flags[0].startswith("The fit is singular: the covariance matrix of rater lacks rank")


def test_units_and_origins_change_nothing_else():
    reaction, subject, day = table("sleepstudy", "reaction")
    shifted = np.column_stack([np.ones(180), 2010 + day / 365])
    found = mixed_model(reaction * 1e-90, shifted, [RandomTerm(name="s", labels=subject, design=shifted)])
    plain = sleep_models()[1]
    assert found.fixed[1].t == pytest.approx(plain.fixed[1].t, rel=1e-7)
    assert found.fixed[1].estimate == pytest.approx(plain.fixed[1].estimate * 365e-90, rel=1e-7)
    assert found.random[1].sd == pytest.approx(plain.random[1].sd * 365e-90, rel=1e-5)
    far = sleep_models_shifted(1e6)
    assert far.fixed[0].estimate - 1e6 == pytest.approx(plain.fixed[0].estimate, rel=1e-10)
    assert far.fixed[1].t == pytest.approx(plain.fixed[1].t, rel=1e-9)


def sleep_models_shifted(offset):
    reaction, subject, day = table("sleepstudy", "reaction")
    fixed = np.column_stack([np.ones(180), day])
    return mixed_model(reaction + offset, fixed, [RandomTerm(name="s", labels=subject, design=fixed)])


def test_models_that_cannot_be_compared():
    reaction, subject, day = table("sleepstudy", "reaction")
    term = [RandomTerm(name="Subject", labels=subject)]
    flat, line = np.ones((180, 1)), np.column_stack([np.ones(180), day])
    with pytest.raises(DataError, match="Restricted likelihoods of models with different fixed effects"):
        compare(mixed_model(reaction, flat, term), mixed_model(reaction, line, term))
    null, full = (mixed_model(reaction, fixed, term, method="ML") for fixed in (flat, line))
    assert compare(null, full).flags == ()
    assert compare(null, full).df == 1
    with pytest.raises(DataError, match="not contained in the second"):
        compare(full, null)
    with pytest.raises(DataError, match="by REML, the other by ML"):
        compare(mixed_model(reaction, flat, term), full)
    with pytest.raises(DataError, match="different values"):
        compare(mixed_model(2 * reaction, flat, term, method="ML"), full)


GROUP = np.repeat([0, 1, 2, 3], 5)
ONES = np.ones((20, 1))
Y = np.random.default_rng(5).normal(size=20)


@pytest.mark.parametrize(
    ("error", "message", "change"),
    [
        (DataError, "values: 1 of 20 values are missing", {"y": np.where(np.arange(20) == 3, np.nan, Y)}),
        (DataError, "must have 20 rows", {"fixed": np.ones((19, 1))}),
        (DataError, "the column b is a combination", {"fixed": np.c_[ONES, 2 * ONES], "names": ["a", "b"]}),
        (DataError, "the column x2 is zero", {"fixed": np.c_[ONES, 0 * ONES]}),
        (DataError, "1 columns, but 2 names", {"names": ["a", "b"]}),
        (DataError, "not all numbers", {"fixed": [["a"]] * 20}),
        (DataError, "There is no random term", {"random": []}),
        (DataError, "same name", {"random": [RandomTerm(name="g", labels=GROUP)] * 2}),
        (DataError, "g: there are 19 labels for 20", {"random": [RandomTerm(name="g", labels=GROUP[1:])]}),
        (
            DataError,
            "g: the label at place 0 is missing",
            {"random": [RandomTerm(name="g", labels=[None, *GROUP[1:]])]},
        ),
        (DataError, "a flat list", {"random": [RandomTerm(name="g", labels=np.c_[GROUP, GROUP])]}),
        (DataError, "the column x2", {"random": [RandomTerm(name="g", labels=GROUP, design=np.c_[ONES, ONES])]}),
        (DataError, "method is 'reml'", {"method": "reml"}),
        (DataError, "confidence is 95", {"confidence": 95}),
        (InsufficientDataError, "one g only", {"random": [RandomTerm(name="g", labels=[1] * 20)]}),
        (InsufficientDataError, "cannot tell", {"random": [RandomTerm(name="g", labels=range(20))]}),
        (InsufficientDataError, "cannot tell", {"fixed": np.eye(4)[GROUP]}),
        (InsufficientDataError, "cannot tell", {"random": [RandomTerm(name=n, labels=GROUP) for n in "gh"]}),
        (InsufficientDataError, "All values are the same", {"y": np.full(20, 4.1)}),
        (InsufficientDataError, "fixed effects explain", {"y": np.arange(20) * 0.1, "fixed": np.c_[ONES, range(20)]}),
        (InsufficientDataError, "explain the values exactly", {"y": GROUP * 0.3}),
        (InsufficientDataError, "20 columns for 20 values", {"fixed": np.eye(20)}),
    ],
)
def test_what_cannot_be_fitted(error, message, change):
    usual = {"y": Y, "fixed": ONES, "random": [RandomTerm(name="g", labels=GROUP)]}
    with pytest.raises(error, match=message):
        mixed_model(**(usual | change))


def test_weights_that_do_not_fit():
    found = mixed_model(Y, ONES, [RandomTerm(name="g", labels=GROUP)])
    with pytest.raises(DataError, match="needs 1 weights in each row"):
        found.f_test([[1, 0]])
    with pytest.raises(DataError, match="the weight 0 for every fixed effect"):
        found.contrast([0])
    assert not found.vcov.flags.writeable


rating = st.sampled_from([1.0, 2.0, 3.0, math.nan, math.inf, 1e300]) | st.sampled_from([1.0, 2.0])


@pytest.mark.filterwarnings("error")
@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(rating, st.integers(0, 3), st.integers(0, 2), st.booleans()), max_size=24), st.booleans())
def test_any_data_give_finite_numbers_or_an_error(rows, slopes):
    y, first, second, x = np.array(rows, dtype=float).reshape(-1, 4).T
    fixed = np.column_stack([np.ones(len(rows)), x])
    terms = [RandomTerm(name="a", labels=first, design=fixed if slopes else None), RandomTerm(name="b", labels=second)]
    try:
        found = mixed_model(y, fixed, terms)
    except EvaluationError as error:
        assert str(error).endswith(".")
        return
    numbers = [found.sigma, found.loglik, *(value for one in found.fixed for value in (one.t, one.se, one.df, one.p))]
    assert np.isfinite([*numbers, *(one.sd for one in found.random)]).all()
    assert found.sigma > 0
    # Very few ratings may leave the search on a ridge, which the result says.
    assert found.converged or any("did not converge" in flag for flag in found.flags)
