import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.pairwise import mean_pairwise_pearson
from evaluation.statistics.correlation import pearson

seeds = st.integers(0, 2**32)

# Three raters, four items; the correlations are 1 (1 and 2), 0.6 (1 and 3) and 0.6 (2 and 3).
BY_HAND = np.array([[1, 2, 2], [2, 4, 1], [3, 6, 4], [4, 8, 3]], dtype=float)


def pair_by_pair(ratings):
    """Mean, pairs left out for too few common items, and for a constant side, each pair by itself."""
    raters = range(ratings.shape[1])
    found, few, constant = [], 0, 0
    for i in raters:
        for j in range(i):
            both = ~np.isnan(ratings[:, i]) & ~np.isnan(ratings[:, j])
            if both.sum() < 3:
                few += 1
            elif np.ptp(ratings[both, i]) == 0 or np.ptp(ratings[both, j]) == 0:
                constant += 1
            else:
                found.append(pearson(ratings[both, i], ratings[both, j]).r)
    return np.mean(found) if found else None, len(found), few, constant


def some_ratings(rng, items, raters, kind):
    ratings = rng.normal(size=(items, 1)) + rng.normal(size=(items, raters))
    return np.clip(np.round(3 + ratings), 1, 5) if kind == "whole" else ratings


kinds = pytest.mark.parametrize("kind", ["whole", "scores"])


class TestComplete:
    def test_by_hand(self):
        found = mean_pairwise_pearson(BY_HAND)
        assert found.r == pytest.approx(2.2 / 3, rel=1e-12)
        assert (found.items, found.raters, found.pairs) == (4, 3, 3)
        # W = (1 + 2 r) / 3 = 0.8222, as if it were Kendall's.
        W = (1 + 2 * 2.2 / 3) / 3
        assert (found.F, found.df1, found.df2) == pytest.approx(
            (2 * W / (1 - W), 3 - 2 / 3, 2 * (3 - 2 / 3)), rel=1e-12
        )
        assert found.p == pytest.approx(stats.f.sf(found.F, found.df1, found.df2), rel=1e-9)
        assert found.apa() == found.summary() == "mean pairwise r = .73 (3 pairs), F(2.33, 4.67) = 9.25, p = .022"
        assert found.to_frame().iloc[0]["r"] == found.r

    @kinds
    @given(seed=seeds, items=st.integers(3, 20), raters=st.integers(2, 7))
    @settings(max_examples=40)
    def test_it_is_the_mean_over_all_pairs(self, kind, seed, items, raters):
        ratings = some_ratings(np.random.default_rng(seed), items, raters, kind)
        expected, pairs, _, _ = pair_by_pair(ratings)
        if expected is None:
            with pytest.raises(InsufficientDataError):
                mean_pairwise_pearson(ratings)
            return
        found = mean_pairwise_pearson(ratings)
        assert found.r == pytest.approx(expected, abs=1e-12)
        assert found.pairs == pairs

    @given(seeds, st.integers(3, 30))
    def test_two_raters_are_tested_as_by_pearson(self, seed, items):
        ratings = np.random.default_rng(seed).normal(size=(items, 2))
        expected = pearson(*ratings.T)
        found = mean_pairwise_pearson(ratings)
        assert found.r == pytest.approx(expected.r, abs=1e-12)
        one_sided = expected.p / 2 if expected.r > 0 else 1 - expected.p / 2
        assert found.p == pytest.approx(one_sided, rel=1e-6)

    def test_of_ranks_it_is_kendalls_w(self):
        ranks = stats.rankdata(np.random.default_rng(2).normal(size=(9, 40)), axis=0)
        found = mean_pairwise_pearson(ranks)
        friedman = stats.friedmanchisquare(*ranks)
        assert 8 * (1 + 39 * found.r) == pytest.approx(friedman.statistic, rel=1e-12)
        assert found.p == pytest.approx(friedman.pvalue, abs=0.01)

    @pytest.mark.parametrize("kind", [float, "Int64", object])
    def test_the_kind_of_table_does_not_matter(self, kind):
        frame = pd.DataFrame(BY_HAND).astype(kind)
        for table in (frame, np.asfortranarray(BY_HAND), BY_HAND.tolist()):
            assert mean_pairwise_pearson(table).r == pytest.approx(2.2 / 3, rel=1e-12)
        gap = pd.DataFrame(np.vstack([BY_HAND, [math.nan] * 3])).astype(kind)
        assert mean_pairwise_pearson(gap.where(gap.notna(), pd.NA) if kind is object else gap).items == 4


@pytest.mark.parametrize("missing", [0, 0.3])
def test_a_large_common_part_and_the_scale_of_a_rater_cost_no_digits(missing):
    rng = np.random.default_rng(3)
    # Eighths and sixteenths can be written beside a million.
    ratings = rng.integers(0, 30, size=(40, 6)) / 8
    ratings[rng.random(ratings.shape) < missing] = math.nan
    expected = mean_pairwise_pearson(ratings)
    moved = mean_pairwise_pearson(ratings * [1, 2, 0.5, 1, 4, 1] + [1e6, -1e6, 3e6, 0, 1e6, 1e7])
    assert moved.r == pytest.approx(expected.r, rel=1e-11)
    assert moved.p == pytest.approx(expected.p, rel=1e-8)
    small = mean_pairwise_pearson(ratings * [1e-200, 1, 1e120, 1, 1, 1e-300])
    assert small.r == pytest.approx(expected.r, rel=1e-11)


class TestMissing:
    @kinds
    @given(seed=seeds, items=st.integers(3, 15), raters=st.integers(2, 6), missing=st.floats(0.05, 0.7))
    @settings(max_examples=60)
    def test_it_is_the_mean_over_all_pairs_that_have_a_correlation(self, kind, seed, items, raters, missing):
        rng = np.random.default_rng(seed)
        ratings = some_ratings(rng, items, raters, kind)
        ratings[rng.random(ratings.shape) < missing] = math.nan
        expected, pairs, _, _ = pair_by_pair(ratings)
        if expected is None:
            with pytest.raises(InsufficientDataError):
                mean_pairwise_pearson(ratings)
            return
        found = mean_pairwise_pearson(ratings)
        assert found.r == pytest.approx(expected, abs=1e-12)
        assert found.pairs == pairs
        assert 0 <= found.p <= 1

    @kinds
    def test_as_pandas_finds_it(self, kind):
        rng = np.random.default_rng(4)
        # More raters than are multiplied at once.
        ratings = some_ratings(rng, 12, 1100, kind)
        ratings[rng.random(ratings.shape) < 0.3] = math.nan
        pairs = pd.DataFrame(ratings[:, ::25]).corr(min_periods=3).to_numpy()[np.triu_indices(44, 1)]
        found = mean_pairwise_pearson(ratings[:, ::25])
        assert found.r == pytest.approx(np.nanmean(pairs), abs=1e-12)
        counts = (~np.isnan(ratings)).T.astype(int) @ ~np.isnan(ratings)
        enough = int((counts[np.triu_indices(1100, 1)] >= 3).sum())
        left_out = sum(int(flag.split()[0].replace(",", "")) for flag in mean_pairwise_pearson(ratings).flags[1:])
        assert mean_pairwise_pearson(ratings).pairs + left_out == enough

    def test_left_out_pairs_are_counted(self):
        ratings = np.array([[1, 2, 5, 1], [2, 1, 5, 2], [3, 4, 5, 3], [4, 3, math.nan, math.nan], [5, 6, 7, math.nan]])
        ratings[4, 3], ratings[:2, 1] = math.nan, math.nan
        expected, pairs, few, constant = pair_by_pair(ratings)
        found = mean_pairwise_pearson(ratings)
        assert (found.r, found.pairs) == (pytest.approx(expected), pairs)
        assert (pairs, few, constant) == (3, 2, 1)
        assert found.flags == (
            "2 pairs with fewer than 3 items in common left out.",
            "1 pair left out since one of the two gave the common items one rating.",
        )

    def test_a_common_part_that_varies_little_beside_the_rest_keeps_its_digits(self):
        rng = np.random.default_rng(5)
        small = rng.integers(1, 9, size=(10, 2)) / 7
        ratings = np.vstack([small, [1e9, math.nan], [math.nan, -1e8]])
        constant = ratings.copy()
        constant[:10, 0] = 0.1
        assert mean_pairwise_pearson(ratings).r == pytest.approx(pearson(*small.T).r, rel=1e-12)
        with pytest.raises(InsufficientDataError, match="No two raters vary on 3 or more items in common"):
            mean_pairwise_pearson(constant)

    def test_two_panels_are_as_good_as_twice_the_items(self):
        rng = np.random.default_rng(6)
        panels = rng.normal(size=(2, 10, 4))
        ratings = np.full((20, 8), math.nan)
        ratings[:10, :4], ratings[10:, 4:] = panels
        found = mean_pairwise_pearson(ratings)
        assert found.pairs == 12
        # Each panel is a chi-square with 9 degrees of freedom, so both together have 18, less 2 / 4 for four raters.
        assert (found.df1, found.df2) == pytest.approx((17.5, 3 * 17.5), rel=1e-12)


@pytest.mark.parametrize("missing", [0, 0.3])
def test_p_is_uniform_when_ratings_are_shuffled(missing):
    rng = np.random.default_rng(7)
    ratings = rng.integers(1, 6, size=(14, 6)).astype(float)
    gaps = rng.random(ratings.shape) < missing
    found = [mean_pairwise_pearson(np.where(gaps, math.nan, rng.permuted(ratings, axis=0))).p for _ in range(500)]
    assert stats.kstest(found, "uniform").pvalue > 0.01


class TestRatersWhoDoNotVary:
    @pytest.mark.parametrize("gap", [False, True])
    @pytest.mark.parametrize("constant", [0.1, 3, 1e9 + 0.1])
    def test_they_are_named_and_left_out(self, gap, constant):
        frame = pd.DataFrame(BY_HAND, columns=["a", "b", "c"]).assign(same=constant)
        if gap:
            frame.loc[4] = [1, math.nan, math.nan, constant]
        found = mean_pairwise_pearson(frame)
        assert found.r == pytest.approx(2.2 / 3)
        assert found.raters == 3
        assert found.flags == ("Raters who did not give two different ratings were left out: same.",)

    def test_a_rater_without_ratings_and_many_others(self):
        ratings = np.column_stack([BY_HAND, np.full((4, 12), 2), np.full(4, math.nan)])
        assert mean_pairwise_pearson(ratings).flags == (
            "Raters who did not give two different ratings were left out: 4, 5, 6, 7, 8, 9, 10, 11, 12, 13 and 3 more.",
        )

    def test_raters_who_agree_completely(self):
        found = mean_pairwise_pearson(np.repeat(BY_HAND[:, :1], 5, axis=1))
        assert found.r == pytest.approx(1, abs=1e-14)
        assert found.p == pytest.approx(0, abs=1e-12)

    def test_two_who_contradict_each_other(self):
        found = mean_pairwise_pearson([[1, 3], [2, 2], [3, 1]])
        assert (found.r, found.p) == pytest.approx((-1, 1))


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="there are 2 items and 3 raters"):
        mean_pairwise_pearson([[1, 2, 3], [2, 1, 4]])
    with pytest.raises(InsufficientDataError, match="there are 4 items and 1 raters"):
        mean_pairwise_pearson(BY_HAND[:, :1])
    with pytest.raises(InsufficientDataError, match="Fewer than two raters gave different ratings"):
        mean_pairwise_pearson(np.ones((4, 3)))
    for nothing in (np.full((4, 3), math.nan), np.diag([1.0, 2, 3, 4]) * math.nan):
        with pytest.raises(InsufficientDataError):
            mean_pairwise_pearson(nothing)
    for wrong in (math.inf, -math.inf, 1e200):
        with pytest.raises(DataError, match="ratings"):
            mean_pairwise_pearson(np.where(BY_HAND == 8, wrong, BY_HAND))
        with pytest.raises(DataError, match="ratings"):
            mean_pairwise_pearson(np.where(BY_HAND == 8, wrong, np.where(BY_HAND == 6, math.nan, BY_HAND)))
    with pytest.raises(DataError, match="items x raters"):
        mean_pairwise_pearson([1, 2, 3])
    with pytest.raises(DataError, match="not all numbers"):
        mean_pairwise_pearson([["a", "b"], ["c", "d"], ["e", "f"]])


@pytest.mark.parametrize("ratings", [[[5, 4], [3, 2], [2, 1.0]], [[0, 1, 5], [0.1, 1.1, 5.1], [0.7, 1.7, 5.7]]])
def test_perfect_agreement_has_no_bounded_f(ratings):
    found = mean_pairwise_pearson(ratings)
    assert (math.isinf(found.F), found.p) == (True, 0)
    assert found.flags == ("All raters agree perfectly but for level and scale, so F has no bound.",)
