import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.ellipse import ellipse, ellipses

seeds = st.integers(0, 2**32)
dimensions = st.sampled_from([2, 3])


def standardised(rng, n, d):
    """Points with mean 0 and covariance exactly 1."""
    points = rng.normal(size=(n, d))
    points -= points.mean(axis=0)
    return linalg.qr(points, mode="economic")[0] * math.sqrt(n - 1)


@pytest.mark.parametrize(("coverage", "d", "name"), [(0.5, 2, "p50_2d"), (0.95, 2, "p95_2d"), (0.5, 3, "p50_3d")])
def test_the_quantiles(case, coverage, d, name):
    published = case("ellipse_quantiles")
    found = ellipse(standardised(np.random.default_rng(1), 30, d), coverage=coverage)
    assert found.half_axes**2 == pytest.approx([published["expected"][name]] * d, rel=published["tolerance"]["rtol"])


def test_a_tilted_ellipse():
    points = standardised(np.random.default_rng(1), 30, 2) * [2, 0.5]
    turn = math.radians(30)
    rotation = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    found = ellipse(points @ rotation + [0.3, -0.2], coverage=0.95, category="Joy")
    radius = math.sqrt(-2 * math.log(0.05))
    assert found.centre == pytest.approx([0.3, -0.2])
    assert found.half_axes == pytest.approx([2 * radius, 0.5 * radius])
    assert found.angle == pytest.approx(30)
    assert found.size == pytest.approx(math.pi * radius**2)
    assert not found.flat
    assert found.summary().startswith("Joy: 95% ellipse: centre (0.30, -0.20), half-axes 4.90, 1.22, area 18.823, ")
    row = found.to_frame().iloc[0]
    assert (row["category"], row["angle"], row["half_axis_2"]) == ("Joy", found.angle, found.half_axes[1])


def test_an_ellipsoid():
    found = ellipse(standardised(np.random.default_rng(1), 30, 3) * [1, 3, 2])
    radius = math.sqrt(stats.chi2.ppf(0.5, 3))
    assert found.half_axes == pytest.approx(radius * np.array([3, 2, 1]))
    assert np.abs(found.directions) == pytest.approx(np.eye(3)[[1, 2, 0]], abs=1e-9)
    assert found.size == pytest.approx(4 / 3 * math.pi * 6 * radius**3)
    assert found.angle is None
    assert "ellipsoid" in found.summary()
    assert math.isnan(found.to_frame().iloc[0]["angle"])


@pytest.mark.parametrize(("d", "about"), [(2, "mean"), (3, "mean")])
def test_the_ellipse_of_the_mean_is_hotellings(d, about):
    # T² of a point is n times its squared Mahalanobis distance; on the outline it is the critical value.
    rng = np.random.default_rng(4)
    points = rng.normal(size=(12, d)) @ rng.normal(size=(d, d))
    found = ellipse(points, coverage=0.95, about=about)
    difference = found.outline(20).reshape(-1, d)[7] - points.mean(axis=0)
    squared = 12 * difference @ linalg.solve(np.cov(points.T), difference)
    critical = d * 11 / (12 - d) * stats.f.ppf(0.95, d, 12 - d)
    assert squared == pytest.approx(critical)


@pytest.mark.parametrize("coverage", [0.5, 0.95])
@pytest.mark.parametrize("d", [2, 3])
def test_the_ellipse_covers_that_share_of_the_population(coverage, d):
    rng = np.random.default_rng(9)
    shape = rng.normal(size=(d, d))
    found = ellipse(rng.normal(size=(20000, d)) @ shape + 3, coverage=coverage)
    assert found.share_inside == pytest.approx(coverage, abs=0.01)
    fresh = rng.normal(size=(20000, d)) @ shape + 3
    assert found.contains(fresh).mean() == pytest.approx(coverage, abs=0.015)


@pytest.mark.parametrize(("d", "n"), [(2, 5), (3, 8)])
def test_the_ellipse_of_the_mean_covers_the_true_mean_that_often(d, n):
    rng = np.random.default_rng(9)
    shape = rng.normal(size=(d, d))
    samples = rng.normal(size=(1500, n, d)) @ shape + 1
    covered = [ellipse(sample, coverage=0.8, about="mean").contains([[1] * d])[0] for sample in samples]
    assert np.mean(covered) == pytest.approx(0.8, abs=0.03)


@settings(max_examples=60)
@given(seeds, dimensions, st.floats(0.01, 0.99))
def test_the_outline_is_where_the_mahalanobis_distance_says(seed, d, coverage):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(15, d)) @ rng.normal(size=(d, d)) + rng.normal(size=d)
    found = ellipse(points, coverage=coverage)
    outline = found.outline(24).reshape(-1, d)
    differences = outline - points.mean(axis=0)
    squared = np.sum(differences * linalg.solve(np.cov(points.T), differences.T).T, axis=1)
    assert squared == pytest.approx(stats.chi2.ppf(coverage, d), rel=1e-5)
    assert found.contains(outline).all()
    assert not found.contains(found.centre + 1.001 * differences).any()
    assert found.contains(found.centre + 0.999 * differences).all()
    assert found.share_inside == found.contains(points).mean()


@given(seeds, dimensions)
def test_moving_turning_and_scaling_the_points_does_so_to_the_ellipse(seed, d):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, d)) * np.arange(1, d + 1)
    rotation = linalg.qr(rng.normal(size=(d, d)))[0]
    found, moved = ellipse(points), ellipse(3 * points @ rotation + 10)
    assert moved.centre == pytest.approx(3 * found.centre @ rotation + 10)
    assert moved.half_axes == pytest.approx(3 * found.half_axes)
    assert moved.size == pytest.approx(3**d * found.size)
    assert moved.directions @ moved.directions.T == pytest.approx(np.eye(d), abs=1e-9)


def test_outlines_are_closed():
    points = np.random.default_rng(4).normal(size=(12, 3))
    flat = ellipse(points[:, :2]).outline(40)
    assert flat.shape == (41, 2)
    assert (flat[0] == flat[-1]).all()
    assert ellipse(points).outline(40).shape == (21, 41, 3)
    with pytest.raises(DataError, match="at least 4"):
        ellipse(points).outline(3)


class TestFlatData:
    def test_points_on_a_line(self):
        along = np.array([-2.0, -1, 0, 1, 2, 5])
        points = np.column_stack([0.1 * along + 0.3, 0.2 * along - 0.7])
        found = ellipse(points)
        assert found.flat
        assert found.half_axes[1] == 0
        assert found.size == 0
        assert found.angle == pytest.approx(math.degrees(math.atan(2)))
        # In the one dimension in which they vary, half of a normal population lies within 0.674 SD.
        assert found.half_axes[0] == pytest.approx(0.6744897 * np.std(along, ddof=1) * math.sqrt(0.05))
        # The mean of `along` is 5/6 and its deviation 2.48, so that -2, -1 and 5 lie outside.
        assert found.share_inside == 0.5
        assert found.contains([[0.3, -0.7], [0.31, -0.7]]).tolist() == [True, False]
        assert "flat, area 0" in found.summary()
        assert np.isfinite(found.outline()).all()

    def test_points_on_a_plane_and_on_a_line_in_space(self):
        rng = np.random.default_rng(3)
        plane = rng.normal(size=(20, 2)) @ rng.normal(size=(2, 3))
        assert np.count_nonzero(ellipse(plane).half_axes) == 2
        line = rng.normal(size=(20, 1)) @ rng.normal(size=(1, 3))
        assert np.count_nonzero(ellipse(line).half_axes) == 1
        assert np.count_nonzero(ellipse(line, about="mean").half_axes) == 1

    def test_a_large_common_part_does_not_hide_it(self):
        along = np.random.default_rng(3).normal(size=30)
        assert ellipse(np.column_stack([along + 1e8, along / 3 - 1e8])).flat

    def test_a_thin_ellipse_is_not_flat(self):
        points = np.random.default_rng(3).normal(size=(30, 2)) * [1, 1e-6]
        assert not ellipse(points).flat

    def test_points_along_an_axis(self):
        along = np.arange(5.0)
        assert ellipse(np.column_stack([along, along * 0])).angle == pytest.approx(0)
        assert ellipse(np.column_stack([along * 0, along])).angle == pytest.approx(90)


class TestTooLittleData:
    @pytest.mark.parametrize("d", [2, 3])
    def test_too_few_points(self, d):
        points = np.random.default_rng(1).normal(size=(d, d))
        with pytest.raises(InsufficientDataError, match=rf"of Joy needs at least {d + 1} points; there are {d}"):
            ellipse(points, category="Joy")

    def test_all_points_the_same(self):
        with pytest.raises(InsufficientDataError, match="All 5 points are the same"):
            ellipse([[0.1, 0.3]] * 5)

    def test_no_points(self):
        with pytest.raises(InsufficientDataError, match="there are 0"):
            ellipse(np.empty((0, 2)))


def test_by_category():
    rng = np.random.default_rng(6)
    points, names = rng.normal(size=(30, 2)), ["Joy", "Fear", "Anger"] * 10
    found = ellipses(points, names, coverage=0.9)
    assert [one.category for one in found] == ["Joy", "Fear", "Anger"]
    alone = ellipse(points[1::3], coverage=0.9)
    assert (found[1].half_axes == alone.half_axes).all()
    assert found[1].n == 10
    with pytest.raises(DataError, match="30 points but 29 categories"):
        ellipses(points, names[1:])
    with pytest.raises(InsufficientDataError, match="An ellipse of Sadness needs"):
        ellipses(points, ["Joy"] * 28 + ["Sadness"] * 2)


def test_bad_input():
    points = np.random.default_rng(1).normal(size=(9, 2))
    with pytest.raises(DataError, match="have 4 dimensions"):
        ellipse(np.ones((9, 4)))
    with pytest.raises(DataError, match="points x dimensions"):
        ellipse(points[:, 0])
    with pytest.raises(DataError, match="coverage is 50"):
        ellipse(points, coverage=50)
    with pytest.raises(DataError, match='must be "points" or "mean"'):
        ellipse(points, about="median")
    with pytest.raises(DataError, match="points of Joy: 1 of 18 values"):
        ellipse(np.where(points == points[3, 1], math.inf, points), category="Joy")
    with pytest.raises(DataError, match="3 dimensions, but the ellipse has 2"):
        ellipse(points).contains([[1, 2, 3]])
