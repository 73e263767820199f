"""The order in which a participant sees the trials."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from evaluation.design.assignment import assigned_cells
from evaluation.seeding import below, bit_generator
from evaluation.study import Cell, StudySpec

# One attempt is nearly always perfect; the others are for designs in which a perfect order is rare or impossible.
_ATTEMPTS = 64


def trial_order(spec: StudySpec, participant_index: int) -> list[Cell]:
    """Return the trials of a participant in their order.

    The order is random, but never shows the same stimulus twice in a row when that can be avoided, nor the same
    condition twice in a row when that can be avoided (the stimulus comes first if not both can be).

    Parameters
    ----------
    spec : StudySpec
        The study.
    participant_index : int
        Number of the enrolment, counted from 0.

    Returns
    -------
    list of Cell
        Pairs (stimulus, condition); those of `evaluation.design.assignment.assigned_cells`, each once. They depend on
        the study's seed, slug, cells and assignment and on the index alone: neither other participants, nor texts, nor
        the version of numpy change them.

    Raises
    ------
    EvaluationError
        If `participant_index` is negative.
    """
    cells = assigned_cells(spec, participant_index)
    bits = bit_generator(spec.seed, spec.slug, "trial order", participant_index)
    unavoidable = tuple(_unavoidable_repeats([cell[part] for cell in cells]) for part in (0, 1))
    best: list[Cell] = []
    fewest = (len(cells), len(cells))
    for _ in range(_ATTEMPTS):
        order = _attempt(cells, bits)
        repeats = (_repeats(order, 0), _repeats(order, 1))
        if not best or repeats < fewest:
            best, fewest = order, repeats
        if fewest == unavoidable:
            break
    return best


def _attempt(cells: Sequence[Cell], bits: np.random.PCG64) -> list[Cell]:
    remaining = list(cells)
    left = [Counter(cell[part] for cell in cells) for part in (0, 1)]
    order: list[Cell] = []
    while remaining:
        candidates = _candidates(remaining, order, left)
        cell = candidates[below(bits, len(candidates))]
        remaining.remove(cell)
        order.append(cell)
        for part in (0, 1):
            left[part][cell[part]] -= 1
    return order


def _candidates(remaining: Sequence[Cell], order: Sequence[Cell], left: Sequence[Counter[str]]) -> Sequence[Cell]:
    pool = remaining
    for part in (0, 1):
        if order:
            pool = [cell for cell in pool if cell[part] != order[-1][part]] or pool
        # A value that fills more than half of the remaining places comes now, or it will have to follow itself later.
        pressing = {value for value, count in left[part].items() if 2 * count > len(remaining)}
        if pressing:
            pool = [cell for cell in pool if cell[part] in pressing] or pool
    return pool


def _repeats(order: Sequence[Cell], part: int) -> int:
    return sum(one[part] == other[part] for one, other in pairwise(order))


def _unavoidable_repeats(values: Sequence[str]) -> int:
    most = max(Counter(values).values())
    return max(0, 2 * most - len(values) - 1)
