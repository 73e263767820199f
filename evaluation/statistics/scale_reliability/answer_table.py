"""Answers of many people to the items of one scale."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array

# Squares of what is smaller, in units of the item that varies most, vanish.
_SMALLEST = 1e-140


class AnswerTable(NamedTuple):
    """Complete answers to items that vary.

    Attributes
    ----------
    names : tuple of str
        Names of the items.
    mean : numpy.ndarray, shape (items,)
        Mean of each item.
    differences : numpy.ndarray, shape (rows, items)
        Answers less their mean, over `unit`.
    unit : float
        Largest difference from a mean, in the units of the answers.
    left_out : int
        Rows that lacked an answer.
    """

    names: tuple[str, ...]
    mean: FloatArray
    differences: FloatArray
    unit: float
    left_out: int

    @property
    def rows(self) -> int:
        """Number of complete rows."""
        return len(self.differences)

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of each item (n - 1), over `unit`."""
        # Over the largest first, so that squares of an item in very small units do not vanish.
        largest = np.abs(self.differences).max(axis=0)
        deviations: FloatArray = largest * np.sqrt(((self.differences / largest) ** 2).sum(axis=0) / (self.rows - 1))
        return deviations

    @property
    def standardized(self) -> FloatArray:
        """Answers with mean 0 and standard deviation 1 (n - 1), shape (rows, items)."""
        return self.differences / self.deviations

    @property
    def correlations(self) -> FloatArray:
        """Correlations of the items, shape (items, items)."""
        scaled = self.standardized
        between: FloatArray = np.clip(scaled.T @ scaled / (self.rows - 1), -1, 1)
        np.fill_diagonal(between, 1)
        return between

    @property
    def flags(self) -> tuple[str, ...]:
        """Sentence about rows left out, if there are any."""
        if not self.left_out:
            return ()
        return (f"Left out, lacking an answer: {self.left_out} of {self.left_out + self.rows} rows.",)


def answer_table(
    answers: npt.ArrayLike | pd.DataFrame, *, names: Sequence[str] | None = None, for_factor: bool = False
) -> AnswerTable:
    """Return the complete rows of a table of answers.

    Parameters
    ----------
    answers : array_like or pandas.DataFrame, shape (rows, items)
        Answers keyed in one direction; NaN where one is missing.
    names : sequence of str, optional
        Names of the items; the columns of a frame or else ``item 1``, ``item 2`` ... without it.
    for_factor : bool
        Whether a factor is to be found, which needs more complete rows than items; else three are enough.

    Returns
    -------
    AnswerTable
        The complete rows about their means.

    Raises
    ------
    DataError
        If the answers are no table of numbers, one is infinite, or the names do not fit.
    InsufficientDataError
        If there are fewer than two items or too few complete rows, or an item does not vary.
    """
    try:
        table = np.asarray(answers, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("answers: these values are not all numbers, or the rows differ in length.") from error
    if table.ndim != 2:
        raise DataError(f"answers has the shape {table.shape}, but must have rows x items.")
    known = _names(answers, names, table.shape[1])
    complete = ~np.isnan(table).any(axis=1)
    values = finite_array(table[complete], axes=("rows", "items"), name="answers")
    if table.shape[1] < 2:
        raise InsufficientDataError(f"A scale needs at least 2 items; there {_are(table.shape[1])}.")
    least_rows = max(3, table.shape[1] + 1) if for_factor else 3
    if len(values) < least_rows:
        raise InsufficientDataError(f"At least {least_rows} complete rows are needed; there {_are(len(values))}.")
    mean, differences = centred_columns(values)
    constant = np.flatnonzero(constant_columns(values, differences))
    if constant.size:
        listed = ", ".join(known[place] for place in constant)
        raise InsufficientDataError(f"Items with the same answer throughout must be left out first: {listed}.")
    unit = float(np.abs(differences).max())
    lost = np.flatnonzero(np.abs(differences).max(axis=0) / unit < _SMALLEST)
    if lost.size:
        listed = ", ".join(known[place] for place in lost)
        raise DataError(
            f"Items that vary so much less than others cannot be reckoned with; use like units for {listed}."
        )
    return AnswerTable(known, mean, differences / unit, unit, int((~complete).sum()))


def _names(answers: object, names: Sequence[str] | None, items: int) -> tuple[str, ...]:
    if names is None and isinstance(answers, pd.DataFrame):
        return tuple(str(column) for column in answers.columns)
    known = tuple(names) if names is not None else tuple(f"item {place}" for place in range(1, items + 1))
    if len(known) != items:
        raise DataError(f"The answers have {items} items, but {len(known)} names.")
    return known


def _are(number: int) -> str:
    return "is 1" if number == 1 else f"are {number}"
