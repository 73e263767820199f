"""What a participant does in a part of a study: questionnaires, training, ratings, and the checks among them."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from evaluation.design.assignment import Shown, conditions_of, stream
from evaluation.design.ordering import arrange, rating_order
from evaluation.design.plan import PlannedTrial
from evaluation.errors import EvaluationError
from evaluation.seeding import below, shuffled
from evaluation.study import Cell, StudySpec

# For how many more originals than needed the first repeat waits.
_CHOICE = 2

Clash = Callable[[Shown, Shown], tuple[int, ...]]
"""How badly a trial goes beside another; smaller is better."""


def plan_part(spec: StudySpec, part: str, slot: int) -> tuple[PlannedTrial, ...]:
    """Return all trials of a slot in a part without annotation.

    First the questionnaires before, then the training, both in the order of the file; then the ratings in the order of
    `evaluation.design.ordering.rating_order`, mixed with the gold clips, the instructed answers and the repeats; then
    the questionnaires after.

    Gold, instructed and repeats are spread evenly over the ratings: these are cut into as many stretches of equal
    length, give or take one, as there are checks, and one comes at a random place in each. None comes before the first
    rating, and none directly after another unless there are more of them than ratings. Each repeat comes in the stretch
    of ratings in which ``gap`` can be kept, so repeats crowd at the end if ``gap`` is large, if need be one after
    another; with a ``gap`` that no order keeps, all come after the last rating in the order of their originals. Places
    beside the same stimulus, then beside the same condition, are avoided if there are others to choose from; in blocks
    and Williams designs a repeat is rather of the condition around it.

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
    tuple of PlannedTrial
        Every gold clip, instructed answer, training trial and questionnaire once, every rating of the slot once, and as
        many repeats, of different ratings and with the same sides, as the part asks for, but at most one of each
        rating. They depend on the study's seed and slug, the part and the slot alone. The places of checks differ from
        slot to slot and change nothing in the order of the ratings.

    Raises
    ------
    EvaluationError
        If there is no such part, the part is annotated in rounds (`plan_round` plans those), `slot` is negative, or
        the part can show nothing.
    """
    found = spec.part(part)
    if found.annotation is not None:
        raise EvaluationError(f"Part {part} is annotated in rounds, so it has no plan but those of its rounds.")
    ratings = rating_order(spec, part, slot)
    first = (*plan_before(spec, part), *plan_training(spec, part))
    wanted = 0 if found.repeats is None else min(found.repeats.count, len(ratings))
    gap = 1 if found.repeats is None else found.repeats.gap
    blocked = found.presentation.order in ("blocks", "williams")
    mixed = _Mixture(ratings, stream(spec, part, "checks", slot), _unlike_block if blocked else _alike)
    mixed.place_repeats(wanted, gap)
    mixed.place_checks(_checks(spec, part))
    trials = mixed.trials(_asked(spec, part), gap=gap, offset=len(first))
    return (*first, *trials, *plan_after(spec, part))


def plan_before(spec: StudySpec, part: str) -> tuple[PlannedTrial, ...]:
    """Return the questionnaires before a part, one in each trial; EvaluationError if there is no such part."""
    return tuple(PlannedTrial(kind="before", instruments=(name,)) for name in spec.part(part).before)


def plan_training(spec: StudySpec, part: str) -> tuple[PlannedTrial, ...]:
    """Return the training of a part in the order of the file; EvaluationError if there is no such part."""
    return tuple(
        PlannedTrial(
            kind="training",
            cells=(Cell(shown.stimulus, shown.condition),),
            instruments=_asked(spec, part),
            check=place,
        )
        for place, shown in enumerate(spec.part(part).training)
    )


def plan_after(spec: StudySpec, part: str) -> tuple[PlannedTrial, ...]:
    """Return the questionnaires after a part, one in each trial; EvaluationError if there is no such part."""
    return tuple(PlannedTrial(kind="after", instruments=(name,)) for name in spec.part(part).after)


def plan_round(
    spec: StudySpec, part: str, cells: Sequence[Cell], *, slot: int, round_index: int
) -> tuple[PlannedTrial, ...]:
    """Return the trials of one rater in one round of annotation.

    The order is random whatever ``order`` says, with the constraints of `evaluation.design.ordering.arrange`, and new
    for each rater and round, so that nobody can answer from memory. All gold clips and instructed answers of the part
    are mixed in, as in `plan_part`, in every round.

    Parameters
    ----------
    spec : StudySpec
        The study.
    part : str
        Name of the part.
    cells : sequence of Cell
        The round's samples, in any order, which changes nothing.
    slot : int
        The rater's place in the panel, counted from 0.
    round_index : int
        The round, counted from 0.

    Returns
    -------
    tuple of PlannedTrial
        Each of the samples once as a rating, among the checks; neither questionnaires nor training (`plan_before`,
        `plan_training`, `plan_after`). They depend on the study's seed and slug, the part, the samples, the slot and
        the round alone.

    Raises
    ------
    EvaluationError
        If there is no such part, a cell is not in it or is there twice, or `slot` or `round_index` is negative.
    """
    if slot < 0 or round_index < 0:
        raise EvaluationError(f"Slot {slot} and round {round_index} must both be 0 or more.")
    wanted = Counter(Cell(*cell) for cell in cells)
    for cell, count in wanted.items():
        if count > 1:
            raise EvaluationError(f"Round {round_index} of part {part} has {cell.stimulus}, {cell.condition} twice.")
    samples = [(cell,) for cell in spec.cells(part) if cell in wanted]
    if len(samples) < len(wanted):
        strange = next(iter(wanted.keys() - {cell for (cell,) in samples}))
        raise EvaluationError(f"Part {part} has no stimulus {strange.stimulus} in condition {strange.condition}.")
    order = arrange(samples, stream(spec, part, "round order", round_index, slot))
    mixed = _Mixture(order, stream(spec, part, "round checks", round_index, slot), _alike)
    mixed.place_checks(_checks(spec, part))
    return tuple(mixed.trials(_asked(spec, part), gap=1, offset=0))


def _asked(spec: StudySpec, part: str) -> tuple[str, ...]:
    return tuple(use.use for use in spec.part(part).instruments)


def _checks(spec: StudySpec, part: str) -> list[PlannedTrial]:
    found = spec.part(part)
    gold = [
        PlannedTrial(
            kind="gold",
            cells=(Cell(shown.stimulus, shown.condition),),
            instruments=_asked(spec, part),
            check=place,
        )
        for place, shown in enumerate(found.gold)
    ]
    instructed = [
        PlannedTrial(kind="instructed", instruments=(told.instrument,), check=place)
        for place, told in enumerate(found.instructed)
    ]
    return gold + instructed


def _alike(one: Shown, other: Shown) -> tuple[int, ...]:
    if not one or not other:
        return (0, 0)
    same_stimulus = one[0].stimulus == other[0].stimulus
    return (int(same_stimulus), int(set(conditions_of(one)) == set(conditions_of(other))))


def _unlike_block(one: Shown, other: Shown) -> tuple[int, ...]:
    same_stimulus, same_conditions = _alike(one, other)
    return (1 - same_conditions, same_stimulus)


class _Mixture:
    """The ratings of a plan and what comes after each of them: `_gaps[g]` is what comes after g ratings."""

    def __init__(self, ratings: Sequence[Shown], bits: np.random.PCG64, clash: Clash) -> None:
        self._ratings = ratings
        self._bits = bits
        self._clash = clash
        self._gaps: list[list[PlannedTrial | None]] = [[] for _ in range(len(ratings) + 1)]

    def place_repeats(self, count: int, gap: int) -> None:
        """Put room for repeats, written None, where their originals can lie `gap` other trials before."""
        last = len(self._ratings)
        room = last - gap
        if count <= room:
            # The k-th comes after gap + k ratings or more, so there is an original for each whatever the others take;
            # a little later, if there is room, so that there is a choice.
            earliest = gap + 1 + min(_CHOICE, (room - count) // 2)
            places = [
                stretch[below(self._bits, len(stretch))]
                for stretch in self._stretches(range(earliest, last + 1), count)
            ]
        else:
            # Those that do not find a place of their own come last, where they are farthest from their originals; if
            # every rating is repeated, the last of them needs gap others before its own repeat.
            places = list(range(gap + 1, last if count == last else last + 1))
            places += [last] * (count - len(places))
        for place in places:
            self._gaps[place].append(None)

    def place_checks(self, checks: Sequence[PlannedTrial]) -> None:
        """Put checks evenly into what room is free, and only then beside others."""
        waiting = shuffled(checks, self._bits)
        every = list(range(min(1, len(self._ratings)), len(self._gaps)))
        while waiting:
            fewest = min(len(self._gaps[gap]) for gap in every)
            free = [gap for gap in every if len(self._gaps[gap]) == fewest]
            now, waiting = waiting[: len(free)], waiting[len(free) :]
            for check, choice in zip(now, self._stretches(free, len(now)), strict=True):
                gap = self._best(choice, [self._beside(check.cells, gap, _alike) for gap in choice])
                self._gaps[gap].append(check)

    def trials(self, instruments: tuple[str, ...], *, gap: int, offset: int) -> list[PlannedTrial]:
        """Return ratings, checks and repeats; `offset` trials of the plan come before them."""
        planned: list[PlannedTrial] = []
        rooms: list[tuple[int, int]] = []
        originals: list[int] = []
        for ratings_before, inserted in enumerate(self._gaps):
            if ratings_before:
                originals.append(len(planned))
                shown = self._ratings[ratings_before - 1]
                planned.append(PlannedTrial(kind="rating", cells=shown, instruments=instruments))
            # Repeats come last where several meet, since that is farther from their originals.
            for check in sorted(inserted, key=lambda one: one is None):
                if check is None:
                    rooms.append((len(planned), ratings_before))
                planned.append(check or PlannedTrial(kind="repeat", instruments=instruments))
        unused = list(originals)
        for place, ratings_before in rooms:
            # What is far enough for one repeat is so for all later ones, so any choice leaves enough for them.
            far = [original for original in unused if place - original - 1 >= gap] or unused[:1]
            costs = [self._beside(planned[original].cells, ratings_before, self._clash) for original in far]
            original = self._best(far, costs)
            unused.remove(original)
            planned[place] = replace(planned[place], cells=planned[original].cells, repeats=offset + original)
        return planned

    @staticmethod
    def _stretches(places: Sequence[int], count: int) -> list[Sequence[int]]:
        """Cut places into `count` stretches of equal length, give or take one; single places if there are too few."""
        bounds = [k * len(places) // count for k in range(count + 1)] if count else []
        return [places[low : max(high, low + 1)] for low, high in pairwise(bounds)]

    def _best(self, places: Sequence[int], costs: Sequence[tuple[int, ...]]) -> int:
        least = min(costs)
        best = [place for place, cost in zip(places, costs, strict=True) if cost == least]
        return best[below(self._bits, len(best))]

    def _beside(self, shown: Shown, gap: int, clash: Clash) -> tuple[int, ...]:
        """Return how badly a trial goes between the ratings before and after a gap."""
        neighbours = self._ratings[max(gap - 1, 0) : gap + 1]
        return tuple(map(sum, zip(*(clash(shown, other) for other in neighbours), strict=True)))
