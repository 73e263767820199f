"""Columns of exported tables: every column gets one type, and a note on what it means."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError
from evaluation.instruments import ChoiceItem, Instrument, LikertItem, TextItem

Kind = Literal["integer", "number", "boolean", "time", "text", "mixed"]
"""What a column holds. A mixed one holds numbers as well as texts."""

EXACT = 2**53
"""Up to here, and down to minus this, every whole number is a number of double precision."""

_NO_LABELS: Mapping[int, str] = MappingProxyType({})


class Note(NamedTuple):
    """What a column means: a text, and what its values stand for."""

    text: str = ""
    labels: Mapping[int, str] = _NO_LABELS


class Table(NamedTuple):
    """A table that is ready to be written: its name, its columns as `plain` returns them, and a note on each."""

    name: str
    frame: pd.DataFrame
    notes: Mapping[str, Note]

    @property
    def columns(self) -> dict[str, pd.Series]:
        """Return the columns by name."""
        return {str(name): column for name, column in self.frame.items()}


def plain(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table with columns of six types, whatever they were held in.

    Parameters
    ----------
    frame : pandas.DataFrame
        Any table. Its index is left out. Tuples and lists are joined with ``;``; times without a zone are in UTC.

    Returns
    -------
    pandas.DataFrame
        Columns of whole numbers (``Int64``), numbers (``float64``), truth values (``boolean``), times
        (``datetime64[us, UTC]``), texts (``str``), or of numbers and texts mixed (``object``, None if missing). A
        column without any value holds texts.

    Raises
    ------
    DataError
        If two columns have the same name.
    """
    names = [str(name) for name in frame.columns]
    twice = [name for name, times in Counter(names).items() if times > 1]
    if twice:
        raise DataError(f"The table has two columns {twice[0]!r}; each column needs a name of its own.")
    columns = {name: _plain(frame.iloc[:, place]) for place, name in enumerate(names)}
    return pd.DataFrame(columns, index=pd.RangeIndex(len(frame)), columns=names)


def kind(column: pd.Series) -> Kind:
    """Return what a column of a table that `plain` returned holds."""
    dtype = column.dtype
    if isinstance(dtype, pd.DatetimeTZDtype):
        return "time"
    kinds: dict[str, Kind] = {"Int64": "integer", "float64": "number", "boolean": "boolean", "object": "mixed"}
    return kinds.get(str(dtype), "text")


def iso_times(column: pd.Series) -> npt.NDArray[np.object_]:
    """Return times as texts such as ``2026-01-02T03:04:05.000000Z``; None if missing."""
    moments = column.dt.tz_localize(None).to_numpy(dtype="datetime64[us]")
    texts: npt.NDArray[np.object_] = np.char.add(np.datetime_as_string(moments, unit="us"), "Z").astype(object)
    texts[np.isnat(moments)] = None
    return texts


def as_text(column: pd.Series) -> pd.Series:
    """Return a column of `plain` as texts: times as `iso_times`, numbers as Python writes them."""
    if kind(column) == "text":
        return column
    found = iso_times(column) if kind(column) == "time" else _objects(column)
    return pd.Series([None if value is None else str(value) for value in found], index=column.index, dtype="str")


def python_values(column: pd.Series) -> list[Any]:
    """Return the values of a column of `plain` as Python has them; None if missing."""
    values: list[Any] = _objects(column).tolist()
    return values


def require_finite(table: Table, held_by: str) -> None:
    """Raise DataError if a number is infinite, which some formats cannot hold."""
    for name, column in table.columns.items():
        if kind(column) == "number" and np.isinf(column).any():
            raise DataError(
                f"The column {name} of the table {table.name} holds an infinite number, which {held_by} cannot hold; "
                f"use csv or parquet."
            )


def notes_on(
    name: str, frame: pd.DataFrame, book: pd.DataFrame, labels: Mapping[str, Mapping[int, str]]
) -> dict[str, Note]:
    """Return a note on each column of a table.

    Parameters
    ----------
    name : str
        Name of the table.
    frame : pandas.DataFrame
        The table.
    book : pandas.DataFrame
        The codebook, with the columns variable and text; ``TABLE.COLUMN`` goes before ``COLUMN``.
    labels : mapping of str to mapping
        What the values of some columns stand for, as `value_labels` returns them.
    """
    texts: dict[str, str] = {}
    for variable, text in zip(book["variable"], book["text"], strict=True):
        texts.setdefault(str(variable), str(text))
    return {
        column: Note(texts.get(f"{name}.{column}", texts.get(column, "")), labels.get(column, _NO_LABELS))
        for column in map(str, frame.columns)
    }


def value_labels(instrument: Instrument) -> dict[str, dict[int, str]]:
    """Return what the values of an instrument's items stand for, by ``INSTRUMENT.ITEM``.

    A scale between two poles has a label at each end. The labels are English or, if there is none, in the instrument's
    first language. Texts and choices of several options have none.
    """
    language = "en" if "en" in instrument.languages else instrument.languages[0]
    found = {}
    for item in instrument.items:
        if isinstance(item, TextItem) or (isinstance(item, ChoiceItem) and item.multiple):
            continue
        if isinstance(item, (LikertItem, ChoiceItem)):
            labels = {option.value: option.label[language] for option in item.options}
        else:
            labels = {item.low: item.left[language], item.high: item.right[language]}
        found[f"{instrument.name}.{item.id}"] = dict(sorted(labels.items()))
    return found


def cut(text: str, limit: int, encoding: str = "utf-8", *, mark: str = "…") -> str:
    """Return a text that takes at most `limit` bytes; a mark at its end shows that it was cut."""
    coded = text.encode(encoding)
    if len(coded) <= limit:
        return text
    return coded[: limit - len(mark.encode(encoding))].decode(encoding, errors="ignore") + mark


def distinct(names: Mapping[str, str], shorten: Callable[[str, int], str]) -> dict[str, str]:
    """Return names that differ even if capitals are small letters; those that need no change keep theirs.

    Parameters
    ----------
    names : mapping of str to str
        What each name should become.
    shorten : callable
        Makes a name so short that this many characters fit behind it.
    """
    given: dict[str, str] = {}
    taken: set[str] = set()
    for name in sorted(names, key=lambda name: names[name] != name):
        found = next(one for one in _candidates(names[name], shorten) if one.casefold() not in taken)
        taken.add(found.casefold())
        given[name] = found
    return {name: given[name] for name in names}


def _candidates(name: str, shorten: Callable[[str, int], str]) -> Iterator[str]:
    yield shorten(name, 0)
    number = 2
    while True:
        suffix = f"_{number}"
        yield shorten(name, len(suffix)) + suffix
        number += 1


def _plain(column: pd.Series) -> pd.Series:
    column, types = column.reset_index(drop=True), pd.api.types
    if isinstance(column.dtype, pd.CategoricalDtype):
        categories = _plain(pd.Series(column.cat.categories))
        found = pd.Series(categories.array.take(column.cat.codes.to_numpy(), allow_fill=True))
    elif types.is_datetime64_any_dtype(column.dtype):
        found = _times(column)
    elif types.is_object_dtype(column.dtype) or types.is_unsigned_integer_dtype(column.dtype):
        found = _inferred(column.astype(object))
    elif types.is_bool_dtype(column.dtype):
        found = column.astype("boolean")
    elif types.is_integer_dtype(column.dtype):
        found = column.astype("Int64")
    elif types.is_float_dtype(column.dtype):
        found = pd.Series(column.to_numpy(dtype=np.float64, na_value=np.nan))
    elif isinstance(column.dtype, pd.StringDtype):
        found = column.astype("str")
    else:
        found = _inferred(column.astype(object))
    return found


def _inferred(column: pd.Series) -> pd.Series:
    """Return a column of Python's objects with the narrowest type that loses nothing."""
    values = pd.Series(_joined(column), dtype=object)
    found = pd.api.types.infer_dtype(values, skipna=True)
    if found in {"string", "empty"}:
        return values.where(values.notna(), None).astype("str")
    if found == "boolean":
        return values.astype("boolean")
    if found in {"datetime", "datetime64"}:
        return _times(pd.to_datetime(values, utc=True))
    present = values[values.notna()]
    if found == "integer" and all(-(2**63) <= value < 2**63 for value in present):
        return values.astype("Int64")
    if found == "floating" or (found == "mixed-integer-float" and all(abs(value) <= EXACT for value in present)):
        return values.where(values.notna(), np.nan).astype(np.float64)
    return pd.Series(_mixed(values), dtype=object)


def _joined(column: pd.Series) -> list[Any]:
    return [";".join(map(str, value)) if isinstance(value, (tuple, list)) else value for value in column]


def _mixed(values: pd.Series) -> list[Any]:
    missing = values.isna().to_numpy()
    return [None if gap else _scalar(value) for value, gap in zip(values, missing, strict=True)]


def _scalar(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, datetime):
        return iso_times(_times(pd.to_datetime(pd.Series([value]), utc=True)))[0]
    if isinstance(value, (bool, int, str)) or (isinstance(value, float) and np.isfinite(value)):
        return value
    return str(value)


def _times(column: pd.Series) -> pd.Series:
    zoned = column if isinstance(column.dtype, pd.DatetimeTZDtype) else column.dt.tz_localize("UTC")
    moments: pd.Series = zoned.dt.tz_convert("UTC").dt.as_unit("us").reset_index(drop=True)
    return moments


def _objects(column: pd.Series) -> npt.NDArray[np.object_]:
    found = column.to_numpy(dtype=object, copy=True)
    found[column.isna().to_numpy()] = None
    return found
