"""Incremental annotation: what raters disagree about most is rated again in the next round."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from evaluation.annotation.missing import array_with_gaps, known_deviation
from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.annotation import deviation
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.matrices import finite_array

IntArray = npt.NDArray[np.intp]

SHARE = 0.2
"""Share of a round's samples that are rated again (Jia et al., 2013, section 2.4)."""


def _mean(deviations: FloatArray) -> FloatArray:
    result: FloatArray = deviations.mean(axis=1)
    return result


def _largest(deviations: FloatArray) -> FloatArray:
    result: FloatArray = deviations.max(axis=1)
    return result


def _root_mean_square(deviations: FloatArray) -> FloatArray:
    result: FloatArray = np.sqrt((deviations**2).mean(axis=1))
    return result


_RULES: MappingProxyType[str, Callable[[FloatArray], FloatArray]] = MappingProxyType(
    {"mean": _mean, "largest": _largest, "root_mean_square": _root_mean_square}
)
RULES = tuple(_RULES)
"""Names of the rules by which the deviations of a sample's dimensions become one number."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Round:
    """One round of annotation.

    Attributes
    ----------
    samples : numpy.ndarray of int, shape (m,)
        Samples that are rated, numbered from 0, none twice: first those that are new, then those that are rated again.
    new : int
        How many of them are rated for the first time.
    ratings : numpy.ndarray, shape (m, raters, dimensions)
        Their ratings; NaN where one is missing.
    """

    samples: IntArray
    new: int
    ratings: FloatArray

    @property
    def again(self) -> IntArray:
        """The samples that were rated before and are rated again."""
        return self.samples[self.new :]


def divide(n: int, sets: int, *, rng: np.random.Generator) -> tuple[IntArray, ...]:
    """Divide samples into sets at random.

    Parameters
    ----------
    n : int
        Number of samples, which are numbered from 0.
    sets : int
        Number of sets, 1 to n.
    rng : numpy.random.Generator
        Source of the order.

    Returns
    -------
    tuple of numpy.ndarray of int
        The samples of each set, in random order; sizes differ by at most one, larger sets first (486 samples in five
        sets: 98, 97, 97, 97, 97).

    Raises
    ------
    DataError
        If `sets` is not between 1 and n.

    References
    ----------
    Jia et al. (2013), section 2.4.
    """
    if not 1 <= sets <= n:
        raise DataError(f"{n} samples cannot be divided into {sets} sets; there must be 1 to {max(n, 1)} sets.")
    return tuple(np.array_split(rng.permutation(n).astype(np.intp), sets))


def disagreement(ratings: npt.ArrayLike, *, rule: str = "mean", missing: bool = False) -> FloatArray:
    """Return how much raters disagree about each sample, as one number over all dimensions.

    Parameters
    ----------
    ratings : array_like, shape (samples, raters, dimensions)
        Ratings, complete unless `missing`.
    rule : str
        How the standard deviations over raters of a sample's dimensions are combined: "mean" (the default; the paper
        does not say, and each dimension counts alike), "largest", or "root_mean_square".
    missing : bool
        True: ratings may be missing (NaN), and the standard deviations are over those that are there.

    Returns
    -------
    numpy.ndarray, shape (samples,)
        Disagreement, in the units of the ratings; with `missing`, NaN for a sample that has fewer than two ratings on a
        dimension.

    Raises
    ------
    DataError
        If the ratings are no stack of finite numbers, which must be complete unless `missing`, or there is no such
        rule.
    InsufficientDataError
        If there are fewer than two raters, unless `missing`.
    """
    if rule not in _RULES:
        raise DataError(f"There is no rule {rule!r}; there are {', '.join(RULES)}.")
    return _RULES[rule](known_deviation(ratings) if missing else deviation(ratings))


def number_of(n: int, share: float) -> int:
    """Return how many of n samples a share is: rounded to the nearest whole number, halves up (20 % of 97 are 19).

    The share is taken as it is written, so that 0.15 of 10 is 2 although no float is exactly 0.15; DataError if it is
    not from 0 to 1.
    """
    if not 0 <= share <= 1:
        raise DataError(f"The share is {share}, but must be from 0 to 1.")
    return int((Decimal(str(float(share))) * n).quantize(Decimal(1), rounding=ROUND_HALF_UP))


def most_disputed(disagreements: npt.ArrayLike, share: float = SHARE) -> IntArray:
    """Return the places of the samples that raters disagree about most.

    Parameters
    ----------
    disagreements : array_like, shape (n,)
        One number for each sample, as `disagreement` returns them.
    share : float
        Which share of the samples, 0 to 1; their number is `number_of` (n, share).

    Returns
    -------
    numpy.ndarray of int
        Places in `disagreements`, the most disputed first; of equal samples the earlier.

    Raises
    ------
    DataError
        If a number is missing or infinite, or the share is not from 0 to 1.
    """
    values = finite_vector(disagreements, name="disagreements")
    number = number_of(values.size, share)
    if not number:
        return np.array([], dtype=np.intp)
    # Only what can be among them is sorted; in a stable sort the earlier of equals comes first.
    least = np.partition(values, values.size - number)[values.size - number]
    candidates: IntArray = np.flatnonzero(values >= least)
    return candidates[np.argsort(-values[candidates], kind="stable")][:number]


def annotate(
    n: int,
    rate: Callable[[IntArray], FloatArray],
    *,
    sets: int = 5,
    share: float = SHARE,
    rule: str = "mean",
    rng: np.random.Generator,
) -> tuple[Round, ...]:
    """Rate samples in rounds, in each of them a new set and what was most disputed in the round before.

    Parameters
    ----------
    n : int
        Number of samples.
    rate : callable
        Gives the ratings, shape (m, raters, dimensions), of the m samples whose numbers it gets.
    sets : int
        Number of sets; there is one round for each, and a last one for what was most disputed in the round of the last
        set (none if that share is no sample).
    share : float
        Share of all samples of a round, new and rated again, that go into the next.
    rule : str
        As in `disagreement`; the ratings of the round itself decide, not those of earlier rounds.
    rng : numpy.random.Generator
        Source of the division into sets.

    Returns
    -------
    tuple of Round
        The rounds in their order.

    Raises
    ------
    DataError
        As `divide`, `disagreement` and `most_disputed`, or if `rate` returns ratings of another number of samples.
    InsufficientDataError
        If there are fewer than two raters.

    References
    ----------
    Jia et al. (2013), section 2.4: five sets of about 97 samples, 20 %, six rounds.
    """
    empty = np.array([], dtype=np.intp)
    again, rounds = empty, list[Round]()
    for fresh in (*divide(n, sets, rng=rng), empty):
        samples = np.concatenate([fresh, again])
        if not samples.size:
            break
        ratings = finite_array(rate(samples), axes=("samples", "raters", "dimensions"), name="ratings")
        if len(ratings) != samples.size:
            raise DataError(f"{samples.size} samples were to be rated, but ratings of {len(ratings)} came back.")
        rounds.append(Round(samples=samples, new=fresh.size, ratings=ratings))
        again = samples[most_disputed(disagreement(ratings, rule=rule), share)]
    return tuple(rounds)


def combine(rounds: Sequence[Round], n: int) -> FloatArray:
    """Return each rater's rating of each sample: the mean over the rounds in which that rater rated it.

    For a fixed panel; where raters differ between rounds, see `combine_fresh`.

    Parameters
    ----------
    rounds : sequence of Round
        All rounds, with the same raters and dimensions; ratings may be missing (NaN).
    n : int
        Number of samples.

    Returns
    -------
    numpy.ndarray, shape (n, raters, dimensions)
        Mean ratings; NaN where a rater never rated a sample.

    Raises
    ------
    DataError
        If the rounds differ in raters or dimensions, or a round names a sample twice or one that there is not.
    InsufficientDataError
        If there are no rounds or a sample was never rated, by anybody, on a dimension.

    References
    ----------
    Jia et al. (2013), section 2.4.
    """
    if not rounds:
        raise InsufficientDataError("There are no rounds to combine.")
    return _mean_over_rounds(rounds, [found.ratings for found in rounds], n)


def combine_fresh(rounds: Sequence[Round], n: int) -> FloatArray:
    """Return the rating of each sample by panels that differ from round to round.

    It is the mean over the rounds of each round's mean over its raters, so that each round counts alike however many
    raters it had. A rater of one round is nobody in another, so that there are no means of single raters.

    Parameters
    ----------
    rounds : sequence of Round
        All rounds, with the same dimensions and any numbers of raters; ratings may be missing (NaN).
    n : int
        Number of samples.

    Returns
    -------
    numpy.ndarray, shape (n, dimensions)
        Mean ratings.

    Raises
    ------
    DataError
        If the rounds differ in dimensions, or a round names a sample twice or one that there is not.
    InsufficientDataError
        If there are no rounds or a sample was never rated, by anybody, on a dimension.
    """
    if not rounds:
        raise InsufficientDataError("There are no rounds to combine.")
    means = []
    for found in rounds:
        stack = array_with_gaps(found.ratings)
        known = ~np.isnan(stack)
        number = known.sum(axis=1, keepdims=True)
        sums = np.where(known, stack, 0).sum(axis=1, keepdims=True)
        means.append(np.where(number > 0, sums / np.maximum(number, 1), np.nan))
    return _mean_over_rounds(rounds, means, n)[:, 0]


def _mean_over_rounds(rounds: Sequence[Round], ratings: Sequence[FloatArray], n: int) -> FloatArray:
    shape = ratings[0].shape[1:]
    sums, times = np.zeros((n, *shape)), np.zeros((n, *shape))
    for number, (found, rated) in enumerate(zip(rounds, ratings, strict=True), start=1):
        if rated.shape != (found.samples.size, *shape):
            raise DataError(
                f"Round {number} has ratings of the shape {rated.shape}, but {(found.samples.size, *shape)} is needed."
            )
        _check_samples(found.samples, n, number)
        known = ~np.isnan(rated)
        sums[found.samples] += np.where(known, rated, 0)
        times[found.samples] += known
    never = (times.sum(axis=1) == 0).any(axis=1)
    if never.any():
        raise InsufficientDataError(
            f"{int(never.sum())} of {n} samples were never rated, the first of them sample {int(never.argmax())}."
        )
    return np.where(times > 0, sums / np.maximum(times, 1), np.nan)


def times_rated(rounds: Sequence[Round], n: int) -> IntArray:
    """Return in how many of the rounds each of n samples was to be rated; DataError if a round names another sample."""
    times = np.zeros(n, dtype=np.intp)
    for number, found in enumerate(rounds, start=1):
        _check_samples(found.samples, n, number)
        times[found.samples] += 1
    return times


def _check_samples(samples: IntArray, n: int, number: int) -> None:
    if samples.size and not 0 <= int(samples.min()) <= int(samples.max()) < n:
        raise DataError(f"Round {number} has a sample that is not among the {n}, which are numbered 0 to {n - 1}.")
    if has_doubles(samples):
        raise DataError(f"Round {number} has a sample twice.")


def has_doubles(samples: IntArray) -> bool:
    """Return whether a sample is there more than once; sorting tells sooner than `numpy.unique`."""
    return bool((np.diff(np.sort(samples)) == 0).any())
