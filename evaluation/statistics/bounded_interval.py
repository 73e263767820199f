"""Intervals for the mean of ratings on a bounded scale, which do not leave the scale."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, finite_vector, is_constant
from evaluation.statistics.bootstrap_mean import bca_intervals
from evaluation.statistics.result import Result

Method = Literal["binomial", "wilson", "bootstrap"]
"""How an interval is computed; see `bounded_interval`."""

# Ratings vary more than binomial ones if chance alone would make them do so less often than this.
_OVERDISPERSED = 0.05
_NAMES = {"binomial": "binomial (Clopper-Pearson)", "wilson": "binomial (Wilson)", "bootstrap": "bootstrap (BCa)"}


@dataclass(frozen=True, kw_only=True)
class BoundedInterval(Result):
    """A mean with an interval that stays on the scale.

    Attributes
    ----------
    mean : float
        Mean of the ratings, in their units.
    sd : float or None
        Standard deviation with n - 1; None for one rating.
    n : int
        Number of ratings.
    ci : tuple of float
        The interval for the mean.
    confidence : float
        Confidence of the interval.
    method : {"binomial", "wilson", "bootstrap"}
        How the interval was computed.
    low, high : float
        Ends of the scale.
    """

    mean: float
    sd: float | None
    n: int
    ci: tuple[float, float]
    confidence: float
    method: Method
    low: float
    high: float

    def apa(self) -> str:
        """Return for instance ``M = 4.80, SD = 0.41, n = 20, 95% CI [4.56, 4.93] by binomial (Clopper-Pearson)``."""
        parts = [f"M = {wording.number(self.mean)}"]
        if self.sd is not None:
            parts.append(f"SD = {wording.number(self.sd)}")
        interval = wording.interval(*self.ci, confidence=self.confidence)
        return ", ".join([*parts, f"n = {self.n}", f"{interval} by {_NAMES[self.method]}"])

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no value."""
        row = {"n": self.n, "mean": self.mean, "sd": np.nan if self.sd is None else self.sd}
        row |= {"ci_low": self.ci[0], "ci_high": self.ci[1], "confidence": self.confidence}
        return pd.DataFrame([{**row, "method": self.method}])


def bounded_interval(
    ratings: npt.ArrayLike,
    *,
    low: float,
    high: float,
    method: Method = "binomial",
    confidence: float = 0.95,
    trials: float | None = None,
    rng: np.random.Generator | None = None,
    resamples: int = 2000,
) -> BoundedInterval:
    """Return the mean of ratings on a bounded scale with an interval that does not leave the scale.

    Parameters
    ----------
    ratings : array_like, shape (n,)
        Ratings, from `low` to `high`.
    low, high : float
        Ends of the scale, for instance 1 and 5.
    method : {"binomial", "wilson", "bootstrap"}
        "binomial": each rating counts as `trials` Bernoulli trials, of which (rating - low) / (high - low) succeed, and
        the interval is that of Clopper and Pearson for the n * trials trials: conservative, and open at one end only
        where all ratings are at that end of the scale. "wilson": the same with Wilson's score interval, which is
        shorter and holds its confidence on average. "bootstrap": bias-corrected and accelerated percentiles of the
        means of resamples; it knows nothing of the scale, but cannot leave the range of the ratings.
    confidence : float
        Confidence of the interval, between 0 and 1.
    trials : float, optional
        Bernoulli trials that one rating stands for: 1 / a, where a is the SOS parameter (`evaluation.statistics.sos`).
        Left out, high - low, which is for a scale of whole numbers (4 for 1 to 5); a scale with many more steps has
        ratings that vary far more than so many trials, for which the result is flagged: give 1 / a there.
    rng : numpy.random.Generator, optional
        For the bootstrap of ratings that lie on no common lattice, as means of several items may; ratings in equal
        steps need none, since the distribution of all their resamples is computed exactly.
    resamples : int
        How many resamples are drawn where `rng` is needed.

    Returns
    -------
    BoundedInterval
        Mean and interval; flagged where the ratings vary more than the binomial, or do not vary and are bootstrapped.

    Raises
    ------
    DataError
        If a rating is no finite number on the scale, the scale has no length, an option is not one of those above, or
        a generator is needed and missing.
    InsufficientDataError
        If there are no ratings.

    References
    ----------
    Hossfeld, Heegaard, Skorin-Kapov and Varela (2018), Confidence interval estimators for MOS values
    (arXiv:1806.01126), recommend the binomial estimators. Clopper and Pearson (1934), Biometrika 26:404. Wilson (1927),
    J. Amer. Statist. Assoc. 22:209. Efron (1987), J. Amer. Statist. Assoc. 82:171 (BCa).
    """
    values = finite_vector(ratings, name="ratings")
    _check(values, low=low, high=high, method=method, confidence=confidence, trials=trials)
    if not values.size:
        raise InsufficientDataError("There are no ratings, so there is no mean.")
    mean, differences = centred(values)
    n = values.size
    mean = min(max(mean, low), high)
    sd = float(np.sqrt(differences @ differences / (n - 1))) if n > 1 else None
    if method == "bootstrap":
        limits = bca_intervals(
            values, np.zeros(n, dtype=np.intp), 1, confidence=confidence, rng=rng, resamples=resamples
        ).clip(low, high)
        flags = _alike(values, differences)
    else:
        per_rating = high - low if trials is None else trials
        limits = binomial_interval(
            [mean], [n], low=low, high=high, trials=per_rating, confidence=confidence, wilson=method == "wilson"
        )
        flags = _overdispersed(np.array([mean]), np.array([sd or 0.0]), np.array([n]), _Scale(low, high, per_rating))
    ci = (float(limits[0, 0]), float(limits[0, 1]))
    return BoundedInterval(
        mean=mean, sd=sd, n=n, ci=ci, confidence=confidence, method=method, low=low, high=high, flags=flags
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class BoundedTable(Result):
    """Means of many groups of ratings with intervals that stay on the scale.

    Attributes
    ----------
    table : pandas.DataFrame
        A row for each group, in the order of their first rating: the columns that make the groups, then n, mean, sd,
        ci_low and ci_high; sd is NaN for a group of one rating.
    confidence : float
        Confidence of the intervals.
    method : {"binomial", "wilson", "bootstrap"}
        How the intervals were computed.
    """

    table: pd.DataFrame
    confidence: float
    method: Method

    def apa(self) -> str:
        """Return for instance ``Means of 14 groups from 1.73 to 4.32, 95% CI by binomial (Clopper-Pearson)``."""
        means, groups = self.table["mean"], len(self.table)
        reach = f" from {wording.number(means.min())} to {wording.number(means.max())}" if groups else ""
        noun = "group" if groups == 1 else "groups"
        return f"Means of {groups} {noun}{reach}, {100 * self.confidence:g}% CI by {_NAMES[self.method]}"

    def to_frame(self) -> pd.DataFrame:
        """Return the table."""
        return self.table.copy()


def bounded_table(
    frame: pd.DataFrame,
    *,
    score: str,
    by: Sequence[str],
    low: float,
    high: float,
    method: Method = "binomial",
    confidence: float = 0.95,
    trials: float | None = None,
    rng: np.random.Generator | None = None,
    resamples: int = 2000,
) -> BoundedTable:
    """Return the means of groups of rows with intervals that do not leave the scale.

    Parameters
    ----------
    frame : pandas.DataFrame
        One row for each rating.
    score : str
        Column of the ratings; rows where it is missing do not count.
    by : sequence of str
        Columns that make the groups.
    low, high, method, confidence, trials, rng, resamples
        As in `bounded_interval`.

    Returns
    -------
    BoundedTable
        Means and intervals of all groups; the flags say of how many groups something is to be known.

    Raises
    ------
    DataError
        As `bounded_interval`, or if a column is missing.

    References
    ----------
    As `bounded_interval`.
    """
    missing = [column for column in [*by, score] if column not in frame.columns]
    if missing:
        raise DataError(f"The frame has no column {', '.join(missing)}; it has {', '.join(map(str, frame.columns))}.")
    rated = frame.dropna(subset=[*by, score])
    values = finite_vector(rated[score].to_numpy(), name=score)
    _check(values, low=low, high=high, method=method, confidence=confidence, trials=trials)
    groups = rated.groupby(list(by), sort=False, observed=True)
    group = np.asarray(groups.ngroup(), dtype=np.intp)
    table = groups.size().rename("n").reset_index()
    n = table["n"].to_numpy(dtype=float)
    mean, sd = _moments(values, group, n, low)
    if method == "bootstrap":
        limits = bca_intervals(values, group, len(table), confidence=confidence, rng=rng, resamples=resamples)
        limits = limits.clip(low, high)
        still = int(np.count_nonzero(limits[:, 0] == limits[:, 1]))
        flags = _still(still, len(table))
    else:
        per_rating = high - low if trials is None else trials
        limits = binomial_interval(
            mean, n, low=low, high=high, trials=per_rating, confidence=confidence, wilson=method == "wilson"
        )
        flags = _overdispersed(mean, np.nan_to_num(sd), n, _Scale(low, high, per_rating))
    table = table.assign(mean=mean, sd=sd, ci_low=limits[:, 0], ci_high=limits[:, 1])
    return BoundedTable(table=table, confidence=confidence, method=method, flags=flags)


def binomial_interval(
    means: npt.ArrayLike,
    numbers: npt.ArrayLike,
    *,
    low: float,
    high: float,
    trials: float,
    confidence: float = 0.95,
    wilson: bool = False,
) -> FloatArray:
    """Return the intervals of many means, each rating being taken for the successes in `trials` Bernoulli trials.

    Parameters
    ----------
    means : array_like, shape (k,)
        Means of ratings from `low` to `high`.
    numbers : array_like, shape (k,)
        Ratings of which each is the mean, 1 or more.
    low, high : float
        Ends of the scale.
    trials : float
        Bernoulli trials that one rating stands for, more than 0.
    confidence : float
        Confidence of the intervals, between 0 and 1.
    wilson : bool
        Whether Wilson's interval is taken, and not that of Clopper and Pearson.

    Returns
    -------
    numpy.ndarray, shape (k, 2)
        Lower and upper limits, in the units of the scale.

    Raises
    ------
    DataError
        If a mean is not on the scale or an option is out of range.

    References
    ----------
    As `bounded_interval`.
    """
    mean, number = finite_vector(means, name="means"), finite_vector(numbers, name="numbers")
    _check(mean, low=low, high=high, method="binomial", confidence=confidence, trials=trials)
    if mean.size != number.size or (number < 1).any():
        raise DataError("Each mean needs the number of its ratings, 1 or more.")
    total = number * trials
    share = (mean - low) / (high - low)
    if wilson:
        z = float(special.ndtri((1 + confidence) / 2))
        middle = (share + z**2 / (2 * total)) / (1 + z**2 / total)
        half = z / (1 + z**2 / total) * np.sqrt(share * (1 - share) / total + z**2 / (4 * total**2))
        lower, upper = np.where(share == 0, 0, middle - half), np.where(share == 1, 1, middle + half)
    else:
        tail = (1 - confidence) / 2
        hits, misses = share * total, (1 - share) * total
        lower, upper = np.zeros(share.size), np.ones(share.size)
        some, short = share > 0, share < 1
        lower[some] = special.betaincinv(hits[some], misses[some] + 1, tail)
        upper[short] = special.betaincinv(hits[short] + 1, misses[short], 1 - tail)
    limits: FloatArray = low + (high - low) * np.clip(np.column_stack([lower, upper]), 0, 1)
    return limits


class _Scale(NamedTuple):
    low: float
    high: float
    trials: float


def _check(
    values: FloatArray, *, low: float, high: float, method: str, confidence: float, trials: float | None
) -> None:
    check_confidence(confidence)
    if method not in _NAMES:
        raise DataError(f"method is {method!r}, but must be one of {', '.join(_NAMES)}.")
    if not np.isfinite(high - low) or low >= high:
        raise DataError(f"The scale goes from {low} to {high}, but must have a lower and a higher end.")
    if trials is not None and not 0 < trials < np.inf:
        raise DataError(f"trials is {trials}, but must be a number above 0.")
    finite_vector([low, high], name="the scale")
    finite_vector([high - low if trials is None else trials], name="trials")
    wrong = np.flatnonzero((values < low) | (values > high))
    if wrong.size:
        raise DataError(f"{wrong.size} of {values.size} ratings are not on the scale from {low:g} to {high:g}.")


def _moments(
    values: FloatArray, group: npt.NDArray[np.intp], n: FloatArray, low: float
) -> tuple[FloatArray, FloatArray]:
    """Return means and standard deviations (n - 1; NaN of one value) of the groups."""
    k = n.size
    mean = low + np.bincount(group, weights=values - low, minlength=k) / n
    rest = values - mean[group]
    correction = np.bincount(group, weights=rest, minlength=k) / n
    squares = np.bincount(group, weights=(rest - correction[group]) ** 2, minlength=k)
    return mean + correction, np.where(n > 1, np.sqrt(squares / np.maximum(n - 1, 1)), np.nan)


def _still(groups: int, of: int) -> tuple[str, ...]:
    return (f"{groups} of {of} groups do not vary: the bootstrap gives them no width.",) if groups else ()


def _alike(values: FloatArray, differences: FloatArray) -> tuple[str, ...]:
    if not is_constant(values, differences):
        return ()
    what = f"All {values.size} ratings are the same" if values.size > 1 else "There is one rating"
    return (f"{what}: the bootstrap gives no width, which says nothing of the precision.",)


def _overdispersed(mean: FloatArray, sd: FloatArray, n: FloatArray, scale: _Scale) -> tuple[str, ...]:
    """Say where the ratings vary more than the binomial: variance (mean - low) (high - mean) / trials."""
    expected = (mean - scale.low) * (scale.high - mean) / scale.trials
    tested = (n > 1) & (expected > 0)
    chi2 = (n[tested] - 1) * sd[tested] ** 2 / expected[tested]
    more = int(np.count_nonzero(special.chdtrc(n[tested] - 1, chi2) < _OVERDISPERSED))
    # Chance alone makes some of many groups vary more.
    if more <= 2 * _OVERDISPERSED * n.size and n.size > 1:
        return ()
    if not more:
        return ()
    who = "The ratings vary" if n.size == 1 else f"The ratings of {more} of {n.size} groups vary"
    return (f"{who} more than those of {scale.trials:g} Bernoulli trials each, so the interval is too short there.",)
