import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import special, stats

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.effect_size import cliffs_delta, cohens_d, cohens_d_paired, hedges_g
from evaluation.statistics.noncentral_t import noncentrality_interval

# Student (1908), sleep gained by two drugs.
ONE = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0, 2]
TWO = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]
# Hess and Kromrey (2004), Robust confidence intervals for effect sizes.
TREATMENT, CONTROL = [10, 10, 20, 20, 20, 30, 30, 30, 40, 50], [10, 20, 30, 40, 40, 50]

values = hnp.arrays(float, st.integers(2, 12), elements=st.integers(-5, 5).map(float))
any_values = hnp.arrays(float, st.integers(0, 5), elements=st.sampled_from([1.0, 2.0, 1e6, 1e150, math.nan, math.inf]))


def test_d_and_its_interval():
    d = cohens_d(ONE, TWO)
    assert d.value == pytest.approx(-0.8321811, abs=1e-7)
    t, unit = stats.ttest_ind(ONE, TWO).statistic, math.sqrt(2 / 10)
    assert d.value == pytest.approx(t * unit)
    for end, p in zip(d.ci, (0.975, 0.025), strict=True):
        assert stats.nct.cdf(t, 18, end / unit) == pytest.approx(p, abs=1e-10)
    assert d.apa() == "d = -0.83, 95% CI [-1.74, 0.10]"


def test_the_published_example_of_a_noncentrality_interval():
    # Kelley (2007), Journal of Statistical Software 20(8), conf.limits.nct(ncp = 2.83, df = 126).
    low, high = noncentrality_interval(2.83, 126, confidence=0.95)
    assert (low, high) == pytest.approx((0.8337502, 4.8153592), abs=5e-6)


@pytest.mark.parametrize(("t", "df"), [(1200.0, 1e6), (5000.0, 2e6), (2e4, 40), (1e7, 3)])
def test_intervals_of_very_large_t(t, df):
    low, high = noncentrality_interval(t, df, confidence=0.9)
    # For large df and t, δ / t is nearly chi / sqrt(df), made wider by a normal deviate.
    expected = [math.sqrt(stats.chi2.ppf(p, df) / df) * t for p in (0.05, 0.95)]
    slack = 1.7 if df > 1e5 else 1e-4 * t
    assert low == pytest.approx(expected[0], abs=slack)
    assert high == pytest.approx(expected[1], abs=slack)


def test_pairs():
    differences = np.subtract(ONE, TWO)
    d = cohens_d_paired(ONE, TWO)
    assert d.value == pytest.approx(differences.mean() / differences.std(ddof=1))
    assert d.apa() == "d_z = -1.28, 95% CI [-2.12, -0.41]"
    average = cohens_d_paired(ONE, TWO, standardiser="average")
    unit = math.sqrt((np.var(ONE, ddof=1) + np.var(TWO, ddof=1)) / 2)
    assert average.value == pytest.approx(differences.mean() / unit)
    assert average.ci[0] / average.value == pytest.approx(d.ci[0] / d.value)


@pytest.mark.parametrize("n", [2, 3, 10, 101, 102, 400])
def test_g_takes_the_exact_bias_off(n):
    rng = np.random.default_rng(n)
    x, y = rng.normal(1, 1, n), rng.normal(0, 1, n)
    df = 2 * n - 2
    J = math.exp(special.gammaln(df / 2) - special.gammaln((df - 1) / 2)) / math.sqrt(df / 2)
    d, g = cohens_d(x, y), hedges_g(x, y)
    assert g.value == pytest.approx(J * d.value, rel=1e-12)
    assert g.ci == pytest.approx((J * d.ci[0], J * d.ci[1]), rel=1e-12)


def test_g_of_pairs_is_named():
    assert hedges_g(ONE, TWO, paired=True).name == "g_z"
    assert hedges_g(ONE, TWO, paired=True, standardiser="average").name == "g_av"


def test_cliff_as_published_and_by_the_table():
    found = cliffs_delta(TREATMENT, CONTROL)
    assert found.value == -0.25
    table = np.sign(np.subtract.outer(TREATMENT, CONTROL))
    n, m = table.shape
    rows, columns = table.mean(axis=1).var(ddof=1), table.mean(axis=0).var(ddof=1)
    cells = ((table + 0.25) ** 2).sum() / ((n - 1) * (m - 1))
    variance = ((m - 1) * rows + (n - 1) * columns + cells) / (n * m)
    z, d = stats.norm.ppf(0.975), -0.25
    half = z * math.sqrt(variance) * math.sqrt((1 - d**2) ** 2 + z**2 * variance)
    expected = [(d - d**3 + sign * half) / (1 - d**2 + z**2 * variance) for sign in (-1, 1)]
    assert found.ci == pytest.approx(expected)


@given(x=values, y=values)
def test_cliff_is_mann_and_whitney_and_turns_with_the_sides(x, y):
    found, turned = cliffs_delta(x, y), cliffs_delta(y, x)
    assert found.value == pytest.approx(np.sign(np.subtract.outer(x, y)).mean())
    assert found.ci == pytest.approx((-turned.ci[1], -turned.ci[0]))
    assert -1 <= found.ci[0] <= found.value <= found.ci[1] <= 1


def test_cliff_without_overlap():
    found = cliffs_delta([1, 2, 3], [4, 5])
    z = stats.norm.ppf(0.975)
    assert found.ci == pytest.approx((-1, -(2 - z**2) / (2 + z**2)))
    assert found.flags


@given(offset=st.sampled_from([0.0, 1e6, -1e9]), scale=st.sampled_from([1.0, 1e-3, 1e5]))
@settings(max_examples=9, deadline=None)
def test_offset_and_scale_change_nothing(offset, scale):
    x, y = (np.round(np.array(side) * 8) / 8 for side in (ONE, TWO))
    for effect in (cohens_d, cohens_d_paired, hedges_g, cliffs_delta):
        plain, moved = effect(x, y), effect(x * scale + offset, y * scale + offset)
        assert moved.value == pytest.approx(plain.value, rel=1e-3 if scale < 1 and offset else 1e-9)


@given(x=any_values, y=any_values)
@settings(max_examples=60, deadline=None)
@pytest.mark.filterwarnings("error")
def test_bad_data_give_an_error(x, y):
    for effect in (cohens_d, cohens_d_paired, hedges_g, cliffs_delta):
        try:
            found = effect(x, y)
        except EvaluationError:
            continue
        assert np.isfinite([found.value, *found.ci]).all()
        assert found.ci[0] <= found.value <= found.ci[1]


def test_what_has_no_effect_size_is_refused():
    with pytest.raises(InsufficientDataError):
        cohens_d([1, 1], [2, 2])
    with pytest.raises(InsufficientDataError):
        cohens_d_paired([1, 2], [2, 3])
    with pytest.raises(InsufficientDataError):
        hedges_g([1, 2], [2, 4], paired=True)
    with pytest.raises(DataError, match="pairs"):
        cohens_d_paired([1, 2], [2, 3, 4])
    with pytest.raises(DataError, match="standardiser"):
        cohens_d_paired(ONE, TWO, standardiser="pooled")
    with pytest.raises(DataError, match="confidence"):
        cliffs_delta(ONE, TWO, confidence=0)


def test_few_pairs_with_a_large_t():
    found = hedges_g([1.4118348, 1.2817177, 0.3470825], [2.9425146, 2.9533112, 1.9017858], paired=True)
    assert found.ci[0] < found.value < found.ci[1] < 0


@pytest.mark.parametrize("standardiser", ["difference", "average"])
def test_tiny_units_change_nothing(standardiser):
    plain = cohens_d_paired([5, 4, 1], [3, 4, 2], standardiser=standardiser)
    tiny = cohens_d_paired([5e-300, 4e-300, 1e-300], [3e-300, 4e-300, 2e-300], standardiser=standardiser)
    assert (tiny.value, *tiny.ci) == pytest.approx((plain.value, *plain.ci))
