import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.t_test import paired_t, student_t, welch_t

# Student (1908): hours of sleep gained with two drugs.
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0, 2]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]
TESTS = [paired_t, student_t, welch_t]


def test_students_sleep():
    # R: t.test(extra ~ group, data = sleep), paired and not.
    paired, welch = paired_t(DRUG_1, DRUG_2), welch_t(DRUG_1, DRUG_2)
    assert [paired.t, paired.p] == pytest.approx([-4.062127683382, 0.0028328901973843], rel=1e-12)
    assert paired.ci == pytest.approx((-2.4598858, -0.7001142), rel=1e-6)
    assert [round(welch.t, 4), round(welch.df, 3), round(welch.p, 5)] == [-1.8608, 17.776, 0.07939]
    assert welch.ci == pytest.approx((-3.3654832, 0.2054832), rel=1e-6)
    assert paired.d == pytest.approx(paired.t / math.sqrt(10))
    assert student_t(DRUG_1, DRUG_2).d == pytest.approx(-1.8608134674868526 * math.sqrt(2 / 10))


def test_the_sentences_and_the_frame():
    paired = paired_t(DRUG_1, DRUG_2)
    assert paired.apa() == "Paired t(9) = -4.06, p = .003, difference = -1.58, 95% CI [-2.46, -0.70], d = -1.28"
    assert student_t(DRUG_1, DRUG_2).apa().startswith("t(18) = -1.86, p = .079")
    assert welch_t(DRUG_1, DRUG_2).apa().startswith("Welch's t(17.78) = -1.86, p = .079")
    row = paired.to_frame().iloc[0]
    assert (row["ci_low"], row["n"]) == (paired.ci[0], 10)


@given(st.integers(2, 40), st.integers(0, 2**32), st.floats(0.5, 0.999))
@settings(max_examples=40)
def test_they_agree_with_scipy(n, seed, confidence):
    x, y = np.random.default_rng(seed).normal(size=(2, n)) * [[1], [3]]
    cases = [
        (paired_t, stats.ttest_rel(x, y), x, y),
        (student_t, stats.ttest_ind(x, y[:-1]), x, y[:-1]),
        (welch_t, stats.ttest_ind(x, np.append(y, 0.5), equal_var=False), x, np.append(y, 0.5)),
    ]
    for test, expected, one, other in cases:
        found = test(one, other, confidence=confidence)
        assert [found.t, found.p, found.df] == pytest.approx(
            [expected.statistic, expected.pvalue, expected.df], rel=1e-9, abs=1e-12
        )
        assert found.ci == pytest.approx(tuple(expected.confidence_interval(confidence)), rel=1e-8, abs=1e-10)


@given(st.integers(2, 10), st.integers(0, 2**32), st.sampled_from([2.0**-400, 2.0**440]))
@settings(max_examples=30)
def test_units_and_a_common_part_change_nothing_and_order_the_sign(n, seed, unit):
    x, y = np.random.default_rng(seed).integers(-9, 9, size=(2, n)).astype(float)
    assume(np.ptp(x) * np.ptp(y) * np.ptp(x - y) > 0)
    for test in TESTS:
        found, moved, turned = test(x, y), test((x + 2.0**20) * unit, (y + 2.0**20) * unit), test(y, x)
        assert (moved.t, moved.p, moved.d) == pytest.approx((found.t, found.p, found.d), rel=1e-8, abs=1e-12)
        assert (turned.t, turned.p, turned.d) == pytest.approx((-found.t, found.p, -found.d), rel=1e-9, abs=1e-12)


def test_equal_sizes_and_variances_make_welchs_test_students():
    x, y = [1.0, 2, 4], [11.0, 12, 14]
    one, other = welch_t(x, y), student_t(x, y)
    assert (one.t, one.df, one.p) == pytest.approx((other.t, other.df, other.p))


@pytest.mark.parametrize("test", TESTS)
def test_nothing_varies(test):
    found = test([1e6 + 0.1] * 3, [1e6 + 0.3] * 3)
    assert (found.t, found.p, found.d) == (-math.inf, 0, -math.inf)
    assert found.ci == pytest.approx((-0.2, -0.2))
    assert "infinite" in found.flags[0]
    with pytest.raises(InsufficientDataError, match="nothing to test"):
        test([1e6 + 0.1] * 3, [1e6 + 0.1] * 3)


@pytest.mark.parametrize("test", TESTS)
def test_bad_input(test):
    for x, y in (([], []), ([1], [1]), ([], [1])):
        with pytest.raises((InsufficientDataError, DataError)):
            test(x, y)
    for wrong in (math.nan, math.inf, None, "x", 1e300):
        with pytest.raises(DataError, match=r"^y: "):
            test([1, 2], [1, wrong])
    with pytest.raises(DataError, match="confidence"):
        test([1, 2], [3, 5], confidence=95)


def test_what_each_needs():
    with pytest.raises(DataError, match="needs pairs"):
        paired_t([1, 2, 3], [1, 2])
    with pytest.raises(InsufficientDataError, match="there is one"):
        paired_t([1], [2])
    with pytest.raises(InsufficientDataError, match="two values or more on each side"):
        welch_t([1, 2, 3], [1])
    assert student_t([1, 2, 3], [1]).df == 2
