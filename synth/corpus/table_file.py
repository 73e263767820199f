"""CSV files whose faults are told by file, line and column."""

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from synth.errors import SpecError

# The characters of plain decimal numbers: without the words (nan, inf) and signs (_) that Python would also read.
_NUMBER = re.compile(r"[-+.0-9eE]+")


class Row:
    """One line of a table.

    Attributes
    ----------
    line : int
        Its number in the file, counted from 1.
    """

    def __init__(self, path: Path, line: int, cells: dict[str, str]) -> None:
        self.line = line
        self._path, self._cells = path, cells

    def text(self, column: str) -> str:
        """Return a cell without blanks around it; "" if there is no such column."""
        return self._cells.get(column, "").strip()

    def name(self, column: str) -> str:
        """Return a cell that must not be empty."""
        value = self.text(column)
        if not value:
            raise self.fault(column, "the cell is empty", "every row needs a value here")
        return value

    def number(self, column: str, *, largest: float = math.inf) -> float:
        """Return a cell that must be a finite number whose amount is at most ``largest``."""
        value = self.text(column)
        try:
            number = float(value) if _NUMBER.fullmatch(value) else math.nan
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            shown = value if len(value) <= 24 else value[:24] + "…"
            raise self.fault(column, f"{shown!r} is no number", "values are decimal numbers such as 120 or -3.5")
        if abs(number) > largest:
            raise self.fault(column, f"{value} is out of range", f"values go from {-largest:g} to {largest:g}")
        return number

    def fault(self, column: str, wrong: str, right: str) -> SpecError:
        """Return the error for a cell."""
        return SpecError(f"{self._path}, line {self.line}, column {column}: {wrong}; {right}.")


class TableFile:
    """A CSV file in UTF-8 with a header.

    Parameters
    ----------
    path : Path
        The file.

    Attributes
    ----------
    columns : tuple of str
        The header.

    Raises
    ------
    SpecError
        If it is not UTF-8 text, is empty, or its header has an empty or repeated name.
    OSError
        If it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            text = path.read_bytes().decode("utf-8-sig")
        except UnicodeDecodeError:
            raise SpecError(f"{path}: is not UTF-8 text; save the table as CSV in UTF-8.") from None
        self._reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        header = self._next()
        if header is None:
            raise SpecError(f"{path}, line 1: the file is empty; the first line must name the columns.")
        self.columns = tuple(name.strip() for name in header)
        for k, name in enumerate(self.columns):
            if not name:
                raise SpecError(f"{path}, line 1: column {k + 1} has no name; name each column.")
            if name in self.columns[:k]:
                raise SpecError(f"{path}, line 1, column {name}: the name comes twice; each column must have its own.")

    def require(self, names: Sequence[str]) -> None:
        """Raise if a column is missing."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise SpecError(f"{self._path}, line 1: the columns {', '.join(missing)} are missing; add them.")

    def rows(self) -> Iterator[Row]:
        """Yield the rows; empty lines are passed over."""
        while (cells := self._next()) is not None:
            line = self._reader.line_num
            if not any(cell.strip() for cell in cells):
                continue
            if len(cells) != len(self.columns):
                raise SpecError(
                    f"{self._path}, line {line}: has {len(cells)} cells; it must have {len(self.columns)}, as line 1."
                )
            yield Row(self._path, line, dict(zip(self.columns, cells, strict=True)))

    def _next(self) -> list[str] | None:
        try:
            return next(self._reader, None)
        except csv.Error as error:
            raise SpecError(
                f"{self._path}, line {self._reader.line_num}: is no CSV ({error}); quote cells with commas or quotes."
            ) from None
