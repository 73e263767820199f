"""Printed numbers beside recomputed ones: whether they agree, or could, given how their inputs were rounded."""

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import pandas as pd

from evaluation.report.block import Block
from evaluation.report.section import NOTHING, Section
from evaluation.statistics.printed_tables import rounding

YES, ROUNDING, NO = "yes", "if unrounded", "no"
"""Whether a printed number is the recomputed one, rounded; could be, before its inputs were rounded; or cannot be."""

COLUMNS = ("quantity", "printed", "recomputed", "lowest", "highest", "agrees")
"""Columns of a frame of checks."""

HEADER = ("Number", "Agrees", "Printed", "Ours", "Unrounded")
"""Heads of a table of checks; the last column is left out where all inputs are exact."""

# Less than any digit that is printed, more than arithmetic loses.
_SLACK = 1e-9


class Check(NamedTuple):
    """A number that can be recomputed from what is printed.

    Attributes
    ----------
    quantity : str
        What it is.
    printed : str or None
        As it is printed; None if the paper does not print it.
    value : float
        Recomputed from the printed inputs.
    span : tuple of float, or None
        Lowest and highest value that inputs can have given before they were rounded; None if they are exact.
    digits : int or None
        Decimals to show; left out, two more than are printed, or none for whole numbers.
    """

    quantity: str
    printed: str | None
    value: float
    span: tuple[float, float] | None = None
    digits: int | None = None

    @property
    def agrees(self) -> str | None:
        """`YES`, `ROUNDING` or `NO`; None if nothing is printed."""
        if self.printed is None:
            return None
        printed, room = float(self.printed), rounding(self.printed) + _SLACK
        if abs(self.value - printed) <= room:
            return YES
        low, high = self.span or (self.value, self.value)
        return ROUNDING if low <= printed + room and high >= printed - room else NO

    def written(self, value: float) -> str:
        """Return a recomputed value with the digits to show."""
        digits = self.digits
        if digits is None:
            decimals = len((self.printed or "").partition(".")[2])
            digits = 0 if not decimals and abs(value - round(value)) < _SLACK else decimals + 2
        return f"{value:.{digits}f}"


def rows(checks: Sequence[Check]) -> tuple[tuple[str, ...], ...]:
    """Return the cells of a table of checks, under `HEADER`."""
    return tuple(
        (
            one.quantity,
            one.agrees or NOTHING,
            one.printed or NOTHING,
            one.written(one.value),
            NOTHING if one.span is None else f"{one.written(one.span[0])}–{one.written(one.span[1])}",
        )
        for one in checks
    )


def frame(checks: Sequence[Check]) -> pd.DataFrame:
    """Return checks with full digits; NaN where nothing is printed or the inputs are exact."""
    lines = [
        (
            one.quantity,
            None if one.printed is None else float(one.printed),
            one.value,
            *(one.span or (None, None)),
            one.agrees or "",
        )
        for one in checks
    ]
    table = pd.DataFrame(lines, columns=list(COLUMNS))
    numbers = list(COLUMNS[1:5])
    return table.astype(dict.fromkeys(numbers, float))


def check_block(name: str, title: str, checks: Sequence[Check], notes: Sequence[str] = ()) -> Block:
    """Return a block of one table of checks and its frame."""
    width = len(HEADER) - all(one.span is None for one in checks)
    lines = tuple(line[:width] for line in rows(checks))
    return Block((Section(name, title, HEADER[:width], 2, lines, tuple(notes)),), {name: frame(checks)})


def plain_block(
    name: str,
    title: str,
    header: Sequence[str],
    table: pd.DataFrame,
    *,
    text_columns: int = 1,
    digits: int | Sequence[int] = 2,
    notes: Sequence[str] = (),
) -> Block:
    """Return a block of one table that shows a frame as it is: texts first, then numbers.

    Parameters
    ----------
    name, title : str
        Of the section and the frame.
    header : sequence of str
        Heads of the columns.
    table : pandas.DataFrame
        The numbers, a column for each head.
    text_columns : int
        How many columns hold text.
    digits : int or sequence of int
        Decimals of all columns of numbers, or of each.
    notes : sequence of str
        Sentences under the table.
    """
    numbers = len(header) - text_columns
    places = [digits] * numbers if isinstance(digits, int) else list(digits)
    lines = tuple(
        (
            *map(str, line[:text_columns]),
            *(f"{value:.{k}f}" for value, k in zip(line[text_columns:], places, strict=True)),
        )
        for line in table.to_numpy(dtype=object).tolist()
    )
    return Block((Section(name, title, tuple(header), text_columns, lines, tuple(notes)),), {name: table})


def spanned(compute: Callable[..., float], *printed: str) -> tuple[float, float]:
    """Return the lowest and highest value of a function of printed numbers before they were rounded.

    Parameters
    ----------
    compute : callable
        Function of as many numbers as are printed, monotone in each.
    *printed : str
        Its arguments as they are printed.
    """
    ends = [(float(one) - rounding(one), float(one) + rounding(one)) for one in printed]
    values = [compute(*corner) for corner in itertools.product(*ends)]
    return min(values), max(values)


def share(count: int, number: int) -> float:
    """Return a count of a number in percent."""
    return 100 * count / number


def nearest_count(percent: str, number: int) -> int:
    """Return the count of `number` whose share comes nearest to a printed percentage."""
    return min(range(number + 1), key=lambda count: abs(share(count, number) - float(percent)))


def possible(percents: Sequence[str], number: int) -> bool:
    """Return whether each printed percentage is the rounded share of some count of `number`."""
    return all(
        abs(share(nearest_count(one, number), number) - float(one)) <= rounding(one) + _SLACK for one in percents
    )
