import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.votes_needed import MOST_VOTES, votes_needed, votes_needed_from_summary


def by_counting(sd, half_width, confidence=0.95):
    n = 2
    while stats.t.ppf((1 + confidence) / 2, n - 1) * sd / math.sqrt(n) > half_width:
        n += 1
    return n


@pytest.mark.parametrize(("sd", "half_width"), [(1, 0.25), (0.7, 0.1), (1.2, 2), (0.02, 0.25)])
def test_the_smallest_number_is_found(sd, half_width):
    found = votes_needed_from_summary([5], [sd], half_width=half_width, prior_votes=0)
    assert found.total.tolist() == [by_counting(sd, half_width)]


def test_a_textbook_number():
    # 95 % and half a standard deviation: the normal gives (1.96 / 0.5)^2 = 15.4, and Student's t asks for 18 in all.
    found = votes_needed_from_summary([10], [1.0], half_width=0.5)
    assert (found.total[0], found.missing[0], found.votes) == (18, 8, 8)


def test_cells_are_drawn_towards_each_other():
    found = votes_needed_from_summary([3, 41], [0.1, 1.0], half_width=0.3, names=["a", "b"])
    pooled = math.sqrt((2 * 0.01 + 40) / 42)
    assert found.pooled_sd == pytest.approx(pooled)
    assert found.planned_sd == pytest.approx(
        [math.sqrt((4 * pooled**2 + 2 * 0.01) / 6), math.sqrt((4 * pooled**2 + 40) / 44)]
    )
    assert found.total.tolist() == [by_counting(sd, 0.3) for sd in found.planned_sd]


def test_from_votes():
    rng = np.random.default_rng(1)
    cells = {"a": rng.integers(1, 6, 12), "b": rng.integers(1, 6, 30), "new": []}
    found = votes_needed(cells, half_width=0.3, scale=(1, 5))
    assert found.sd[:2] == pytest.approx([np.std(cells["a"], ddof=1), np.std(cells["b"], ddof=1)])
    assert math.isnan(found.sd[2])
    assert found.planned_sd[2] == pytest.approx(found.pooled_sd)
    half = stats.t.ppf(0.975, 29) * np.std(cells["b"], ddof=1) / math.sqrt(30)
    assert found.reached[1] == pytest.approx(half)
    assert math.isinf(found.reached[2])
    assert found.to_frame()["missing"].tolist() == (found.total - found.n).tolist()
    assert "1 of 3 cells have fewer than two votes" in found.summary()
    assert found.apa().startswith(f"95% CIs of ±0.3 need {found.votes} more votes, in 3 of 3 cells (")


def test_nothing_is_missing():
    found = votes_needed_from_summary([50, 60], [0.5, 0.4], half_width=0.5)
    assert found.apa() == "95% CIs of ±0.5 need no more votes in any of 2 cells, with a pooled SD of 0.45"


@pytest.mark.parametrize("assurance", [0.5, 0.9])
def test_the_assurance_holds(assurance):
    found = votes_needed_from_summary([10], [1.0], half_width=0.4, assurance=assurance)
    rng = np.random.default_rng(3)
    n = int(found.total[0])
    for votes, least in ((n, assurance), (n - 2, 0)):
        samples = rng.normal(size=(20_000, votes))
        half = stats.t.ppf(0.975, votes - 1) * samples.std(axis=1, ddof=1) / math.sqrt(votes)
        share = (half <= 0.4).mean()
        assert share >= least - 0.01
        assert votes == n or share < assurance


def test_votes_that_do_not_differ_are_flagged():
    found = votes_needed({"a": [3, 3, 3], "b": [4, 4]}, half_width=0.1)
    assert found.total.tolist() == [2, 2]
    assert "hardly be trusted" in found.flags[0]


def test_the_plan_is_bounded():
    found = votes_needed_from_summary([5, 9], [1.0, 1.0], half_width=1e-6)
    assert found.total.tolist() == [MOST_VOTES] * 2
    assert "the plan stops there" in found.summary()


def test_no_more_spread_is_planned_than_the_scale_has():
    found = votes_needed_from_summary([2, 2], [2.8, 2.8], half_width=0.5, scale=(1, 5))
    assert found.planned_sd == pytest.approx([2, 2])


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="no cells"):
        votes_needed({}, half_width=1)
    with pytest.raises(InsufficientDataError, match="No cell has two votes"):
        votes_needed({"a": [1], "b": []}, half_width=1)
    with pytest.raises(DataError, match="a: 1 of 2 values"):
        votes_needed({"a": [1, math.nan]}, half_width=1)
    with pytest.raises(DataError, match="not on the scale"):
        votes_needed({"a": [1, 9]}, half_width=1, scale=(1, 5))
    for option, wrong in (
        ("half_width", 0),
        ("half_width", math.nan),
        ("confidence", 1),
        ("prior_votes", -1),
        ("assurance", 0.2),
        ("scale", (5, 1)),
        ("scale", (1, 2)),
        ("names", ["a", "b"]),
    ):
        with pytest.raises(DataError):
            votes_needed_from_summary([5], [1.0], **{"half_width": 1, option: wrong})
    for n, sd in (([2.5], [1]), ([-1], [1]), ([5], [-1]), ([5], [math.nan]), ([5], [1, 2])):
        with pytest.raises(DataError):
            votes_needed_from_summary(n, sd, half_width=1)


@pytest.mark.filterwarnings("error")
@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.tuples(st.integers(0, 40), st.floats(0, 10)), min_size=1, max_size=6),
    st.floats(0.01, 5),
    st.sampled_from([1e-100, 1.0, 1e50]),
)
def test_units_do_not_matter_and_narrower_takes_more(cells, half_width, scale):
    n, sd = (np.array([cell[k] for cell in cells]) for k in (0, 1))
    try:
        found = votes_needed_from_summary(n, sd, half_width=half_width)
    except InsufficientDataError:
        assert n.max() < 2
        return
    narrower = votes_needed_from_summary(n, sd, half_width=half_width / 2)
    assert (narrower.total >= found.total).all()
    scaled = votes_needed_from_summary(n, sd * scale, half_width=half_width * scale)
    assert np.abs(scaled.total - found.total).max() <= 1
