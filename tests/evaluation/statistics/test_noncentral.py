import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics.noncentral import f_exceeds, f_power, t_exceeds


@settings(max_examples=60)
@given(st.floats(0.01, 30), st.floats(1, 10), st.floats(1, 300), st.floats(0.01, 100))
def test_the_noncentral_f_is_scipys(value, df_effect, df_error, noncentrality):
    assert f_exceeds(value, df_effect, df_error, noncentrality) == pytest.approx(
        stats.ncf.sf(value, df_effect, df_error, noncentrality), abs=1e-9
    )


@settings(max_examples=60)
@given(st.floats(-6, 6), st.floats(2, 300), st.floats(-6, 6).map(lambda value: round(value, 3)))
def test_the_noncentral_t_is_scipys(value, df, noncentrality):
    assert t_exceeds(value, df, noncentrality) == pytest.approx(stats.nct.sf(value, df, noncentrality), abs=1e-8)


def test_where_scipy_has_no_number_or_a_wrong_one():
    assert f_exceeds(1.8, 4, 375, 1520.0) == pytest.approx(1, abs=1e-12)
    for tiny in (0.0, 1e-300, 1e-130, 1e-16, 1e-13):
        assert f_exceeds(3.2, 2, 38, tiny) == pytest.approx(stats.f.sf(3.2, 2, 38), rel=1e-9)
        assert t_exceeds(1.1, 38, tiny) == pytest.approx(stats.t.sf(1.1, 38), rel=1e-9)


@pytest.mark.parametrize("df_error", [1, 3, 40, 1e5])
def test_no_step_where_the_series_ends(df_error):
    powers = [f_power(2, df_error, noncentrality, alpha=1e-5) for noncentrality in (0.99e6, 1.01e6)]
    assert powers[0] <= powers[1] + 1e-9
    assert powers[1] - powers[0] < 0.01


def test_samples_of_the_ratio_agree():
    rng = np.random.default_rng(1)
    ratio = rng.noncentral_chisquare(3, 8.0, 40_000) / 3 / (rng.chisquare(12, 40_000) / 12)
    found = f_power(3, 12, 8.0, alpha=0.05, df_test=30, inflation=1.5)
    assert found == pytest.approx(np.mean(1.5 * ratio > stats.f.isf(0.05, 3, 30)), abs=0.01)


@pytest.mark.parametrize("alpha", [0, 1, -0.1, math.nan])
def test_a_level_lies_between_0_and_1(alpha):
    with pytest.raises(DataError, match="alpha is"):
        f_power(2, 10, 1, alpha=alpha)


@pytest.mark.parametrize(
    ("value", "df", "noncentrality", "expected"),
    [
        # Where scipy's nctdtr has no number, or a few digits; by a sum over a million values of log s.
        (12, 1, 8.4, 0.5145613775698),
        (12, 1, 24, 0.95374857320817),
        (100, 2, 70, 0.38737483694676),
        (999, 2, 999, 0.63212019021318),
        (316, 3, 411, 0.83360208756026),
        (999, 1, 1299, 0.80650171162914),
        (10, 2, -10, 1.4521266695625e-27),
    ],
)
def test_the_noncentral_t_where_values_are_large(value, df, noncentrality, expected):
    assert t_exceeds(value, df, noncentrality) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("level", [0.3, 1e-12, 1e-30, 1e-100])
@pytest.mark.parametrize("df", [1, 2, 60, 1e6])
def test_the_far_tail_keeps_its_digits(df, level):
    assert t_exceeds(float(stats.t.isf(level, df)), df, 0.0) == pytest.approx(level, rel=1e-8)
