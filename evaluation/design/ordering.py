"""The order in which a participant sees the trials."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from evaluation.design.assignment import (
    Shown,
    assigned_trials,
    condition_sets,
    conditions_of,
    only_part,
    stream,
)
from evaluation.design.williams import williams_rows
from evaluation.errors import EvaluationError
from evaluation.seeding import below, shuffled
from evaluation.study import Cell, StudySpec

# One attempt is nearly always perfect; the others are for designs in which a perfect order is rare or impossible.
_ATTEMPTS = 64


def trial_order(spec: StudySpec, participant_index: int, part: str | None = None) -> list[Cell]:
    """Return the trials of a participant in their order, for parts that show one clip in each trial.

    Parameters
    ----------
    spec : StudySpec
        The study.
    participant_index : int
        The participant's slot, counted from 0.
    part : str, optional
        Name of the part; left out, the only one.

    Returns
    -------
    list of Cell
        Pairs (stimulus, condition); those of `evaluation.design.assignment.assigned_cells`, each once, in the order of
        `rating_order`.

    Raises
    ------
    EvaluationError
        As `rating_order`, if trials show several clips, or if `part` is left out although the study has several.
    """
    name = only_part(spec) if part is None else part
    together = spec.part(name).presentation.together
    if together != "single":
        raise EvaluationError(f"Part {name} shows several clips in a trial (together: {together}), not one.")
    return [cell for shown in rating_order(spec, name, participant_index) for cell in shown]


def rating_order(spec: StudySpec, part: str, slot: int) -> list[Shown]:
    """Return what the trials of a slot show, in their order.

    ``random``: random, but never the same stimulus twice in a row when that can be avoided, nor the same condition (or
    pair of conditions) twice in a row when that can be avoided; the stimulus comes first if not both can be.
    ``fixed``: as in the file, where it lists cells as they are listed there.
    ``blocks``: all trials of one condition (or pair), then those of the next, the order of the blocks random for each
    slot; inside a block as ``random``, also as to the trial before the block.
    ``williams``: as ``blocks``, but the blocks' order is a row of a Williams design, whose letters are given to the
    conditions at random once for the study. If everything is shown to everybody, slot i has row i modulo the number of
    rows r, so over any r consecutive slots each condition has each place equally often, and each follows each other
    equally often (r is the number of conditions, twice that if it is odd). If a slot sees a selection, it has row
    i + floor(i / r) modulo r: a selection returns with i too, and would always meet the same row otherwise; then this
    holds over slots j r to j r + r - 1 for each j, as far as all have trials of every condition.

    Two clips of a pair have random sides, for each slot anew, but each condition of a pair has each side in half of its
    trials, give or take one, and so have all trials together. More clips are in random order.

    Parameters
    ----------
    spec : StudySpec
        The study.
    part : str
        Name of the part.
    slot : int
        The participant's place in the design, counted from 0.

    Returns
    -------
    list of tuple of Cell
        The trials of `evaluation.design.assignment.assigned_trials`, each once. They depend on the study's seed and
        slug, the part's name, cells and design, and the slot alone: neither other participants, nor texts, nor the
        version of numpy change them.

    Raises
    ------
    EvaluationError
        As `evaluation.design.assignment.assigned_trials`.
    """
    order = spec.part(part).presentation.order
    trials = assigned_trials(spec, part, slot)
    bits = stream(spec, part, "trial order", slot)
    if order == "random":
        arranged = arrange(trials, bits)
    elif order == "fixed":
        arranged = _as_listed(spec, part, trials)
    else:
        arranged = []
        sets = _row(spec, part, slot) if order == "williams" else shuffled(condition_sets(spec, part), bits)
        for conditions in sets:
            block = [shown for shown in trials if conditions_of(shown) == conditions]
            arranged += arrange(block, bits, after=arranged[-1] if arranged else None)
    return _sided(arranged, stream(spec, part, "sides", slot))


def arrange(trials: Sequence[Shown], bits: np.random.PCG64, *, after: Shown | None = None) -> list[Shown]:
    """Return trials in a random order that repeats stimuli, then conditions, as seldom as can be found.

    Parameters
    ----------
    trials : sequence of tuple of Cell
        What the trials show; each shows one stimulus.
    bits : numpy.random.PCG64
        Source of the order.
    after : tuple of Cell, optional
        The trial before the first.

    Returns
    -------
    list of tuple of Cell
        The trials, each once: the best of up to 64 random orders, of which nearly always the first has no repetition
        that could be avoided. 600 trials take some milliseconds, 0.2 s at worst (all 64); 3000 take 2 s at worst.
    """
    if not trials:
        return []
    keys = [(shown[0].stimulus, " ".join(conditions_of(shown))) for shown in trials]
    before = None if after is None else (after[0].stimulus, " ".join(conditions_of(after)))
    unavoidable = tuple(_unavoidable_repeats([key[of] for key in keys], before and before[of]) for of in (0, 1))
    others = [_others([key[of] for key in keys]) for of in (0, 1)]
    best: list[int] = []
    fewest = (len(keys) + 1, len(keys) + 1)
    for _ in range(_ATTEMPTS):
        order = _attempt(keys, others, before, bits)
        shown_keys = ([] if before is None else [before]) + [keys[trial] for trial in order]
        repeats = (_repeats(shown_keys, 0), _repeats(shown_keys, 1))
        if repeats < fewest:
            best, fewest = order, repeats
        if fewest == unavoidable:
            break
    return [trials[trial] for trial in best]


class _Counts:
    """How often each value is among the trials that are left."""

    def __init__(self, values: Sequence[str]) -> None:
        self._counts = Counter(values)
        self._most = max(self._counts.values())
        self._having: list[set[str]] = [set() for _ in range(self._most + 1)]
        for value, count in self._counts.items():
            self._having[count].add(value)

    def take(self, value: str) -> None:
        count = self._counts[value]
        self._having[count].remove(value)
        self._having[count - 1].add(value)
        self._counts[value] = count - 1
        if not self._having[self._most]:
            self._most -= 1

    def pressing(self, left: int) -> str | None:
        """Return the value that more than half of the trials that are left have, if there is one."""
        if 2 * self._most <= left:
            return None
        (value,) = self._having[self._most]
        return value


def _attempt(
    keys: Sequence[tuple[str, str]],
    others: Sequence[dict[str, int]],
    before: tuple[str, str] | None,
    bits: np.random.PCG64,
) -> list[int]:
    # Sets of trials are whole numbers, bit k for trial k: with thousands of trials, lists would take seconds.
    remaining = (1 << len(keys)) - 1
    counts = [_Counts([key[of] for key in keys]) for of in (0, 1)]
    order: list[int] = []
    for left in range(len(keys), 0, -1):
        pool = remaining
        for of in (0, 1):
            if before is not None:
                pool = pool & others[of].get(before[of], pool) or pool
            # A value that fills more than half of the remaining places comes now, or it must follow itself later.
            pressing = counts[of].pressing(left)
            if pressing is not None:
                pool = pool & ~others[of][pressing] or pool
        trial = _place_of_bit(pool, below(bits, pool.bit_count()))
        remaining ^= 1 << trial
        order.append(trial)
        before = keys[trial]
        for of in (0, 1):
            counts[of].take(before[of])
    return order


def _others(values: Sequence[str]) -> dict[str, int]:
    """Return, for each value, the set of trials that have another."""
    having: dict[str, int] = {}
    for trial, value in enumerate(values):
        having[value] = having.get(value, 0) | 1 << trial
    every = (1 << len(values)) - 1
    return {value: every ^ trials for value, trials in having.items()}


def _place_of_bit(number: int, rank: int) -> int:
    """Return the place of the set bit of this rank, both counted from 0."""
    place, width = 0, number.bit_length()
    while width > 1:
        half = width // 2
        lower = number & ((1 << half) - 1)
        count = lower.bit_count()
        if rank < count:
            number, width = lower, half
        else:
            number, width, place, rank = number >> half, width - half, place + half, rank - count
    return place


def _repeats(order: Sequence[tuple[str, str]], of: int) -> int:
    return sum(one[of] == other[of] for one, other in pairwise(order))


def _unavoidable_repeats(values: Sequence[str], before: str | None) -> int:
    counts = Counter(values)
    if before is None:
        return max(0, 2 * max(counts.values()) - len(values) - 1)
    # The one before counts as the first of the row, so a value that is not its own must begin after it.
    counts[before] += 1
    length = len(values) + 1
    return max(0, *(2 * count - length - (value == before) for value, count in counts.items()))


def _as_listed(spec: StudySpec, part: str, trials: Sequence[Shown]) -> list[Shown]:
    listed = spec.part(part).presentation.cells
    if listed is None:
        return list(trials)
    places = {(cell.stimulus, cell.condition): place for place, cell in enumerate(listed)}
    return sorted(trials, key=lambda shown: sorted(places[cell] for cell in shown))


def _row(spec: StudySpec, part: str, slot: int) -> list[tuple[str, ...]]:
    sets = condition_sets(spec, part)
    letters = shuffled(sets, stream(spec, part, "williams"))
    rows = williams_rows(len(sets))
    presentation = spec.part(part).presentation
    everything = presentation.assignment == "full" and presentation.per_participant is None
    row = rows[(slot if everything else slot + slot // len(rows)) % len(rows)]
    return [letters[letter] for letter in row]


def _sided(order: Sequence[Shown], bits: np.random.PCG64) -> list[Shown]:
    """Return the trials with several clips in random places; those with one are as they were."""
    result = list(order)
    pairs = [place for place, shown in enumerate(order) if len(shown) == 2]
    # In turn along a list in which the trials of the same conditions are neighbours, so that each pair is balanced.
    ranked = sorted(shuffled(pairs, bits), key=lambda place: conditions_of(order[place]))
    start = below(bits, 2)
    for rank, place in enumerate(ranked):
        if (rank + start) % 2:
            result[place] = order[place][::-1]
    for place, shown in enumerate(order):
        if len(shown) > 2:
            result[place] = tuple(shuffled(shown, bits))
    return result
