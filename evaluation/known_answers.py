"""Answers that are known beforehand: of training trials, gold clips and instructed questions."""

from collections.abc import Mapping, Sequence

from evaluation.design.plan import TrialKind
from evaluation.study_parts import Part


def accepted(part: Part, kind: TrialKind | str, place: int | None) -> Mapping[str, Sequence[int]]:
    """Return the accepted answers of a check, by ``instrument.item``; empty if none are known.

    Parameters
    ----------
    part : Part
        The part of the study.
    kind : str
        Kind of the trial.
    place : int or None
        Which of the part's training trials, gold clips or instructed questions, from 0.
    """
    if place is None:
        return {}
    if kind == "training":
        return part.training[place].accept or {}
    if kind == "gold":
        return part.gold[place].accept
    return part.instructed[place].accept if kind == "instructed" else {}


def passes(accept: Mapping[str, Sequence[int]], answers: Mapping[str, Mapping[str, object]]) -> bool:
    """Tell whether answers are among the accepted ones.

    Parameters
    ----------
    accept : mapping
        ``instrument.item`` to the values that are right.
    answers : mapping
        Instrument to item to the keyed answer.

    Returns
    -------
    bool
        True if every item named has one of its values; an item without an answer is not right.
    """
    return all(
        answers.get(key.partition(".")[0], {}).get(key.partition(".")[2]) in values for key, values in accept.items()
    )
