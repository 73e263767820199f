"""How many ratings a study file plans, and what they can show."""

import math
from collections import defaultdict
from dataclasses import dataclass

from evaluation.errors import DataError
from evaluation.responses import input_pad, pad_instruments
from evaluation.statistics.power.crossed_design import Assignment, CrossedDesign
from evaluation.study import Part, StudySpec
from evaluation.study_parts import Presentation

USUAL_RATERS = 15
"""Raters of a study file that does not say how many: those of Jia et al. (2013), section 5.4."""

SEEING: dict[Assignment, str] = {
    "full": "each rater sees each stimulus in each condition",
    "latin_square": "each rater sees each stimulus once, the conditions rotated over raters",
    "between": "each rater sees all stimuli in one condition",
}
"""What raters see, by assignment."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a part of a study plans.

    Attributes
    ----------
    study, part : str
        Slug of the study and name of the part.
    raters : int
        People who take part.
    conditions : tuple of str
        The conditions that are compared.
    design : CrossedDesign
        The complete, balanced design whose power is told. It has fewer raters than people if each gets only a share of
        the trials, and a little fewer of both if they cannot be divided evenly.
    people_per_rater : float
        How many people make up one rater of the design.
    notes : tuple of str
        Where the design departs from the study file, a sentence each.
    """

    study: str
    part: str
    raters: int
    conditions: tuple[str, ...]
    design: CrossedDesign
    people_per_rater: float
    notes: tuple[str, ...]

    def people(self, raters: int) -> int:
        """Return how many people have to take part to make so many raters of the design."""
        return math.ceil(raters * self.people_per_rater - 1e-9)


def comparable_parts(spec: StudySpec) -> tuple[str, ...]:
    """Return the names of the parts that show stimuli in two conditions or more."""
    return tuple(part.name for part in spec.all_parts if len(_complete(spec, part.name)[0]) > 1)


def correlated_parts(spec: StudySpec) -> tuple[str, ...]:
    """Return the names of the parts that ask for the PAD of stimuli that were made from one."""
    asking = [part.name for part in spec.all_parts if pad_instruments(spec.only(part.name))]
    return tuple(name for name in asking if _made_from_pad(spec, name))


def plan_comparison(spec: StudySpec, part: str, *, raters: int | None = None, items: int | None = None) -> Plan:
    """Return how many raters rate how many stimuli in a part that compares conditions.

    Parameters
    ----------
    spec : StudySpec
        The study.
    part : str
        Name of the part.
    raters : int, optional
        How many people take part; left out, as many as the file says (annotation, then quota), or `USUAL_RATERS`.
    items : int, optional
        How many stimuli there are; left out, those that the part shows in all its conditions.

    Returns
    -------
    Plan
        The design; trials that do not count (training, gold, instructed, repeats) are no part of it.

    Raises
    ------
    EvaluationError
        If there is no such part.
    DataError
        If it has one condition, shows pairs of several conditions in a design that is not full, or has too few raters
        or stimuli to be tested.
    """
    found = spec.part(part)
    conditions, stimuli, left_out = _complete(spec, part)
    place = f"Study {spec.slug}, part {part}"
    if len(conditions) < 2:
        raise DataError(f"{place} shows one condition, so there is nothing to compare; plan a correlation instead.")
    if not stimuli and items is None:
        raise DataError(f"{place} shows no stimulus in all of its {len(conditions)} conditions.")
    notes = []
    if left_out and items is None:
        notes.append(f"Stimuli that are not there in all conditions are left out: {left_out}.")
    number = len(stimuli) if items is None else items
    assignment, trials, more = _shown(found.presentation, number, len(conditions), place)
    people, said = _people(spec, found, raters)
    each = found.presentation.per_participant
    share = 1.0 if each is None or found.annotation is not None else min(1.0, each / trials)
    if share < 1:
        more += (
            f"Each rater gets {each} of {trials} trials, so {people} raters give as many ratings as "
            f"{math.floor(people * share + 1e-9)} who get them all; the power is that of these.",
        )
    whole = math.floor(people * share + 1e-9)
    raters_step = 1 if assignment == "full" else len(conditions)
    items_step = len(conditions) if assignment == "latin_square" else 1
    even, even_items = whole - whole % raters_step, number - number % items_step
    for name, count, step in (("raters", even, raters_step), ("stimuli", even_items, items_step)):
        if count < 2 * step:
            raise DataError(
                f"{place} plans {whole if name == 'raters' else number} {name}, but a test of {len(conditions)} "
                f"conditions in the design {assignment} needs at least {2 * step}."
            )
    if (even, even_items) != (whole, number):
        more += (
            f"The power is that of {even} raters and {even_items} stimuli, which can be divided evenly among "
            f"{len(conditions)} conditions; a few more do no harm.",
        )
    return Plan(
        study=spec.slug,
        part=part,
        raters=people,
        conditions=conditions,
        design=CrossedDesign(raters=even, items=even_items, conditions=len(conditions), assignment=assignment),
        people_per_rater=1 / share,
        notes=(*said, *notes, *more),
    )


def planned_pairs(spec: StudySpec, part: str) -> int:
    """Return over how many stimuli a part correlates input and evaluated PAD.

    Raises
    ------
    EvaluationError
        If there is no such part.
    DataError
        If fewer than three stimuli of it were made from a PAD.
    """
    number = _made_from_pad(spec, part)
    if number < 3:
        raise DataError(
            f"Study {spec.slug}, part {part} has {number} stimuli with an input PAD, but a correlation needs 3 or more."
        )
    return number


def _complete(spec: StudySpec, part: str) -> tuple[tuple[str, ...], list[str], int]:
    """Return a part's conditions, the stimuli that are there in all of them, and how many are not."""
    by_stimulus = defaultdict(set)
    for stimulus, condition in spec.cells(part):
        by_stimulus[stimulus].add(condition)
    every = set().union(*by_stimulus.values())
    stimuli = [stimulus for stimulus, conditions in by_stimulus.items() if conditions == every]
    names = tuple(condition.name for condition in spec.conditions if condition.name in every)
    return names, stimuli, len(by_stimulus) - len(stimuli)


def _shown(
    presentation: Presentation, stimuli: int, conditions: int, place: str
) -> tuple[Assignment, int, tuple[str, ...]]:
    """Return the design, how many trials a rater has who gets all of them, and what is to be said about it."""
    assignment = presentation.assignment
    if presentation.together == "all" or (presentation.together == "pairs" and conditions == 2):
        return "full", stimuli, ("A trial shows all conditions of a stimulus; ratings of each of them are planned.",)
    if presentation.together == "pairs":
        if assignment != "full":
            raise DataError(
                f"{place} shows pairs of conditions; their power can be told for the assignment full alone."
            )
        note = "Each clip comes in several pairs; the power is that of one rating of each clip by each rater."
        return "full", stimuli * math.comb(conditions, 2), (note,)
    return assignment, stimuli * conditions if assignment == "full" else stimuli, ()


def _people(spec: StudySpec, part: Part, raters: int | None) -> tuple[int, tuple[str, ...]]:
    if raters is not None:
        return raters, ()
    if part.annotation is not None:
        return part.annotation.raters, ()
    if spec.quota is not None:
        return spec.quota, ()
    return USUAL_RATERS, (f"The study file names no quota; {USUAL_RATERS} raters are assumed.",)


def _made_from_pad(spec: StudySpec, part: str) -> int:
    return len({cell.stimulus for cell in spec.cells(part) if input_pad(spec, cell.stimulus, cell.condition)})
