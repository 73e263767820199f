"""CSV files with a header, and faults told by line and column."""

import csv
import io
import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from synth.errors import SpecError
from synth.files import read_text, shown

# Plain decimal numbers: without the words (nan, inf) and signs (_) that Python would also read.
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"\d{1,9}", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """A row of a file.

    Attributes
    ----------
    path : Path
        The file.
    line : int
        Its line, counted from 1.
    fields : mapping of str to str
        Text by column, without blanks around it.
    """

    path: Path
    line: int
    fields: Mapping[str, str]

    def fault(self, wrong: str, right: str, *, column: str = "") -> SpecError:
        """Return the error for this row, or for its field in a column that the file is known to have."""
        place = f"{self.path}, line {self.line}, column {column}" if column else f"{self.path}, line {self.line}"
        return SpecError(f"{place}: {wrong}; {right}.")

    def text(self, column: str) -> str:
        """Return a field; "" if there is no such column."""
        return self.fields.get(column, "")

    def name(self, column: str) -> str:
        """Return a field that must not be empty."""
        text = self.text(column)
        if not text:
            raise self.fault("the field is empty", "every line needs a value here", column=column)
        return text

    def whole(self, column: str) -> int:
        """Return a whole number, 0 or more."""
        text = self.text(column)
        if not _WHOLE.fullmatch(text):
            raise self.fault(f"the value is {shown(text)}", "it must be a whole number, 0 or more", column=column)
        return int(text)

    def number(self, column: str, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``, both finite."""
        text = self.text(column)
        if not _NUMBER.fullmatch(text) or not low <= float(text) <= high:
            right = f"it must be a number from {low:g} to {high:g}"
            raise self.fault(f"the value is {shown(text)}", right, column=column)
        return float(text)


@dataclass(frozen=True, slots=True, eq=False)
class Header:
    """The line that names a file's columns.

    Attributes
    ----------
    path : Path
        The file.
    line : int
        Its line, counted from 1.
    columns : tuple of str
        Names without blanks around them, no two alike. One of them may be empty.
    expected : str
        Which columns there must be, for messages.
    """

    path: Path
    line: int
    columns: tuple[str, ...]
    expected: str

    def fault(self, wrong: str, right: str = "") -> SpecError:
        """Return the error for this line; by default it is right to name the expected columns."""
        right = right or f"the first line must name the columns {self.expected}"
        return SpecError(f"{self.path}, line {self.line}: {wrong}; {right}.")

    def require(self, names: Sequence[str]) -> None:
        """Raise if a column is missing."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise self.fault(f"there is no column {', '.join(missing)}")

    def permit(self, names: Container[str]) -> None:
        """Raise if there is a column other than these."""
        for number, name in enumerate(self.columns, start=1):
            if not name:
                raise self.fault(f"column {number} has no name")
            if name not in names:
                raise self.fault(f"the column {shown(name)} is unknown")


def read_csv(path: Path, required: Sequence[str], *, expected: str = "") -> tuple[Header, list[Row]]:
    """Read a CSV file (UTF-8, comma) whose first line names its columns; empty lines mean nothing.

    Parameters
    ----------
    path : Path
        The file.
    required : sequence of str
        Columns that must be there; others may be, in any order.
    expected : str
        The columns that messages ask for, if not just the required ones.

    Returns
    -------
    header : Header
        The first line.
    rows : list of Row
        The others, at least one.

    Raises
    ------
    SpecError
        If the file is malformed; the message names the file and the line, and says what would be right.
    OSError
        If it cannot be read.
    """
    lines = _lines(path, read_text(path, "save the file as CSV in UTF-8"))
    line, names = next(lines, (1, []))
    header = Header(path, line, tuple(name.strip() for name in names), expected or ",".join(required))
    if not names:
        raise header.fault("the file is empty")
    header.require(required)
    twice = next((name for name in header.columns if header.columns.count(name) > 1), None)
    if twice is not None:
        raise header.fault(f"the column {shown(twice)} comes twice", "each column must have a name of its own")
    rows = []
    for number, fields in lines:
        if len(fields) != len(names):
            wrong = f"has {len(fields)} fields"
            raise Row(path, number, {}).fault(wrong, f"there must be {len(names)}, as in the first line")
        rows.append(Row(path, number, dict(zip(header.columns, map(str.strip, fields), strict=True))))
    if not rows:
        raise header.fault("nothing follows the first line", "at least one line of values must")
    return header, rows


def _lines(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of every line that is not empty."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for fields in reader:
            if any(field.strip() for field in fields):
                yield reader.line_num, fields
    except csv.Error as error:
        raise SpecError(
            f"{path}, line {reader.line_num}: is not CSV ({error}); fields are separated by commas, and those with "
            f"commas or quotes are quoted."
        ) from None
