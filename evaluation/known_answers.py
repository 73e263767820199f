"""Answers that are known beforehand: of training trials, gold clips and instructed questions."""

from collections.abc import Collection, Mapping, Sequence

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


def by_place(
    answers: Mapping[str, Mapping[str, object]], several: Collection[str]
) -> list[dict[str, dict[str, object]]]:
    """Return the answers of a page as `passes` takes them: for each clip or word that it asks about.

    Parameters
    ----------
    answers : mapping
        Instrument to item to the keyed answer, items about a clip or word as on the page ("tone-2").
    several : collection of str
        Names of the instruments that ask about each clip or word.

    Returns
    -------
    list of dict
        At least one; what is not asked about clips or words is in each. A choice of several options of which one was
        chosen is that option.
    """
    common: dict[str, dict[str, object]] = {}
    places: dict[int, dict[str, dict[str, object]]] = {}
    for name, items in answers.items():
        for key, answer in items.items():
            item, _, number = key.rpartition("-") if name in several else (key, "", "0")
            about = places.setdefault(int(number), {}) if name in several else common
            about.setdefault(name, {})[item] = _only(answer)
    return [{**common, **about} for _, about in sorted(places.items())] or [common]


def _only(answer: object) -> object:
    return answer[0] if isinstance(answer, tuple | list) and len(answer) == 1 else answer
