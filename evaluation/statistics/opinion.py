"""Mean opinion scores with their intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import centred, check_confidence, finite_vector, is_constant
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class OpinionScore(Result):
    """A mean opinion score.

    Attributes
    ----------
    mean : float
        Mean of the scores, in their units.
    sd : float or None
        Standard deviation with n - 1; None for one score.
    n : int
        Number of scores.
    ci : tuple of float, or None
        Student's interval for the mean; None for one score. It does not know the ends of the scale and may reach
        beyond them.
    confidence : float
        Confidence of the interval.
    """

    mean: float
    sd: float | None
    n: int
    ci: tuple[float, float] | None
    confidence: float

    def apa(self) -> str:
        """Return the result in APA style, for instance ``M = 3.42, SD = 0.91, n = 30, 95% CI [3.08, 3.76]``."""
        parts = [f"M = {wording.number(self.mean)}"]
        if self.sd is not None:
            parts.append(f"SD = {wording.number(self.sd)}")
        parts.append(f"n = {self.n}")
        if self.ci is not None:
            parts.append(wording.interval(*self.ci, confidence=self.confidence))
        return ", ".join(parts)

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no value."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "n": [self.n],
                "mean": [self.mean],
                "sd": [math.nan if self.sd is None else self.sd],
                "ci_low": [low],
                "ci_high": [high],
            }
        )


def opinion_score(scores: npt.ArrayLike, *, confidence: float = 0.95) -> OpinionScore:
    """Return the mean opinion score of some ratings.

    Parameters
    ----------
    scores : array_like, shape (n,)
        Ratings, each from another rater or of another item.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    OpinionScore
        Mean, standard deviation, number and Student's interval.

    Raises
    ------
    DataError
        If a score is not a finite number, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are no scores.

    References
    ----------
    ITU-T Rec. P.800.1 (the term); Student (1908), Biometrika 6:1 (the interval); Jia et al. (2013), section 5.4.
    """
    check_confidence(confidence)
    values = finite_vector(scores, name="scores")
    if values.size == 0:
        raise InsufficientDataError("There are no scores, so there is no mean.")
    mean, differences = centred(values)
    n = values.size
    if n == 1:
        why = "There is one score, so there is no standard deviation and no interval."
        return OpinionScore(mean=mean, sd=None, n=1, ci=None, confidence=confidence, flags=(why,))
    # In units of the largest difference, so that squares of small numbers do not vanish.
    largest = float(np.abs(differences).max()) or 1.0
    relative = differences / largest
    sd = largest * math.sqrt(float(relative @ relative) / (n - 1))
    half = float(stats.t.ppf((1 + confidence) / 2, n - 1)) * sd / math.sqrt(n)
    flags: tuple[str, ...] = ()
    if is_constant(values, differences):
        flags = (f"All {n} scores are the same: the interval has no width, which says nothing of its precision.",)
    return OpinionScore(mean=mean, sd=sd, n=n, ci=(mean - half, mean + half), confidence=confidence, flags=flags)


def opinion_table(frame: pd.DataFrame, *, score: str, by: Sequence[str], confidence: float = 0.95) -> pd.DataFrame:
    """Return the mean opinion score of each group of rows, for instance of each condition and stimulus.

    Parameters
    ----------
    frame : pandas.DataFrame
        One row for each rating.
    score : str
        Column of the ratings; rows where it is missing do not count.
    by : sequence of str
        Columns that make the groups.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    pandas.DataFrame
        The columns `by`, then n, mean, sd, ci_low and ci_high; the groups in the order of their first row. NaN where a
        group of one rating has no value.

    Raises
    ------
    DataError
        If a column is missing, a score is infinite, or `confidence` is not between 0 and 1.

    References
    ----------
    As `opinion_score`.
    """
    check_confidence(confidence)
    missing = [column for column in [*by, score] if column not in frame.columns]
    if missing:
        raise DataError(f"The frame has no column {', '.join(missing)}; it has {', '.join(map(str, frame.columns))}.")
    rated = frame.dropna(subset=[score])
    finite_vector(rated[score].to_numpy(), name=score)
    groups = rated.groupby(list(by), sort=False, observed=True)[score]
    table = groups.agg(n="size", mean="mean", sd="std").reset_index()
    n = table["n"].to_numpy(dtype=float)
    half = stats.t.ppf((1 + confidence) / 2, n - 1) * table["sd"].to_numpy(dtype=float) / np.sqrt(n)
    return table.assign(ci_low=table["mean"] - half, ci_high=table["mean"] + half)
