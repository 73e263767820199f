"""Planning of precision: votes still needed until intervals are as narrow as wanted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, finite_vector
from evaluation.statistics.result import Result

IntArray = npt.NDArray[np.int64]

MOST_VOTES = 10_000_000
"""More votes than these are never planned."""


@dataclass(frozen=True, kw_only=True, eq=False)
class VotesNeeded(Result):
    """Votes still needed for intervals of a wanted half-width.

    Attributes
    ----------
    names : tuple of str
        The cells, for instance stimuli.
    n : numpy.ndarray of int, shape (cells,)
        Votes of each so far.
    sd : numpy.ndarray, shape (cells,)
        Standard deviation of each (n - 1); NaN with fewer than two votes.
    planned_sd : numpy.ndarray, shape (cells,)
        The standard deviation that the plan counts with: drawn towards the pooled one.
    pooled_sd : float
        Standard deviation within cells.
    reached : numpy.ndarray, shape (cells,)
        Half-width of Student's interval so far; infinite with fewer than two votes.
    total : numpy.ndarray of int, shape (cells,)
        Votes with which the half-width is expected to be as wanted, at least 2.
    half_width : float
        The wanted half-width.
    confidence : float
        Confidence of the intervals.
    assurance : float or None
        Probability with which the half-width is to be reached; None: it is reached in the middle of cases.
    """

    names: tuple[str, ...]
    n: IntArray
    sd: FloatArray
    planned_sd: FloatArray
    pooled_sd: float
    reached: FloatArray
    total: IntArray
    half_width: float
    confidence: float
    assurance: float | None

    @property
    def missing(self) -> IntArray:
        """Votes still needed of each cell, shape (cells,)."""
        result: IntArray = np.maximum(self.total - self.n, 0)
        return result

    @property
    def votes(self) -> int:
        """Votes still needed in all."""
        return int(self.missing.sum())

    def apa(self) -> str:
        """Return for instance ``95% CIs of ±0.25 need 120 more votes, in 9 of 14 cells (8 to 31 each), ...``."""
        what = f"{100 * self.confidence:g}% CIs of ±{self.half_width:g}"
        sd = f"with a pooled SD of {wording.number(self.pooled_sd)}"
        missing = self.missing[self.missing > 0]
        if not missing.size:
            return f"{what} need no more votes in any of {len(self.names)} cells, {sd}"
        each = f"{missing.min()} each" if missing.min() == missing.max() else f"{missing.min()} to {missing.max()} each"
        assured = "" if self.assurance is None else f", reached with a probability of {wording.share(self.assurance)}"
        noun = "vote" if self.votes == 1 else "votes"
        where = f"in {missing.size} of {len(self.names)} cells ({each})"
        return f"{what} need {self.votes} more {noun}, {where}, {sd}{assured}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each cell."""
        return pd.DataFrame(
            {
                "cell": list(self.names),
                "n": self.n,
                "sd": self.sd,
                "planned_sd": self.planned_sd,
                "half_width": self.reached,
                "total": self.total,
                "missing": self.missing,
            }
        )


def votes_needed(
    groups: Mapping[str, npt.ArrayLike],
    *,
    half_width: float,
    confidence: float = 0.95,
    prior_votes: float = 4,
    assurance: float | None = None,
    scale: tuple[float, float] | None = None,
) -> VotesNeeded:
    """Return how many more votes each cell needs until the interval of its mean is as narrow as wanted.

    Parameters
    ----------
    groups : mapping of str to array_like
        The votes of each cell so far; a cell may have none.
    half_width : float
        Wanted half-width of Student's interval, in the units of the votes.
    confidence, prior_votes, assurance, scale
        As in `votes_needed_from_summary`.

    Returns
    -------
    VotesNeeded
        Votes needed by cell and in all.

    Raises
    ------
    DataError
        As `votes_needed_from_summary`, or if a vote is no finite number or not on the scale.
    InsufficientDataError
        As `votes_needed_from_summary`.

    References
    ----------
    As `votes_needed_from_summary`.
    """
    n, sd = [], []
    for name, votes in groups.items():
        values = finite_vector(votes, name=str(name))
        if scale is not None and values.size and (values.min() < scale[0] or values.max() > scale[1]):
            raise DataError(f"{name}: a vote is not on the scale from {scale[0]:g} to {scale[1]:g}.")
        n.append(values.size)
        sd.append(_deviation(values) if values.size > 1 else np.nan)
    return votes_needed_from_summary(
        n,
        sd,
        names=[str(name) for name in groups],
        half_width=half_width,
        confidence=confidence,
        prior_votes=prior_votes,
        assurance=assurance,
        scale=scale,
    )


def votes_needed_from_summary(
    n: npt.ArrayLike,
    sd: npt.ArrayLike,
    *,
    half_width: float,
    names: Sequence[str] | None = None,
    confidence: float = 0.95,
    prior_votes: float = 4,
    assurance: float | None = None,
    scale: tuple[float, float] | None = None,
) -> VotesNeeded:
    """Return how many more votes each cell needs, from numbers and standard deviations of votes.

    Parameters
    ----------
    n : array_like, shape (cells,)
        Votes of each cell so far, whole numbers of 0 or more.
    sd : array_like, shape (cells,)
        Their standard deviations (n - 1); of cells with fewer than two votes they do not count and may be NaN.
    half_width : float
        Wanted half-width of Student's interval, above 0.
    names : sequence of str, optional
        Names of the cells; left out, "1", "2" and so on.
    confidence : float
        Confidence of the intervals, between 0 and 1.
    prior_votes : float
        Degrees of freedom that the pooled variance counts for beside those of the cell, 0 or more. The standard
        deviation of a handful of votes says little of that of the next ones, so that it is drawn towards the pooled
        one; the more votes the less. With 0, only cells with fewer than two votes take the pooled one.
    assurance : float, optional
        Probability with which the half-width is to be reached, between 0.5 and 1. Left out, the plan is for votes that
        spread as expected, and about half the intervals end up somewhat wider than wanted.
    scale : tuple of float, optional
        Ends of the scale. A standard deviation beyond half its length times sqrt(n / (n - 1)) is then an error, and
        none larger than half its length is planned.

    Returns
    -------
    VotesNeeded
        Votes needed by cell and in all.

    Raises
    ------
    DataError
        If an argument is out of range.
    InsufficientDataError
        If there are no cells, or no cell has two votes, so that nothing is known of the spread.

    Notes
    -----
    The smallest N with t(N - 1) s / sqrt(N) <= half_width is found by halving, since the left side falls with N; with
    an assurance s is multiplied by the root of its chi-square quantile over N - 1. s^2 = (prior_votes * pooled^2 +
    (n - 1) sd^2) / (prior_votes + n - 1).

    References
    ----------
    Kupper and Hafner (1989), Amer. Statist. 43:101 (sample sizes for half-widths, and the assurance). Smyth (2004),
    Stat. Appl. Genet. Mol. Biol. 3:3 (variances drawn towards a common one).
    """
    number, spread = _table(n, sd)
    _check(half_width, confidence, prior_votes, assurance)
    known_as = tuple(str(name) for name in names) if names is not None else tuple(map(str, range(1, number.size + 1)))
    if len(known_as) != number.size:
        raise DataError(f"There are {number.size} cells, but {len(known_as)} names.")
    df = np.maximum(number - 1, 0)
    if not df.any():
        raise InsufficientDataError("No cell has two votes, so that nothing is known of their spread.")
    used = np.where(df > 0, spread, 0)
    largest = float(used.max())
    # In units of the largest, so that squares of small numbers do not vanish.
    relative = used / (largest or 1.0)
    pooled = float(df @ relative**2 / df.sum())
    weight = prior_votes + df
    planned = largest * np.sqrt((prior_votes * pooled + df * relative**2) / np.where(weight > 0, weight, 1))
    planned = np.where(weight > 0, planned, largest * np.sqrt(pooled))
    if scale is not None:
        planned = np.minimum(planned, _half_length(scale, number, used))
    total = _smallest(planned, half_width, confidence, assurance)
    reached = np.full(number.size, np.inf)
    two = df > 0
    reached[two] = special.stdtrit(df[two], (1 + confidence) / 2) * used[two] / np.sqrt(number[two])
    flags = []
    if not largest:
        flags.append(
            "No votes differ within a cell: the plan counts with no spread at all, which can hardly be trusted."
        )
    few = int(np.count_nonzero(~two))
    if few:
        flags.append(f"{few} of {number.size} cells have fewer than two votes and are planned with the pooled SD.")
    beyond = int(np.count_nonzero(total >= MOST_VOTES))
    if beyond:
        flags.append(f"{beyond} of {number.size} cells need {MOST_VOTES} votes or more; the plan stops there.")
    return VotesNeeded(
        names=known_as,
        n=number,
        sd=np.where(two, spread, np.nan),
        planned_sd=planned,
        pooled_sd=largest * float(np.sqrt(pooled)),
        reached=reached,
        total=total,
        half_width=half_width,
        confidence=confidence,
        assurance=assurance,
        flags=tuple(flags),
    )


def _deviation(values: FloatArray) -> float:
    """Return the standard deviation (n - 1), in which squares of small numbers do not vanish."""
    rest = centred(values)[1]
    largest = float(np.abs(rest).max()) or 1.0
    return largest * float(np.sqrt((rest / largest) @ (rest / largest) / (values.size - 1)))


def _table(n: npt.ArrayLike, sd: npt.ArrayLike) -> tuple[IntArray, FloatArray]:
    number = finite_vector(n, name="n")
    if not number.size:
        raise InsufficientDataError("There are no cells.")
    if (number < 0).any() or (number != np.round(number)).any() or number.max() > MOST_VOTES:
        raise DataError(f"n: the votes of a cell must be whole numbers from 0 to {MOST_VOTES}.")
    spread = np.asarray(sd, dtype=float)
    if spread.shape != number.shape:
        raise DataError(f"There are {number.size} numbers of votes, but the standard deviations are {spread.shape}.")
    if (finite_vector(spread[number > 1], name="sd") < 0).any():
        raise DataError("sd: a standard deviation is negative.")
    return number.astype(np.int64), spread


def _check(half_width: float, confidence: float, prior_votes: float, assurance: float | None) -> None:
    check_confidence(confidence)
    if not 0 < half_width < np.inf:
        raise DataError(f"half_width is {half_width}, but must be above 0.")
    if not 0 <= prior_votes < np.inf:
        raise DataError(f"prior_votes is {prior_votes}, but must be 0 or more.")
    if assurance is not None and not 0.5 <= assurance < 1:
        raise DataError(f"assurance is {assurance}, but must be from 0.5 to below 1.")


def _half_length(scale: tuple[float, float], number: IntArray, spread: FloatArray) -> float:
    low, high = scale
    if not np.isfinite(high - low) or low >= high:
        raise DataError(f"The scale goes from {low} to {high}, but must have a lower and a higher end.")
    half = (high - low) / 2
    possible = half * np.sqrt(number / np.maximum(number - 1, 1)) * (1 + 1e-9)
    if (spread > possible).any():
        raise DataError(f"A standard deviation is larger than any of votes from {low:g} to {high:g}.")
    return half


def _smallest(sd: FloatArray, half_width: float, confidence: float, assurance: float | None) -> IntArray:
    """Return the smallest numbers of votes, from 2 to the most, with which the half-width is reached."""
    few, enough = np.ones(sd.size, dtype=np.int64), np.full(sd.size, MOST_VOTES, dtype=np.int64)
    while (enough - few > 1).any():
        middle = (few + enough) // 2
        middle = np.maximum(middle, 2)
        df = middle - 1.0
        expected = special.stdtrit(df, (1 + confidence) / 2) * sd / np.sqrt(middle)
        if assurance is not None:
            expected = expected * np.sqrt(special.chdtri(df, 1 - assurance) / df)
        narrow = expected <= half_width * (1 + 1e-12)
        enough, few = np.where(narrow, middle, enough), np.where(narrow, few, middle)
    return enough
