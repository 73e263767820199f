import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.mixed.models import compare, crossed_mixed_model


def ratings(conditions=3, raters=12, stimuli=8, *, seed=1, slopes=0.0):
    """A complete design in long form: values and the numbers of condition, rater and stimulus."""
    rng = np.random.default_rng(seed)
    c, r, s = np.indices((conditions, raters, stimuli)).reshape(3, -1)
    y = 3 + 0.3 * c + rng.normal(size=raters)[r] + 0.7 * rng.normal(size=stimuli)[s] + rng.normal(size=c.size)
    y += slopes * (rng.normal(size=(raters, conditions))[r, c] + rng.normal(size=(stimuli, conditions))[s, c])
    return y, c, r, s


def test_a_complete_design_gives_the_analysis_of_variance():
    y, c, r, s = ratings()
    found = crossed_mixed_model(y, c, r, s)
    cube = y.reshape(3, 12, 8)
    sizes = {0: 12 * 8, 1: 3 * 8, 2: 3 * 12}
    squares = {
        axis: size * np.sum((cube.mean(axis=tuple({0, 1, 2} - {axis})) - y.mean()) ** 2) for axis, size in sizes.items()
    }
    df = y.size - 1 - 2 - 11 - 7
    error = (np.sum((y - y.mean()) ** 2) - sum(squares.values())) / df
    assert found.sigma**2 == pytest.approx(error, rel=1e-9)
    rater, stimulus = (squares[1] / 11 - error) / 24, (squares[2] / 7 - error) / 36
    assert [one.variance for one in found.random] == pytest.approx([rater, stimulus], rel=1e-6)
    F = squares[0] / 2 / error
    assert (found.condition.F, found.condition.df1) == (pytest.approx(F, rel=1e-9), 2)
    assert found.condition.df2 == pytest.approx(df, rel=1e-6)
    assert found.condition.p == pytest.approx(stats.f.sf(F, 2, df), rel=1e-6)
    assert [one.estimate for one in found.means] == pytest.approx(cube.mean(axis=(1, 2)), rel=1e-12)
    whole = rater + stimulus + error
    shares = {"rater": rater / whole, "stimulus": stimulus / whole, "residual": error / whole}
    assert found.shares == pytest.approx(shares, rel=1e-6)
    # The variance of a condition's mean is that of rater, stimulus and residual over their numbers.
    assert found.means[0].se ** 2 == pytest.approx(rater / 12 + stimulus / 8 + error / 96, rel=1e-6)
    for one, (a, b) in zip(found.contrasts, itertools.combinations(range(3), 2), strict=True):
        assert one.name == f"{a} - {b}"
        assert one.estimate == pytest.approx(cube[a].mean() - cube[b].mean())
        assert one.se == pytest.approx(math.sqrt(2 * error / 96), rel=1e-6)
        half = stats.t.ppf(0.975, df) * one.se
        assert one.ci == pytest.approx((one.estimate - half, one.estimate + half), rel=1e-6)
        assert one.p == pytest.approx(2 * stats.t.sf(abs(one.t), df), rel=1e-6)
    assert found.apa() == f"F(2, {df}.0) = {F:.2f}, p = .002"
    assert found.groups == {"rater": 12, "stimulus": 8}
    assert list(found.means_frame().columns) == ["name", "estimate", "se", "df", "ci_low", "ci_high"]
    assert list(found.contrasts_frame()["p_holm"]) == [one.p_holm for one in found.contrasts]


def test_effects_of_condition_by_rater_give_the_repeated_measures_analysis():
    # Without effects of stimuli, the raters' mean in each condition has all that there is to know.
    rng = np.random.default_rng(8)
    c, r, s = np.indices((3, 10, 6)).reshape(3, -1)
    y = rng.normal(size=10)[r] + rng.normal(size=(10, 3))[r, c] + 0.4 * c + rng.normal(size=c.size)
    y -= y.reshape(3, 10, 6).mean(axis=(0, 1))[s]
    found = crossed_mixed_model(y, c, r, s, slopes=True)
    cells = y.reshape(3, 10, 6).mean(axis=2)
    interaction = cells - cells.mean(axis=0) - cells.mean(axis=1, keepdims=True) + cells.mean()
    F = 10 * cells.mean(axis=1).var(ddof=1) / (np.sum(interaction**2) / 18)
    spread = {one.term: one.sd for one in found.random}
    assert spread["stimulus"] == 0
    if spread["condition:stimulus"] == 0:
        assert pytest.approx(F, rel=1e-6) == found.condition.F
        assert found.condition.df2 == pytest.approx(18, rel=1e-6)
    assert "The fit is singular: the standard deviation of stimulus is estimated as 0." in found.flags
    assert found.groups["condition:rater"] == 30


def test_effects_of_conditions_within_raters_are_compared_with_none():
    y, c, r, s = ratings(3, 30, 40, slopes=0.8)
    null, full = (crossed_mixed_model(y, c, r, s, slopes=slopes) for slopes in (False, True))
    found = compare(null, full)
    assert (found.df, found.method) == (2, "REML")
    assert found.p < 0.01
    assert full.condition.df2 < null.condition.df2
    assert [one.term for one in full.random] == ["rater", "condition:rater", "stimulus", "condition:stimulus"]
    assert [one.sd for one in full.random] == pytest.approx([1, 0.8, 0.7, 0.8], abs=0.3)


def test_no_effects_of_conditions_where_each_stimulus_has_one():
    y, c, r, s = ratings()
    found = crossed_mixed_model(y, c, r, 8 * c + s, slopes=True)
    assert "No stimulus occurs in several conditions, so no effects of condition by stimulus are fitted." in found.flags
    assert [one.term for one in found.random] == ["rater", "condition:rater", "stimulus"]


def test_order_and_names_of_labels_change_nothing():
    y, c, r, s = ratings()
    keep = np.random.default_rng(2).permutation(y.size)[:200]
    plain = crossed_mixed_model(y[keep], c[keep], r[keep], s[keep])
    names = np.array(["low", "mid", "high"])[c[keep]]
    ordered = pd.Categorical(names, categories=["high", "mid", "low"])
    found = crossed_mixed_model(
        y[keep].tolist(), ordered, [f"r{one}" for one in r[keep]], pd.Categorical(s[keep]), reference="mid"
    )
    assert [one.name for one in found.means] == ["high", "mid", "low"]
    assert [one.name for one in found.fixed] == ["intercept", "high", "low"]
    assert found.fixed[0].estimate == pytest.approx(found.means[1].estimate)
    means = {one.name: one.estimate for one in plain.means}
    assert [one.estimate for one in found.means] == pytest.approx([means["2"], means["1"], means["0"]], rel=1e-9)
    assert pytest.approx(plain.condition.F, rel=1e-8) == found.condition.F
    # Which independent combinations are tested depends on the order.
    assert found.condition.df2 == pytest.approx(plain.condition.df2, rel=1e-3)
    assert [one.df for one in found.contrasts] == pytest.approx([one.df for one in plain.contrasts[::-1]], rel=1e-6)
    assert found.loglik == pytest.approx(plain.loglik, rel=1e-10)


def test_a_large_common_part_costs_no_digits():
    y, c, r, s = ratings()
    rounded = np.round(y, 1)
    near, far = (crossed_mixed_model(rounded + offset, c, r, s) for offset in (0, 1e6))
    assert pytest.approx(near.condition.F, rel=1e-9) == far.condition.F
    assert [one.sd for one in far.random] == pytest.approx([one.sd for one in near.random], rel=1e-8)
    assert far.means[1].estimate - 1e6 == pytest.approx(near.means[1].estimate, abs=1e-8)


def test_tiny_residuals_are_kept_apart_from_none():
    y, c, r, s = ratings()
    exact = 0.1 * c + 3.0 * r + 2.0 * (s % 3)
    with pytest.raises(InsufficientDataError, match="explain the values exactly"):
        crossed_mixed_model(exact, c, r, s)
    found = crossed_mixed_model(exact + 1e-3 * (y - y.mean()), c, r, s)
    assert found.condition.df2 == pytest.approx(267, rel=1e-3)
    assert found.converged


def test_many_ratings_with_gaps():
    rng = np.random.default_rng(4)
    r, s = np.indices((200, 150)).reshape(2, -1)
    kept = rng.random(r.size) > 0.3
    r, s = r[kept], s[kept]
    c = rng.integers(0, 3, r.size)
    y = 0.1 * c + 0.5 * rng.normal(size=200)[r] + 0.8 * rng.normal(size=150)[s] + rng.normal(size=r.size)
    found = crossed_mixed_model(np.round(y), c, r, s)
    assert [one.sd for one in found.random] == pytest.approx([0.5, 0.8], abs=0.1)
    assert found.condition.df2 == pytest.approx(r.size - 350, rel=0.01)


@pytest.mark.parametrize(
    ("error", "message", "change"),
    [
        (InsufficientDataError, "one rater only", {"raters": [1] * 48}),
        (InsufficientDataError, "one stimulus only", {"stimuli": ["x"] * 48}),
        (InsufficientDataError, "Fewer than two conditions", {"conditions": ["a"] * 48}),
        (
            InsufficientDataError,
            "The condition c has no values",
            {"conditions": pd.Categorical(["a", "b"] * 24, categories=["a", "b", "c"])},
        ),
        (InsufficientDataError, "All values are the same", {"values": [3] * 48}),
        (InsufficientDataError, "cannot tell", {"stimuli": list("abcdef") * 8, "raters": list("uvwxyz") * 8}),
        (DataError, "1 of 48 values are missing or infinite", {"values": [math.nan, *[1, 2, 3] * 15, 1, 2]}),
        (DataError, "conditions: there are 2 labels for 48", {"conditions": ["a", "b"]}),
        (DataError, "raters: the label at place 0 is missing", {"raters": [None, *["a", "b"] * 23, "a"]}),
        (DataError, "There is no condition z to refer to; there are 0, 1", {"reference": "z"}),
    ],
)
def test_what_cannot_be_compared(error, message, change):
    y, c, r, s = ratings(2, 6, 4)
    with pytest.raises(error, match=message):
        crossed_mixed_model(**({"values": y, "conditions": c, "raters": r, "stimuli": s} | change))


@pytest.mark.filterwarnings("error")
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(4, 40), st.booleans(), st.sampled_from(["REML", "ML"]), st.integers(1, 3))
def test_any_design_gives_finite_numbers_or_an_error(seed, n, slopes, method, levels):
    rng = np.random.default_rng(seed)
    c, r, s = rng.integers(0, 3, n), rng.integers(0, 2 * levels, n), rng.integers(0, 3 * levels, n)
    y = rng.integers(1, 6, n) + (10.0 * (seed % 3)) * r
    try:
        found = crossed_mixed_model(y, c, r, s, slopes=slopes, method=method)
    except EvaluationError as error:
        assert str(error).endswith(".")
        return
    assert np.isfinite([found.condition.F, found.condition.df2, found.sigma, found.loglik]).all()
    assert all(0 <= one.p <= one.p_holm <= 1 for one in found.contrasts)
    assert found.singular == any(flag.startswith("The fit is singular") for flag in found.flags)
    assert found.singular == any(one.sd == 0 for one in found.random)


def test_values_whose_squares_vanish_are_refused():
    labels = ["a", "b"] * 6, [1, 1, 2, 2, 3, 3] * 2, [*[1] * 6, *[2] * 6]
    with pytest.raises(DataError, match="values: no value exceeds 1e-140"):
        crossed_mixed_model(np.arange(12) ** 2 % 7 * 1e-300, *labels)
    small, plain = (crossed_mixed_model(np.arange(12) ** 2 % 7 * unit, *labels).condition for unit in (1e-138, 1.0))
    assert pytest.approx(plain.F) == small.F
