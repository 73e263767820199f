"""Rejection of raters whose scores are often out of range (ITU-R BT.500)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import ratings_table
from evaluation.statistics.result import Result

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

LARGEST_SHARE = 0.05
"""Share of a rater's scores that may be out of range (ITU-R BT.500-14, A1-2.3.1)."""

SMALLEST_ASYMMETRY = 0.3
"""Raters whose outlying scores lie mostly on one side, by this or more, are not rejected (ibid.)."""

LEAST_RATERS = 6
"""Among fewer raters no score can be 2 standard deviations from the mean."""

# Comparisons of sums count as equal what differs by rounding alone.
_ROUNDING = 1e-9

_NO_SCORES = "no scores, so no share of them"
_NO_OUTLIERS = "no scores out of range, so no asymmetry of these"


@dataclass(frozen=True, kw_only=True, eq=False)
class RangeCounts(Result):
    """How many of each rater's scores are far above or below those of the others.

    Attributes
    ----------
    above, below : numpy.ndarray of int, shape (raters,)
        The standard's P and Q.
    presentations : numpy.ndarray of int, shape (raters,)
        How many presentations the rater has rated: the standard's J K R where nothing is missing.
    share : numpy.ndarray, shape (raters,)
        (P + Q) / presentations; NaN without any.
    asymmetry : numpy.ndarray, shape (raters,)
        abs(P - Q) / (P + Q); NaN where both are 0.
    """

    above: IntArray
    below: IntArray
    presentations: IntArray
    share: FloatArray
    asymmetry: FloatArray

    def apa(self) -> str:
        """Return for instance ``12 of 2054 scores by 26 raters are out of the range of their presentation``."""
        out, total = int((self.above + self.below).sum()), int(self.presentations.sum())
        return f"{out} of {total} scores by {self.above.size} raters are out of the range of their presentation"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each rater, numbered from 0 as the columns of the ratings."""
        return pd.DataFrame(
            {
                "rater": np.arange(self.above.size),
                "above": self.above,
                "below": self.below,
                "presentations": self.presentations,
                "share": self.share,
                "asymmetry": self.asymmetry,
            }
        )


def range_counts(ratings: npt.ArrayLike) -> RangeCounts:
    """Count each rater's scores that are out of the range of the presentation's scores (ITU-R BT.500).

    A score is out of range if it is 2 standard deviations (n - 1) or more from the presentation's mean, or the root of
    20 of them where the scores are not normal: where their kurtosis, the fourth moment over the square of the second,
    is not from 2 to 4. The standard rejects a rater if share > 0.05 and asymmetry < 0.3.

    Parameters
    ----------
    ratings : array_like, shape (presentations, raters)
        Scores; NaN where a rater did not rate a presentation.

    Returns
    -------
    RangeCounts
        Counts for each rater.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.

    Notes
    -----
    The rater's own score is part of mean and deviation, so that nothing is 2 deviations off among fewer than 6 raters,
    and nothing the root of 20 among fewer than 22. Where all agree, nothing is out of range.

    References
    ----------
    Recommendation ITU-R BT.500-14 (2019), Annex 1, A1-2.3.1.
    """
    scores, given = ratings_table(ratings)
    number = given.sum(axis=1)
    differences = scores - (scores.sum(axis=1) / np.maximum(number, 1))[:, None]
    differences[~given] = 0
    largest = np.abs(differences).max(axis=1, initial=0)
    varied = largest > _ROUNDING * np.abs(scores).max(axis=1, initial=0)
    # In units of the largest difference, so that fourth powers of small numbers do not vanish.
    differences /= np.where(varied, largest, 1)[:, None]
    squares = differences**2
    sums = np.where(varied, squares.sum(axis=1), 1)
    spread = np.sqrt(sums / np.maximum(number - 1, 1))
    kurtosis = number * np.einsum("ji,ji->j", squares, squares) / sums**2
    normal = (kurtosis >= 2 * (1 - _ROUNDING)) & (kurtosis <= 4 * (1 + _ROUNDING))
    # No score is out of the range of a presentation that all rate alike.
    limit = np.where(varied, np.where(normal, 2.0, np.sqrt(20)) * spread * (1 - _ROUNDING), np.inf)[:, None]
    above = (differences >= limit).sum(axis=0)
    below = (differences <= -limit).sum(axis=0)
    presentations = given.sum(axis=0)
    out = above + below
    return RangeCounts(
        above=above,
        below=below,
        presentations=presentations,
        share=_ratio(out, presentations),
        asymmetry=_ratio(np.abs(above - below), out),
        flags=(*_few(given), *_without(presentations, out)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Bt500Rejection(Result):
    """Which raters ITU-R BT.500 rejects, and why.

    Attributes
    ----------
    counts : RangeCounts
        How often each rater's scores are out of range.
    rejected : numpy.ndarray of bool, shape (raters,)
        Whether the rater is rejected.
    reasons : tuple of str
        Why each rater is rejected or accepted.
    """

    counts: RangeCounts
    rejected: BoolArray
    reasons: tuple[str, ...]

    @property
    def accepted(self) -> BoolArray:
        """Whether each rater is accepted, shape (raters,)."""
        return ~self.rejected

    def apa(self) -> str:
        """Return for instance ``ITU-R BT.500 rejects 1 of 26 raters (number 14)``; numbers are counted from 1."""
        places = np.flatnonzero(self.rejected) + 1
        text = f"ITU-R BT.500 rejects {places.size} of {self.rejected.size} raters"
        if not places.size:
            return text
        number = "number" if places.size == 1 else "numbers"
        return f"{text} ({number} {', '.join(str(place) for place in places)})"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each rater: the counts, whether the rater is rejected, and why."""
        return self.counts.to_frame().assign(rejected=self.rejected, reason=list(self.reasons))


def bt500_rejection(ratings: npt.ArrayLike) -> Bt500Rejection:
    """Return which raters ITU-R BT.500 rejects: share of scores out of range > 0.05 and asymmetry < 0.3.

    Parameters
    ----------
    ratings : array_like, shape (presentations, raters)
        Scores; NaN where a rater did not rate a presentation.

    Returns
    -------
    Bt500Rejection
        Rejected raters and reasons. A rater without any score is accepted, which the reason says.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    InsufficientDataError
        If there are no scores.

    Notes
    -----
    The standard applies the procedure once, to all scores, and not again to what is left.

    References
    ----------
    Recommendation ITU-R BT.500-14 (2019), Annex 1, A1-2.3.1.
    """
    counts = range_counts(ratings)
    if not counts.presentations.sum():
        raise InsufficientDataError("There are no scores, so that no rater can be judged.")
    out = counts.above + counts.below
    often = out > LARGEST_SHARE * counts.presentations * (1 + _ROUNDING)
    even = np.abs(counts.above - counts.below) < SMALLEST_ASYMMETRY * out * (1 - _ROUNDING)
    reasons = tuple(
        _reason(int(a), int(b), int(n), often=bool(is_often), even=bool(is_even))
        for a, b, n, is_often, is_even in zip(
            counts.above, counts.below, counts.presentations, often, even, strict=True
        )
    )
    # No score out of range is what raters should have.
    flags = tuple(flag for flag in counts.flags if _NO_OUTLIERS not in flag)
    return Bt500Rejection(counts=counts, rejected=often & even, reasons=reasons, flags=flags)


def _reason(above: int, below: int, presentations: int, *, often: bool, even: bool) -> str:
    if not presentations:
        return "accepted: no scores"
    out = above + below
    text = f"{out} of {presentations} scores out of range ({above} above, {below} below)"
    if often and even:
        return f"rejected: {text}, more than {LARGEST_SHARE:.0%} and on both sides"
    if often:
        return f"accepted: {text}, most on one side"
    return f"accepted: {text}, no more than {LARGEST_SHARE:.0%}"


def _few(given: BoolArray) -> tuple[str, ...]:
    panels = given.sum(axis=1)
    few, rated = int(np.count_nonzero((panels > 0) & (panels < LEAST_RATERS))), int(np.count_nonzero(panels))
    if not few:
        return ()
    who = f"fewer than {LEAST_RATERS} raters, among whom no score can be out of range"
    return (f"{few} of {rated} presentations have {who}.",)


def _without(presentations: IntArray, out: IntArray) -> tuple[str, ...]:
    unrated, within = int(np.count_nonzero(presentations == 0)), int(np.count_nonzero((presentations > 0) & (out == 0)))
    return tuple(
        f"{count} of {out.size} raters have {what}."
        for what, count in ((_NO_SCORES, unrated), (_NO_OUTLIERS, within))
        if count
    )


def _ratio(part: npt.ArrayLike, whole: IntArray) -> FloatArray:
    result: FloatArray = np.where(whole > 0, np.asarray(part) / np.maximum(whole, 1), np.nan)
    return result
