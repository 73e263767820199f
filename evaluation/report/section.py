"""A table of a report with its cells written out, and the words in it."""

import unicodedata
from collections.abc import Mapping
from typing import NamedTuple

NOTHING = "–"
"""What stands where there is no value."""


class Section(NamedTuple):
    """One table of the report, its cells written out.

    Attributes
    ----------
    name : str
        Name for an anchor or a file.
    title : str
        Heading.
    header : tuple of str
        Heads of the columns; the first `text_columns` hold text, the others numbers.
    text_columns : int
        How many columns hold text.
    rows : tuple of tuple of str
        The cells.
    notes : tuple of str
        Sentences under the table.
    source : str
        Name of the frame that has the numbers with full digits, if it is not the section's.
    """

    name: str
    title: str
    header: tuple[str, ...]
    text_columns: int
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    source: str = ""

    @property
    def frame(self) -> str:
        """Name of the frame that has the numbers with full digits."""
        return self.source or self.name


def label(texts: object) -> str:
    """Return a text of the study in English, or else in its first language."""
    if not isinstance(texts, Mapping):
        return str(texts)
    return str(texts.get("en") or next(iter(texts.values())))


def lines(section: Section) -> list[str]:
    """Return a section as lines of aligned plain text."""
    aligned = _aligned(section) if section.rows else []
    return [section.title, "-" * _width(section.title), *aligned, *section.notes]


def _aligned(section: Section) -> list[str]:
    table = [section.header, *section.rows]
    widths = [max(_width(row[column]) for row in table) for column in range(len(section.header))]
    written = []
    for row in table:
        cells = []
        for column, cell in enumerate(row):
            space = " " * (widths[column] - _width(cell))
            cells.append(cell + space if column < section.text_columns else space + cell)
        written.append("  ".join(cells).rstrip())
    return written


def _width(text: str) -> int:
    # A Chinese character takes two columns of a terminal.
    return sum(2 if unicodedata.east_asian_width(character) in "WF" else 1 for character in text)
