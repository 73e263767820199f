"""Tables as files for other programs: CSV, Parquet, SPSS, Excel and JSON."""

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from evaluation.errors import DataError
from evaluation.report.spss import write_sav
from evaluation.report.typed_columns import (
    Note,
    Table,
    as_text,
    iso_times,
    kind,
    notes_on,
    plain,
    python_values,
    require_finite,
)
from evaluation.report.workbook import check_size, write_xlsx

FORMATS = ("csv", "parquet", "sav", "xlsx", "json")
"""The formats that `write` takes."""

WORKBOOK = "tables.xlsx"
"""Name of the one file that holds all tables as sheets."""

_ROWS_AT_ONCE = 50_000
_NO_LABELS: Mapping[str, Mapping[int, str]] = MappingProxyType({})


def write(
    tables: Mapping[str, pd.DataFrame],
    folder: Path,
    formats: Sequence[str],
    *,
    labels: Mapping[str, Mapping[int, str]] = _NO_LABELS,
) -> list[Path]:
    """Write tables in one or several formats.

    Parameters
    ----------
    tables : mapping of str to pandas.DataFrame
        The tables by name. One called ``codebook`` with the columns variable and text explains the columns of the
        others; files that can hold an explanation get it.
    folder : pathlib.Path
        Where the files are written; it must be there.
    formats : sequence of str
        Some of `FORMATS`.
    labels : mapping of str to mapping, optional
        What the values of columns stand for, as `typed_columns.value_labels` returns them; sav and parquet hold them.

    Returns
    -------
    list of pathlib.Path
        A file for each table in each format, ``NAME.FORMAT``, but one `WORKBOOK` for all.

    Raises
    ------
    DataError
        If a format is not known, or a table does not fit into one; see `write_sav` and `write_xlsx`.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise DataError(f"There is no format {unknown[0]!r}; there are {', '.join(FORMATS)}.")
    book = tables.get("codebook", pd.DataFrame({"variable": [], "text": []}))
    ready = [Table(name, plain(frame), notes_on(name, frame, book, labels)) for name, frame in tables.items()]
    if "xlsx" in formats:
        check_size(ready)
    paths = []
    for chosen in dict.fromkeys(formats):
        if chosen == "xlsx":
            paths.append(folder / WORKBOOK)
            write_xlsx(ready, paths[-1])
            continue
        for table in ready:
            paths.append(folder / f"{table.name}.{chosen}")
            _WRITERS[chosen](table, paths[-1])
    return paths


def to_csv(frame: pd.DataFrame) -> str:
    """Return a table as CSV: RFC 4180's quotes, a point for decimals, empty for missing, times in UTC with a Z.

    Texts are written as they are, also those that a spreadsheet would take for a formula.
    """
    return _csv(plain(frame), None) or ""


def to_json(frame: pd.DataFrame) -> str:
    """Return a table as JSON: an array with an object for each row, null for missing, times in UTC with a Z.

    Raises
    ------
    DataError
        If a number is infinite, which JSON cannot hold.
    """
    return "".join(_json(Table("of the data", plain(frame), {})))


def write_csv(table: Table, path: Path) -> None:
    """Write a table as `to_csv` returns it, in UTF-8."""
    with path.open("w", encoding="utf-8", newline="") as file:
        _csv(table.frame, file)


def write_json(table: Table, path: Path) -> None:
    """Write a table as `to_json` returns it, in UTF-8, a row on each line."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(_json(table))


def write_parquet(table: Table, path: Path) -> None:
    """Write a table as Parquet: whole numbers with gaps, truth values, times in UTC, texts.

    The metadata of each field hold its ``description`` and, if its values have labels, ``labels`` as a JSON object. A
    column of numbers and texts mixed is written as texts.
    """
    texts = {name: as_text(column) for name, column in table.columns.items() if kind(column) == "mixed"}
    frame = table.frame.assign(**texts)
    found = pa.Table.from_pandas(frame, preserve_index=False)
    fields = [field.with_metadata(_metadata(table.notes.get(field.name, Note()))) for field in found.schema]
    schema = pa.schema(fields, metadata=found.schema.metadata)
    pq.write_table(pa.Table.from_arrays(found.columns, schema=schema), path)


_WRITERS: Mapping[str, Callable[[Table, Path], None]] = MappingProxyType(
    {"csv": write_csv, "parquet": write_parquet, "sav": write_sav, "json": write_json}
)


def _metadata(note: Note) -> dict[str, str]:
    held = {"description": note.text} if note.text else {}
    return {**held, "labels": json.dumps(dict(note.labels), ensure_ascii=False)} if note.labels else held


def _csv(frame: pd.DataFrame, file: Any) -> str | None:
    columns = {str(name): column for name, column in frame.items()}
    texts = [column for column in columns.values() if kind(column) in {"text", "mixed"}]
    times = {name: iso_times(column) for name, column in columns.items() if kind(column) == "time"}
    # A carriage return ends a line for most readers, but Python quotes only what ends its own lines.
    returns = any("\r" in value for column in texts for value in column.unique() if isinstance(value, str))
    returns = returns or any("\r" in name for name in columns)
    quoting: Any = csv.QUOTE_NONNUMERIC if returns else csv.QUOTE_MINIMAL
    written: str | None = frame.assign(**times).to_csv(file, index=False, lineterminator="\n", quoting=quoting)
    return written


def _json(table: Table) -> Iterator[str]:
    require_finite(table, "json")
    encode = json.JSONEncoder(ensure_ascii=False, check_circular=False).encode
    names, comma = list(table.columns), ""
    yield "["
    for begin in range(0, len(table.frame), _ROWS_AT_ONCE):
        block = [column.iloc[begin : begin + _ROWS_AT_ONCE] for column in table.columns.values()]
        rows = zip(*map(_json_values, block), strict=True)
        yield f"{comma}\n" + ",\n".join(encode(dict(zip(names, row, strict=True))) for row in rows)
        comma = ","
    yield "\n]\n"


def _json_values(column: pd.Series) -> list[Any]:
    return iso_times(column).tolist() if kind(column) == "time" else python_values(column)
