import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.power import FTestAnovaPower, TTestIndPower, TTestPower

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.power.closed_form import (
    correlation_power,
    effect_f,
    independent_t_power,
    one_way_power,
    paired_t_power,
    repeated_measures_power,
    required_n,
)

few = settings(max_examples=40)
levels = st.floats(0.001, 0.2)


@pytest.mark.parametrize(
    ("f", "groups", "n"),
    # Cohen (1992), A power primer, Psychological Bulletin 112:155, Table 2: power .80 at .05, cases in each group.
    [(0.10, 3, 322), (0.25, 3, 52), (0.40, 3, 21), (0.25, 4, 45), (0.40, 5, 16), (0.25, 2, 64)],
)
def test_cohens_table_of_the_analysis_of_variance(f, groups, n):
    found = required_n(lambda count: one_way_power(f, count, groups).power)
    assert found is not None
    # The printed numbers come from rounded tables.
    assert abs(found - n) <= 1


@pytest.mark.parametrize(("d", "n"), [(0.2, 393), (0.5, 64), (0.8, 26)])
def test_cohens_table_of_the_t_test(d, n):
    found = required_n(lambda count: independent_t_power(d, count).power)
    assert found is not None
    assert abs(found - n) <= 1


@pytest.mark.parametrize(("r", "n"), [(0.1, 783), (0.3, 85), (0.5, 28)])
def test_cohens_table_of_the_correlation(r, n):
    found = required_n(lambda count: correlation_power(r, count).power, least=3)
    assert found is not None
    assert abs(found - n) <= 1


def test_numbers_that_g_power_prints():
    # Its defaults: t test of matched pairs, d_z 0.5; repeated measures within, f 0.25, 3 times, correlation 0.5.
    assert required_n(lambda n: paired_t_power(0.5, n).power) == 34
    assert required_n(lambda n: repeated_measures_power(0.25, n, 3, correlation=0.5).power) == 28
    assert required_n(lambda n: one_way_power(0.25, n, 3).power) == 53


@few
@given(st.floats(0, 2), st.integers(2, 80), st.integers(2, 8), levels)
def test_one_way_agrees_with_statsmodels(f, n, groups, alpha):
    expected = FTestAnovaPower().power(f, n * groups, alpha, groups)
    assume(math.isfinite(expected))
    assert one_way_power(f, n, groups, alpha=alpha).power == pytest.approx(expected, abs=1e-9)


@few
@given(st.floats(-2, 2), st.integers(2, 80), levels)
def test_paired_t_agrees_with_statsmodels(d, n, alpha):
    two, one = (TTestPower().power(d, n, alpha, alternative=kind) for kind in ("two-sided", "larger"))
    # statsmodels gives NaN where the tail on the wrong side is too small.
    assume(math.isfinite(two + one))
    assert paired_t_power(d, n, alpha=alpha).power == pytest.approx(two, abs=1e-9)
    assert paired_t_power(d, n, alpha=alpha, alternative="greater").power == pytest.approx(one, abs=1e-9)


@few
@given(st.floats(-2, 2), st.integers(2, 60), st.integers(2, 60), levels)
def test_independent_t_agrees_with_statsmodels(d, n, other, alpha):
    expected = TTestIndPower().power(d, n, alpha, ratio=other / n)
    assume(math.isfinite(expected))
    assert independent_t_power(d, n, other, alpha=alpha).power == pytest.approx(expected, abs=1e-9)


@few
@given(st.floats(-2, 2), st.integers(2, 80), levels)
def test_two_groups_are_a_t_test(d, n, alpha):
    assert one_way_power(abs(d) / 2, n, 2, alpha=alpha).power == pytest.approx(
        independent_t_power(d, n, alpha=alpha).power, abs=1e-12
    )


@few
@given(st.floats(0, 2), st.integers(2, 80), st.floats(-0.9, 0.9), levels)
def test_two_repeated_measures_are_a_paired_t_test(f, n, correlation, alpha):
    # Two means that lie 2 f apart, in units of the SD within conditions; the differences have the variance 2 (1 - r).
    d_z = 2 * f / math.sqrt(2 * (1 - correlation))
    assert repeated_measures_power(f, n, 2, correlation=correlation, alpha=alpha).power == pytest.approx(
        paired_t_power(d_z, n, alpha=alpha).power, abs=1e-9
    )


def test_measures_within_help_as_they_correlate_and_departures_from_sphericity_cost():
    powers = [repeated_measures_power(0.25, 20, 3, correlation=r).power for r in (0.0, 0.3, 0.6, 0.9)]
    assert powers == sorted(powers)
    assert repeated_measures_power(0.25, 20, 3, correlation=0.5, epsilon=0.6).power < powers[2]


@pytest.mark.parametrize(("r", "n"), [(0.569, 14), (-0.3, 84), (0.85, 6), (0.02, 500)])
def test_the_power_of_a_correlation_is_that_of_t_mixed_over_samples_of_x(r, n):
    critical, slope = stats.t.isf(0.025, n - 2), r / math.sqrt(1 - r * r)
    # Given x, t is noncentral with the root of the sum of squares of x, which is chi-squared.
    roots = np.sqrt(stats.chi2.ppf((np.arange(2000) + 0.5) / 2000, n - 1))
    expected = np.mean(stats.nct.sf(critical, n - 2, slope * roots) + stats.nct.cdf(-critical, n - 2, slope * roots))
    assert correlation_power(r, n).power == pytest.approx(expected, abs=2e-4)


def test_a_correlation_nears_what_fishers_z_says():
    approximate = stats.norm.sf(stats.norm.isf(0.025) - math.atanh(0.15) * math.sqrt(397))
    assert correlation_power(0.15, 400).power == pytest.approx(approximate, abs=0.003)


@few
@given(st.floats(-0.9999, 0.9999), st.integers(3, 5000), levels)
def test_the_power_of_a_correlation_is_a_probability_not_below_the_level(r, n, alpha):
    power = correlation_power(r, n, alpha=alpha).power
    assert alpha - 1e-9 <= power <= 1
    assert correlation_power(-r, n, alpha=alpha).power == power


@few
@given(st.integers(2, 500), st.integers(2, 6), levels)
def test_without_an_effect_the_power_is_the_level(n, groups, alpha):
    for found in (
        one_way_power(0, n, groups, alpha=alpha),
        repeated_measures_power(0, n, groups, alpha=alpha),
        paired_t_power(0, n, alpha=alpha),
        paired_t_power(0, n, alpha=alpha, alternative="greater"),
        correlation_power(0, n + 1, alpha=alpha),
    ):
        assert found.power == pytest.approx(alpha, abs=1e-9), found.test


@few
@given(st.floats(0, 1000), st.integers(2, 10**6), st.floats(1e-12, 0.999))
def test_no_size_of_effect_or_sample_breaks_the_series(f, n, alpha):
    for found in (one_way_power(f, n, 3, alpha=alpha), paired_t_power(f, n, alpha=alpha, alternative="greater")):
        assert alpha * (1 - 1e-6) - 1e-9 <= found.power <= 1


def test_effect_f_of_table_10():
    assert effect_f([2.62, 3.75, 4.36], 0.63468) == pytest.approx(1.1357, abs=1e-3)
    # By F = f² k (n - 1) n / ((k - 1) n) of groups of equal size, with sums of squares.
    assert effect_f([2.62, 3.75, 4.36], 0.63468) ** 2 * 60 / 2 == pytest.approx(38.7, rel=1e-3)


def test_required_numbers():
    assert required_n(lambda n: n / 100, target=0.37) == 37
    assert required_n(lambda n: n / 100, target=0.37, least=10, step=4) == 38
    assert required_n(lambda _: 0.9, least=5) == 5
    assert required_n(lambda n: n / 100, target=0.8, most=79) is None
    assert required_n(lambda n: n / 100, target=0.8, most=80) == 80
    assert required_n(lambda n: one_way_power(0.0, n, 3).power, most=10**6) is None


def test_sentences_and_tables():
    found = one_way_power(0.25, 53, 3)
    assert found.apa() == (
        "A one-way analysis of variance of 3 groups of 53 has a power of .80 to find f = 0.25 at α = .05."
    )
    assert found.to_frame().loc[0, ["df_1", "df_2", "noncentrality"]].tolist() == [2, 156, pytest.approx(9.9375)]
    assert paired_t_power(0.5, 34).to_frame().loc[0, "df_2"] == 33
    assert "over .999" in correlation_power(0.9, 100).summary()
    assert "to find r = .30" in correlation_power(0.3, 84).summary()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: one_way_power(-0.1, 10, 3), "effect size is -0.1"),
        (lambda: one_way_power(math.nan, 10, 3), "effect size is nan"),
        (lambda: one_way_power(0.1, 1, 3), "n is 1"),
        (lambda: one_way_power(0.1, 10.5, 3), "n is 10.5"),
        (lambda: one_way_power(0.1, True, 3), "n is True"),
        (lambda: one_way_power(0.1, 10, 1), "number of groups is 1"),
        (lambda: one_way_power(0.1, 10, 3, alpha=0), "alpha is 0"),
        (lambda: repeated_measures_power(0.1, 10, 3, correlation=1), "correlation is 1"),
        (lambda: repeated_measures_power(0.1, 10, 3, correlation=-0.5), "between -0.5 and 1"),
        (lambda: repeated_measures_power(0.1, 10, 3, epsilon=0.4), "epsilon is 0.4"),
        (lambda: repeated_measures_power(0.1, 10, 1), "number of conditions is 1"),
        (lambda: paired_t_power(0.1, 10, alternative="less"), "'two-sided' or 'greater'"),
        (lambda: paired_t_power(0.1, 10, alpha=1.5), "alpha is 1.5"),
        (lambda: paired_t_power(math.inf, 10), "effect size is inf"),
        (lambda: independent_t_power(0.1, 1), "number of values is 2"),
        (lambda: correlation_power(1, 10), "correlation is 1"),
        (lambda: correlation_power(0.1, 2), "n is 2"),
        (lambda: correlation_power(math.nan, 10), "correlation is nan"),
        (lambda: effect_f([1, math.nan], 1), "missing or infinite"),
        (lambda: effect_f([1, 2], 0), "standard deviation is 0"),
        (lambda: required_n(lambda n: n, target=1), "power wanted is 1"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(DataError, match=message):
        call()
    with pytest.raises(InsufficientDataError, match="two means"):
        effect_f([1], 1)


@pytest.mark.parametrize("n", [2, 3, 4, 11])
def test_a_level_that_is_next_to_nothing(n):
    assert 0 <= paired_t_power(0.5, n, alpha=1e-300, alternative="greater").power < 1e-200


def test_a_correlation_has_no_noncentrality():
    found = correlation_power(0.3, 20)
    assert found.noncentrality is None and math.isnan(found.to_frame()["noncentrality"][0])
