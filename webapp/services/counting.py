"""Answers as the statistics take them: those of the trials that count."""

from collections.abc import Sequence

import pandas as pd

from evaluation.design.plan import COUNTING
from evaluation.instruments.paired import PAIRED
from evaluation.responses import OPTIONAL_COLUMNS, RESPONSE_COLUMNS, asked_about_clips, statistical
from evaluation.study import StudySpec
from webapp.services.collected import Collected

__all__ = ["COUNTING", "PREFERENCE_COLUMNS", "preferences_frame", "statistics_frame"]

PREFERENCE_COLUMNS = ("participant", "trial", "stimulus", "condition_a", "condition_b", "preferred")


def statistics_frame(
    spec: StudySpec, rows: Sequence[Collected], part: str | None = None, *, kinds: Sequence[str] = COUNTING
) -> pd.DataFrame:
    """Return the answers about single clips that are whole numbers, as `evaluation.responses` describes them.

    Parameters
    ----------
    spec : StudySpec
        The study.
    rows : sequence of Collected
        All answers.
    part : str, optional
        Name of the part; left out, all parts.
    kinds : sequence of str
        Kinds of the trials.
    """
    rows = _last_words(spec, rows)
    per = {(one.name, item.id): one.per for one in asked_about_clips(spec) for item in statistical(one)}
    found = [
        (
            *(one.participant, one.trial, one.stimulus, one.condition),
            *(one.instrument, one.item, one.raw, one.keyed, one.clip),
        )
        for one in rows
        if one.kind in kinds
        and part in (None, one.part)
        and (one.instrument, one.item) in per
        and one.stimulus is not None
        and (len(one.conditions) == 1 or per[one.instrument, one.item] == "clip")
    ]
    return pd.DataFrame(found, columns=[*RESPONSE_COLUMNS, *OPTIONAL_COLUMNS])


def _last_words(spec: StudySpec, rows: Sequence[Collected]) -> Sequence[Collected]:
    """Leave out what was said in a consensus before the last time that a rater spoke about a clip."""
    annotated = [part for part in spec.all_parts if part.annotation is not None]
    discussed = {part.name for part in annotated if part.annotation and part.annotation.mode == "consensus"}
    last: dict[tuple[object, ...], int] = {}
    for one in rows:
        if one.part in discussed:
            key = (one.part, one.participant, one.stimulus, one.condition)
            last[key] = max(last.get(key, 0), one.trial)
    return [
        one
        for one in rows
        if one.part not in discussed or one.trial == last[one.part, one.participant, one.stimulus, one.condition]
    ]


def preferences_frame(rows: Sequence[Collected], part: str | None = None) -> pd.DataFrame:
    """Return which of two clips was preferred in each trial that asked so; the columns are `PREFERENCE_COLUMNS`."""
    found = [
        (one.participant, one.trial, one.stimulus, *one.conditions, one.conditions[one.keyed - 1])
        for one in rows
        if one.instrument == PAIRED.name and one.kind in COUNTING and part in (None, one.part)
        if len(one.conditions) == len(PAIRED.items[0].values)
    ]
    return pd.DataFrame(found, columns=list(PREFERENCE_COLUMNS))
