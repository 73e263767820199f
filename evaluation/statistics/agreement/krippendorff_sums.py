"""What alpha needs to know of each item: sums from which disagreements follow for any weights of the items."""

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import sparse

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import ratings_table

_CHUNK = 65536
"""Ratings looked at together: half a megabyte, which stays in the processor's cache."""

_CANCELLED = 1e-3
"""Sums of squares less than this share of what they were subtracted from are computed anew with more care."""

_DENSE = 4_000_000
_MOST_RATIO_VALUES = 5000


class UnitMoments(NamedTuple):
    """Moments of each item's ratings.

    Attributes
    ----------
    sizes : numpy.ndarray, shape (items,)
        Number of ratings.
    mean : numpy.ndarray, shape (items,)
        Their mean, from a common origin near all of them; 0 where there are none.
    squares : numpy.ndarray, shape (items,)
        Sum of their squared differences from their mean.
    unit : float
        What mean and differences are measured in, in units of the ratings.
    """

    sizes: FloatArray
    mean: FloatArray
    squares: FloatArray
    unit: float = 1.0


class Disagreement(ABC):
    """Observed and expected disagreement of items that count any number of times.

    Attributes
    ----------
    unit : float
        What differences are measured in, in units of the ratings: disagreements are in its square.
    """

    unit = 1.0

    @abstractmethod
    def of(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both disagreements for each row of weights.

        Parameters
        ----------
        weights : numpy.ndarray, shape (samples, items)
            How often each item counts in each sample: whole numbers.

        Returns
        -------
        tuple of numpy.ndarray, both of shape (samples,)
            D_o and D_e of Krippendorff (2011).
        """


class IntervalDisagreement(Disagreement):
    """Of numbers whose differences count: the sums of squares within items and over all give both in closed form.

    The squared differences of each two of m numbers add up to 2 m times their sum of squares about the mean.
    """

    def __init__(self, moments: UnitMoments) -> None:
        self.unit = moments.unit
        sizes, squares = moments.sizes, moments.squares
        means = moments.mean - float(sizes @ moments.mean) / float(sizes.sum())
        within = 2 * squares * sizes / (sizes - 1)
        self._sums = np.stack([sizes, within, squares + sizes * means**2, sizes * means], axis=1)

    def of(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both disagreements for each row of weights."""
        n, within, squares, total = (weights @ self._sums).T
        return within / n, 2 * np.maximum(squares - total**2 / n, 0) / (n - 1)


class NominalDisagreement(Disagreement):
    """Of labels, which are the same or not."""

    def __init__(self, counts: sparse.csr_array) -> None:
        self._counts = counts
        self._each = _sum_rows(counts)
        self._observed = (self._each**2 - _sum_rows(counts.power(2))) / (self._each - 1)

    def of(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both disagreements for each row of weights."""
        n = weights @ self._each
        totals = weights @ self._counts
        return weights @ self._observed / n, (n**2 - (totals**2).sum(axis=1)) / (n * (n - 1))


class OrdinalDisagreement(Disagreement):
    """Of ranks: the ordinal difference is that of the values' mean ranks in the sample, to be squared."""

    def __init__(self, counts: sparse.csr_array) -> None:
        self._counts = counts
        self._each = _sum_rows(counts)

    def of(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both disagreements for each row of weights."""
        n = weights @ self._each
        totals = weights @ self._counts
        ranks = np.cumsum(totals, axis=1) - (totals + n[:, None]) / 2
        sums, squares = self._counts @ ranks.T, self._counts @ (ranks**2).T
        within = 2 * (self._each[:, None] * squares - sums**2) / (self._each - 1)[:, None]
        expected = 2 * (totals * ranks**2).sum(axis=1) / (n - 1)
        return np.maximum(np.einsum("si,is->s", weights, within), 0) / n, expected


class RatioDisagreement(Disagreement):
    """Of amounts: the difference as a share of the sum, squared."""

    def __init__(self, counts: sparse.csr_array, values: FloatArray) -> None:
        if values.size > _MOST_RATIO_VALUES:
            raise DataError(
                f"There are {values.size} different ratings; alpha at the ratio level compares each two of them, and "
                f"can do so for {_MOST_RATIO_VALUES} at most. Round them first."
            )
        if values[0] < 0:
            raise DataError(f"The ratio level needs ratings of 0 or above; the smallest is {values[0]:g}.")
        self._counts = counts
        self._each = _sum_rows(counts)
        largest = values[-1]
        scaled = values / largest
        sums = scaled[:, None] + scaled
        sums[sums == 0] = 1
        self._metric = ((scaled[:, None] - scaled) / sums) ** 2
        self._observed = _sum_rows(counts.multiply(counts @ self._metric).tocsr()) / (self._each - 1)

    def of(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both disagreements for each row of weights."""
        n = weights @ self._each
        totals = weights @ self._counts
        expected = np.einsum("sv,sv->s", totals @ self._metric, totals)
        return weights @ self._observed / n, expected / (n * (n - 1))


def unit_moments(table: FloatArray) -> UnitMoments:
    """Return number, mean and sum of squares of each item's ratings.

    Parameters
    ----------
    table : numpy.ndarray, shape (items, raters)
        Ratings; NaN where there is none.

    Returns
    -------
    UnitMoments
        The moments.

    Raises
    ------
    DataError
        If a rating is infinite or beyond 1e140.

    Notes
    -----
    One pass of plain sums is enough for most ratings. Where a sum of squares is small beside the squares themselves, it
    would lose digits, and is computed from the differences from the items' means instead.
    """
    count, total, squares = _plain_sums(table)
    largest = squares.max(initial=0)
    if np.isfinite(largest) and 1e-200 < largest < 1e200:
        mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
        within = np.maximum(squares - total * mean, 0)
        pairable = count > 1
        if within[pairable].sum() > _CANCELLED * squares[pairable].sum():
            return UnitMoments(count, mean, within)
    return _careful_moments(table)


def _plain_sums(table: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return number, sum and sum of squares of each item's ratings, in blocks of whichever axis lies together."""
    by_item = table.flags.c_contiguous or not table.flags.f_contiguous
    lines = table if by_item else table.T
    rows = max(1, _CHUNK // lines.shape[1])
    if not by_item:
        # What is missing is counted in bytes.
        rows = min(rows, 255)
    count, total, squares = np.zeros((3, len(table)))
    buffers = np.empty((rows, lines.shape[1])), np.empty((rows, lines.shape[1]), dtype=bool)
    complete = True
    with np.errstate(all="ignore"):
        for start in range(0, len(lines), rows):
            block = np.ascontiguousarray(lines[start : start + rows])
            items = slice(start, start + rows) if by_item else slice(None)
            if complete:
                sums, gaps = _block_sums(block, by_item=by_item), np.zeros(1)
                complete = bool(np.isfinite(sums[0]).all())
            if not complete:
                sums, gaps = _block_with_gaps(block, buffers, by_item=by_item)
            count[items] += block.shape[1 if by_item else 0] - gaps
            total[items] += sums[0]
            squares[items] += sums[1]
    return count, total, squares


def _block_sums(block: FloatArray, *, by_item: bool) -> tuple[FloatArray, FloatArray]:
    if by_item:
        return block @ np.ones(block.shape[1]), np.vecdot(block, block)
    return np.ones(len(block)) @ block, np.einsum("ri,ri->i", block, block)


def _block_with_gaps(
    block: FloatArray, buffers: tuple[FloatArray, npt.NDArray[np.bool_]], *, by_item: bool
) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
    """Return the sums of a block in which ratings are missing, and how many are.

    The smallest rating stands in for missing ones, and is taken out of the sums again: filling by a mask takes many
    times as long.
    """
    low = np.nan_to_num(np.fmin.reduce(block, axis=None))
    missing = np.isnan(block, out=buffers[1][: len(block)])
    total, squares = _block_sums(np.fmax(block, low, out=buffers[0][: len(block)]), by_item=by_item)
    if by_item:
        # Bits are counted eight bytes at a time, faster than adding up booleans.
        bits = missing.view(np.uint64) if missing.shape[1] % 8 == 0 else np.packbits(missing, axis=1)
        gaps = np.bitwise_count(bits).sum(axis=1, dtype=float)
    else:
        gaps = missing.view(np.uint8).sum(axis=0, dtype=np.uint8).astype(float)
    return (total - gaps * low, squares - gaps * low**2), gaps


def _careful_moments(table: FloatArray) -> UnitMoments:
    shifted, given = ratings_table(table)
    count = given.sum(axis=1).astype(float)
    if given.any():
        shifted -= table[given][0]
    shifted[~given] = 0
    divisor = np.maximum(count, 1)
    mean = shifted.sum(axis=1) / divisor
    differences = np.where(given, shifted - mean[:, None], 0)
    correction = differences.sum(axis=1) / divisor
    differences = np.where(given, differences - correction[:, None], 0)
    # Alpha does not depend on the unit, and squares of very small numbers would vanish.
    unit = max(float(np.abs(differences).max(initial=0)), float(np.abs(mean).max(initial=0))) or 1.0
    differences /= unit
    return UnitMoments(count, (mean + correction) / unit, np.vecdot(differences, differences), unit)


def value_counts(table: FloatArray) -> tuple[sparse.csr_array, FloatArray]:
    """Return how often each item got each value.

    Parameters
    ----------
    table : numpy.ndarray, shape (items, raters)
        Ratings; NaN where there is none.

    Returns
    -------
    tuple of scipy.sparse.csr_array, shape (items, values), and numpy.ndarray, shape (values,)
        The counts, and the values that occur, from small to large.

    Raises
    ------
    DataError
        If a rating is infinite or beyond 1e140.
    """
    with np.errstate(invalid="ignore"):
        low, high = float(np.fmin.reduce(table, axis=None)), float(np.fmax.reduce(table, axis=None))
    for steps in (1, 16):
        width = (high - low) * steps + 2
        if abs(low) < 2**30 and width * len(table) <= _DENSE:
            found = _whole_steps(table, low, steps, int(width))
            if found is not None:
                return found
    ratings, given = ratings_table(table)
    rows = np.broadcast_to(np.arange(len(table))[:, None], given.shape)[given]
    values, codes = np.unique(ratings[given], return_inverse=True)
    entries = sparse.coo_array((np.ones(rows.size), (rows, codes)), shape=(len(table), values.size))
    return entries.tocsr(), values


def _whole_steps(table: FloatArray, low: float, steps: int, width: int) -> tuple[sparse.csr_array, FloatArray] | None:
    """Return the counts if all ratings are whole steps above the lowest, without sorting them; else None."""
    items, raters = table.shape
    counts = np.zeros((items, width), dtype=np.intp)
    rows = max(1, _CHUNK // raters)
    # A step below the lowest rating stands in for a missing one.
    below = low - 1 / steps
    for start in range(0, items, rows):
        block = np.fmax(table[start : start + rows], below)
        scaled = (block - below) * steps
        codes = scaled.astype(np.intp)
        if (codes != scaled).any() or (below + codes / steps != block).any():
            return None
        codes += width * np.arange(len(block))[:, None]
        counts[start : start + rows] = np.bincount(codes.ravel(), minlength=len(block) * width).reshape(-1, width)
    occurring = np.flatnonzero(counts[:, 1:].any(axis=0))
    return sparse.csr_array(counts[:, 1 + occurring].astype(float)), low + occurring / steps


def pairable(counts: sparse.csr_array, values: FloatArray) -> tuple[npt.NDArray[np.intp], sparse.csr_array, FloatArray]:
    """Return which items have two values or more, and the counts and the values of these alone."""
    kept = np.flatnonzero(_sum_rows(counts) > 1)
    rows = counts[kept]
    occurring = np.flatnonzero(np.asarray(rows.sum(axis=0)).ravel())
    return kept, rows[:, occurring], values[occurring]


def _sum_rows(counts: sparse.csr_array) -> FloatArray:
    sums: FloatArray = np.asarray(counts.sum(axis=1), dtype=float).ravel()
    return sums
