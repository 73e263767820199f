"""The data by which raters are screened."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import pandas as pd

from evaluation.errors import DataError

Participant = str | int
"""What names a participant: a number or a name."""

COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "scores": ("participant", "trial", "stimulus", "condition", "score", "value"),
        "repeats": ("participant", "score", "first", "second"),
        "checks": ("participant", "kind", "passed"),
        "timing": ("participant", "trial", "seconds", "share"),
        "answers": ("participant", "trial", "instrument", "item", "value"),
        "ranges": ("instrument", "item", "low", "high"),
    }
)
"""Columns of each table."""

_NUMBERS = frozenset({"value", "first", "second", "seconds", "share", "low", "high"})
CHECKS = ("gold", "instructed")


def _empty(name: str) -> pd.DataFrame:
    return pd.DataFrame({column: pd.Series(dtype=object) for column in COLUMNS[name]})


@dataclass(frozen=True, kw_only=True, eq=False)
class ScreeningData:
    """What is known of raters; a table that is left out is empty.

    The tables are checked and copied, with the columns of `COLUMNS` alone; numbers that are missing are NaN.

    Attributes
    ----------
    scores : pandas.DataFrame
        A row for each score of each clip in each trial that counts (kind "rating" alone): `score` is its name, for
        instance "P", `value` what it came to.
    repeats : pandas.DataFrame
        A row for each score of each trial that was repeated: `first` and `second` are what it came to.
    checks : pandas.DataFrame
        A row for each check: `kind` is "gold" or "instructed", `passed` whether it was answered as known or told.
    timing : pandas.DataFrame
        A row for each trial that counts: `seconds` it took, and the `share` of its clips that was played.
    answers : pandas.DataFrame
        A row for each answered item of each trial that counts. `value` is the answer as it was shown, before flipped
        poles are turned back: straight-lining is a thing of the page.
    ranges : pandas.DataFrame
        A row for each item that may be part of a straight line: its lowest and its highest answer. Items without a row
        (choices, free text) are not looked at.
    raters : tuple of str or int
        Participants who are to be in the report even if no table tells of them.

    Raises
    ------
    DataError
        If a table has not its columns, a participant is missing, a number is none or infinite, or a check is of another
        kind.
    """

    scores: pd.DataFrame = field(default_factory=lambda: _empty("scores"))
    repeats: pd.DataFrame = field(default_factory=lambda: _empty("repeats"))
    checks: pd.DataFrame = field(default_factory=lambda: _empty("checks"))
    timing: pd.DataFrame = field(default_factory=lambda: _empty("timing"))
    answers: pd.DataFrame = field(default_factory=lambda: _empty("answers"))
    ranges: pd.DataFrame = field(default_factory=lambda: _empty("ranges"))
    raters: tuple[Participant, ...] = ()

    def __post_init__(self) -> None:
        for name, columns in COLUMNS.items():
            object.__setattr__(self, name, _checked(name, getattr(self, name), columns))
        wrong = sorted(set(self.checks["kind"]) - set(CHECKS), key=str)
        if wrong:
            raise DataError(f"checks: there is no kind {wrong[0]!r}; there are {' and '.join(CHECKS)}.")
        if not self.checks["passed"].isin([True, False]).all():
            raise DataError("checks: `passed` must be true or false.")

    @property
    def participants(self) -> tuple[Participant, ...]:
        """Everybody of whom anything is known, in the order of their names."""
        tables = (self.scores, self.repeats, self.checks, self.timing, self.answers)
        return ordered({*self.raters, *(one for table in tables for one in table["participant"].unique().tolist())})


def ordered(participants: set[Participant]) -> tuple[Participant, ...]:
    """Return participants in the order of their numbers, then of their names."""
    return tuple(
        sorted(participants, key=lambda one: (isinstance(one, str), 0 if isinstance(one, str) else one, str(one)))
    )


def _checked(name: str, table: pd.DataFrame, columns: Sequence[str]) -> pd.DataFrame:
    missing = [column for column in columns if column not in table.columns]
    if missing:
        raise DataError(f"{name}: there is no column {', '.join(missing)}; needed are {', '.join(columns)}.")
    checked = table[list(columns)].reset_index(drop=True)
    for column in columns:
        if column in _NUMBERS:
            checked[column] = _numbers(name, checked[column])
        elif checked[column].isna().any():
            raise DataError(f"{name}: {column} is missing in {int(checked[column].isna().sum())} rows.")
    return checked


def _numbers(name: str, values: pd.Series) -> pd.Series:
    try:
        numbers = pd.to_numeric(values).astype(float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name}: {values.name} must be numbers, or missing.") from error
    # Squares of what is smaller cannot overflow.
    if bool((np.abs(numbers) > 1e140).any()):
        raise DataError(f"{name}: {values.name} must be finite numbers, 1e140 at most in size.")
    return numbers
