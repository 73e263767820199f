"""Comparison of two divisions of the same things into categories, such as clusters and labels."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import optimize, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.label_codes import level_codes
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class Contingency(Result):
    """A contingency table and how strongly its rows and columns belong together.

    Attributes
    ----------
    counts : tuple of tuple of int
        The table, row by row.
    row_names, column_names : tuple of str
        Names of the rows (for instance clusters) and columns (for instance intended emotions).
    chi2 : float
        Pearson's chi-square of independence, without continuity correction.
    df : int
        Its degrees of freedom; rows and columns without counts do not count.
    p : float
        Probability of a chi-square at least as large if rows and columns were independent.
    smallest_expected : float
        Smallest count expected under independence; p is an approximation that is good when this is about 5 or more.
    cramers_v : float
        Cramer's V, 0 to 1.
    purity : float
        Share of the things that belong to the most frequent column of their row.
    matching : tuple of tuple of str
        The pairs (row, column), each row and column in at most one, that hold the most things together.
    share_matched : float
        Share of the things in the cells of `matching`.
    """

    counts: tuple[tuple[int, ...], ...]
    row_names: tuple[str, ...]
    column_names: tuple[str, ...]
    chi2: float
    df: int
    p: float
    smallest_expected: float
    cramers_v: float
    purity: float
    matching: tuple[tuple[str, str], ...]
    share_matched: float

    @property
    def row_sums(self) -> tuple[int, ...]:
        """Sum of each row."""
        return tuple(sum(row) for row in self.counts)

    @property
    def column_sums(self) -> tuple[int, ...]:
        """Sum of each column."""
        return tuple(sum(column) for column in zip(*self.counts, strict=True))

    @property
    def total(self) -> int:
        """Number of things."""
        return sum(self.row_sums)

    def apa(self) -> str:
        """Return the result in APA style, for instance ``χ²(36, N = 213) = 505.54, p < .001, V = .63, purity = .62``.

        Where a cell's expected count is below 5 the sentence says so.
        """
        test = f"χ²({self.df}, N = {self.total}) = {wording.number(self.chi2)}, {wording.p_value(self.p)}"
        text = f"{test}, V = {wording.share(self.cramers_v)}, purity = {wording.share(self.purity)}"
        if self.smallest_expected >= 5:
            return text
        return f"{text} (smallest expected count {wording.number(self.smallest_expected)}: p is approximate)"

    def to_frame(self) -> pd.DataFrame:
        """Return the table with a last row and column of sums, named "sum"."""
        frame = pd.DataFrame(self.counts, index=list(self.row_names), columns=list(self.column_names))
        frame["sum"] = frame.sum(axis=1)
        frame.loc["sum"] = frame.sum(axis=0)
        return frame


def contingency(rows: Sequence[Hashable], columns: Sequence[Hashable]) -> Contingency:
    """Count how often two divisions of the same things go together, and test whether they are independent.

    Parameters
    ----------
    rows, columns : sequence, length n
        Category of each thing in the one and the other division, for instance its cluster and its intended emotion.
        Rows and columns of the table are in the order of the sorted categories if they can be sorted, and otherwise in
        the order in which they first appear.

    Returns
    -------
    Contingency
        As `contingency_of_counts`.

    Raises
    ------
    DataError
        If the two differ in length or a category is missing (None or NaN).
    InsufficientDataError
        If either division has fewer than two categories.
    """
    if len(rows) != len(columns):
        raise DataError(f"There are {len(rows)} row and {len(columns)} column categories; each thing needs both.")
    row_places, row_kinds = _places(rows, "rows")
    column_places, column_kinds = _places(columns, "columns")
    counts = np.zeros((len(row_kinds), len(column_kinds)), dtype=int)
    np.add.at(counts, (row_places, column_places), 1)
    return contingency_of_counts(counts, row_names=row_kinds, column_names=column_kinds)


def contingency_of_counts(
    counts: npt.ArrayLike, *, row_names: Sequence[str] | None = None, column_names: Sequence[str] | None = None
) -> Contingency:
    """Test a table of counts for independence, and describe how rows and columns go together.

    Parameters
    ----------
    counts : array_like, shape (r, c)
        Whole numbers, 0 or more.
    row_names, column_names : sequence of str, optional
        Their names; left out, "1", "2" and so on.

    Returns
    -------
    Contingency
        The table, chi-square, Cramer's V, purity of the rows and the best matching.

    Raises
    ------
    DataError
        If the counts are no table of whole numbers of 0 or more, or the names do not fit or are not unique.
    InsufficientDataError
        If fewer than two rows or two columns have counts.

    References
    ----------
    Pearson (1900), Phil. Mag. 50:157. Cramer (1946), Mathematical Methods of Statistics, section 21.9. Purity: Manning,
    Raghavan and Schuetze (2008), Introduction to Information Retrieval, section 16.3. Matching: Kuhn (1955), Naval Res.
    Logist. Q. 2:83. Zhang et al. (2007), Table 4, compare clusters of PEP with intended emotions.
    """
    table = finite_array(counts, axes=("rows", "columns"), name="counts")
    if (table < 0).any() or (table != np.round(table)).any():
        raise DataError("The counts must be whole numbers of 0 or more.")
    names_of_rows = _names(row_names, table.shape[0], "rows")
    names_of_columns = _names(column_names, table.shape[1], "columns")
    filled = table[table.sum(axis=1) > 0][:, table.sum(axis=0) > 0]
    if min(filled.shape) < 2:
        raise InsufficientDataError(
            f"The table has counts in {filled.shape[0]} rows and {filled.shape[1]} columns; it needs two of each."
        )
    test = stats.chi2_contingency(filled, correction=False)
    total = float(table.sum())
    row_places, column_places = optimize.linear_sum_assignment(table, maximize=True)
    return Contingency(
        counts=tuple(tuple(int(count) for count in row) for row in table),
        row_names=names_of_rows,
        column_names=names_of_columns,
        chi2=float(test.statistic),
        df=int(test.dof),
        p=float(test.pvalue),
        smallest_expected=float(test.expected_freq.min()),
        cramers_v=min(1.0, math.sqrt(float(test.statistic) / (total * (min(filled.shape) - 1)))),
        purity=float(table.max(axis=1).sum()) / total,
        matching=tuple((names_of_rows[i], names_of_columns[j]) for i, j in zip(row_places, column_places, strict=True)),
        share_matched=float(table[row_places, column_places].sum()) / total,
    )


def _places(labels: Sequence[Hashable], name: str) -> tuple[npt.NDArray[np.intp], tuple[str, ...]]:
    places, kinds = level_codes(labels, name=name, unused=False)
    order: list[int] = list(range(len(kinds)))
    try:
        order.sort(key=lambda place: kinds[place])
    except TypeError:
        # Categories of different types have no order, and keep that of their appearance.
        order = list(range(len(kinds)))
    rank = np.empty(len(kinds), dtype=np.intp)
    rank[order] = np.arange(len(kinds))
    return rank[places], tuple(str(kinds[place]) for place in order)


def _names(names: Sequence[str] | None, number: int, what: str) -> tuple[str, ...]:
    result = tuple(names) if names is not None else tuple(str(k + 1) for k in range(number))
    if len(result) != number:
        raise DataError(f"There are {number} {what}, but {len(result)} names.")
    if len(set(result)) != number:
        raise DataError(f"The names of the {what} must differ from each other.")
    return result
