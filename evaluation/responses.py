"""Collected answers as a table: its columns, its checks, and the scores of each trial."""

import math
from types import MappingProxyType

import numpy as np
import pandas as pd

from evaluation import instruments
from evaluation.errors import DataError
from evaluation.study import Cell, StudySpec

RESPONSE_COLUMNS = MappingProxyType(
    {
        "participant": "number or name of the participant",
        "trial": "place of the trial in the participant's order, counted from 1",
        "stimulus": "id of the stimulus in the study file",
        "condition": "name of the condition in the study file",
        "instrument": "name of the instrument",
        "item": "id of the item in the instrument",
        "raw": "the answer as given, a whole number",
    }
)
"""Columns of a table of responses, which has one row for each answered item."""

DIMENSIONS = ("P", "A", "D")
INPUT_COLUMNS = tuple(f"input_{dimension}" for dimension in DIMENSIONS)

_TRIAL = ["participant", "trial"]


def check_responses(spec: StudySpec, responses: pd.DataFrame) -> pd.DataFrame:
    """Return the responses with the columns `RESPONSE_COLUMNS` alone, `raw` as whole numbers, sorted by trial.

    Parameters
    ----------
    spec : StudySpec
        The study that was answered.
    responses : pandas.DataFrame
        One row for each answered item; more columns are allowed and left out.

    Returns
    -------
    pandas.DataFrame
        A new frame; the one given is not changed.

    Raises
    ------
    DataError
        If a column is missing, a name is not in the study, an answer is not one of those offered, an item is answered
        twice in a trial, or a trial shows two stimuli.
    """
    missing = [column for column in RESPONSE_COLUMNS if column not in responses.columns]
    if missing:
        raise DataError(f"The responses have no column {', '.join(missing)}; needed are {', '.join(RESPONSE_COLUMNS)}.")
    table = responses[list(RESPONSE_COLUMNS)].copy()
    if table.empty:
        return table.astype({"trial": "int64", "raw": "int64"}).reset_index(drop=True)
    gaps = [column for column in RESPONSE_COLUMNS if table[column].isna().any()]
    if gaps:
        raise DataError(f"The responses have empty cells in {', '.join(gaps)}; a missing answer is a row left out.")
    table["raw"] = _whole(table["raw"], "raw")
    table["trial"] = _whole(table["trial"], "trial")
    _check_cells(spec, table)
    _check_answers(spec, table)
    if table.duplicated([*_TRIAL, "instrument", "item"]).any():
        first = table[table.duplicated([*_TRIAL, "instrument", "item"])].iloc[0]
        raise DataError(
            f"The responses hold two answers of participant {first['participant']} to {first['instrument']}."
            f"{first['item']} in trial {first['trial']}, but only the one that counts may be there."
        )
    shown = table.drop_duplicates([*_TRIAL, "stimulus", "condition"])
    if shown.duplicated(_TRIAL).any():
        first = shown[shown.duplicated(_TRIAL)].iloc[0]
        raise DataError(
            f"Trial {first['trial']} of participant {first['participant']} has two different stimuli or conditions, "
            "but shows one."
        )
    return table.sort_values(_TRIAL, kind="stable", ignore_index=True)


def input_pad(spec: StudySpec, stimulus: str, condition: str) -> tuple[float, float, float] | None:
    """Return the pleasure, arousal and dominance that went into a cell's clip; None if its clip does not name them."""
    pad = spec.clip_fields(stimulus, condition).get("pad")
    if not isinstance(pad, list) or len(pad) != len(DIMENSIONS):
        return None
    numbers = [float(value) for value in pad if isinstance(value, (int, float)) and not isinstance(value, bool)]
    if len(numbers) != len(DIMENSIONS):
        return None
    P, A, D = numbers
    return P, A, D


def score_trials(spec: StudySpec, responses: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of each trial.

    Parameters
    ----------
    spec : StudySpec
        The study that was answered.
    responses : pandas.DataFrame
        As `check_responses` returns them.

    Returns
    -------
    pandas.DataFrame
        One row for each trial with an answer: participant, trial, stimulus, condition, the clip's input_P, input_A and
        input_D, and every score of the study's instruments (P, A and D by Jia et al., 2013, Eq. 13; MOS). NaN where an
        item that the score needs has no answer, or the clip names no PAD.
    """
    trials = responses.drop_duplicates(_TRIAL)[[*_TRIAL, "stimulus", "condition"]].reset_index(drop=True)
    nothing = (math.nan, math.nan, math.nan)
    pads = {cell: input_pad(spec, *cell) or nothing for cell in spec.cells()}
    given = [pads[Cell(*cell)] for cell in zip(trials["stimulus"], trials["condition"], strict=True)]
    trials[list(INPUT_COLUMNS)] = np.array(given, dtype=float).reshape(-1, len(DIMENSIONS))
    for name in spec.instruments:
        instrument = instruments.get(name)
        answered = responses[responses["instrument"] == name]
        wide = answered.pivot(index=_TRIAL, columns="item", values="raw")
        scores = instrument.score_table(wide.reindex(columns=[item.id for item in instrument.items]))
        trials = trials.join(scores, on=_TRIAL)
    return trials


def _whole(values: pd.Series, column: str) -> pd.Series:
    numbers = pd.to_numeric(values, errors="coerce")
    wrong = numbers.isna() | (numbers % 1 != 0)
    if wrong.any():
        raise DataError(f"The responses hold {values[wrong].iloc[0]!r} in {column}, but it must be a whole number.")
    return numbers.astype("int64")


def _check_cells(spec: StudySpec, table: pd.DataFrame) -> None:
    cells = set(spec.cells())
    for stimulus, condition in table[["stimulus", "condition"]].drop_duplicates().itertuples(index=False):
        if (stimulus, condition) not in cells:
            raise DataError(
                f"The responses hold the stimulus {stimulus!r} in the condition {condition!r}, "
                f"which the study {spec.slug} does not show."
            )


def _check_answers(spec: StudySpec, table: pd.DataFrame) -> None:
    offered = {
        (name, item.id): frozenset(item.values) for name in spec.instruments for item in instruments.get(name).items
    }
    for name, item, raw in table[["instrument", "item", "raw"]].drop_duplicates().itertuples(index=False):
        if (name, item) not in offered:
            raise DataError(f"The responses hold {name}.{item}, which the study {spec.slug} does not ask.")
        if raw not in offered[name, item]:
            raise DataError(f"The responses hold {raw} for {name}.{item}, which is not one of the answers offered.")
