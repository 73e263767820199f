"""Tables as a workbook of Excel (``.xlsx``): a sheet for each, in which no text is ever a formula."""

import re
import shutil
import zipfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd
from openpyxl import Workbook
from openpyxl.cell import WriteOnlyCell
from openpyxl.cell.cell import ERROR_CODES
from openpyxl.writer.excel import ExcelWriter

from evaluation.errors import DataError
from evaluation.report.typed_columns import EXACT, Table, cut, distinct, kind, python_values, require_finite

# Limits of the format (Microsoft, Excel specifications and limits).
ROWS = 1_048_576
COLUMNS = 16_384
TEXT_CHARACTERS = 32_767
SHEET_CHARACTERS = 31

# The earliest time that a zip archive can hold.
_MADE = datetime(1980, 1, 1, tzinfo=UTC).replace(tzinfo=None)
# What XML 1.0 cannot hold: control characters but tab and line feed, halves of surrogate pairs, U+FFFE and U+FFFF. A
# carriage return would come back as a line feed, so it is made one.
_NOT_IN_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_LIKE_A_FORMULA = ("=", "+", "-", "@")


def check_size(tables: Sequence[Table]) -> None:
    """Raise DataError if a table does not fit on a sheet: 1,048,576 rows with the header, 16,384 columns."""
    for table in tables:
        rows, columns = table.frame.shape
        if rows >= ROWS:
            raise DataError(
                f"The table {table.name} has {rows:,} rows, but a sheet of xlsx holds {ROWS:,} with the header; use "
                f"csv, parquet, sav or json."
            )
        if columns > COLUMNS:
            raise DataError(
                f"The table {table.name} has {columns:,} columns, but a sheet of xlsx holds {COLUMNS:,}; use csv, "
                f"parquet, sav or json."
            )


def write_xlsx(tables: Sequence[Table], path: Path) -> None:
    """Write tables as one workbook with a sheet for each, whose header stays when one scrolls.

    Texts are texts, also those that begin with ``=``, ``+``, ``-`` or ``@``; control characters that XML cannot hold
    are left out, and texts of more than 32,767 characters, Excel's limit, are cut and end with ``…``. Times are in UTC.
    Whole numbers beyond 2^53 are texts, since Excel would round them. The file is the same for the same tables.

    Raises
    ------
    DataError
        If a table does not fit on a sheet, or holds an infinite number.
    """
    check_size(tables)
    for table in tables:
        require_finite(table, "xlsx")
    book = Workbook(write_only=True)
    titles = distinct(
        {table.name: _title(table.name) for table in tables}, lambda name, room: name[: SHEET_CHARACTERS - room]
    )
    for table in tables:
        sheet = book.create_sheet(titles[table.name])
        sheet.freeze_panes = "A2"
        sheet.append([_text(sheet, name) for name in table.columns])
        for row in zip(*(_cells(sheet, column) for column in table.columns.values()), strict=True):
            sheet.append(row)
    book.properties.creator = "padlab"
    book.properties.created = book.properties.modified = _MADE
    with _Archive(path, "w", zipfile.ZIP_DEFLATED) as archive:
        ExcelWriter(book, archive).save()


class _Archive(zipfile.ZipFile):
    """An archive whose members all have the same time, so that equal tables give equal files."""

    def writestr(self, zinfo_or_arcname: Any, data: Any, *args: Any, **options: Any) -> None:
        super().writestr(self._member(str(zinfo_or_arcname)), data, *args, **options)

    def write(self, filename: Any, arcname: Any = None, *args: Any, **options: Any) -> None:
        with Path(filename).open("rb") as source, self.open(self._member(str(arcname)), "w", force_zip64=True) as out:
            shutil.copyfileobj(source, out)

    def _member(self, name: str) -> zipfile.ZipInfo:
        member = zipfile.ZipInfo(name, _MADE.timetuple()[:6])
        member.compress_type = self.compression
        return member


def _cells(sheet: Any, column: pd.Series) -> list[Any]:
    what = kind(column)
    if what == "time":
        return python_values(column.dt.tz_localize(None))
    values = python_values(column)
    if what in {"boolean", "number"}:
        return values
    return [_cell(sheet, value) for value in values]


def _cell(sheet: Any, value: Any) -> Any:
    if isinstance(value, str):
        return _text(sheet, value)
    if isinstance(value, int) and abs(value) > EXACT:
        return _text(sheet, str(value))
    return value


def _text(sheet: Any, text: str) -> Any:
    text = _NOT_IN_XML.sub("", text.replace("\r\n", "\n").replace("\r", "\n"))
    # Excel counts units of UTF-16, of two bytes.
    text = cut(text, 2 * TEXT_CHARACTERS, "utf-16-le") if len(text) > TEXT_CHARACTERS // 2 else text
    if not text.startswith(_LIKE_A_FORMULA) and text not in ERROR_CODES:
        return text
    cell = WriteOnlyCell(sheet, text)
    cell.data_type = "s"
    # Excel's own mark of a text: it stays one when somebody edits the cell.
    cell.quotePrefix = True
    return cell


def _title(name: str) -> str:
    return re.sub(r"[\[\]:*?/\\']", "_", name) or "table"
