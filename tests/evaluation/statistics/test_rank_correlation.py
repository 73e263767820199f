import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.rank_correlation import kendall, spearman

seeds = st.integers(0, 2**32)
both = pytest.mark.parametrize("correlate", [spearman, kendall])

# Tuna: Hollander and Wolfe (1973), Nonparametric Statistical Methods, p. 187, the example of R's cor.test, which prints
# tau = .4444444 with p = .1194 and rho = .6 with p = .0968.
LIGHTNESS = [44.4, 45.9, 41.9, 53.3, 44.7, 44.1, 50.7, 45.2, 60.1]
PANEL = [2.6, 3.1, 2.5, 5.0, 3.6, 4.0, 5.2, 2.8, 3.8]


class TestTuna:
    def test_kendall(self):
        found = kendall(LIGHTNESS, PANEL)
        assert found.value == pytest.approx(0.4444444, abs=5e-8)
        assert found.p == pytest.approx(0.1194, abs=5e-5)
        assert found.test == "exact"

    def test_spearman(self):
        found = spearman(LIGHTNESS, PANEL)
        assert found.value == pytest.approx(0.6, abs=1e-12)
        assert found.p == pytest.approx(0.0968, abs=5e-5)
        assert found.test == "exact"

    def test_the_intervals_by_hand(self):
        rho, tau = spearman(LIGHTNESS, PANEL, confidence=0.9), kendall(LIGHTNESS, PANEL)
        half = 1.6448536 * math.sqrt((1 + 0.6**2 / 2) / 6)
        assert rho.ci == pytest.approx((math.tanh(math.atanh(0.6) - half), math.tanh(math.atanh(0.6) + half)), abs=1e-7)
        half = 1.9599640 * math.sqrt(0.437 / 5)
        centre = math.atanh(4 / 9)
        assert tau.ci == pytest.approx((math.tanh(centre - half), math.tanh(centre + half)), abs=1e-7)

    def test_sentences_and_frames(self):
        rho, tau = spearman(LIGHTNESS, PANEL), kendall(LIGHTNESS, PANEL)
        assert rho.apa() == rho.summary() == "rs(7) = .60, 95% CI [-.17, .92], exact p = .097"
        assert tau.apa() == "τb = .44, 95% CI [-.10, .78], n = 9, exact p = .119"
        assert rho.to_frame().iloc[0]["value"] == rho.value
        assert tau.to_frame().iloc[0][["coefficient", "test"]].tolist() == ["Kendall's tau-b", "exact"]


@pytest.mark.parametrize("n", [3, 5, 6])
def test_the_exact_p_of_spearman_counts_all_orders(n):
    rho = np.array([stats.pearsonr(range(n), order).statistic for order in itertools.permutations(range(n))])
    for order in itertools.islice(itertools.permutations(range(n)), 0, None, 7):
        found = spearman(range(n), order)
        assert found.p == pytest.approx(np.mean(np.abs(rho) >= abs(found.value) - 1e-9), rel=1e-12)


def test_ten_pairs_in_one_order():
    assert spearman(range(10), range(10)).p == pytest.approx(2 / math.factorial(10), rel=1e-12)
    assert spearman(range(10), range(10, 0, -1)).value == -1


@settings(max_examples=50)
@given(seeds, st.integers(11, 60), st.booleans())
def test_they_agree_with_scipy(seed, n, ties):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=n)
    y = x + 2 * rng.normal(size=n)
    if ties:
        x, y = np.append(np.round(x), [7, 8]), np.append(np.round(y), [7, 7])
    rho, tau = spearman(x, y), kendall(x, y)
    expected = stats.spearmanr(x, y)
    assert (rho.value, rho.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-9, abs=1e-12)
    exact = not ties and n <= 50
    expected = stats.kendalltau(x, y, method="exact" if exact else "asymptotic")
    assert (tau.value, tau.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-9, abs=1e-12)
    assert (rho.test, tau.test) == ("t", "exact" if exact else "normal")


@both
@given(seed=seeds, n=st.integers(5, 20))
def test_any_transformation_that_keeps_the_order_changes_nothing(correlate, seed, n):
    x, y = np.random.default_rng(seed).normal(size=(2, n))
    found = correlate(x, y)
    assert correlate(np.exp(x), 3 * y + 1e6) == found
    assert correlate(-x, y).value == pytest.approx(-found.value, abs=1e-12)
    assert correlate(y, x).value == pytest.approx(found.value, abs=1e-12)


@both
def test_values_that_differ_by_rounding_only_are_ties(correlate):
    assert correlate([0.1 + 0.2, 0.3, 1, 2, 3], [1, 2, 3, 4, 6]) == correlate([0.3, 0.3, 1, 2, 3], [1, 2, 3, 4, 6])


@both
def test_ties_among_few_pairs_are_flagged(correlate):
    found = correlate([1, 1, 2, 3, 4], [1, 3, 2, 4, 5])
    assert found.flags == ("With ties among so few pairs p is only an approximation.",)
    assert "exact" not in found.apa()


def test_too_few_pairs_for_an_interval():
    assert spearman([1, 2, 3], [1, 3, 2]).flags == ("The interval needs at least 4 pairs.",)
    found = kendall([1, 2, 3, 4], [1, 3, 2, 4])
    assert found.ci is None
    assert math.isnan(found.to_frame()["ci_low"].iloc[0])
    assert found.summary() == "τb = .67, n = 4, exact p = .333\nThe interval needs at least 5 pairs."


@both
def test_bad_input(correlate):
    with pytest.raises(InsufficientDataError, match="needs at least 3 pairs"):
        correlate([1, 2], [1, 2])
    with pytest.raises(InsufficientDataError, match="All 4 values of y are the same"):
        correlate([1, 2, 3, 4], [0.3, 0.1 + 0.2, 0.3, 0.3])
    for wrong in (math.nan, math.inf, None):
        with pytest.raises(DataError, match=r"^x: "):
            correlate([1, wrong, 3, 4], [1, 2, 3, 4])
    with pytest.raises(DataError, match="needs pairs"):
        correlate([1, 2, 3], [1, 2, 3, 4])
    with pytest.raises(DataError, match="between 0 and 1"):
        correlate([1, 2, 3], [1, 3, 2], confidence=95)
