"""What a participant sees: stimuli and conditions, alone or several together."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from evaluation.errors import EvaluationError
from evaluation.seeding import bit_generator, shuffled
from evaluation.study import MAIN, Cell, StudySpec

Shown = tuple[Cell, ...]
"""What one trial shows: one cell, or several conditions of one stimulus."""


def assigned_cells(spec: StudySpec, participant_index: int, part: str | None = None) -> tuple[Cell, ...]:
    """Return the cells that a participant sees, in the order of the study file.

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
    tuple of Cell
        At least one cell, none twice; those of `assigned_trials`.

    Raises
    ------
    EvaluationError
        As `assigned_trials`, or if `part` is left out although the study has several.
    """
    name = only_part(spec) if part is None else part
    seen = {cell for shown in assigned_trials(spec, name, participant_index) for cell in shown}
    return tuple(cell for cell in spec.cells(name) if cell in seen)


def assigned_trials(spec: StudySpec, part: str, slot: int) -> tuple[Shown, ...]:
    """Return what the trials of a slot show, in the order of the study file.

    A trial shows a *variant* of a stimulus: one condition of it (``together: single``), two of them (``pairs``), or
    all (``all``). The stimuli are put into a random order that belongs to the study and the part. Then slot i sees

    - with ``full`` every variant of every stimulus. With ``per_participant: n`` it sees n of those T trials: they are
      arranged in layers, of which each has every stimulus once and the variants in turn, and slot i has the places
      i n to i n + n - 1 modulo T.
      *Balance*: over any run of consecutive slots all trials are seen equally often, give or take one; exactly so over
      T / gcd(T, n) slots. A slot sees a stimulus again only after all others if all have equally many variants.
    - with ``latin_square`` each stimulus once: that at place k in its variant number (k + i) modulo its number of
      variants. *Balance*: any v consecutive slots, where v is the number of variants, see each stimulus exactly once
      in each; each slot sees the variants equally often, give or take one. With ``per_participant: n`` it sees n of
      the S stimuli, those at places i n to i n + n - 1 modulo S, each in the variant after that of its last
      time. *Balance*: over any run of consecutive slots all trials are seen equally often, give or take one (if all
      stimuli have equally many variants; else all stimuli, and the variants of each stimulus).
    - with ``between`` all stimuli in variant number i modulo the number of variants, in the order of the file.
      *Balance*: any v consecutive slots have one of each variant. With ``per_participant: n``, n of them in turn.
      *Balance*: over any run of consecutive slots the trials of one variant are seen equally often, give or take one;
      all trials are, over runs of a multiple of v slots.

    Parameters
    ----------
    spec : StudySpec
        The study.
    part : str
        Name of the part.
    slot : int
        The participant's place in the design, counted from 0. Balance is over slots: those of participants who lapsed
        are to be given to others.

    Returns
    -------
    tuple of tuple of Cell
        At least one trial. They depend on the study's seed and slug, the part's name, cells and design, and the slot
        alone. Inside a trial, conditions are in the order of the file. If the part has fewer trials than
        ``per_participant`` asks for, all of them.

    Raises
    ------
    EvaluationError
        If `slot` is negative, there is no such part, or pairs are asked for but no stimulus has two conditions.

    References
    ----------
    Cochran and Cox (1957), Experimental Designs, 2nd ed., chapter 4 (Latin squares; here with more rows than columns).
    """
    if slot < 0:
        raise EvaluationError(f"A participant's index is {slot}, but must be 0 or more.")
    presentation = spec.part(part).presentation
    variants = _variants(spec, part)
    places = shuffled(list(variants), stream(spec, part, "latin square"))
    ordered = [variants[stimulus] for stimulus in places]
    if presentation.assignment == "full":
        chosen = _of_all(ordered, slot, presentation.per_participant)
    elif presentation.assignment == "latin_square":
        chosen = _once_each(ordered, slot, presentation.per_participant)
    else:
        chosen = _of_group(ordered, _condition_sets(variants), slot, presentation.per_participant)
    seen = set(chosen)
    return tuple(shown for several in variants.values() for shown in several if shown in seen)


def stream(spec: StudySpec, part: str, purpose: str, *keys: str | int) -> np.random.PCG64:
    """Return the random bits of a part for one purpose.

    The part of a study without ``parts`` has the streams that such studies had before there were parts.
    """
    return bit_generator(spec.seed, spec.slug, purpose, *(() if part == MAIN else (part,)), *keys)


def only_part(spec: StudySpec) -> str:
    """Return the name of the study's only part; EvaluationError if it has several."""
    names = [one.name for one in spec.all_parts]
    if len(names) > 1:
        raise EvaluationError(f"Study {spec.slug} has several parts; name one of {', '.join(names)}.")
    return names[0]


def conditions_of(shown: Shown) -> tuple[str, ...]:
    """Return the conditions that a trial shows."""
    return tuple(cell.condition for cell in shown)


def condition_sets(spec: StudySpec, part: str) -> tuple[tuple[str, ...], ...]:
    """Return the conditions, pairs of them, or all of them, that the trials of a part show; in the file's order."""
    return _condition_sets(_variants(spec, part))


def _variants(spec: StudySpec, part: str) -> dict[str, list[Shown]]:
    together = spec.part(part).presentation.together
    by_stimulus: dict[str, list[Cell]] = {}
    for cell in spec.cells(part):
        by_stimulus.setdefault(cell.stimulus, []).append(cell)
    if together == "all":
        return {stimulus: [tuple(cells)] for stimulus, cells in by_stimulus.items()}
    size = 2 if together == "pairs" else 1
    variants = {stimulus: list[Shown](combinations(cells, size)) for stimulus, cells in by_stimulus.items()}
    variants = {stimulus: several for stimulus, several in variants.items() if several}
    if not variants:
        raise EvaluationError(f"Part {part}: no stimulus is there in two conditions, so there are no pairs to show.")
    return variants


def _condition_sets(variants: dict[str, list[Shown]]) -> tuple[tuple[str, ...], ...]:
    return tuple(dict.fromkeys(conditions_of(shown) for several in variants.values() for shown in several))


def _of_all(ordered: Sequence[Sequence[Shown]], slot: int, wanted: int | None) -> list[Shown]:
    layers = max(len(several) for several in ordered)
    trials = [
        several[(place + layer) % len(several)]
        for layer in range(layers)
        for place, several in enumerate(ordered)
        if layer < len(several)
    ]
    return _in_turn(trials, slot, wanted)


def _once_each(ordered: Sequence[Sequence[Shown]], slot: int, wanted: int | None) -> list[Shown]:
    number = len(ordered) if wanted is None else min(wanted, len(ordered))
    chosen = []
    for turn in range(slot * number, (slot + 1) * number):
        times, place = divmod(turn, len(ordered))
        chosen.append(ordered[place][(place + times) % len(ordered[place])])
    return chosen


def _of_group(
    ordered: Sequence[Sequence[Shown]], groups: Sequence[tuple[str, ...]], slot: int, wanted: int | None
) -> list[Shown]:
    turn, number = divmod(slot, len(groups))
    trials = [shown for several in ordered for shown in several if conditions_of(shown) == groups[number]]
    return _in_turn(trials, turn, wanted)


def _in_turn(trials: Sequence[Shown], turn: int, wanted: int | None) -> list[Shown]:
    if wanted is None or wanted >= len(trials):
        return list(trials)
    return [trials[(turn * wanted + k) % len(trials)] for k in range(wanted)]
