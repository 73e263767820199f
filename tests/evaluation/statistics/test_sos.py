import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.sos import sos, sos_from_summary

CASES = json.loads((Path(__file__).parents[2] / "data" / "p910_cases.json").read_text(encoding="utf-8"))


def rng():
    return np.random.default_rng(1)


def binomial(trials, items=300, raters=40, seed=2):
    """Ratings from 1 to 5 of which a is 1 / trials."""
    generator = np.random.default_rng(seed)
    shares = generator.uniform(0.05, 0.95, (items, 1))
    ratings = 1 + 4 * generator.binomial(trials, shares, (items, raters)) / trials
    return {str(k): row for k, row in enumerate(ratings)}


@pytest.mark.parametrize("trials", [1, 4, 10])
def test_binomial_ratings_have_one_over_the_trials(trials):
    found = sos(binomial(trials), low=1, high=5, rng=rng())
    # The variance around the own mean is a little larger than around the true one; 40 raters leave 2.5 %.
    assert found.a == pytest.approx(1 / trials, rel=0.05)
    assert found.ci[0] <= found.a <= found.ci[1]


def test_the_line_is_that_of_least_squares():
    rows = [[float(one) for one in row if one != "-"] for row in CASES["nflx"]["ratings"]]
    found = sos({str(k): row for k, row in enumerate(rows)}, low=1, high=5, rng=rng())
    mean, variance = found.mean, found.variance
    expected, covariance = optimize.curve_fit(lambda x, a: a * (-(x**2) + 6 * x - 5), mean, variance, p0=[0.2])
    assert found.a == pytest.approx(expected[0])
    assert found.se == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-4)
    assert 0.1 < found.a < 0.3
    assert found.r_squared > 0.85
    assert found.apa().startswith("SOS parameter a = 0.20, SE = 0.01, 95% CI [0.18, 0.2")
    assert "1 of 79 items are rated at one end of the scale by all" in found.summary()


def test_exact_variances_and_the_expected_deviation():
    means = np.array([1.5, 2, 3, 4.2])
    found = sos_from_summary(means, 0.3 * (means - 1) * (5 - means), low=1, high=5, rng=rng())
    assert found.a == pytest.approx(0.3)
    assert found.se == pytest.approx(0, abs=1e-12)
    assert found.ci == pytest.approx((0.3, 0.3))
    assert found.r_squared == pytest.approx(1)
    assert found.expected_sd([1, 3, 5]) == pytest.approx([0, math.sqrt(0.3 * 4), 0])
    assert found.to_frame().loc[0, "items"] == 4


def test_the_interval_covers_the_truth():
    covered = 0
    for seed in range(60):
        found = sos(binomial(4, items=60, raters=200, seed=seed), low=1, high=5, rng=rng(), resamples=300)
        covered += found.ci[0] <= 0.25 <= found.ci[1]
    assert covered / 60 == pytest.approx(0.95, abs=0.08)


def test_the_same_generator_gives_the_same_interval():
    one, two = (sos(binomial(4, items=9), low=1, high=5, rng=rng()).ci for _ in range(2))
    assert one == two


def test_beyond_one_is_flagged():
    found = sos({"a": [1, 5], "b": [1, 5]}, low=1, high=5, rng=rng())
    assert found.a == pytest.approx(2)
    assert "not from 0 to 1" in found.summary()


def test_what_tells_nothing_is_said():
    found = sos({"a": [1, 2, 3], "b": [4], "c": [5, 5]}, low=1, high=5, rng=rng())
    assert (found.se, found.ci, found.mean.size) == (None, None, 1)
    assert any("fewer than two ratings" in flag for flag in found.flags)
    assert any("One item" in flag for flag in found.flags)
    still = sos({"a": [2, 2], "b": [3, 3]}, low=1, high=5, rng=rng())
    assert (still.a, still.r_squared) == (0, None)
    assert "whatever the hypothesis" in still.summary()


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="between the ends"):
        sos({"a": [1, 1], "b": [5, 5]}, low=1, high=5, rng=rng())
    with pytest.raises(InsufficientDataError):
        sos({}, low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="a: a rating is not on the scale"):
        sos({"a": [1, 9]}, low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="a: 1 of 2"):
        sos({"a": [1, math.nan]}, low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="higher end"):
        sos({"a": [1, 2]}, low=5, high=1, rng=rng())
    with pytest.raises(DataError, match="2 means, but 1 variances"):
        sos_from_summary([1, 2], [1], low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="negative"):
        sos_from_summary([2], [-1], low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="mean is not on the scale"):
        sos_from_summary([0], [1], low=1, high=5, rng=rng())
    with pytest.raises(DataError, match="resamples"):
        sos_from_summary([2], [1], low=1, high=5, rng=rng(), resamples=1)
    with pytest.raises(DataError, match="confidence"):
        sos_from_summary([2], [1], low=1, high=5, rng=rng(), confidence=95)


@pytest.mark.filterwarnings("error")
@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.lists(st.integers(1, 5), max_size=6), max_size=5),
    st.floats(-1000, 1000),
    st.sampled_from([1e-60, 0.3, 1e60]),
)
def test_units_do_not_matter(rows, shift, scale):
    groups = {str(k): row for k, row in enumerate(rows)}
    try:
        one = sos(groups, low=1, high=5, rng=rng(), resamples=100)
    except InsufficientDataError:
        return
    assert np.isfinite(one.a)
    moved = {name: (np.array(row, dtype=float) + shift) * scale for name, row in groups.items()}
    low, high = (1 + shift) * scale, (5 + shift) * scale
    two = sos(moved, low=low, high=high, rng=rng(), resamples=100)
    assert two.a == pytest.approx(one.a, rel=1e-6, abs=1e-9)
