"""Correlation of two measurements of the same things."""

import math
from dataclasses import dataclass

import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import centred, finite_vector, is_constant


@dataclass(frozen=True, kw_only=True)
class Correlation:
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

    def summary(self) -> str:
        """Return the result as a sentence in APA style, for instance ``r(12) = .87, 95% CI [.63, .96], p < .001``."""
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
        If the two differ in length, a value is not a finite number, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than three pairs or one side does not vary.

    References
    ----------
    Pearson (1896), Phil. Trans. R. Soc. A 187:253; p by the t distribution with n - 2 degrees of freedom (Student,
    1908, Biometrika 6:302); interval by Fisher (1921), Metron 1:3. Jia et al. (2013), section 5.2, use r to compare the
    PAD that went into a face with the PAD that people see.
    """
    if not 0 < confidence < 1:
        raise DataError(f"confidence is {confidence}, but must lie between 0 and 1.")
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"x has {xs.size} values and y has {ys.size}, but a correlation needs pairs.")
    n = xs.size
    if n < 3:
        raise InsufficientDataError(f"A correlation needs at least 3 pairs; there {'is' if n == 1 else 'are'} {n}.")
    (mean_x, dx), (mean_y, dy) = centred(xs), centred(ys)
    for name, values, differences in (("x", xs, dx), ("y", ys, dy)):
        if is_constant(values, differences):
            raise InsufficientDataError(
                f"All {n} values of {name} are the same, so there is no correlation to compute."
            )
    size_x, size_y = math.sqrt(dx @ dx), math.sqrt(dy @ dy)
    r = min(1.0, max(-1.0, float((dx / size_x) @ (dy / size_y))))
    slope = r * size_y / size_x
    return Correlation(
        r=r,
        n=n,
        p=_p_value(r, n),
        ci=_fisher_interval(r, n, confidence),
        confidence=confidence,
        slope=slope,
        intercept=mean_y - slope * mean_x,
    )


def _p_value(r: float, n: int) -> float:
    # The beta form of the t test, which stays exact for correlations near 1.
    return float(2 * special.betainc(n / 2 - 1, n / 2 - 1, (1 - abs(r)) / 2))


def _fisher_interval(r: float, n: int, confidence: float) -> tuple[float, float] | None:
    if n == 3:
        return None
    if abs(r) == 1:
        return (r, r)
    half = float(stats.norm.ppf((1 + confidence) / 2)) / math.sqrt(n - 3)
    return math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)
