"""Reliability of a sum of items: Cronbach's alpha, its items, and the Spearman-Brown formula for two."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.result import Result
from evaluation.statistics.scale_reliability.answer_table import AnswerTable, answer_table

_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True)
class ItemStatistics:
    """One item of a scale.

    Attributes
    ----------
    name : str
        Its name.
    mean, sd : float
        Mean and standard deviation (n - 1), in units of the answers.
    rest_r : float or None
        Corrected item-total correlation: with the sum of the other items. None if that sum does not vary.
    alpha_if_dropped : float or None
        Cronbach's alpha of the other items; None if there is one other item, or their sum does not vary.
    """

    name: str
    mean: float
    sd: float
    rest_r: float | None
    alpha_if_dropped: float | None


@dataclass(frozen=True, kw_only=True)
class CronbachAlpha(Result):
    """Cronbach's alpha.

    Attributes
    ----------
    alpha : float
        Of the sum of the items as they are.
    standardized : float or None
        Of the sum of standardised items; None if their correlations add up to none.
    ci : tuple of float
        Feldt's interval for `alpha`.
    confidence : float
        Confidence of the interval.
    mean_r : float
        Mean correlation of two items.
    rows : int
        Number of complete rows.
    items : tuple of ItemStatistics
        The items.
    """

    alpha: float
    standardized: float | None
    ci: tuple[float, float]
    confidence: float
    mean_r: float
    rows: int
    items: tuple[ItemStatistics, ...]

    def apa(self) -> str:
        """Return a sentence, for instance ``Cronbach's alpha (7 items, n = 30) = .84, 95% CI [.74, .92].``."""
        interval = wording.interval(*self.ci, confidence=self.confidence, bounded=True)
        return f"Cronbach's alpha ({len(self.items)} items, n = {self.rows}) = {wording.share(self.alpha)}, {interval}."

    def to_frame(self) -> pd.DataFrame:
        """Return alpha as a frame of one row; `item_frame` has the items."""
        return pd.DataFrame(
            {
                "items": [len(self.items)],
                "n": [self.rows],
                "alpha": [self.alpha],
                "ci_low": [self.ci[0]],
                "ci_high": [self.ci[1]],
                "confidence": [self.confidence],
                "standardized_alpha": [_or_nan(self.standardized)],
                "mean_r": [self.mean_r],
            }
        )

    def item_frame(self) -> pd.DataFrame:
        """Return a row for each item; NaN where there is no value."""
        return pd.DataFrame(
            {
                "item": [item.name for item in self.items],
                "mean": [item.mean for item in self.items],
                "sd": [item.sd for item in self.items],
                "rest_r": [_or_nan(item.rest_r) for item in self.items],
                "alpha_if_dropped": [_or_nan(item.alpha_if_dropped) for item in self.items],
            }
        )


def cronbach_alpha(
    answers: npt.ArrayLike | pd.DataFrame, *, names: Sequence[str] | None = None, confidence: float = 0.95
) -> CronbachAlpha:
    """Return Cronbach's alpha of a scale, raw and standardised, with Feldt's interval and what each item does to it.

    Parameters
    ----------
    answers : array_like or pandas.DataFrame, shape (rows, items)
        Answers, those to items of opposite meaning reversed; rows with a missing answer (NaN) are left out.
    names : sequence of str, optional
        Names of the items; the columns of a frame or else ``item 1`` ... without it.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    CronbachAlpha
        Alpha, its interval and the items.

    Raises
    ------
    DataError
        If the answers are no table of numbers, one is infinite, or an option is wrong.
    InsufficientDataError
        If there are fewer than two items or three complete rows, an item does not vary, or their sum does not.

    Notes
    -----
    alpha = k / (k - 1) (1 - sum of the items' variances / variance of their sum). The interval is exact for rows that
    are independent and items that are parallel: (1 - alpha) over its estimate has the F distribution with n - 1 and
    (n - 1)(k - 1) degrees of freedom.

    References
    ----------
    Cronbach (1951), Psychometrika 16:297. Interval: Feldt (1965), Psychometrika 30:357; Feldt, Woodruff and Salih
    (1987), Applied Psychological Measurement 11:93.
    """
    check_confidence(confidence)
    table = answer_table(answers, names=names)
    n, k = table.differences.shape
    alpha = _alpha(table.differences)
    if alpha is None:
        raise InsufficientDataError("The sum of the items does not vary, so that Cronbach's alpha is not defined.")
    mean_r = float(table.correlations[np.triu_indices(k, 1)].mean())
    room = 1 + (k - 1) * mean_r
    items = tuple(_item(table, place) for place in range(k))
    tail = (1 - confidence) / 2
    low, high = 1 - (1 - alpha) * stats.f.ppf([1 - tail, tail], n - 1, (n - 1) * (k - 1))
    return CronbachAlpha(
        alpha=alpha,
        standardized=k * mean_r / room if room > _ROUNDING else None,
        ci=(float(low), float(high)),
        confidence=confidence,
        mean_r=mean_r,
        rows=n,
        items=items,
        flags=table.flags + _flags(alpha, items),
    )


def _alpha(differences: FloatArray) -> float | None:
    k = differences.shape[1]
    differences = differences / np.abs(differences).max()
    parts = float((differences**2).sum())
    whole = float((differences.sum(axis=1) ** 2).sum())
    if whole <= _ROUNDING * parts:
        return None
    # The variance within rows about their means is what alpha lacks; as a sum of squares it loses no digits.
    apart = float(((differences - differences.mean(axis=1, keepdims=True)) ** 2).sum())
    return float(1 - k / (k - 1) * apart / whole)


def _item(table: AnswerTable, place: int) -> ItemStatistics:
    own = table.standardized[:, place]
    others = np.delete(table.differences, place, axis=1)
    others = others / np.abs(others).max()
    rest = others.sum(axis=1)
    size = float(rest @ rest)
    varies = size > _ROUNDING * float((others**2).sum())
    rest_r = float(own @ rest) / math.sqrt(float(own @ own) * size) if varies else None
    return ItemStatistics(
        name=table.names[place],
        mean=float(table.mean[place]),
        sd=float(table.deviations[place]) * table.unit,
        rest_r=None if rest_r is None else min(1.0, max(-1.0, rest_r)),
        alpha_if_dropped=_alpha(others) if varies and others.shape[1] > 1 else None,
    )


def _flags(alpha: float, items: tuple[ItemStatistics, ...]) -> tuple[str, ...]:
    flags = []
    if alpha < 0:
        flags.append("Alpha is negative: the items do not measure one thing, or some are not reversed.")
    against = [item.name for item in items if item.rest_r is not None and item.rest_r < 0]
    if against:
        flags.append(f"Items that correlate negatively with the sum of the others: {', '.join(against)}.")
    unknown = [item.name for item in items if item.rest_r is None]
    if unknown:
        flags.append(
            f"Items without item-total correlation, since the others' sum does not vary: {', '.join(unknown)}."
        )
    return tuple(flags)


def spearman_brown(correlation: float, *, times: float = 2) -> float:
    """Return the reliability of a scale so many times as long as one with the reliability given.

    Parameters
    ----------
    correlation : float
        Reliability of the shorter scale, above -1 and at most 1: for a scale of two items, their correlation.
    times : float
        How many times longer the scale is, above 0.

    Returns
    -------
    float
        times r / (1 + (times - 1) r).

    Raises
    ------
    DataError
        If a value is out of range, or there is no such reliability.

    References
    ----------
    Spearman (1910) and Brown (1910), British Journal of Psychology 3:271 and 3:296.
    """
    if not -1 < correlation <= 1:
        raise DataError(f"correlation is {correlation}, but must be above -1 and at most 1.")
    if not 0 < times < math.inf:
        raise DataError(f"times is {times}, but must be a number above 0.")
    room = 1 + (times - 1) * correlation
    if room <= 0:
        raise DataError(f"A correlation of {correlation} has no reliability at {times} times the length.")
    return times * correlation / room


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
