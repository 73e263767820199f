"""How incremental annotation goes on: which samples the next round holds, when it ends, and how well raters agree."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from evaluation.annotation.agreement import RoundAgreement, round_agreement
from evaluation.annotation.missing import array_with_gaps
from evaluation.annotation.rounds import IntArray, Round, disagreement, has_doubles, most_disputed
from evaluation.errors import DataError
from evaluation.seeding import shuffled
from evaluation.study_parts import Annotation, Stop

_NONE = np.array([], dtype=np.intp)


@dataclass(frozen=True, kw_only=True, eq=False)
class RoundPlan:
    """What a round of annotation is to rate.

    Attributes
    ----------
    number : int
        Number of the round, from 1.
    samples : numpy.ndarray of int, shape (m,)
        Samples, numbered from 0, none twice: first those that were not rated yet, then those that are rated again, the
        most disputed first. It is no order of presentation: each rater sees them in an order of their own.
    new : int
        How many of them were not rated yet.
    """

    number: int
    samples: IntArray
    new: int

    @property
    def again(self) -> IntArray:
        """The samples that were rated before and are rated again."""
        return self.samples[self.new :]

    def rated(self, ratings: npt.ArrayLike) -> Round:
        """Return the finished round, given its ratings, shape (m, raters, dimensions), NaN where one is missing."""
        stack = array_with_gaps(ratings)
        if len(stack) != self.samples.size:
            raise DataError(f"{self.samples.size} samples were to be rated, but ratings of {len(stack)} came back.")
        return Round(samples=self.samples, new=self.new, ratings=stack)


def first_sets(n: int, annotation: Annotation, *, bits: np.random.PCG64) -> tuple[IntArray, ...]:
    """Divide samples into the sets of an annotation, by bits that stay the same in every version of numpy.

    Parameters
    ----------
    n : int
        Number of samples, which are numbered from 0.
    annotation : Annotation
        Its settings; `sets` counts.
    bits : numpy.random.PCG64
        Source of the order, as `evaluation.seeding.bit_generator` gives it.

    Returns
    -------
    tuple of numpy.ndarray of int
        The samples of each set, in random order; sizes differ by at most one, larger sets first.

    Raises
    ------
    DataError
        If there are fewer samples than sets.

    References
    ----------
    Jia et al. (2013), section 2.4.
    """
    if n < annotation.sets:
        raise DataError(f"{n} samples cannot be divided into {annotation.sets} sets; there must be at least as many.")
    return tuple(np.array_split(np.array(shuffled(range(n), bits), dtype=np.intp), annotation.sets))


def next_round(sets: Sequence[npt.ArrayLike], finished: Sequence[Round], annotation: Annotation) -> RoundPlan | None:
    """Return what comes after the finished rounds, or None when the annotation is at its end.

    Each round holds one set and the most disputed share of the round before; after the round of the last set, one more
    holds only what is rated again. The same arguments give the same round.

    Parameters
    ----------
    sets : sequence of array_like of int
        The division into sets, as `first_sets` returns it.
    finished : sequence of Round
        The rounds so far, in their order, each with its samples in the order of its plan: of equally disputed samples
        the earlier is chosen. Ratings may be missing (NaN).
    annotation : Annotation
        Its settings: `share`, `rule` and `stop` count. Nothing depends on who the raters are, so that panels may be
        fixed or fresh.

    Returns
    -------
    RoundPlan or None
        The next round.

    Raises
    ------
    DataError
        If the sets share a sample, or a finished round lacks its set or holds a sample twice or one of
        a later set.

    Notes
    -----
    *Stopping* (`stopped_by`) means that nothing is rated again from then on. Sets that were not rated yet still come,
    each alone, so that every sample is rated at least once; a largest number of rounds below the number of sets
    therefore ends the repetitions, not the sets. The extra round after the last set is the last in any case.

    *Missing ratings*: a sample with fewer than two ratings on a dimension has no standard deviation, and counts as more
    disputed than all that have one. A sample that nobody rated on some dimension in any round (all its raters withdrew)
    is not rated yet: it comes with the next round, behind the next set, whatever was stopped, in a round of its own if
    need be, and is not among those rated again, though it takes up one of their places. The share is of all samples
    of the round before.

    References
    ----------
    Jia et al. (2013), section 2.4: five sets, 20 %, six rounds.
    """
    parts = _checked(sets, finished)
    fresh = parts[len(finished)] if len(finished) < len(parts) else _NONE
    unrated = _unrated(finished)
    again = _NONE
    if 0 < len(finished) <= len(parts) and stopped_by(finished, annotation.stop) is None:
        last = finished[-1]
        order = last.samples[_places_of_most_disputed(last, annotation)]
        again = order[~np.isin(order, unrated)]
    samples = np.concatenate([fresh, unrated, again])
    if not samples.size:
        return None
    return RoundPlan(number=len(finished) + 1, samples=samples, new=fresh.size + unrated.size)


def stopped_by(finished: Sequence[Round], stop: Stop) -> str | None:
    """Return which rule forbids to rate anything again after these rounds, in words, or None.

    The first rule that is fulfilled is enough. The largest number of rounds is fulfilled by as many finished rounds; a
    target by one round whose own ratings (all its samples, new and again) reach it on every dimension, and it stays
    fulfilled. A measure that cannot be computed (`round_agreement`) reaches no target.

    Parameters
    ----------
    finished : sequence of Round
        The rounds so far, in their order; ratings may be missing (NaN).
    stop : Stop
        The rules.

    Returns
    -------
    str or None
        For instance ``round 2 reached the target SD: no mean SD is above 0.3``.
    """
    if stop.rounds is not None and len(finished) >= stop.rounds:
        return f"the largest number of rounds is reached: {stop.rounds}"
    if stop.sd is None and stop.r is None:
        return None
    for number, found in enumerate(finished, start=1):
        names = [str(place) for place in range(found.ratings.shape[2])]
        agreement = round_agreement(found.ratings, dimensions=names)
        if stop.sd is not None and _largest_sd(agreement) <= stop.sd:
            return f"round {number} reached the target SD: no mean SD is above {stop.sd:g}"
        if stop.r is not None and _smallest_r(agreement) >= stop.r:
            return f"round {number} reached the target correlation: no mean pairwise r is below {stop.r:g}"
    return None


def _largest_sd(agreement: RoundAgreement) -> float:
    return max((math.inf if one.sd is None else one.sd for one in agreement.dimensions), default=math.inf)


def _smallest_r(agreement: RoundAgreement) -> float:
    values = (-math.inf if one.pairwise_r is None else one.pairwise_r for one in agreement.dimensions)
    return min(values, default=-math.inf)


def _places_of_most_disputed(found: Round, annotation: Annotation) -> IntArray:
    values = disagreement(found.ratings, rule=annotation.rule, missing=True)
    known = values[~np.isnan(values)]
    above = float(known.max()) + 1 if known.size else 1.0
    return most_disputed(np.where(np.isnan(values), above, values), annotation.share)


def _unrated(finished: Sequence[Round]) -> IntArray:
    """Return the samples that were in a round, but were rated in none, in the order of their first round."""
    gaps = [_samples_with_gaps(found) for found in finished]
    waiting = np.concatenate([_NONE, *gaps])
    if not waiting.size:
        return waiting
    rated = [found.samples[~np.isin(found.samples, left)] for found, left in zip(finished, gaps, strict=True)]
    waiting = waiting[~np.isin(waiting, np.concatenate(rated))]
    _, first = np.unique(waiting, return_index=True)
    return waiting[np.sort(first)]


def _samples_with_gaps(found: Round) -> IntArray:
    """Return the samples of a round that have no rating at all on some dimension."""
    missing = np.isnan(found.ratings)
    rows = np.flatnonzero(missing.reshape(len(missing), math.prod(missing.shape[1:])).any(axis=1))
    return found.samples[rows[np.any(missing[rows].all(axis=1), axis=1)]]


def _checked(sets: Sequence[npt.ArrayLike], finished: Sequence[Round]) -> list[IntArray]:
    parts = [np.asarray(one, dtype=np.intp) for one in sets]
    together = np.concatenate([_NONE, *parts])
    if has_doubles(together) or (together < 0).any():
        raise DataError("The sets share a sample; each must be in one set, once, and be numbered from 0.")
    # Number of each sample's set; what is in none counts as of a set after all others.
    set_of = np.full(int(together.max(initial=-1)) + 2, len(parts) + len(finished))
    for place, part in enumerate(parts):
        set_of[part] = place
    for place, found in enumerate(finished):
        of = set_of[np.clip(found.samples, -1, set_of.size - 1)]
        if (of > place).any():
            raise DataError(f"Round {place + 1} has a sample that is in none of the first {place + 1} sets.")
        if has_doubles(found.samples):
            raise DataError(f"Round {place + 1} has a sample twice.")
        if place < len(parts) and int((of == place).sum()) != parts[place].size:
            raise DataError(f"Round {place + 1} lacks a sample of set {place + 1}; it must hold the whole set.")
        if len(found.ratings) != found.samples.size:
            raise DataError(f"Round {place + 1} has {found.samples.size} samples, but ratings of {len(found.ratings)}.")
    return parts
