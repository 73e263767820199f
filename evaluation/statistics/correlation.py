"""Correlation of two measurements of the same things."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, finite_vector, is_constant
from evaluation.statistics.result import Result

# Closer to 1 than this, which rounding alone may bring about, a correlation counts as perfect.
_PERFECT = 1e-14


@dataclass(frozen=True, kw_only=True)
class Correlation(Result):
    """A Pearson correlation.

    Attributes
    ----------
    r : float
        Correlation, -1 to 1.
    n : int
        Number of pairs.
    p : float
        Two-sided probability of a correlation at least as strong if there were none.
    ci : tuple of float, or None
        Fisher's interval for r; None for three pairs, where it would be all of [-1, 1].
    confidence : float
        Confidence of the interval.
    slope, intercept : float
        Least-squares line y = slope x + intercept; a slope far from 1 shows a difference of scale that r cannot show.
    """

    r: float
    n: int
    p: float
    ci: tuple[float, float] | None
    confidence: float
    slope: float
    intercept: float

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``r(12) = .87, 95% CI [.63, .96], p < .001``."""
        parts = [f"r({self.n - 2}) = {wording.share(self.r)}"]
        if self.ci:
            parts.append(wording.interval(*self.ci, confidence=self.confidence, bounded=True))
        return ", ".join([*parts, wording.p_value(self.p)])

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "r": [self.r],
                "n": [self.n],
                "p": [self.p],
                "ci_low": [low],
                "ci_high": [high],
                "confidence": [self.confidence],
                "slope": [self.slope],
                "intercept": [self.intercept],
            }
        )


def pearson(x: npt.ArrayLike, y: npt.ArrayLike, *, confidence: float = 0.95) -> Correlation:
    """Return Pearson's correlation with its p value and Fisher's interval.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    Correlation
        The correlation and the least-squares line of y on x.

    Raises
    ------
    DataError
        If the two differ in length, a value is not a finite number, `confidence` is not between 0 and 1, or the slope
        would be infinite.
    InsufficientDataError
        If there are fewer than three pairs or one side does not vary.

    References
    ----------
    Pearson (1896), Phil. Trans. R. Soc. A 187:253; p by the t distribution with n - 2 degrees of freedom (Student,
    1908, Biometrika 6:302); interval by Fisher (1921), Metron 1:3. Jia et al. (2013), section 5.2, use r to compare the
    PAD that went into a face with the PAD that people see.
    """
    check_confidence(confidence)
    xs, ys = paired(x, y)
    n = xs.size
    (mean_x, dx), (mean_y, dy) = centred(xs), centred(ys)
    for name, values, differences in (("x", xs, dx), ("y", ys, dy)):
        if is_constant(values, differences):
            raise InsufficientDataError(
                f"All {n} values of {name} are the same, so there is no correlation to compute."
            )
    size_x, size_y = _length(dx), _length(dy)
    r = float(without_rounding((dx / size_x) @ (dy / size_y)))
    slope = r * (size_y / size_x)
    if not math.isfinite(slope):
        raise DataError("x varies so little beside y that the line's slope is beyond all numbers; use other units.")
    return Correlation(
        r=r,
        n=n,
        p=float(pearson_p_values(np.array(r), n)),
        ci=fisher_interval(r, 1 / math.sqrt(n - 3), confidence) if n > 3 else None,
        confidence=confidence,
        slope=slope,
        intercept=mean_y - slope * mean_x,
        flags=_flags(r, n),
    )


def without_rounding(r: npt.ArrayLike) -> FloatArray:
    """Return correlations with those that only rounding keeps from 1 or -1, or puts beyond, set to it; NaN stays."""
    values = np.asarray(r, dtype=float)
    return np.where(np.abs(values) >= 1 - _PERFECT, np.sign(values), values)


def pearson_p_values(r: FloatArray, n: npt.NDArray[np.int64] | int) -> FloatArray:
    """Return the two-sided p values of Pearson correlations.

    Parameters
    ----------
    r : numpy.ndarray
        Correlations, -1 to 1; NaN gives NaN.
    n : numpy.ndarray or int
        Numbers of pairs of values behind them, 3 or more.

    Returns
    -------
    numpy.ndarray, shape of r
        Student's test with n - 2 degrees of freedom, in its beta form, which stays exact for correlations near 1.
    """
    half = np.asarray(n, dtype=float) / 2 - 1
    p: FloatArray = np.minimum(2 * special.betainc(half, half, (1 - np.abs(r)) / 2), 1)
    return p


def fisher_interval(r: float, standard_error: float, confidence: float) -> tuple[float, float]:
    """Return an interval for a correlation: symmetric around artanh(r), with the standard error on that scale."""
    if abs(r) == 1:
        return (r, r)
    half = float(stats.norm.ppf((1 + confidence) / 2)) * standard_error
    return math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)


def paired(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the two sides of a correlation as vectors.

    Raises
    ------
    DataError
        If a value is not a finite number or the two differ in length.
    InsufficientDataError
        If there are fewer than three pairs.
    """
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"x has {xs.size} values and y has {ys.size}, but a correlation needs pairs.")
    if xs.size < 3:
        verb = "is" if xs.size == 1 else "are"
        raise InsufficientDataError(f"A correlation needs at least 3 pairs; there {verb} {xs.size}.")
    return xs, ys


def _length(vector: FloatArray) -> float:
    # Scaled by the largest first, so that squares of small numbers do not vanish.
    largest = float(np.abs(vector).max())
    return largest * math.sqrt(float((vector / largest) @ (vector / largest)))


def _flags(r: float, n: int) -> tuple[str, ...]:
    flags = []
    if n == 3:
        flags.append("Three pairs give no interval for r.")
    if abs(r) == 1:
        flags.append("All pairs lie on one line: check that the two sides are not the same measurement.")
    return tuple(flags)
