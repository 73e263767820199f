"""Collected answers as a table: its columns, its checks, and the scores of each trial."""

import math
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError
from evaluation.instruments import Instrument, Item, TextItem
from evaluation.study import Cell, StudySpec

RESPONSE_COLUMNS = MappingProxyType(
    {
        "participant": "number or name of the participant",
        "trial": "place of the trial in the participant's order, counted from 1",
        "stimulus": "id of the stimulus in the study file",
        "condition": "name of the condition in the study file",
        "instrument": "name of the instrument",
        "item": "id of the item in the instrument",
        "raw": "the answer as given on the page, a whole number",
    }
)
"""Columns of a table of responses, which has one row for each answered item."""

OPTIONAL_COLUMNS = MappingProxyType(
    {
        "keyed": "the answer as if no poles had changed sides, which scores are made of; raw if the column is left out",
        "clip": "place of the clip on the page that the answer is about, counted from 1; 1 if the column is left out",
    }
)
"""Columns that a table of responses may have besides."""

Ints = npt.NDArray[np.int64]

DIMENSIONS = ("P", "A", "D")
INPUT_COLUMNS = tuple(f"input_{dimension}" for dimension in DIMENSIONS)

KEY = ("participant", "trial", "clip")
"""What a row of scores is about: one clip of one trial."""

_KEY = list(KEY)
_NUMBERS = ("trial", "raw", "keyed", "clip")


def check_responses(spec: StudySpec, responses: pd.DataFrame) -> pd.DataFrame:
    """Return the responses with their columns of `RESPONSE_COLUMNS` and `OPTIONAL_COLUMNS` alone, sorted by trial.

    Parameters
    ----------
    spec : StudySpec
        The study that was answered.
    responses : pandas.DataFrame
        One row for each answered item; more columns are allowed and left out.

    Returns
    -------
    pandas.DataFrame
        A new frame; the one given is not changed. Answers and places are whole numbers.

    Raises
    ------
    DataError
        If a column is missing, a name is not in the study, an answer is not one of those offered, an item is answered
        twice in a trial, or one clip of a trial is two stimuli.
    """
    missing = [column for column in RESPONSE_COLUMNS if column not in responses.columns]
    if missing:
        raise DataError(f"The responses have no column {', '.join(missing)}; needed are {', '.join(RESPONSE_COLUMNS)}.")
    columns = [*RESPONSE_COLUMNS, *(column for column in OPTIONAL_COLUMNS if column in responses.columns)]
    table = responses[columns].copy()
    numbers = [column for column in _NUMBERS if column in columns]
    if table.empty:
        return table.astype(dict.fromkeys(numbers, "int64")).reset_index(drop=True)
    gaps = [column for column in columns if table[column].isna().any()]
    if gaps:
        raise DataError(f"The responses have empty cells in {', '.join(gaps)}; a missing answer is a row left out.")
    for column in numbers:
        table[column] = _whole(table[column], column)
    _check_cells(spec, table)
    _check_answers(spec, complete(table))
    _check_once(complete(table))
    if _in_order(table):
        return table.reset_index(drop=True)
    return table.sort_values(["participant", "trial"], kind="stable", ignore_index=True)


def _in_order(table: pd.DataFrame) -> bool:
    """Tell whether whole numbers of participants, and their trials, come in order already."""
    people, trials = table["participant"], table["trial"].to_numpy()
    if not pd.api.types.is_integer_dtype(people.dtype):
        return False
    steps = np.diff(people.to_numpy())
    return bool(((steps > 0) | ((steps == 0) & (np.diff(trials) >= 0))).all())


def complete(responses: pd.DataFrame) -> pd.DataFrame:
    """Return checked responses with all of `OPTIONAL_COLUMNS`, as a new frame."""
    filled = responses.copy()
    if "keyed" not in filled:
        filled["keyed"] = filled["raw"]
    if "clip" not in filled:
        filled["clip"] = 1
    return filled


def statistical(instrument: Instrument) -> tuple[Item, ...]:
    """Return the items of an instrument whose answers are whole numbers about one clip.

    Free texts, choices of several options, and items about each word of a sentence are none: those are exported, but
    not in tables of responses.
    """
    if instrument.per == "word":
        return ()
    return tuple(item for item in instrument.items if not isinstance(item, TextItem) and not several(item))


def several(item: Item) -> bool:
    """Tell whether several answers may be chosen."""
    return bool(getattr(item, "multiple", False))


def numbers_of(instrument: Instrument) -> tuple[str, ...]:
    """Return the columns that an instrument has in a table of scores: its scores, or else its items with numbers.

    An item of an instrument without scores is called ``instrument.item``.
    """
    if instrument.scores:
        return tuple(score.name for score in instrument.scores)
    return tuple(f"{instrument.name}.{item.id}" for item in instrument.items if item.numeric)


def asked_about_clips(spec: StudySpec) -> tuple[Instrument, ...]:
    """Return the instruments of a study that can have rows in a table of responses, in the order of the page."""
    return tuple(one for one in map(spec.instrument, spec.instrument_names) if statistical(one))


def pad_instruments(spec: StudySpec) -> tuple[str, ...]:
    """Return the names of a study's instruments from whose answers pleasure, arousal and dominance are scored."""
    return tuple(one.name for one in asked_about_clips(spec) if set(DIMENSIONS) <= {score.name for score in one.scores})


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
        One row for each clip of each trial with an answer: participant, trial, clip (if the responses have that
        column), stimulus, condition, the clip's input_P, input_A and input_D, and the numbers (see `numbers_of`) of all
        instruments of the study, for instance P, A and D by Jia et al. (2013), Eq. 13, and MOS. Scores are made of the
        keyed answers. NaN where an item that the score needs has no answer, or the clip names no PAD.
    """
    table = complete(responses)
    which, trials = alike(table, _KEY, keep=["stimulus", "condition"])
    nothing = (math.nan, math.nan, math.nan)
    pads = {cell: input_pad(spec, *cell) or nothing for cell in spec.cells()}
    shown, cells = alike(trials, ["stimulus", "condition"])
    given = np.array([pads[Cell(*cell)] for cell in cells.itertuples(index=False)], dtype=float)
    given = given.reshape(-1, len(DIMENSIONS))
    trials[list(INPUT_COLUMNS)] = given[shown]
    for instrument in asked_about_clips(spec):
        own = (table["instrument"] == instrument.name).to_numpy()
        numbers = _numbers(instrument, table[own], which[own], len(trials))
        for name in numbers_of(instrument):
            column = pd.Series(numbers[name].to_numpy(dtype=float), index=trials.index)
            # Two parts may each ask an instrument that has this score.
            trials[name] = trials[name].fillna(column) if name in trials else column
    return trials if "clip" in responses else trials.drop(columns="clip")


def alike(frame: pd.DataFrame, columns: Sequence[str], *, keep: Sequence[str] = ()) -> tuple[Ints, pd.DataFrame]:
    """Return which of the different rows each row of a frame is, and these, as far as some columns go.

    Parameters
    ----------
    frame : pandas.DataFrame
        Any frame; it may have millions of rows.
    columns : sequence of str
        Columns that tell rows apart.
    keep : sequence of str
        Columns that the different rows have besides, from the first of those that are alike.

    Returns
    -------
    tuple of (numpy.ndarray of int, pandas.DataFrame)
        A number for each row, and the different rows in the order in which they come first.
    """
    which = np.asarray(frame.groupby(list(columns), sort=False).ngroup(), dtype=np.int64)
    _, first = np.unique(which, return_index=True)
    return which, frame.iloc[first][[*columns, *keep]].reset_index(drop=True)


def _numbers(instrument: Instrument, answered: pd.DataFrame, which: Ints, trials: int) -> pd.DataFrame:
    """Return the numbers of one instrument, one row for each clip of each trial; `which` is that of each answer."""
    items = [item.id for item in instrument.items if item.numeric]
    places = pd.Index(items).get_indexer(pd.Index(answered["item"]))
    asked = places >= 0
    wide = np.full((trials, len(items)), math.nan)
    wide[which[asked], places[asked]] = answered["keyed"].to_numpy(dtype=float)[asked]
    frame = pd.DataFrame(wide, columns=items)
    if instrument.scores:
        return instrument.score_table(frame)
    return frame.rename(columns={item: f"{instrument.name}.{item}" for item in items})


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
        (instrument.name, item.id): frozenset(item.values)
        for instrument in asked_about_clips(spec)
        for item in statistical(instrument)
    }
    for name, item, raw, keyed in (
        table[["instrument", "item", "raw", "keyed"]].drop_duplicates().itertuples(index=False)
    ):
        if (name, item) not in offered:
            raise DataError(f"The responses hold {name}.{item}, which the study {spec.slug} does not ask.")
        for answer in (raw, keyed):
            if answer not in offered[name, item]:
                raise DataError(
                    f"The responses hold {answer} for {name}.{item}, which is not one of the answers offered."
                )


def _check_once(table: pd.DataFrame) -> None:
    twice = table[table.duplicated([*_KEY, "instrument", "item"])]
    if len(twice):
        first = twice.iloc[0]
        raise DataError(
            f"The responses hold two answers of participant {first['participant']} to {first['instrument']}."
            f"{first['item']} in trial {first['trial']}, but only the one that counts may be there."
        )
    shown = table.drop_duplicates([*_KEY, "stimulus", "condition"])
    if shown.duplicated(_KEY).any():
        first = shown[shown.duplicated(_KEY)].iloc[0]
        raise DataError(
            f"Trial {first['trial']} of participant {first['participant']} has two different stimuli or conditions, "
            "but shows one at each place."
        )
