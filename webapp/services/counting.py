"""Answers as the statistics take them: those of the trials that count."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.design.plan import COUNTING
from evaluation.instruments.paired import PAIRED
from evaluation.responses import OPTIONAL_COLUMNS, RESPONSE_COLUMNS, asked_about_clips, statistical
from evaluation.study import StudySpec

__all__ = ["COUNTING", "PREFERENCE_COLUMNS", "preferences_frame", "statistics_frame"]

PREFERENCE_COLUMNS = ("participant", "trial", "stimulus", "condition_a", "condition_b", "preferred")

_NAMES = ("stimulus", "condition", "instrument", "item")
_NUMBERS = ("raw", "keyed", "clip")


def statistics_frame(
    spec: StudySpec, rows: pd.DataFrame, part: str | None = None, *, kinds: Sequence[str] = COUNTING
) -> pd.DataFrame:
    """Return the answers about single clips that are whole numbers, as `evaluation.responses` describes them.

    Parameters
    ----------
    spec : StudySpec
        The study.
    rows : pandas.DataFrame
        All answers, as `webapp.services.collected.read` returns them.
    part : str, optional
        Name of the part; left out, all parts.
    kinds : sequence of str
        Kinds of the trials.
    """
    kept = rows["kind"].isin(kinds) & rows["stimulus"].notna() & _last_words(spec, rows)
    if part is not None:
        kept &= rows["part"] == part
    per = {(one.name, item.id): one.per for one in asked_about_clips(spec) for item in statistical(one)}
    kept &= _of_items(rows, set(per))
    kept &= (rows["shown"] == 1) | _of_items(rows, {key for key, about in per.items() if about == "clip"})
    frame = rows.loc[kept, [*RESPONSE_COLUMNS, *OPTIONAL_COLUMNS]].reset_index(drop=True)
    return frame.astype({**dict.fromkeys(_NAMES, object), **dict.fromkeys(_NUMBERS, "int64")})


def _of_items(rows: pd.DataFrame, items: set[tuple[str, str]]) -> npt.NDArray[np.bool_]:
    """Tell which rows answer one of some items, named by instrument and item."""
    instruments, asked = rows["instrument"].cat, rows["item"].cat
    chosen = np.array(
        [[(instrument, item) in items for item in asked.categories] for instrument in instruments.categories],
        dtype=bool,
    ).reshape(len(instruments.categories), len(asked.categories))
    found: npt.NDArray[np.bool_] = chosen[instruments.codes, asked.codes] if len(rows) else np.zeros(0, dtype=bool)
    return found


def _last_words(spec: StudySpec, rows: pd.DataFrame) -> pd.Series:
    """Tell which rows are not what a rater said of a clip in a consensus before the last time."""
    annotated = [part for part in spec.all_parts if part.annotation is not None]
    discussed = {part.name for part in annotated if part.annotation and part.annotation.mode == "consensus"}
    within = rows["part"].isin(discussed)
    if not within.any():
        return ~within
    spoken = rows[within].groupby(["part", "participant", "stimulus", "condition"], observed=True, dropna=False)[
        "trial"
    ]
    return ~within | (rows["trial"] == spoken.transform("max").reindex(rows.index))


def preferences_frame(rows: pd.DataFrame, part: str | None = None) -> pd.DataFrame:
    """Return which of two clips was preferred in each trial that asked so; the columns are `PREFERENCE_COLUMNS`."""
    kept = (rows["instrument"] == PAIRED.name) & rows["kind"].isin(COUNTING)
    kept &= rows["shown"] == len(PAIRED.items[0].values)
    if part is not None:
        kept &= rows["part"] == part
    found = [
        (participant, trial, stimulus, *conditions, conditions[keyed - 1])
        for participant, trial, stimulus, conditions, keyed in rows.loc[
            kept, ["participant", "trial", "stimulus", "conditions", "keyed"]
        ].itertuples(index=False)
    ]
    return pd.DataFrame(found, columns=list(PREFERENCE_COLUMNS))
