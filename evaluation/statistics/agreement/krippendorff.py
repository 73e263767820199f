"""Krippendorff's alpha: agreement of any number of raters, at any level of measurement, with missing ratings."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.krippendorff_sums import (
    Disagreement,
    IntervalDisagreement,
    NominalDisagreement,
    OrdinalDisagreement,
    RatioDisagreement,
    UnitMoments,
    pairable,
    unit_moments,
    value_counts,
)
from evaluation.statistics.arrays import FloatArray, check_confidence, is_constant
from evaluation.statistics.label_codes import label_codes
from evaluation.statistics.matrices import ratings_table
from evaluation.statistics.result import Result

Level = Literal["nominal", "ordinal", "interval", "ratio"]

_LEVELS = ("nominal", "ordinal", "interval", "ratio")
_FEW_ITEMS = 20
_BATCH = 2_000_000


@dataclass(frozen=True, kw_only=True)
class KrippendorffAlpha(Result):
    """Krippendorff's alpha.

    Attributes
    ----------
    alpha : float
        1 for perfect agreement, 0 for what chance alone gives, below 0 for systematic disagreement.
    level : str
        Level of measurement: ``nominal``, ``ordinal``, ``interval`` or ``ratio``.
    observed, expected : float
        Observed and expected disagreement D_o and D_e, whose ratio alpha subtracts from 1: in squared units of the
        ratings at the interval level, in squared ranks at the ordinal one.
    items, raters, ratings : int
        Numbers of items with two ratings or more, of raters who gave these, and of these ratings.
    ci : tuple of float, or None
        Bootstrap interval; None if none was asked for.
    confidence : float
        Confidence of the interval.
    replicates : int
        Bootstrap samples that the interval comes from; 0 if none was asked for.
    """

    alpha: float
    level: Level
    observed: float
    expected: float
    items: int
    raters: int
    ratings: int
    ci: tuple[float, float] | None
    confidence: float
    replicates: int

    def apa(self) -> str:
        """Return a sentence, for instance ``Krippendorff's alpha (ordinal, 4 raters, 11 items) = .82.``."""
        text = (
            f"Krippendorff's alpha ({self.level}, {self.raters} raters, {self.items} items) = "
            f"{wording.share(self.alpha)}"
        )
        if self.ci is not None:
            text = f"{text}, {wording.interval(*self.ci, confidence=self.confidence, bounded=True)}"
        return f"{text}."

    def to_frame(self) -> pd.DataFrame:
        """Return the numbers as a frame of one row; NaN for an interval that was not asked for."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "level": [self.level],
                "alpha": [self.alpha],
                "ci_low": [low],
                "ci_high": [high],
                "confidence": [self.confidence],
                "observed_disagreement": [self.observed],
                "expected_disagreement": [self.expected],
                "items": [self.items],
                "raters": [self.raters],
                "ratings": [self.ratings],
                "replicates": [self.replicates],
            }
        )


def krippendorff_alpha(
    ratings: npt.ArrayLike,
    *,
    level: Level = "interval",
    categories: Sequence[Hashable] | None = None,
    rng: np.random.Generator | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
) -> KrippendorffAlpha:
    """Return Krippendorff's alpha, with a bootstrap interval if a generator is given.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item. At the nominal level, and with `categories` at the ordinal
        one, labels of any kind; None or NaN where one is missing.
    level : {"nominal", "ordinal", "interval", "ratio"}
        What differences between ratings mean: whether they are the same, how many ratings lie between them, their
        difference, or their difference as a share of their sum.
    categories : sequence, optional
        All labels, at the ordinal level from the lowest to the highest.
    rng : numpy.random.Generator, optional
        Source of the bootstrap samples; without it there is no interval.
    replicates : int
        Number of bootstrap samples, at least 100.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    KrippendorffAlpha
        Alpha, the disagreements that it comes from, and its interval.

    Raises
    ------
    DataError
        If the ratings are no table of what `level` needs, one is infinite or negative (ratio), or an option is wrong.
    InsufficientDataError
        If fewer than two items have two ratings, or all ratings that can be compared are the same.

    Notes
    -----
    An item with one rating has nothing to compare it with and is left out, as Krippendorff does.

    The interval takes percentiles of alpha over samples of the items, drawn with replacement; each sample's alpha comes
    from sums kept for each item. Krippendorff's own bootstrap (Hayes and Krippendorff, 2007) draws single observed
    disagreements as if they were independent and holds the expected disagreement fixed; ratings of one item are not
    independent, so that its intervals are as a rule too narrow, and it is not offered.

    References
    ----------
    Krippendorff (2011), Computing Krippendorff's Alpha-Reliability, whose example has .743, .815, .849 and .797.
    Hayes and Krippendorff (2007), Communication Methods and Measures 1:77. Bootstrap of the items: Zapf, Castell,
    Morawietz and Karch (2016), BMC Medical Research Methodology 16:93.
    """
    check_confidence(confidence)
    if level not in _LEVELS:
        raise DataError(f"level is {level!r}, but must be one of {', '.join(_LEVELS)}.")
    if rng is not None and replicates < 100:
        raise DataError(f"replicates is {replicates}, but an interval needs at least 100.")
    table = _table(ratings, level, categories)
    disagreement, kept, count = _disagreement(table, level)
    observed, expected = (float(part[0]) for part in disagreement.of(np.ones((1, kept.size))))
    if not expected > 0:
        raise _all_equal(count)
    ci, drawn, flags = None, 0, _left_out(table, kept)
    if rng is not None:
        ci, drawn = _bootstrap(disagreement, kept.size, rng, replicates=replicates, confidence=confidence)
        flags += _bootstrap_flags(kept.size, drawn, replicates)
    return KrippendorffAlpha(
        alpha=1 - observed / expected,
        level=level,
        observed=observed * disagreement.unit**2,
        expected=expected * disagreement.unit**2,
        items=kept.size,
        raters=_raters(table, kept, count),
        ratings=count,
        ci=ci,
        confidence=confidence,
        replicates=drawn,
        flags=flags,
    )


def _table(ratings: npt.ArrayLike, level: Level, categories: Sequence[Hashable] | None) -> FloatArray:
    if categories is not None and level in {"interval", "ratio"}:
        raise DataError(f"The {level} level needs numbers, so that it has no use for categories.")
    if categories is None:
        try:
            table = np.asarray(ratings, dtype=float)
        except (TypeError, ValueError):
            if level == "ordinal":
                raise DataError("ratings: labels at the ordinal level need their categories in order.") from None
            if level != "nominal":
                ratings_table(ratings)  # Says what is wrong.
                raise
        else:
            return _two_axes(table)
    codes = label_codes(ratings, categories=categories, name="ratings").codes
    return _two_axes(np.where(codes < 0, math.nan, codes))


def _two_axes(table: FloatArray) -> FloatArray:
    if table.ndim != 2:
        raise DataError(f"ratings has the shape {table.shape}, but must have items x raters.")
    if not table.size:
        raise InsufficientDataError("There are no ratings, so that Krippendorff's alpha is not defined.")
    return table


def _disagreement(table: FloatArray, level: Level) -> tuple[Disagreement, npt.NDArray[np.intp], int]:
    """Return the disagreement of the items that have two ratings or more, which these are, and their ratings."""
    if level == "interval":
        moments = unit_moments(table)
        kept = np.flatnonzero(moments.sizes > 1)
        total = int(moments.sizes[kept].sum())
        _check(table, kept, total)
        return IntervalDisagreement(_of_items(moments, kept)), kept, total
    kept, counts, values = pairable(*value_counts(table))
    total = int(counts.sum())
    _check(table, kept, total)
    if level == "nominal":
        return NominalDisagreement(counts), kept, total
    return OrdinalDisagreement(counts) if level == "ordinal" else RatioDisagreement(counts, values), kept, total


def _of_items(moments: UnitMoments, kept: npt.NDArray[np.intp]) -> UnitMoments:
    return UnitMoments(moments.sizes[kept], moments.mean[kept], moments.squares[kept], moments.unit)


def _check(table: FloatArray, kept: npt.NDArray[np.intp], total: int) -> None:
    if kept.size < 2:
        number = "only one item has" if kept.size else "no item has"
        raise InsufficientDataError(
            f"Krippendorff's alpha needs two items or more that two raters have rated; {number} two ratings."
        )
    if not _varies(table, kept):
        raise _all_equal(total)


def _varies(table: FloatArray, kept: npt.NDArray[np.intp]) -> bool:
    """Return whether ratings differ by more than their rounding; a few items mostly tell."""
    for some in (kept[:: 1 + kept.size // 8], kept):
        values = table[some]
        values = values[~np.isnan(values)]
        if not is_constant(values, values - values[0]):
            return True
    return False


def _all_equal(count: int) -> InsufficientDataError:
    return InsufficientDataError(
        f"All {count} ratings that can be compared are the same, so that Krippendorff's alpha is not defined."
    )


def _raters(table: FloatArray, kept: npt.NDArray[np.intp], count: int) -> int:
    if count == kept.size * table.shape[1]:
        return int(table.shape[1])
    seen = np.asarray(~np.isnan(table[kept[:16]]).all(axis=0))
    seen[~seen] = ~np.isnan(table[np.ix_(kept, ~seen)]).all(axis=0)
    return int(seen.sum())


def _left_out(table: FloatArray, kept: npt.NDArray[np.intp]) -> tuple[str, ...]:
    missing = len(table) - kept.size
    if not missing:
        return ()
    return (f"Left out, having fewer than two ratings: {missing} of {len(table)} items.",)


def _bootstrap(
    disagreement: Disagreement,
    items: int,
    rng: np.random.Generator,
    *,
    replicates: int,
    confidence: float,
) -> tuple[tuple[float, float] | None, int]:
    """Return the percentile interval, and how many samples had an alpha."""
    full = disagreement.of(np.ones((1, items)))[1][0]
    size = max(1, _BATCH // items)
    found = []
    for start in range(0, replicates, size):
        samples = min(size, replicates - start)
        drawn = rng.integers(items, size=(samples, items)) + items * np.arange(samples)[:, None]
        weights = np.bincount(drawn.ravel(), minlength=samples * items).reshape(samples, items).astype(float)
        observed, expected = disagreement.of(weights)
        # A sample whose ratings are all the same has no alpha; its expected disagreement is 0 but for rounding.
        sound = expected > 1e-12 * full
        found.append(1 - observed[sound] / expected[sound])
    alphas = np.concatenate(found)
    if alphas.size < 100:
        return None, alphas.size
    low, high = np.quantile(alphas, [(1 - confidence) / 2, (1 + confidence) / 2])
    return (float(low), float(high)), alphas.size


def _bootstrap_flags(items: int, drawn: int, replicates: int) -> tuple[str, ...]:
    flags = []
    if drawn < replicates:
        flags.append(
            f"In {replicates - drawn} of {replicates} bootstrap samples all ratings were the same; the interval "
            "rests on the others."
        )
    if drawn < 100:
        flags.append("Too few bootstrap samples had an alpha, so that there is no interval.")
    if items < _FEW_ITEMS:
        flags.append(f"The interval rests on {items} items; with fewer than {_FEW_ITEMS} it is mostly too narrow.")
    return tuple(flags)
