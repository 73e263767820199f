"""PAD that went into faces against PAD that people saw: bias, error, scale and correlation by dimension."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.correlation import pearson
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array
from evaluation.statistics.result import Result

KNOWN_SCALES = {
    0.8: "evaluations divided by 5 where the input was divided by 4, as in Eq. 13 of Jia et al. (2013); raters who "
    "keep away from the ends of the scale make such a slope too",
    1.25: "an input divided by 5 where the evaluations were divided by 4, as in Eq. 13 of Jia et al. (2013)",
}
"""Slopes of evaluated on input PAD that a confusion of scales makes; Eq. 13 divides means of items by 4."""

# Inputs whose squares, as shares of the largest square of all, are below this do not vary.
_SMALLEST_SQUARES = 1e-280


@dataclass(frozen=True, kw_only=True)
class Line(Result):
    """A least-squares line y = slope x + intercept.

    Attributes
    ----------
    slope, intercept : float
        The line.
    slope_ci, intercept_ci : tuple of float, or None
        Student's intervals; None where the residuals have no degrees of freedom.
    confidence : float
        Confidence of the intervals.
    """

    slope: float
    intercept: float
    slope_ci: tuple[float, float] | None
    intercept_ci: tuple[float, float] | None
    confidence: float

    def apa(self) -> str:
        """Return for instance ``slope 0.62, 95% CI [0.36, 0.88], intercept -0.02, 95% CI [-0.11, 0.07]``."""
        parts = []
        for name, value, ci in (
            ("slope", self.slope, self.slope_ci),
            ("intercept", self.intercept, self.intercept_ci),
        ):
            parts.append(f"{name} {wording.number(value)}")
            if ci is not None:
                parts.append(wording.interval(*ci, confidence=self.confidence))
        return ", ".join(parts)

    def to_frame(self) -> pd.DataFrame:
        """Return the line as a frame of one row."""
        slope, intercept = self.slope_ci or (math.nan,) * 2, self.intercept_ci or (math.nan,) * 2
        return pd.DataFrame(
            [
                {
                    "slope": self.slope,
                    "slope_ci_low": slope[0],
                    "slope_ci_high": slope[1],
                    "intercept": self.intercept,
                    "intercept_ci_low": intercept[0],
                    "intercept_ci_high": intercept[1],
                }
            ]
        )


@dataclass(frozen=True, kw_only=True)
class DimensionComparison(Result):
    """Input against evaluated values of one dimension.

    Attributes
    ----------
    name : str
        The dimension, for instance "P".
    n : int
        Number of points.
    bias : float
        Mean error: mean of evaluated less input.
    bias_ci : tuple of float
        Student's interval.
    rmse : float
        Root of the mean squared error (divided by n).
    rmse_ci : tuple of float
        Root of Student's interval of the mean squared error, 0 at least.
    mae : float
        Mean absolute error.
    mae_ci : tuple of float
        Student's interval, 0 at least.
    line : Line or None
        Evaluated on input; None if the input does not vary.
    r : float or None
        Pearson's correlation; None if a side does not vary.
    r_ci : tuple of float, or None
        Fisher's interval; None for three points.
    p : float or None
        Two-sided p of r.
    confidence : float
        Confidence of the intervals.
    """

    name: str
    n: int
    bias: float
    bias_ci: tuple[float, float]
    rmse: float
    rmse_ci: tuple[float, float]
    mae: float
    mae_ci: tuple[float, float]
    line: Line | None
    r: float | None
    r_ci: tuple[float, float] | None
    p: float | None
    confidence: float

    def apa(self) -> str:
        """Return for instance ``P: bias -0.02, 95% CI [-0.12, 0.08], RMSE = 0.18, MAE = 0.14, slope ..., r = .87``."""
        interval = wording.interval(*self.bias_ci, confidence=self.confidence)
        parts = [f"{self.name}: bias {wording.number(self.bias)}, {interval}"]
        parts += [f"RMSE = {wording.number(self.rmse)}", f"MAE = {wording.number(self.mae)}"]
        if self.line is not None:
            parts.append(self.line.apa())
        if self.r is not None and self.p is not None:
            parts += [f"r({self.n - 2}) = {wording.share(self.r)}", wording.p_value(self.p)]
        return ", ".join(parts)

    def to_frame(self) -> pd.DataFrame:
        """Return the comparison as a frame of one row; NaN where there is no value."""
        row: dict[str, object] = {"dimension": self.name, "n": self.n}
        measures = {
            "bias": (self.bias, self.bias_ci),
            "rmse": (self.rmse, self.rmse_ci),
            "mae": (self.mae, self.mae_ci),
        }
        for name, (value, ci) in measures.items():
            row |= {name: value, f"{name}_ci_low": ci[0], f"{name}_ci_high": ci[1]}
        if self.line is not None:
            row |= {str(name): value for name, value in self.line.to_frame().iloc[0].items()}
        else:
            row |= dict.fromkeys(_LINE, math.nan)
        low, high = self.r_ci or (math.nan, math.nan)
        row |= {"r": _nan(self.r), "r_ci_low": low, "r_ci_high": high, "p": _nan(self.p)}
        return pd.DataFrame([row])


_LINE = ("slope", "slope_ci_low", "slope_ci_high", "intercept", "intercept_ci_low", "intercept_ci_high")


@dataclass(frozen=True, kw_only=True)
class PadComparison(Result):
    """Input against evaluated points of a space, by dimension.

    Attributes
    ----------
    dimensions : tuple of DimensionComparison
        The comparison by dimension.
    mean_distance : float
        Mean Euclidean distance of evaluated from input.
    common_slope : float or None
        The slope that all dimensions have in common, each with an intercept of its own: the difference of scale as all
        of them together show it. None if the input does not vary.
    common_slope_ci : tuple of float, or None
        Student's interval.
    confidence : float
        Confidence of the intervals.
    """

    dimensions: tuple[DimensionComparison, ...]
    mean_distance: float
    common_slope: float | None
    common_slope_ci: tuple[float, float] | None
    confidence: float

    def apa(self) -> str:
        """Return the sentences of the dimensions and the common slope."""
        parts = [one.apa() for one in self.dimensions]
        if self.common_slope is not None:
            text = f"slope common to the dimensions {wording.number(self.common_slope)}"
            if self.common_slope_ci is not None:
                text += f", {wording.interval(*self.common_slope_ci, confidence=self.confidence)}"
            parts.append(text)
        return "; ".join([*parts, f"mean distance {wording.number(self.mean_distance)}"])

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each dimension."""
        return pd.concat([one.to_frame() for one in self.dimensions], ignore_index=True)


def compare_pad(
    given: npt.ArrayLike,
    evaluated: npt.ArrayLike,
    *,
    dimensions: Sequence[str] = ("P", "A", "D"),
    confidence: float = 0.95,
) -> PadComparison:
    """Compare the PAD that went into faces with the PAD that people saw in them.

    Parameters
    ----------
    given, evaluated : array_like, shape (n, d)
        Points that went in and points that were seen, a row for each face; a column for each dimension.
    dimensions : sequence of str, length d
        Names of the dimensions.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    PadComparison
        Bias, errors, line and correlation of each dimension, and the slope that they have in common. Slopes whose
        interval leaves 1 out are flagged as a difference of scale, with the division that would explain it.

    Raises
    ------
    DataError
        If the two are no tables of finite numbers of the same shape, the names do not fit, or `confidence` is not
        between 0 and 1.
    InsufficientDataError
        If there are fewer than three points.

    Notes
    -----
    r and RMSE cannot tell a difference of scale from noise, the slope can. Noise of the evaluation leaves the slope
    where it is, but widens its interval; noise of the input would draw it towards 0, and so does a rater who makes
    little use of the ends of the scale.

    References
    ----------
    Jia et al. (2013), section 5.2, Table 8 and Eq. 13. Willmott (1982), Bull. Amer. Meteorol. Soc. 63:1309 (bias, RMSE
    and line besides r).
    """
    check_confidence(confidence)
    x = finite_array(given, axes=("points", "dimensions"), name="given")
    y = finite_array(evaluated, axes=("points", "dimensions"), name="evaluated")
    if x.shape != y.shape:
        raise DataError(f"given has the shape {x.shape} and evaluated {y.shape}, but each point needs both.")
    if x.shape[1] != len(dimensions) or not len(dimensions):
        raise DataError(f"The points have {x.shape[1]} dimensions, but there are {len(dimensions)} names.")
    if len(x) < 3:
        raise InsufficientDataError(f"A comparison needs at least 3 points; there are {len(x)}.")
    (means_x, dx), (means_y, dy) = centred_columns(x), centred_columns(y)
    # In units of the largest number, so that squares neither vanish nor overflow.
    unit = max(float(np.abs(x).max()), float(np.abs(y).max())) or 1.0
    dx, dy = dx / unit, dy / unit
    still = constant_columns(x, dx * unit) | ((dx**2).sum(axis=0) < _SMALLEST_SQUARES)
    found = []
    for k, name in enumerate(dimensions):
        line = None if still[k] else _line(dx[:, k], dy[:, k], (float(means_x[k]), float(means_y[k])), unit, confidence)
        found.append(_dimension(str(name), x[:, k], y[:, k], line, unit=unit, confidence=confidence))
    common, common_ci = _common(dx[:, ~still], dy[:, ~still], confidence)
    flags = [flag for one in found for flag in one.flags]
    if common is not None and common_ci is not None and len(found) > 1:
        flags += _scale("All dimensions together", common, common_ci)
    return PadComparison(
        dimensions=tuple(found),
        mean_distance=unit * float(np.sqrt(((y / unit - x / unit) ** 2).sum(axis=1)).mean()),
        common_slope=common,
        common_slope_ci=common_ci,
        confidence=confidence,
        flags=tuple(flags),
    )


def _dimension(
    name: str, x: FloatArray, y: FloatArray, line: Line | None, *, unit: float, confidence: float
) -> DimensionComparison:
    errors = y / unit - x / unit
    bias, bias_low, bias_high = unit * _student(errors, confidence)
    rmse, rmse_low, rmse_high = unit * np.sqrt(np.maximum(_student(errors**2, confidence), 0))
    mae, mae_low, mae_high = unit * _student(np.abs(errors), confidence)
    flags = []
    if line is None:
        flags.append(f"{name}: the input does not vary, so that there is no slope and no correlation.")
    elif line.slope_ci is not None:
        flags += _scale(name, line.slope, line.slope_ci)
    try:
        correlation = pearson(x, y, confidence=confidence) if line is not None else None
    except InsufficientDataError:
        correlation = None
        flags.append(f"{name}: the evaluation does not vary, so that there is no correlation.")
    return DimensionComparison(
        name=name,
        n=x.size,
        bias=float(bias),
        bias_ci=(float(bias_low), float(bias_high)),
        rmse=float(rmse),
        rmse_ci=(float(rmse_low), float(rmse_high)),
        mae=float(mae),
        mae_ci=(max(float(mae_low), 0.0), float(mae_high)),
        line=line,
        r=None if correlation is None else correlation.r,
        r_ci=None if correlation is None else correlation.ci,
        p=None if correlation is None else correlation.p,
        confidence=confidence,
        flags=tuple(flags),
    )


def _student(values: FloatArray, confidence: float) -> FloatArray:
    """Return the mean and the limits of Student's interval."""
    mean = float(values.mean())
    rest = values - mean
    error = math.sqrt(float(rest @ rest) / (values.size - 1) / values.size)
    half = float(special.stdtrit(values.size - 1, (1 + confidence) / 2)) * error
    return np.array([mean, mean - half, mean + half])


def _line(dx: FloatArray, dy: FloatArray, means: tuple[float, float], unit: float, confidence: float) -> Line:
    n, squares = dx.size, float(dx @ dx)
    slope = float(dx @ dy) / squares
    intercept = means[1] - slope * means[0]
    rest = dy - slope * dx
    variance = float(rest @ rest) / (n - 2)
    quantile = float(special.stdtrit(n - 2, (1 + confidence) / 2))
    half = quantile * math.sqrt(variance / squares)
    across = unit * quantile * math.sqrt(variance * (1 / n + (means[0] / unit) ** 2 / squares))
    return Line(
        slope=slope,
        intercept=intercept,
        slope_ci=(slope - half, slope + half),
        intercept_ci=(intercept - across, intercept + across),
        confidence=confidence,
    )


def _common(dx: FloatArray, dy: FloatArray, confidence: float) -> tuple[float | None, tuple[float, float] | None]:
    if not dx.size:
        return None, None
    squares = float((dx**2).sum())
    slope = float((dx * dy).sum()) / squares
    df = dx.shape[1] * (len(dx) - 1) - 1
    rest = dy - slope * dx
    error = math.sqrt(float((rest**2).sum()) / df / squares)
    half = float(special.stdtrit(df, (1 + confidence) / 2)) * error
    return slope, (slope - half, slope + half)


def _scale(name: str, slope: float, ci: tuple[float, float]) -> list[str]:
    """Say that a slope is not 1, and which division would explain it."""
    rounding = 1e-9 * abs(slope)
    if ci[0] - rounding <= 1 <= ci[1] + rounding:
        return []
    text = f"{name}: the slope of {wording.number(slope)} differs from 1, which its interval leaves out"
    known = [
        f"; it agrees with {value:g}, which would come of {what}"
        for value, what in KNOWN_SCALES.items()
        if ci[0] - rounding <= value <= ci[1] + rounding
    ]
    explained = known[0] if known else ""
    return [f"{text}{explained}."]


def _nan(value: float | None) -> float:
    return math.nan if value is None else value
