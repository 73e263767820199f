import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import InsufficientDataError
from evaluation.statistics.bt500 import bt500_rejection, range_counts

seeds = st.integers(0, 2**32)


def bt500_by_loops(ratings):
    """Counts with exact fractions, one score at a time; ratings are whole numbers, None where missing."""
    above, below = [0] * len(ratings[0]), [0] * len(ratings[0])
    for row in ratings:
        there = [(rater, Fraction(int(score))) for rater, score in enumerate(row) if score is not None]
        if len(there) < 2:
            continue
        mean = sum(score for _, score in there) / len(there)
        second = sum((score - mean) ** 2 for _, score in there) / len(there)
        fourth = sum((score - mean) ** 4 for _, score in there) / len(there)
        if second == 0:
            continue
        variance = second * len(there) / (len(there) - 1)
        factor = 4 if 2 <= fourth / second**2 <= 4 else 20
        for rater, score in there:
            if (score - mean) ** 2 >= factor * variance:
                if score > mean:
                    above[rater] += 1
                else:
                    below[rater] += 1
    return above, below


class TestRangeCounts:
    @settings(deadline=None)
    @given(seeds, st.integers(2, 30), st.sampled_from([0.0, 0.2]), st.sampled_from([5, 9, 100]))
    def test_against_loops(self, seed, raters, missing, scale):
        rng = np.random.default_rng(seed)
        ratings = np.round(np.clip(rng.normal(scale / 2, scale / 6, (12, raters)), 1, scale))
        ratings[rng.random(ratings.shape) < 0.05] = scale
        ratings[rng.random(ratings.shape) < missing] = np.nan
        above, below = bt500_by_loops([[None if np.isnan(x) else x for x in row] for row in ratings])
        found = range_counts(ratings)
        assert (found.above.tolist(), found.below.tolist()) == (above, below)
        assert found.presentations.tolist() == (~np.isnan(ratings)).sum(axis=0).tolist()

    def test_by_hand(self):
        # Mean 3.25, SD 1.035, kurtosis 3.00: the 1 is 2.17 SD below.
        usual = [4, 3, 4, 3, 4, 3, 4, 1]
        found = range_counts([usual, [3] * 8])
        assert found.below.tolist() == [0] * 7 + [1]
        assert found.above.tolist() == [0] * 8
        assert found.share[-1] == 0.5
        assert found.asymmetry[-1] == 1
        assert math.isnan(found.asymmetry[0])

    def test_a_peak_needs_more(self):
        # Kurtosis 13.1 asks for the root of 20 (4.47) deviations; the lone 5 among 14 ones is 3.61 away, so it stays.
        assert range_counts([[1] * 14 + [5]]).above.sum() == 0
        # Among 29 ones it is 5.29 away.
        assert range_counts([[1] * 29 + [5]]).above.tolist() == [0] * 29 + [1]

    def test_nothing_rated(self):
        found = range_counts([[np.nan, 1, 2], [np.nan, 2, 2]])
        assert math.isnan(found.share[0])
        assert found.presentations[0] == 0

    @settings(deadline=None)
    @given(seeds, st.floats(-100, 100), st.floats(0.1, 10))
    def test_units_do_not_matter(self, seed, shift, scale):
        ratings = np.random.default_rng(seed).standard_t(4, size=(10, 15))
        one, two = range_counts(ratings), range_counts(shift + scale * ratings)
        assert (one.above.tolist(), one.below.tolist()) == (two.above.tolist(), two.below.tolist())

    def test_small_panels_are_flagged(self):
        found = range_counts([[1, 2, 3, 4, 5], [1, 1, 1, 1, 1]])
        assert found.flags == (
            "2 of 2 presentations have fewer than 6 raters, among whom no score can be out of range.",
            "5 of 5 raters have no scores out of range, so no asymmetry of these.",
        )
        assert bt500_rejection([[1, 2, 3, 4, 5], [1, 1, 1, 1, 1]]).flags == found.flags[:1]
        assert found.apa() == "0 of 10 scores by 5 raters are out of the range of their presentation"
        assert found.to_frame()["presentations"].tolist() == [2] * 5


class TestRejection:
    def test_scores_out_of_range_on_both_sides(self):
        rng = np.random.default_rng(1)
        ratings = rng.normal(5, 1, (200, 30))
        # Far out, now above and now below: one rater in thirty leaves the kurtosis of most presentations normal.
        ratings[::3, 4], ratings[1::3, 4] = 7.4, 2.6
        ratings[::2, 9] = 7.4
        found = bt500_rejection(ratings)
        assert np.flatnonzero(found.rejected).tolist() == [4]
        assert found.accepted.sum() == 29
        assert found.reasons[4].startswith("rejected: ")
        assert found.reasons[4].endswith("more than 5% and on both sides")
        assert found.reasons[9].endswith("most on one side")
        assert found.reasons[0].endswith("no more than 5%")
        assert found.apa() == "ITU-R BT.500 rejects 1 of 30 raters (number 5)"
        frame = found.to_frame()
        assert frame.loc[4, "rejected"]
        assert frame["reason"].tolist() == list(found.reasons)

    @settings(deadline=None, max_examples=30)
    @given(seeds)
    def test_it_follows_the_counts(self, seed):
        ratings = np.random.default_rng(seed).standard_t(3, size=(25, 15))
        found = bt500_rejection(ratings)
        out = found.counts.above + found.counts.below
        share = out / 25
        even = np.abs(found.counts.above - found.counts.below) / np.maximum(out, 1) < 0.3
        assert found.rejected.tolist() == ((share > 0.05) & even).tolist()

    def test_a_rater_without_scores_is_accepted(self):
        found = bt500_rejection([[1, np.nan], [2, np.nan]])
        assert found.reasons[1] == "accepted: no scores"
        assert found.apa() == "ITU-R BT.500 rejects 0 of 2 raters"

    def test_nothing_at_all(self):
        with pytest.raises(InsufficientDataError, match="no scores"):
            bt500_rejection(np.full((3, 3), np.nan))


@pytest.mark.parametrize("ratings", [np.full((3, 4), np.nan), np.empty((0, 4))])
def test_raters_without_scores_are_flagged(ratings):
    found = range_counts(ratings)
    assert np.isnan(found.share).all()
    assert found.flags == ("4 of 4 raters have no scores, so no share of them.",)
