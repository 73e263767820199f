import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.equivalence import tost_independent, tost_one_sample, tost_paired

# Student (1908), sleep gained by two drugs.
ONE = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0, 2])
TWO = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])

any_values = hnp.arrays(float, st.integers(0, 5), elements=st.sampled_from([1.0, 2.0, 2.5, 1e6, math.nan, math.inf]))


def test_paired_as_two_t_tests():
    found = tost_paired(ONE, TWO, bounds=(-2, 3))
    above = stats.ttest_1samp(ONE - TWO, -2, alternative="greater")
    below = stats.ttest_1samp(ONE - TWO, 3, alternative="less")
    assert (found.t_lower, found.p_lower) == pytest.approx((above.statistic, above.pvalue))
    assert (found.t_upper, found.p_upper) == pytest.approx((below.statistic, below.pvalue))
    assert (found.t, found.p) == pytest.approx((-4.062127683382, 0.0028328901973843))
    assert found.ci == pytest.approx(tuple(stats.ttest_rel(ONE, TWO).confidence_interval(0.9)))
    assert found.p_tost == found.p_lower


def test_independent_as_welch():
    found = tost_independent(ONE, TWO[:7], bounds=2)
    above = stats.ttest_ind(ONE + 2, TWO[:7], equal_var=False, alternative="greater")
    below = stats.ttest_ind(ONE - 2, TWO[:7], equal_var=False, alternative="less")
    assert (found.p_lower, found.p_upper, found.df) == pytest.approx((above.pvalue, below.pvalue, above.df))


def test_one_sample():
    found = tost_one_sample(ONE, reference=1, bounds=1.5)
    assert found.p_lower == pytest.approx(stats.ttest_1samp(ONE, -0.5, alternative="greater").pvalue)
    assert found.p_upper == pytest.approx(stats.ttest_1samp(ONE, 2.5, alternative="less").pvalue)


@pytest.mark.parametrize(
    ("mean", "bounds", "verdict"),
    [(0.0, 1.0, "equivalent"), (0.5, 1.0, "both"), (2.0, 1.0, "different"), (0.1, 0.05, "inconclusive")],
)
def test_verdicts(mean, bounds, verdict):
    noise = np.tile([-1.0, 1.0], 50)
    found = tost_one_sample(noise + mean, bounds=bounds)
    assert found.verdict == verdict
    assert (found.verdict in ("equivalent", "both")) == (-bounds <= found.ci[0] and found.ci[1] <= bounds)


def test_standardised_bounds_are_flagged():
    found = tost_paired(ONE, TWO, bounds=0.5, standardised=True)
    assert found.bounds[1] == pytest.approx(0.5 * np.std(ONE - TWO, ddof=1))
    assert "standard deviations" in found.flags[0]
    both = tost_independent(ONE, TWO, bounds=0.5, standardised=True)
    assert both.bounds[1] == pytest.approx(0.5 * math.sqrt((np.var(ONE, ddof=1) + np.var(TWO, ddof=1)) / 2))


def test_the_sentence_and_the_table():
    found = tost_paired(ONE, TWO, bounds=1)
    assert found.apa() == (
        "Difference = -1.58, 90% CI [-2.29, -0.87], bounds [-1.00, 1.00], TOST t(9) = -1.49, p = .915; "
        "difference from 0 t(9) = -4.06, p = .003: different from 0, and not shown to be equivalent"
    )
    assert found.to_frame()["p"].tolist() == [found.p_lower, found.p_upper, found.p]


def test_an_offset_changes_nothing():
    x, y = np.round(ONE * 8) / 8, np.round(TWO * 8) / 8
    for test in (tost_paired, tost_independent):
        plain, moved = test(x, y, bounds=1), test(x + 1e9, y + 1e9, bounds=1)
        assert (moved.t, moved.p_tost) == pytest.approx((plain.t, plain.p_tost), rel=1e-12)


@given(x=any_values, y=any_values)
@settings(max_examples=60, deadline=None)
@pytest.mark.filterwarnings("error")
def test_bad_data_give_an_error(x, y):
    for test in (tost_paired, tost_independent):
        try:
            found = test(x, y, bounds=1)
        except EvaluationError:
            continue
        assert np.isfinite([found.p_lower, found.p_upper, found.p, *found.ci]).all()


@pytest.mark.parametrize("bounds", [0, -1, (1, 1), (2, 1), (1, 2, 3), math.nan])
def test_bounds_are_checked(bounds):
    with pytest.raises(DataError, match="bounds"):
        tost_paired(ONE, TWO, bounds=bounds)


def test_what_cannot_be_tested_is_refused():
    with pytest.raises(InsufficientDataError):
        tost_paired([1, 2], [2, 3], bounds=1)
    with pytest.raises(InsufficientDataError):
        tost_independent([1, 1], [2, 2], bounds=1)
    with pytest.raises(InsufficientDataError):
        tost_one_sample([1], bounds=1)
    with pytest.raises(DataError, match="alpha"):
        tost_one_sample([1, 2], bounds=1, alpha=0.5)
    with pytest.raises(DataError, match="pairs"):
        tost_paired([1], [1, 2], bounds=1)


def test_tiny_units_change_nothing():
    plain = tost_paired([5, 4, 1], [3, 4, 2], bounds=1)
    tiny = tost_paired([5e-300, 4e-300, 1e-300], [3e-300, 4e-300, 2e-300], bounds=1e-300)
    assert (tiny.t, tiny.p_lower, tiny.p_upper) == pytest.approx((plain.t, plain.p_lower, plain.p_upper))
