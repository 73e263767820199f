"""CSV files with a header, and faults told by their line."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from synth.errors import SpecError

# Plain decimal numbers: without the words (nan, inf) and signs (_) that Python would also read.
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"\d{1,9}", re.ASCII)


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a file.

    Attributes
    ----------
    path : Path
        The file.
    line : int
        Its line.
    fields : dict of str to str
        Text by column, without blanks around it.
    """

    path: Path
    line: int
    fields: dict[str, str]

    def fault(self, wrong: str, right: str) -> SpecError:
        """Return the error for this row."""
        return SpecError(f"{self.path}, line {self.line}: {wrong}; {right}.")

    def whole(self, column: str) -> int:
        """Return a whole number, 0 or more."""
        text = self.fields[column]
        if not _WHOLE.fullmatch(text):
            raise self.fault(f"{column} is {shown(text)}", "it must be a whole number, 0 or more")
        return int(text)

    def number(self, column: str, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``."""
        text = self.fields[column]
        if not _NUMBER.fullmatch(text) or not low <= float(text) <= high:
            raise self.fault(f"{column} is {shown(text)}", f"it must be a number from {low:g} to {high:g}")
        return float(text)


def shown(text: str) -> str:
    """Return a field for a message: quoted, and not longer than a line bears."""
    return repr(text if len(text) <= 24 else text[:24] + "…")


def read_rows(
    path: Path, required: Sequence[str], *, what: str, usual: Sequence[str] = ()
) -> tuple[tuple[str, ...], list[Row]]:
    """Read a CSV file (UTF-8, comma) whose first line names its columns.

    Parameters
    ----------
    path : Path
        The file.
    required : sequence of str
        Columns that must be there; others may be, in any order.
    what : str
        What a row is, for messages.
    usual : sequence of str
        The columns that messages ask for, if not the required ones.

    Returns
    -------
    columns : tuple of str
        All columns.
    rows : list of Row
        At least one; empty lines mean nothing.

    Raises
    ------
    SpecError
        If the file is malformed.
    OSError
        If it cannot be read.
    """
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecError(f"{path}, line {line}: is not UTF-8 text; save the file as CSV in UTF-8.") from None
    lines = _lines(path, text)
    expected = f"the first line must name the columns {','.join(usual or required)}"
    line, header = next(lines, (1, []))
    columns = tuple(name.strip() for name in header)
    if not columns:
        raise SpecError(f"{path}, line 1: the file is empty; {expected}.")
    lacking = [name for name in required if name not in columns]
    if lacking:
        raise SpecError(f"{path}, line {line}: there is no column {', '.join(lacking)}; {expected}.")
    twice = next((name for name in columns if columns.count(name) > 1), None)
    if twice is not None:
        raise SpecError(f"{path}, line {line}: the column {shown(twice)} comes twice; {expected}.")
    rows = []
    for number, fields in lines:
        if len(fields) != len(columns):
            raise SpecError(
                f"{path}, line {number}: has {len(fields)} fields; there must be {len(columns)}, as in the first line."
            )
        rows.append(Row(path, number, {name: field.strip() for name, field in zip(columns, fields, strict=True)}))
    if not rows:
        raise SpecError(f"{path}, line {line}: nothing follows the first line; a line for each {what} must.")
    return columns, rows


def _lines(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of every line that is not empty."""
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for fields in reader:
            if any(field.strip() for field in fields):
                yield reader.line_num, fields
    except csv.Error as error:
        raise SpecError(
            f"{path}, line {max(reader.line_num, 1)}: is not CSV ({error}); fields are separated by commas."
        ) from None
