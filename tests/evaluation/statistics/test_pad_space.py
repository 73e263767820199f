import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.correlation import pearson
from evaluation.statistics.ellipse import ellipses
from evaluation.statistics.pad_space import compare_pad

seeds = st.integers(0, 2**32)
NIST = json.loads((Path(__file__).parents[2] / "data" / "nist_cases.json").read_text(encoding="utf-8"))


def test_the_table_of_the_paper(case):
    data = case("mtap2013_table8")["data"]
    found = compare_pad(data["input"], data["evaluated"])
    assert [one.r for one in found.dimensions] == pytest.approx([0.873, 0.569, 0.624], abs=0.0005)
    x, y = np.array(data["input"]), np.array(data["evaluated"])
    for k, one in enumerate(found.dimensions):
        line = stats.linregress(x[:, k], y[:, k])
        half = stats.t.ppf(0.975, 12) * line.stderr
        assert (one.line.slope, one.line.intercept) == pytest.approx((line.slope, line.intercept))
        assert one.line.slope_ci == pytest.approx((line.slope - half, line.slope + half))
        half = stats.t.ppf(0.975, 12) * line.intercept_stderr
        assert one.line.intercept_ci == pytest.approx((line.intercept - half, line.intercept + half))
        expected = stats.ttest_1samp(y[:, k] - x[:, k], 0).confidence_interval()
        assert one.bias_ci == pytest.approx(tuple(expected))
    assert [one.bias for one in found.dimensions] == pytest.approx((y - x).mean(axis=0))
    assert [one.rmse for one in found.dimensions] == pytest.approx(np.sqrt(((y - x) ** 2).mean(axis=0)))
    assert [one.mae for one in found.dimensions] == pytest.approx(np.abs(y - x).mean(axis=0))
    assert found.mean_distance == pytest.approx(np.linalg.norm(y - x, axis=1).mean())
    # The three slopes are from .67 to .76; together they are surely not 1.
    assert found.common_slope == pytest.approx(0.74, abs=0.005)
    assert len(found.flags) == 1
    assert "All dimensions together: the slope of 0.74 differs from 1" in found.flags[0]
    assert found.apa().startswith("P: bias -0.05, 95% CI [-0.15, 0.05], RMSE = 0.17, MAE = 0.14, slope 0.75, 95% CI")
    frame = found.to_frame()
    assert frame["dimension"].tolist() == ["P", "A", "D"]
    assert frame["slope"].tolist() == [one.line.slope for one in found.dimensions]


def test_a_certified_line():
    norris = next(one for one in NIST if one["id"] == "nist_Norris")
    x, y = norris["data"]["x"], norris["data"]["y"]
    found = compare_pad(np.array(x)[:, None], np.array(y)[:, None], dimensions=["P"]).dimensions[0].line
    expected = norris["expected"]
    assert (found.slope, found.intercept) == pytest.approx((expected["slope"], expected["intercept"]), rel=1e-9)
    quantile = stats.t.ppf(0.975, len(x) - 2)
    half = found.slope_ci[1] - found.slope, found.intercept_ci[1] - found.intercept
    assert half == pytest.approx((quantile * expected["se_slope"], quantile * expected["se_int"]), rel=1e-8)


@pytest.mark.parametrize(
    ("scale", "what"), [(1.25, "an input divided by 5"), (0.8, "evaluations divided by 5"), (0.5, None), (1, "")]
)
def test_a_difference_of_scale_is_told(scale, what):
    rng = np.random.default_rng(1)
    given = rng.uniform(-0.6, 0.6, (14, 3))
    found = compare_pad(given, scale * given + rng.normal(0, 0.01, (14, 3)))
    if what == "":
        assert not found.flags
        return
    assert len(found.flags) == 4
    assert all(f"slope of {scale:.2f}"[:12] in flag for flag in found.flags)
    assert all((what or "agrees with") in flag for flag in found.flags) == (what is not None)


def test_the_common_slope_covers_the_truth():
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(200):
        given = rng.uniform(-1, 1, (8, 3))
        found = compare_pad(given, 0.8 * given + [0.1, -0.2, 0] + rng.normal(0, 0.2, (8, 3)))
        covered += found.common_slope_ci[0] <= 0.8 <= found.common_slope_ci[1]
    assert covered / 200 == pytest.approx(0.95, abs=0.04)


def test_what_does_not_vary():
    given = np.column_stack([np.full(5, 0.2), np.arange(5) / 5])
    found = compare_pad(given, np.column_stack([np.arange(5) / 5, np.full(5, 0.1)]), dimensions=["P", "A"])
    one, two = found.dimensions
    assert (one.line, one.r) == (None, None)
    assert (two.line.slope, two.r) == (pytest.approx(0), None)
    assert any("P: the input does not vary" in flag for flag in found.flags)
    assert any("A: the evaluation does not vary" in flag for flag in found.flags)
    assert found.to_frame()["slope"].isna().tolist() == [True, False]
    nothing = compare_pad(given[:, :1], given[:, :1], dimensions=["P"])
    assert (nothing.common_slope, nothing.common_slope_ci) == (None, None)


def test_identical_points():
    given = np.random.default_rng(1).uniform(-1, 1, (6, 3))
    found = compare_pad(given, given)
    assert not found.flags
    assert all((one.bias, one.rmse, one.mae) == (0, 0, 0) for one in found.dimensions)


def test_bad_input():
    three = np.random.default_rng(1).uniform(-1, 1, (3, 3))
    with pytest.raises(InsufficientDataError, match="at least 3 points"):
        compare_pad(three[:2], three[:2])
    with pytest.raises(DataError, match="each point needs both"):
        compare_pad(three, three[:2])
    with pytest.raises(DataError, match="2 names"):
        compare_pad(three, three, dimensions=["P", "A"])
    with pytest.raises(DataError, match="missing or infinite"):
        compare_pad(three, np.where(np.eye(3), math.nan, three))
    with pytest.raises(DataError, match="confidence"):
        compare_pad(three, three, confidence=95)


@pytest.mark.filterwarnings("error")
@settings(deadline=None, max_examples=50)
@given(seeds, st.integers(3, 12), st.sampled_from([1e-170, 1e-5, 1.0, 1e120]), st.floats(-1e5, 1e5))
def test_units_do_not_matter(seed, n, scale, shift):
    x, y = np.random.default_rng(seed).uniform(-1, 1, (2, n, 3))
    one, two = compare_pad(x, y), compare_pad(scale * (x + shift), scale * (y + shift))
    for a, b in zip(one.dimensions, two.dimensions, strict=True):
        assert (b.line.slope, b.r) == pytest.approx((a.line.slope, a.r), rel=1e-5, abs=1e-7)
        assert np.array([b.bias, *b.bias_ci, b.rmse, b.mae]) / scale == pytest.approx(
            np.array([a.bias, *a.bias_ci, a.rmse, a.mae]), rel=1e-5, abs=1e-7
        )
        assert (
            b.r
            == pearson(
                scale * (x + shift)[:, one.dimensions.index(a)], scale * (y + shift)[:, one.dimensions.index(a)]
            ).r
        )
    assert two.common_slope == pytest.approx(one.common_slope, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("coverage", [0.5, 0.95])
def test_ellipsoids_by_emotion_hold_that_share_of_each(coverage):
    rng = np.random.default_rng(6)
    points = np.concatenate([rng.normal(size=(4000, 3)) @ rng.normal(size=(3, 3)) + shift for shift in (0.4, -0.3)])
    found = ellipses(points, ["Happy"] * 4000 + ["Sad"] * 4000, coverage=coverage)
    assert [one.category for one in found] == ["Happy", "Sad"]
    assert [one.share_inside for one in found] == pytest.approx([coverage] * 2, abs=0.02)
    radius = math.sqrt(stats.chi2.ppf(coverage, 3))
    lengths = np.sqrt(np.linalg.eigvalsh(np.cov(points[:4000].T))[::-1])
    assert found[0].half_axes == pytest.approx(radius * lengths)
    assert found[0].summary() == found[0].apa()
