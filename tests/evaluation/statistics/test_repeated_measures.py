import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.repeated_measures import repeated_measures, repeated_measures_by_unit
from evaluation.statistics.t_test import paired_t

# Hollander and Wolfe (1973), page 140: times of 22 players to first base by three methods; the expected values by R's
# afex 1.2-1.
ROUNDING_TIMES = np.array(
    [
        *([5.40, 5.50, 5.55], [5.85, 5.70, 5.75], [5.20, 5.60, 5.50], [5.55, 5.50, 5.40], [5.90, 5.85, 5.70]),
        *([5.45, 5.55, 5.60], [5.40, 5.40, 5.35], [5.45, 5.50, 5.35], [5.25, 5.15, 5.00], [5.85, 5.80, 5.70]),
        *([5.25, 5.20, 5.10], [5.65, 5.55, 5.45], [5.60, 5.35, 5.45], [5.05, 5.00, 4.95], [5.50, 5.50, 5.40]),
        *([5.45, 5.55, 5.50], [5.55, 5.55, 5.35], [5.45, 5.50, 5.55], [5.50, 5.45, 5.25], [5.65, 5.60, 5.40]),
        *([5.70, 5.65, 5.55], [6.30, 6.30, 6.25]),
    ]
)
# Maxwell and Delaney (1990), page 497: reaction times, three angles with and without noise; the expected values by R's
# ?mauchly.test and ?anova.mlm, contrasts orthogonal to ~1.
REACTION_TIMES = np.array(
    [
        *([420, 420, 480, 480, 600, 780], [420, 480, 480, 360, 480, 600], [480, 480, 540, 660, 780, 780]),
        *([420, 540, 540, 480, 780, 900], [540, 660, 540, 480, 660, 720], [360, 420, 360, 360, 480, 540]),
        *([480, 480, 600, 540, 720, 840], [480, 600, 660, 540, 720, 900], [540, 600, 540, 480, 720, 780]),
        [480, 420, 540, 540, 660, 780],
    ]
)


def test_rounding_times():
    found = repeated_measures(ROUNDING_TIMES)
    assert (found.df_conditions, found.df_error, found.n) == (2, 42, 22)
    assert [found.F, found.p, found.p_gg] == pytest.approx([6.28831, 0.0040841, 0.0084398], rel=3e-5)
    assert [found.gg_epsilon, found.hf_epsilon] == pytest.approx([0.7735014632706, 0.823370924874377], rel=1e-11)
    assert [found.mauchly_w, found.mauchly_p] == pytest.approx([0.7071776234634, 0.03128132227763], rel=1e-11)
    assert [found.ges, found.pes] == pytest.approx([0.02026075277623, 0.2304396423249], rel=1e-11)
    assert found.apa() == "F(1.55, 32.49) = 6.29, p = .008, ηp² = .23, ηG² = .02 (Greenhouse-Geisser ε = .77)"
    assert found.flags[0].startswith("Mauchly's test rejects sphericity (W = .71, p = .031)")
    assert found.means == pytest.approx(ROUNDING_TIMES.mean(axis=0))


def test_reaction_times():
    found = repeated_measures(REACTION_TIMES)
    assert [round(found.mauchly_w, 6), round(found.mauchly_p, 5)] == [0.031084, 0.04765]
    assert [round(found.gg_epsilon, 4), round(found.hf_epsilon, 4)] == [0.4855, 0.6778]
    assert pytest.approx(38.028, abs=5e-4) == found.F
    assert [found.p, found.p_gg, found.p_hf] == pytest.approx([4.471e-15, 2.532e-08, 7.393e-11], rel=1e-3)


@given(st.integers(2, 12), st.integers(2, 6), st.integers(0, 2**32))
@settings(max_examples=40)
def test_units_and_a_common_part_change_nothing_and_epsilons_keep_their_bounds(n, k, seed):
    table = np.random.default_rng(seed).integers(0, 50, size=(n, k)).astype(float)
    found, moved = repeated_measures(table), repeated_measures((table + 2.0**20) * 2.0**-30)
    numbers = found.to_frame().drop(columns=["SS_conditions", "SS_subjects", "SS_error"]).iloc[0].to_numpy(dtype=float)
    others = moved.to_frame()[["F", "df_conditions", "df_error", "p", "gg_epsilon", "p_gg", "hf_epsilon", "p_hf"]]
    assert others.iloc[0].to_numpy(dtype=float) == pytest.approx(numbers[:8], rel=1e-7, abs=1e-10, nan_ok=True)
    if found.gg_epsilon is not None:
        assert 1 / (k - 1) - 1e-9 <= found.gg_epsilon <= 1
        assert found.p_gg >= found.p or found.F < 3
    if found.hf_epsilon is not None:
        assert found.hf_epsilon >= found.gg_epsilon - 1e-9


@given(st.integers(2, 20), st.integers(0, 2**32))
@settings(max_examples=20)
def test_of_two_conditions_it_is_the_square_of_the_paired_t(n, seed):
    x, y = np.random.default_rng(seed).normal(size=(2, n))
    found, expected = repeated_measures(np.column_stack([x, y])), paired_t(x, y)
    assert pytest.approx(expected.t**2, rel=1e-9) == found.F
    assert [found.p, found.p_gg, found.gg_epsilon] == pytest.approx([expected.p, expected.p, 1], rel=1e-7)
    assert found.mauchly_w is None
    assert "Greenhouse" not in found.apa()


def test_fewer_subjects_than_conditions():
    found = repeated_measures(REACTION_TIMES[:4])
    assert (found.mauchly_w, found.mauchly_p) == (None, None)
    assert found.flags == ("Mauchly's test needs at least as many subjects as conditions; there are 4 and 6.",)
    assert math.isnan(found.to_frame()["mauchly_w"].item())
    two = repeated_measures(REACTION_TIMES[:2])
    assert two.gg_epsilon == pytest.approx(1 / 5)
    assert (two.hf_epsilon, two.p_hf) == (None, None)
    assert "Huynh" in two.flags[-1]


def test_a_condition_twice():
    found = repeated_measures(np.column_stack([ROUNDING_TIMES, ROUNDING_TIMES[:, 0] + 0.1]))
    assert (found.mauchly_w, found.mauchly_p) == (0, 0)
    assert "out of the question" in found.flags[0]


def test_conditions_that_differ_by_the_same_in_all_subjects():
    found = repeated_measures(np.array([[0.1], [0.4], [0.9]]) + np.array([1e6, 1e6 + 1, 1e6 + 2]))
    assert (found.F, found.p, found.gg_epsilon) == (math.inf, 0, None)
    assert found.flags == ("The conditions differ by the same in all subjects, so F is infinite.",)
    with pytest.raises(InsufficientDataError, match="nothing can be compared"):
        repeated_measures(np.repeat([[0.1], [1e6 + 0.4]], 3, axis=1))


def test_bad_input():
    for table in (np.empty((0, 3)), [[1, 2, 3]], [[1], [2]]):
        with pytest.raises(InsufficientDataError, match="Two subjects and two conditions"):
            repeated_measures(table)
    for wrong in (math.nan, math.inf, "x"):
        with pytest.raises(DataError, match="matrix"):
            repeated_measures([[1, 2], [3, wrong]])
    with pytest.raises(DataError, match="2 different names"):
        repeated_measures([[1, 2], [3, 5]], ["I"])


def test_by_item_and_by_rater():
    rng = np.random.default_rng(5)
    ratings = rng.integers(1, 6, size=(3, 20, 15)).astype(float)
    conditions, items, raters = (axis.ravel() for axis in np.indices(ratings.shape))
    names = np.array(["I", "II", "III"])[conditions]
    by_item = repeated_measures_by_unit(ratings.ravel(), names, items)
    by_rater = repeated_measures_by_unit(ratings.ravel(), names, raters)
    # The designs of Jia et al. (2013): 20 sentences, or 15 raters, in three conditions.
    assert (by_item.df_conditions, by_item.df_error) == (2, 38)
    assert (by_rater.df_conditions, by_rater.df_error) == (2, 28)
    assert pytest.approx(repeated_measures(ratings.mean(axis=2).T).F, rel=1e-9) == by_item.F
    assert pytest.approx(repeated_measures(ratings.mean(axis=1).T).F, rel=1e-9) == by_rater.F


def test_units_that_lack_a_condition_are_flagged():
    ratings, items = [1, 2, 2, 5, 3, 3, 4], ["a", "a", "b", "b", "c", "c", "d"]
    found = repeated_measures_by_unit(ratings, ["I", "II"] * 3 + ["I"], items)
    assert found.n == 3
    assert found.conditions == ("I", "II")
    assert found.flags[0] == "Units left out because they lack ratings in a condition: d."
