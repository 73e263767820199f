"""Tidy tables for other programs: the answers, the scores of each trial, and what the columns mean."""

import pandas as pd

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import CodebookRow, Instrument
from evaluation.responses import (
    DIMENSIONS,
    OPTIONAL_COLUMNS,
    RESPONSE_COLUMNS,
    check_responses,
    numbers_of,
    score_trials,
)
from evaluation.study import StudySpec


def responses(spec: StudySpec, answered: pd.DataFrame) -> pd.DataFrame:
    """Return the answers, one row for each item, sorted by participant and trial.

    Parameters
    ----------
    spec : StudySpec
        The study.
    answered : pandas.DataFrame
        As `evaluation.responses.RESPONSE_COLUMNS` describes.

    Returns
    -------
    pandas.DataFrame
        The columns `RESPONSE_COLUMNS`, and those of `OPTIONAL_COLUMNS` that the answers have.

    Raises
    ------
    DataError
        If the answers do not fit the study.
    """
    return check_responses(spec, answered)


def scores(spec: StudySpec, answered: pd.DataFrame) -> pd.DataFrame:
    """Return the scores, one row for each clip of each trial.

    Parameters
    ----------
    spec : StudySpec
        The study.
    answered : pandas.DataFrame
        As `evaluation.responses.RESPONSE_COLUMNS` describes.

    Returns
    -------
    pandas.DataFrame
        As `evaluation.responses.score_trials`: participant, trial, stimulus, condition, input
        PAD and every number.

    Raises
    ------
    DataError
        If the answers do not fit the study.
    """
    return score_trials(spec, check_responses(spec, answered))


def codebook(spec: StudySpec) -> pd.DataFrame:
    """Return what each column of `responses` and `scores`, and each item, means.

    Parameters
    ----------
    spec : StudySpec
        The study.

    Returns
    -------
    pandas.DataFrame
        The columns variable, text, values, scoring and source.
    """
    rows = [*column_rows(spec), *item_rows(spec)]
    return pd.DataFrame(rows, columns=list(CodebookRow._fields))


def column_rows(spec: StudySpec) -> list[CodebookRow]:
    """Return the rows of the codebook on the columns that all studies have."""
    stimuli = ", ".join(stimulus.id for stimulus in spec.stimuli)
    conditions = ", ".join(condition.name for condition in spec.conditions)
    values = {"stimulus": stimuli, "condition": conditions, "instrument": ", ".join(spec.instrument_names)}
    rows = [
        CodebookRow(name, text, values.get(name, ""), "", f"study {spec.slug}")
        for name, text in {**RESPONSE_COLUMNS, **OPTIONAL_COLUMNS}.items()
    ]
    rows += [
        CodebookRow(f"input_{dimension}", f"{dimension} that went into the clip", "-1 to 1", "", f"study {spec.slug}")
        for dimension in DIMENSIONS
    ]
    return rows


def item_rows(spec: StudySpec) -> list[CodebookRow]:
    """Return the rows of the codebook on the items and scores of all instruments, also those asked before and after.

    A score that two instruments have, in different parts, has a row for each.
    """
    rows = []
    for instrument in _instruments(spec):
        book = instrument.codebook()
        rows += book
        if instrument.per == "clip" and not instrument.scores:
            # In a table of scores each clip has a row of its own, and the column no number.
            names = numbers_of(instrument)
            rows += [row._replace(variable=name) for row in book for name in names if row.variable == f"{name}-k"]
    return rows


def _instruments(spec: StudySpec) -> list[Instrument]:
    names = [
        name for part in spec.all_parts for name in (*part.before, *(u.use for u in part.instruments), *part.after)
    ]
    names += [told.instrument for part in spec.all_parts for told in part.instructed]
    discussed = any(part.annotation is not None and part.annotation.mode == "consensus" for part in spec.all_parts)
    return [*map(spec.instrument, dict.fromkeys(names)), *([DISCUSSION] if discussed else [])]
