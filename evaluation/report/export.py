"""Tidy tables for other programs: the answers, the scores of each trial, and what the columns mean."""

import pandas as pd

from evaluation import instruments
from evaluation.instruments import CodebookRow
from evaluation.responses import DIMENSIONS, RESPONSE_COLUMNS, check_responses, score_trials
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
        The columns `RESPONSE_COLUMNS`.

    Raises
    ------
    DataError
        If the answers do not fit the study.
    """
    return check_responses(spec, answered)


def scores(spec: StudySpec, answered: pd.DataFrame) -> pd.DataFrame:
    """Return the scores, one row for each trial.

    Parameters
    ----------
    spec : StudySpec
        The study.
    answered : pandas.DataFrame
        As `evaluation.responses.RESPONSE_COLUMNS` describes.

    Returns
    -------
    pandas.DataFrame
        As `evaluation.responses.score_trials`: participant, trial, stimulus, condition, input PAD and every score.

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
    stimuli = ", ".join(stimulus.id for stimulus in spec.stimuli)
    conditions = ", ".join(condition.name for condition in spec.conditions)
    values = {"stimulus": stimuli, "condition": conditions, "instrument": ", ".join(spec.instruments)}
    rows = [
        CodebookRow(name, text, values.get(name, ""), "", f"study {spec.slug}")
        for name, text in RESPONSE_COLUMNS.items()
    ]
    rows += [
        CodebookRow(f"input_{dimension}", f"{dimension} that went into the clip", "-1 to 1", "", f"study {spec.slug}")
        for dimension in DIMENSIONS
    ]
    for name in spec.instruments:
        rows += instruments.get(name).codebook()
    return pd.DataFrame(rows, columns=list(CodebookRow._fields))
