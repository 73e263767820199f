import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.correlation import pearson

values = hnp.arrays(float, st.integers(4, 30), elements=st.floats(-100, 100))


def columns(published, dimension):
    return tuple([row[dimension] for row in published["data"][side]] for side in ("input", "evaluated"))


@pytest.mark.parametrize("dimension", range(3))
def test_mtap_2013_table_8(case, dimension):
    published = case("mtap2013_table8")
    found = pearson(*columns(published, dimension))
    assert found.r == pytest.approx(published["expected"]["r"][dimension], abs=published["tolerance"]["atol"])
    assert found.r == pytest.approx(published["expected_full_digits"]["r"][dimension], rel=1e-12)
    assert found.p == pytest.approx(published["expected_full_digits"]["p"][dimension], rel=1e-12)
    assert found.n == 14


@pytest.mark.parametrize("dimension", range(3))
def test_acii_2007_table_8(case, dimension):
    published = case("acii2007_table8")
    found = pearson(*columns(published, dimension))
    assert found.r == pytest.approx(published["expected"]["r"][dimension], abs=published["tolerance"]["atol"])
    assert found.r == pytest.approx(published["expected_full_digits"]["r"][dimension], rel=1e-12)


def test_the_sentence_is_in_apa_style(case):
    found = pearson(*columns(case("mtap2013_table8"), 1))
    assert found.apa() == found.summary() == "r(12) = .57, 95% CI [.05, .84], p = .034"


def test_the_frame_has_full_digits(case):
    found = pearson(*columns(case("mtap2013_table8"), 1), confidence=0.9)
    row = found.to_frame().iloc[0]
    assert (row["r"], row["ci_low"], row["confidence"]) == (found.r, found.ci[0], 0.9)


@given(values, st.integers(0, 2**32))
def test_it_agrees_with_scipy(x, seed):
    y = np.random.default_rng(seed).normal(size=len(x)) + x / 100
    assume(np.ptp(x) > 1e-3)
    found, expected = pearson(x, y), stats.pearsonr(x, y)
    assert found.r == pytest.approx(expected.statistic, abs=1e-9)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-6, abs=1e-12)
    assert found.ci == pytest.approx(tuple(expected.confidence_interval()), abs=1e-9)
    line = np.polynomial.Polynomial.fit(x, y, 1).convert().coef
    assert (found.intercept, found.slope) == pytest.approx((line[0], line[1] if len(line) > 1 else 0.0), abs=1e-6)


@given(values, st.floats(0.1, 10), st.floats(-1e6, 1e6))
def test_scale_and_place_do_not_matter_but_the_direction_does(x, factor, shift):
    y = np.cos(np.arange(len(x)))
    assume(np.ptp(x) > 1e-2)
    found = pearson(x, y).r
    assert pearson(factor * x + shift, y).r == pytest.approx(found, abs=1e-6)
    assert pearson(-x, y).r == pytest.approx(-found, abs=1e-9)


def test_a_large_common_part_costs_no_digits():
    # Means of sevenths, which cannot be written beside 1e12.
    x, y = np.array([1.0, 2, 3, 4, 6, 8, 9]), np.array([2.0, 1, 4, 3, 9, 5, 6])
    assert pearson(x + 1e12, y - 1e12).r == pytest.approx(pearson(x, y).r, rel=1e-12)


def test_a_line_too_steep_for_a_number():
    with pytest.raises(DataError, match="use other units"):
        pearson([0, 1e-320, 0, 2e-320], [1, 3, 2, 4])


def test_three_pairs_have_no_interval():
    found = pearson([1, 2, 3], [1, 3, 2])
    assert found.ci is None
    assert found.apa() == "r(1) = .50, p = .667"
    assert found.flags == ("Three pairs give no interval for r.",)
    assert math.isnan(found.to_frame()["ci_low"].iloc[0])


def test_a_perfect_line():
    found = pearson([1, 2, 3, 4], [-1, -3, -5, -7])
    assert (found.r, found.p, found.slope, found.intercept) == pytest.approx((-1, 0, -2, 1), abs=1e-7)
    assert found.ci == pytest.approx((-1, -1))
    assert "All pairs lie on one line" in found.summary()


def test_values_so_small_that_their_squares_vanish():
    x, y = [1.0, 2, 3, 5, 4], [2.0, 1, 4, 3, 5]
    found = pearson(np.multiply(x, 1e-200), np.multiply(y, 1e80))
    assert found.r == pytest.approx(pearson(x, y).r, rel=1e-14)


@pytest.mark.parametrize("x", [[], [1], [1, 2]])
def test_fewer_than_three_pairs(x):
    with pytest.raises(InsufficientDataError, match="needs at least 3 pairs"):
        pearson(x, x)


@pytest.mark.parametrize("constant", [[0.1] * 5, [1e9 + 0.1] * 5, [0.0] * 5, [0.3, 0.1 + 0.2, 0.3, 0.3, 0.3]])
def test_a_side_that_does_not_vary(constant):
    with pytest.raises(InsufficientDataError, match="All 5 values of x are the same"):
        pearson(constant, [1, 2, 3, 4, 5])
    with pytest.raises(InsufficientDataError, match="All 5 values of y are the same"):
        pearson([1, 2, 3, 4, 5], constant)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1e300, None])
def test_what_is_no_finite_number(wrong):
    with pytest.raises(DataError, match=r"^y: "):
        pearson([1, 2, 3, 4], [1, 2, wrong, 4])


def test_other_bad_input():
    with pytest.raises(DataError, match="needs pairs"):
        pearson([1, 2, 3], [1, 2, 3, 4])
    with pytest.raises(DataError, match="not all numbers"):
        pearson(["a", "b", "c"], [1, 2, 3])
    with pytest.raises(DataError, match="dimensions"):
        pearson([[1, 2, 3]], [1, 2, 3])
    with pytest.raises(DataError, match="between 0 and 1"):
        pearson([1, 2, 3], [1, 3, 2], confidence=95)
