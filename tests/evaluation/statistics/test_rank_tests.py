import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.rank_tests import friedman, kruskal_wallis, mann_whitney, wilcoxon

# Hollander and Wolfe (1973), page 140: times of 22 players to first base by three methods of rounding; R's
# ?friedman.test gives chi squared 11.143, p = .003805.
ROUNDING_TIMES = np.array(
    [
        *([5.40, 5.50, 5.55], [5.85, 5.70, 5.75], [5.20, 5.60, 5.50], [5.55, 5.50, 5.40], [5.90, 5.85, 5.70]),
        *([5.45, 5.55, 5.60], [5.40, 5.40, 5.35], [5.45, 5.50, 5.35], [5.25, 5.15, 5.00], [5.85, 5.80, 5.70]),
        *([5.25, 5.20, 5.10], [5.65, 5.55, 5.45], [5.60, 5.35, 5.45], [5.05, 5.00, 4.95], [5.50, 5.50, 5.40]),
        *([5.45, 5.55, 5.50], [5.55, 5.55, 5.35], [5.45, 5.50, 5.55], [5.50, 5.45, 5.25], [5.65, 5.60, 5.40]),
        *([5.70, 5.65, 5.55], [6.30, 6.30, 6.25]),
    ]
)
# Student (1908): hours of sleep gained with two drugs.
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]

whole = st.integers(-9, 9).map(float)
values = hnp.arrays(float, st.integers(1, 12), elements=whole)
tables = hnp.arrays(float, st.tuples(st.integers(2, 9), st.integers(3, 5)), elements=whole)


@pytest.mark.parametrize("name", ["plantgrowth", "insectsprays"])
def test_published_cases_of_kruskal_wallis(case, name):
    published = case(name)
    groups = {}
    for value, group in zip(published["data"]["y"], published["data"]["group"], strict=True):
        groups.setdefault(group, []).append(value)
    found = kruskal_wallis(groups)
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    assert [found.H, found.p] == pytest.approx([expected["kruskal_H"], expected["kruskal_p"]], rel=rtol)
    assert found.epsilon_squared == pytest.approx(found.H / (found.n - 1))
    assert not found.flags
    if name == "plantgrowth":
        assert found.apa() == "H(2) = 7.99, p = .018, ε² = .28"


def test_rounding_times():
    found = friedman(ROUNDING_TIMES, ["round out", "narrow angle", "wide angle"])
    assert [found.chi_squared, found.p] == pytest.approx([11.14285714285714, 0.00380504077551136], rel=1e-12)
    assert found.apa() == "χ²(2, N = 22) = 11.14, p = .004, W = .25"
    assert sum(found.mean_ranks) == pytest.approx(6)
    assert found.names[1] == "narrow angle"
    assert not found.flags


def test_sleep_as_r_has_it():
    # R: wilcox.test gives V = 0, p = 0.009091 for the pairs and W = 25.5, p = 0.06933 for two groups.
    pairs, sides = wilcoxon(DRUG_1, DRUG_2), mann_whitney(DRUG_1, DRUG_2)
    assert (pairs.statistic, round(pairs.p, 6), pairs.method, pairs.n) == (0, 0.009091, "normal", (9,))
    assert (sides.statistic, round(sides.p, 5), sides.method) == (25.5, 0.06933, "normal")
    assert pairs.apa() == "Wilcoxon signed rank V = 0.00, p = .009, rank-biserial r = -1.00"
    assert sides.apa() == "Mann-Whitney U = 25.50, p = .069, rank-biserial r = -.49"


def test_hollander_and_wolfe_depression_scores():
    # Hollander and Wolfe (1973), page 29; R's ?wilcox.test: V = 40, two-sided p = 0.03906 (one-sided 0.01953).
    first = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
    second = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]
    found = wilcoxon(first, second)
    assert (found.statistic, found.method) == (40, "exact")
    assert found.p == pytest.approx(20 / 512)
    assert not found.flags


def test_permeability_of_membranes():
    # Hollander and Wolfe (1973), page 69; R's ?wilcox.test: W = 35, one-sided p = 0.1272.
    at_term = [0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46]
    early = [1.15, 0.88, 0.90, 0.74, 1.21]
    found = mann_whitney(at_term, early)
    assert (found.statistic, found.method, found.rank_biserial) == (35, "exact", pytest.approx(0.4))
    assert found.p == pytest.approx(2 * 0.1272, abs=1e-4)


@given(st.lists(values, min_size=2, max_size=4))
@settings(max_examples=30)
def test_kruskal_wallis_agrees_with_scipy(groups):
    assume(np.ptp(np.concatenate(groups)) > 0)
    found, expected = kruskal_wallis(dict(enumerate(groups))), stats.kruskal(*groups)
    assert [found.H, found.p] == pytest.approx([expected.statistic, expected.pvalue], rel=1e-9, abs=1e-9)
    assert bool(found.flags) == any(len(group) < 5 for group in groups)


@given(tables)
@settings(max_examples=30)
def test_friedman_agrees_with_scipy(table):
    assume((np.ptp(table, axis=1) > 0).any())
    found, expected = friedman(table), stats.friedmanchisquare(*table.T)
    assert [found.chi_squared, found.p] == pytest.approx([expected.statistic, expected.pvalue], rel=1e-9, abs=1e-9)
    assert 0 <= found.W <= 1 + 1e-12


@given(values, values)
@settings(max_examples=40)
def test_two_sides_agree_with_scipy_and_change_with_their_order(x, y):
    assume(np.ptp(np.concatenate([x, y])) > 0)
    found, turned = mann_whitney(x, y), mann_whitney(y, x)
    method = "exact" if found.method == "exact" else "asymptotic"
    assert found.p == pytest.approx(stats.mannwhitneyu(x, y, method=method).pvalue, rel=1e-9)
    assert (found.p, found.rank_biserial) == pytest.approx((turned.p, -turned.rank_biserial))


@given(hnp.arrays(float, st.tuples(st.integers(1, 60), st.just(2)), elements=whole))
@settings(max_examples=40)
def test_pairs_agree_with_scipy_and_change_with_their_order(pairs):
    x, y = pairs.T
    assume((x != y).any())
    found, turned = wilcoxon(x, y), wilcoxon(y, x)
    assert (found.p, found.rank_biserial) == pytest.approx((turned.p, -turned.rank_biserial))
    n = found.n[0]
    assume(found.method == "normal" and found.statistic != n * (n + 1) / 4)
    expected = stats.wilcoxon(x, y, correction=True, method="asymptotic").pvalue
    assert found.p == pytest.approx(expected, rel=1e-7)


def test_two_conditions_and_few_subjects():
    found = friedman([[1, 2], [1, 3], [2, 4], [3, 1]])
    # Of two conditions it is the sign test: (3 - 1)² / 4.
    assert (found.chi_squared, found.df) == (pytest.approx(1), 1)
    assert found.flags == ("There are only 4 subjects, so p is rough.",)


def test_differences_that_differ_by_rounding_are_flagged():
    found = wilcoxon([0.3, 1.3, 2.0, 5.0], [0.1, 1.1, 1.0, 1.0])
    assert "rounding" in found.flags[0]
    assert not wilcoxon([3, 13, 20, 50], [1, 11, 10, 10]).flags


def test_too_little():
    for groups in ({}, {"a": [1, 2]}, {"a": [1], "b": []}, {"a": [2, 2], "b": [2]}):
        with pytest.raises(InsufficientDataError):
            kruskal_wallis(groups)
    for table in ([[1, 2, 3]], [[1], [2]], [[1, 1], [2, 2]], np.empty((0, 3))):
        with pytest.raises(InsufficientDataError):
            friedman(table)
    for x, y in (([], [1]), ([1], []), ([2, 2], [2])):
        with pytest.raises(InsufficientDataError):
            mann_whitney(x, y)
    for x, y in (([], []), ([1, 2], [1, 2]), ([0.3, 1e6], [0.1 + 0.2, 1e6])):
        with pytest.raises(InsufficientDataError, match="No pair differs"):
            wilcoxon(x, y)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, None, "x"])
def test_what_is_no_finite_number(wrong):
    with pytest.raises(DataError, match="group b"):
        kruskal_wallis({"a": [1, 2], "b": [wrong]})
    with pytest.raises(DataError, match="matrix"):
        friedman([[1, 2], [3, wrong]])
    for test in (mann_whitney, wilcoxon):
        with pytest.raises(DataError, match=r"^y: "):
            test([1, 2], [1, wrong])
    with pytest.raises(DataError, match="needs pairs"):
        wilcoxon([1, 2], [1])
    with pytest.raises(DataError, match="different names"):
        friedman([[1, 2], [3, 4]], ["a", "a"])


def test_the_frames():
    assert kruskal_wallis({"a": [1, 2, 3, 4, 5], "b": [2, 3, 4, 5, 7]}).to_frame()["n"].item() == 10
    assert friedman(ROUNDING_TIMES).to_frame()["df"].item() == 2
    assert wilcoxon(DRUG_1, DRUG_2).to_frame()["n"].item() == 9
