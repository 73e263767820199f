"""Probability ellipses and ellipsoids of points, and confidence ellipses of their mean."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import linalg, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import centred_columns, finite_array
from evaluation.statistics.result import Result

About = Literal["points", "mean"]
"""What an ellipse is to cover: a share of the points, or the mean with some confidence."""

# Points that leave a plane (a line) by less than this share of their extent, or by less than rounding, lie in it.
_FLAT = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Ellipse(Result):
    """An ellipse (2-D) or ellipsoid (3-D).

    Attributes
    ----------
    category : str
        What the points belong to; empty if they were not divided.
    n : int
        Number of points.
    coverage : float
        Probability that the ellipse is for, between 0 and 1.
    about : {"points", "mean"}
        Whether it is to hold that share of the points or, with that confidence, their true mean.
    centre : numpy.ndarray, shape (d,)
        Mean of the points.
    half_axes : numpy.ndarray, shape (d,)
        Half-lengths of the axes, longest first; zero across the plane or line in which flat points lie.
    directions : numpy.ndarray, shape (d, d)
        Row k is the unit vector along axis k.
    share_inside : float
        Share of the points inside, 0 to 1.
    """

    category: str
    n: int
    coverage: float
    about: About
    centre: FloatArray
    half_axes: FloatArray
    directions: FloatArray
    share_inside: float

    @property
    def flat(self) -> bool:
        """Whether the points lie on a line (in 3-D: a line or a plane), so that the ellipse has no area (volume)."""
        return bool((self.half_axes == 0).any())

    @property
    def size(self) -> float:
        """Area of an ellipse, volume of an ellipsoid; zero for a flat one."""
        factor = math.pi if len(self.half_axes) == 2 else 4 * math.pi / 3
        return factor * float(np.prod(self.half_axes))

    @property
    def angle(self) -> float | None:
        """Angle of the longest axis from the first coordinate, in degrees, above -90 to 90; None in 3-D."""
        if len(self.half_axes) != 2:
            return None
        x, y = self.directions[0]
        return math.degrees(math.atan2(float(y), float(x)))

    def contains(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return which points, shape (m, d), lie inside or on the outline; of a flat ellipse, on its line or plane."""
        table = finite_array(points, axes=("points", "dimensions"), name="points")
        if table.shape[1] != len(self.centre):
            raise DataError(f"points have {table.shape[1]} dimensions, but the ellipse has {len(self.centre)}.")
        return _inside(table - self.centre, self.half_axes, self.directions, scale=float(np.abs(self.centre).max()))

    def outline(self, points: int = 100) -> FloatArray:
        """Return points on the outline for drawing.

        Parameters
        ----------
        points : int
            How many, at least 4; of an ellipsoid, so many meridians and half as many parallels.

        Returns
        -------
        numpy.ndarray, shape (points + 1, 2) or (points // 2 + 1, points + 1, 3)
            Points in order, the last the same as the first; of an ellipsoid, a grid from pole to pole.

        Raises
        ------
        DataError
            If fewer than 4 points are asked for.
        """
        if points < 4:
            raise DataError(f"points is {points}, but an outline needs at least 4.")
        turn = np.linspace(0, 2 * math.pi, points + 1)
        # So that the outline is closed to the last digit.
        turn[-1] = 0
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        if len(self.centre) == 3:
            tilt = np.linspace(0, math.pi, points // 2 + 1)[:, None, None]
            height = np.broadcast_to(np.cos(tilt), (points // 2 + 1, points + 1, 1))
            circle = np.concatenate([np.sin(tilt) * circle, height], axis=-1)
        outline: FloatArray = self.centre + (circle * self.half_axes) @ self.directions
        return outline

    def apa(self) -> str:
        """Return the ellipse as a sentence with its centre, half-axes, size and the share of points inside."""
        kind, measure = ("ellipse", "area") if len(self.centre) == 2 else ("ellipsoid", "volume")
        what = f"{100 * self.coverage:g}% {kind}" + (" of the mean" if self.about == "mean" else "")
        numbers = ", ".join(wording.number(float(value)) for value in self.centre)
        halves = ", ".join(wording.number(float(value)) for value in self.half_axes)
        size = f"flat, {measure} 0" if self.flat else f"{measure} {wording.number(self.size, 3)}"
        inside = f"{100 * self.share_inside:.0f}% of {self.n} points inside"
        prefix = f"{self.category}: " if self.category else ""
        return f"{prefix}{what}: centre ({numbers}), half-axes {halves}, {size}, {inside}"

    def to_frame(self) -> pd.DataFrame:
        """Return the ellipse as a frame of one row; coordinates and axes are numbered from 1."""
        row: dict[str, object] = {"category": self.category, "n": self.n, "coverage": self.coverage}
        row["about"] = self.about
        row |= {f"centre_{k + 1}": float(value) for k, value in enumerate(self.centre)}
        row |= {f"half_axis_{k + 1}": float(value) for k, value in enumerate(self.half_axes)}
        row |= {"angle": math.nan if self.angle is None else self.angle, "size": self.size, "flat": self.flat}
        return pd.DataFrame([row | {"share_inside": self.share_inside}])


def ellipse(points: npt.ArrayLike, *, coverage: float = 0.5, about: About = "points", category: str = "") -> Ellipse:
    """Return the probability ellipse of points, or the confidence ellipse of their mean.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        The points.
    coverage : float
        Share of the points, or confidence, between 0 and 1; the papers draw 0.5.
    about : {"points", "mean"}
        "points": the ellipse in which that share of a normal population with the points' mean and covariance lies.
        "mean": the region that holds the population's mean with that confidence.
    category : str
        Name of the points, for messages and summaries.

    Returns
    -------
    Ellipse
        Centre, axes, size, and the share of the points inside.

    Raises
    ------
    DataError
        If the points are no table of two or three columns of finite numbers, or an option is not one of those above.
    InsufficientDataError
        If there are fewer than d + 1 points in d dimensions, or all points are the same.

    Notes
    -----
    The half-axes are sqrt(c lambda_k), lambda_k the variances along the principal axes (n - 1) and

    - c the chi-square quantile with d degrees of freedom for the points; in 2-D -2 ln(1 - coverage);
    - c = d (n - 1) / (n (n - d)) times the F quantile with d and n - d degrees of freedom for the mean (Hotelling's
      T²).

    For the points mean and covariance are taken as known, as in the papers' figures; of few points the ellipse then
    holds somewhat less of the population than `coverage`. Enough points that lie on a line or plane are no error: they
    get a flat ellipse, with d the dimensions in which they do vary.

    References
    ----------
    Johnson and Wichern (2007), Applied Multivariate Statistical Analysis, 6th ed., Result 4.7 and Eq. 5-18. Jia et al.
    (2013), Fig. 3, mark a 50 % error ellipse for each emotion.
    """
    table = finite_array(points, axes=("points", "dimensions"), name=_named("points", category))
    if table.shape[1] not in (2, 3):
        raise DataError(f"The points have {table.shape[1]} dimensions, but an ellipse needs 2 and an ellipsoid 3.")
    if not 0 < coverage < 1:
        raise DataError(f"coverage is {coverage}, but must lie between 0 and 1.")
    if about not in ("points", "mean"):
        raise DataError(f'about is {about!r}, but must be "points" or "mean".')
    n, d = table.shape
    if n < d + 1:
        kind = "ellipse" if d == 2 else "ellipsoid"
        raise InsufficientDataError(f"{_named('An ' + kind, category)} needs at least {d + 1} points; there are {n}.")
    centre, differences = centred_columns(table)
    largest = float(np.abs(table).max())
    extent = float(np.abs(differences).max())
    rounding = 4 * float(np.finfo(float).eps) * largest
    if extent <= rounding:
        raise InsufficientDataError(f"{_named(f'All {n} points', category)} are the same, so they have no ellipse.")
    # Divided by their extent first, so that squares of small numbers do not vanish.
    _, lengths, directions = linalg.svd(differences / extent, full_matrices=False)
    lengths[lengths <= max(_FLAT * lengths[0], math.sqrt(n) * rounding / extent)] = 0
    rank = int(np.count_nonzero(lengths))
    half_axes = extent * lengths * math.sqrt(_factor(coverage, about, n=n, d=rank) / (n - 1))
    directions = _pointing_up(directions)
    inside = _inside(differences, half_axes, directions, scale=largest)
    for array in (centre, half_axes, directions):
        array.flags.writeable = False
    return Ellipse(
        category=category,
        n=n,
        coverage=coverage,
        about=about,
        centre=centre,
        half_axes=half_axes,
        directions=directions,
        share_inside=float(inside.mean()),
    )


def ellipses(
    points: npt.ArrayLike, categories: Sequence[str], *, coverage: float = 0.5, about: About = "points"
) -> tuple[Ellipse, ...]:
    """Return the ellipse of each category of points.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        The points.
    categories : sequence of str, length n
        Category of each point.
    coverage, about
        As in `ellipse`.

    Returns
    -------
    tuple of Ellipse
        One for each category, in the order in which the categories first appear.

    Raises
    ------
    DataError
        As `ellipse`, or if there is not one category for each point.
    InsufficientDataError
        As `ellipse`, for the first category to which it applies.
    """
    table = finite_array(points, axes=("points", "dimensions"), name="points")
    names = [str(category) for category in categories]
    if len(names) != len(table):
        raise DataError(f"There are {len(table)} points but {len(names)} categories; each point needs one.")
    labels = np.array(names, dtype=object)
    return tuple(
        ellipse(table[labels == name], coverage=coverage, about=about, category=name) for name in dict.fromkeys(names)
    )


def _factor(coverage: float, about: About, *, n: int, d: int) -> float:
    if about == "mean":
        return d * (n - 1) / (n * (n - d)) * float(stats.f.ppf(coverage, d, n - d))
    return -2 * math.log1p(-coverage) if d == 2 else float(stats.chi2.ppf(coverage, d))


def _pointing_up(directions: FloatArray) -> FloatArray:
    # An axis has two directions; the one with a positive first coordinate is taken, or, if that is zero, the next.
    first = (np.abs(directions) > 1e-12).argmax(axis=1)
    signs = np.where(directions[np.arange(len(directions)), first] < 0, -1.0, 1.0)
    return directions * signs[:, None]


def _inside(
    differences: FloatArray, half_axes: FloatArray, directions: FloatArray, *, scale: float
) -> npt.NDArray[np.bool_]:
    along = differences @ directions.T
    real = half_axes > 0
    distances = np.sum((along[:, real] / half_axes[real]) ** 2, axis=1)
    beside = np.abs(along[:, ~real])
    near = (beside <= 2 * _FLAT * (np.abs(along).max(axis=1, keepdims=True) + half_axes[0] + scale)).all(axis=1)
    # Points of the outline itself are inside, whatever the last digit says.
    result: npt.NDArray[np.bool_] = (distances <= 1 + 1e-9) & near
    return result


def _named(what: str, category: str) -> str:
    return f"{what} of {category}" if category else what
