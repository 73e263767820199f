import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.consistency import rater_consistency

FIRST = [1, 2, 4, 3, 2, 3, 3, 2, 4, 2, 3, 3]
SECOND = [1, 2, 5, 3, 1, 3, 2, 1, 4, 2, 3, 3]
seeds = st.integers(0, 2**32)


def repeated(first, second, rater="x"):
    n = len(first)
    return rater_consistency([*first, *second], raters=[rater] * 2 * n, items=[*range(n), *range(n)])


def simulated(seed, raters=6, items=12):
    rng = np.random.default_rng(seed)
    true = rng.uniform(1, 5, (raters, items)) + rng.normal(0, 2, (raters, 1))
    ratings = true + rng.normal(0, 0.5, (2, raters, items))
    who = np.broadcast_to(np.arange(raters)[:, None], ratings.shape).ravel()
    what = np.broadcast_to(np.arange(items), ratings.shape).ravel()
    return ratings.ravel(), who, what


def test_one_rater_against_other_programs():
    # pingouin 0.7.0: intraclass_corr gives ICC(1,1) = 0.857143 [0.59, 0.96]; numpy.corrcoef 0.906238.
    found = repeated(FIRST, SECOND).pooled
    assert found.icc == pytest.approx(0.857143, abs=5e-7)
    assert found.icc_ci == pytest.approx((0.59, 0.96), abs=0.005)
    assert found.r == pytest.approx(np.corrcoef(FIRST, SECOND)[0, 1])
    # Dahlberg: the root of the sum of squared differences over 2 n.
    assert found.within_sd == pytest.approx(math.sqrt(4 / 24))
    assert found.repeatability == pytest.approx(1.959964 * math.sqrt(2) * found.within_sd)
    assert found.mean_absolute_difference == pytest.approx(4 / 12)
    assert found.mean_difference == pytest.approx(-2 / 12)
    assert found.apa() == (
        "12 repeated items: within-rater SD = 0.41, 95% CI [0.29, 0.67], mean absolute difference 0.33, "
        "repeatability coefficient 1.13, ICC(1,1) = .86, 95% CI [.59, .96], r = .91"
    )


def test_the_interval_of_the_deviation_covers_the_truth():
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(300):
        one, two = rng.normal(0, 0.5, (2, 10)) + rng.normal(0, 1, 10)
        low, high = repeated(one, two).pooled.within_sd_ci
        covered += low <= 0.5 <= high
    assert covered / 300 == pytest.approx(0.95, abs=0.035)


def test_every_rater_and_all_together():
    ratings, who, what = simulated(1)
    found = rater_consistency(ratings, raters=who, items=what)
    assert found.raters == tuple(range(6))
    for rater, one in zip(found.raters, found.by_rater, strict=True):
        own = who == rater
        alone = rater_consistency(ratings[own], raters=who[own], items=what[own]).pooled
        assert (one.icc, one.within_sd, one.r) == pytest.approx((alone.icc, alone.within_sd, alone.r))
    squares = [one.within_sd**2 for one in found.by_rater]
    assert found.pooled.within_sd == pytest.approx(math.sqrt(np.mean(squares)))
    frame = found.to_frame()
    assert frame["rater"].tolist() == [0, 1, 2, 3, 4, 5, None]
    assert frame["items"].tolist() == [12] * 6 + [72]
    assert found.apa().startswith("6 raters, 72 repeated items")


def test_what_raters_differ_by_does_not_count():
    ratings, who, what = simulated(2)
    one = rater_consistency(ratings, raters=who, items=what).pooled
    two = rater_consistency(ratings + 100 * who, raters=who, items=what).pooled
    assert (two.icc, two.r, two.within_sd) == pytest.approx((one.icc, one.r, one.within_sd))


def test_more_than_two_ratings_and_items_rated_once():
    ratings = [1, 2, 4, 5, 3, 3, 2, 9, 4]
    items = ["a", "a", "a", "b", "b", "c", "c", "d", "b"]
    found = rater_consistency(ratings, raters=["x"] * 9, items=items)
    one = found.pooled
    assert (one.items, one.ratings) == (3, 8)
    # Pairs of a: 1, 3, 2; of b: 2, 1, 1; of c: 1.
    assert one.mean_absolute_difference == pytest.approx((2 + 4 / 3 + 1) / 3)
    squares = np.var([1, 2, 4]) * 3 + np.var([5, 3, 4]) * 3 + np.var([3, 2]) * 2
    assert one.within_sd == pytest.approx(math.sqrt(squares / 5))
    assert "unequally often" in found.summary()


def test_perfect_repeats():
    found = repeated([1, 2, 3, 4], [1, 2, 3, 4]).pooled
    assert (found.within_sd, found.icc, found.icc_ci, found.r) == (0, 1, (1, 1), pytest.approx(1))
    assert "no width" in found.flags[0]


def test_ratings_that_do_not_vary():
    found = repeated([3, 3, 3], [3, 3, 3]).pooled
    assert (found.icc, found.r) == (None, None)
    assert "do not vary" in found.summary()


def test_two_items_are_too_few_for_an_icc():
    found = repeated([1, 4], [2, 4]).pooled
    assert (found.icc, found.icc_ci, found.r) == (None, None, None)
    assert "too few" in found.summary()
    assert math.isnan(found.to_frame().loc[0, "icc"])


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="rated an item twice"):
        rater_consistency([1, 2], raters=["x", "x"], items=["a", "b"])
    with pytest.raises(InsufficientDataError, match="rated an item twice"):
        rater_consistency([], raters=[], items=[])
    with pytest.raises(DataError, match="needs both"):
        rater_consistency([1, 2], raters=["x"], items=["a", "a"])
    with pytest.raises(DataError, match="infinite"):
        rater_consistency([1, math.inf], raters=["x", "x"], items=["a", "a"])
    with pytest.raises(DataError, match="raters: the label at place 1 is missing"):
        rater_consistency([1, 2], raters=["x", None], items=["a", "a"])
    with pytest.raises(DataError, match="between 0 and 1"):
        rater_consistency([1, 2], raters=["x", "x"], items=["a", "a"], confidence=0)


@settings(deadline=None, max_examples=50)
@given(seeds, st.floats(-1e6, 1e6), st.sampled_from([1e-170, 0.01, 3.0, 1e100]))
def test_units_do_not_matter(seed, shift, scale):
    ratings, who, what = simulated(seed, raters=3, items=5)
    one = rater_consistency(ratings, raters=who, items=what).pooled
    two = rater_consistency(scale * (ratings + shift), raters=who, items=what).pooled
    assert (two.icc, two.r, two.within_sd / scale) == pytest.approx((one.icc, one.r, one.within_sd), rel=1e-5, abs=1e-6)


@pytest.mark.filterwarnings("error")
@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(1, 5), st.integers(0, 2), st.integers(0, 3)), max_size=25))
def test_any_ratings_give_a_result_or_say_why_not(rows):
    ratings, who, what = ([row[k] for row in rows] for k in range(3))
    try:
        found = rater_consistency(ratings, raters=who, items=what)
    except InsufficientDataError:
        return
    for one in (*found.by_rater, found.pooled):
        assert np.isfinite([one.within_sd, one.repeatability, *one.within_sd_ci]).all()
        assert one.icc is None or (one.icc <= 1 and one.icc_ci[0] <= one.icc + 1e-9 <= one.icc_ci[1] + 2e-9)
        assert one.icc is not None or one.flags
