"""Tables as files of SPSS (``.sav``): names that SPSS takes, labels of variables and values, system-missing gaps."""

import re
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd
import pyreadstat

from evaluation.errors import DataError
from evaluation.report.typed_columns import (
    EXACT,
    Note,
    Table,
    as_text,
    cut,
    distinct,
    kind,
    python_values,
    require_finite,
)

# Limits of the format in bytes (IBM SPSS Statistics, Command Syntax Reference: names, VARIABLE LABELS, VALUE LABELS,
# STRING).
NAME_BYTES = 64
LABEL_BYTES = 256
VALUE_LABEL_BYTES = 120
TEXT_BYTES = 32_767

_RESERVED = frozenset(("ALL", "AND", "BY", "EQ", "GE", "GT", "LE", "LT", "NE", "NOT", "OR", "TO", "WITH"))
# Where the header keeps the date (9 bytes) and the time (8 bytes) at which the file was made.
_MADE_AT = 92
_MADE = b"01 Jan 8000:00:00"


def variable_names(columns: Iterable[str]) -> dict[str, str]:
    """Return the name in SPSS of each column.

    Letters of any script, digits, ``.`` and ``_`` stay, anything else becomes ``_``; a name that does not begin with a
    letter, or is a word of SPSS's language, gets ``v_`` before it; names of more than 64 bytes are cut, and what would
    then be there twice (SPSS does not tell capitals from small letters) is numbered. A column that needs no change
    keeps its name.
    """
    return distinct({name: _valid(name) for name in columns}, _shortened)


def write_sav(table: Table, path: Path) -> None:
    """Write a table as a file of SPSS.

    Times are in UTC to the millisecond, truth values 0 and 1, and columns of numbers and texts mixed texts, as are
    whole numbers beyond 2^53. Missing numbers are system-missing, missing texts empty, which is all that SPSS has.
    Texts of more than 32,767 bytes, SPSS's limit, are cut and end with ``…``. The file is the same for the same table.

    Raises
    ------
    DataError
        If the table has no columns, or holds an infinite number.
    """
    if not len(table.frame.columns):
        raise DataError(f"The table {table.name} has no columns, which sav cannot hold; leave it out.")
    require_finite(table, "sav")
    names = variable_names(table.columns)
    columns: dict[str, pd.Series] = {}
    formats: dict[str, str] = {}
    labels: dict[str, str] = {}
    values: dict[str, dict[float, str]] = {}
    measures: dict[str, str] = {}
    for column, name in names.items():
        values_of, note = table.columns[column], table.notes.get(column, Note())
        columns[name], form, measures[name] = _variable(values_of)
        if form:
            formats[name] = form
        labels[name] = cut(": ".join([column] * (column != name) + [note.text] * bool(note.text)), LABEL_BYTES)
        options = _options(values_of, note)
        if options:
            values[name] = {float(value): cut(text, VALUE_LABEL_BYTES) for value, text in options.items()}
    pyreadstat.write_sav(
        pd.DataFrame(columns),
        path,
        column_labels={name: label for name, label in labels.items() if label},
        variable_value_labels=values,
        variable_format=formats,
        variable_measure=measures,
        row_compress=True,
    )
    with path.open("r+b") as file:
        file.seek(_MADE_AT)
        file.write(_MADE)


def _variable(column: pd.Series) -> tuple[pd.Series, str, str]:
    """Return the values as pyreadstat takes them, the format (empty if it follows from them) and the measure."""
    what = kind(column)
    if what == "time":
        return column.dt.tz_localize(None), "DATETIME23.3", "scale"
    if what == "boolean":
        return column.astype("Float64").astype(float), "F1.0", "nominal"
    if what == "integer":
        low, high = (0, 0) if column.isna().all() else (int(column.min()), int(column.max()))
        if low >= -EXACT and high <= EXACT:
            return column.astype(float), f"F{max(len(str(low)), len(str(high)))}.0", "unknown"
    if what == "number":
        return column, "", "scale"
    texts = [_text(text) for text in python_values(as_text(column))]
    return pd.Series(texts, dtype="str"), "", "nominal"


def _options(column: pd.Series, note: Note) -> Mapping[int, str]:
    if kind(column) == "boolean":
        return {0: "no", 1: "yes"}
    return note.labels if kind(column) in {"integer", "number"} else {}


def _text(value: str | None) -> str:
    # What reads the file takes U+0000 for the end of a text.
    return "" if value is None else cut(value.replace("\0", ""), TEXT_BYTES)


def _valid(name: str) -> str:
    kept = "".join(sign if _allowed(sign) else "_" for sign in unicodedata.normalize("NFC", name)).rstrip(".")
    return kept if kept and kept[0].isalpha() and kept.upper() not in _RESERVED else f"v_{kept}"


def _allowed(sign: str) -> bool:
    return bool(re.match(r"[A-Za-z0-9._]", sign)) or (ord(sign) > 127 and unicodedata.category(sign)[0] == "L")


def _shortened(name: str, room: int) -> str:
    return cut(name, NAME_BYTES - room, mark="").rstrip(".")
