"""Pearson's correlation of each two columns of a table with gaps, by products of masked matrices."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from evaluation.statistics.arrays import FloatArray, centred, finite_vector, is_constant

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
# Single or double precision, the two that matrix products are quick for.
_Floats = npt.NDArray[np.floating[Any]]

# Two columns correlate if they have so many rows in common.
FEWEST_COMMON = 3

# So many columns are multiplied at once, which bounds the memory; so many rows of the products are then worked on at
# once, which stay in the processor's cache.
_TILE, _ROWS = 1024, 32

# Whole numbers up to here are exact.
_EXACT_SINGLE, _EXACT_DOUBLE = 2**24, 2**53

# Fourth powers of larger numbers, or of the inverse, might overflow or vanish when they are summed and multiplied.
_MODERATE = 1e60

# A column whose differences are so small beside its values may be constant but for rounding.
_SUSPICIOUS = 1e-10

# Where columns vary on the common rows by less than this share of their mean squares there (both shares multiplied),
# differences of sums lose digits, and the pair is worked out by itself.
_ILL_SPREAD = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Block:
    """Correlations of some columns (`rows`) with some (`columns`) of those that vary.

    Attributes
    ----------
    rows, columns : slice
        Which of the columns that vary.
    correlations, common : numpy.ndarray, shape (rows, columns)
        Correlations and numbers of common items; a correlation is 0 unless `used`.
    used : numpy.ndarray of bool, shape (rows, columns)
        True for a pair that has a correlation; each pair is in one block only.
    few, constant : int
        Pairs without one: too few common items, or a side that does not vary on them.
    """

    rows: slice
    columns: slice
    correlations: FloatArray
    common: _Floats
    used: BoolArray
    few: int
    constant: int


@dataclass(frozen=True, kw_only=True, eq=False)
class MaskedRatings:
    """Ratings with gaps, ready for products.

    Attributes
    ----------
    varying : numpy.ndarray of bool, shape (raters,)
        Which raters gave two different ratings; the others are left out of all that follows.
    ratings : numpy.ndarray, shape (items, varying raters)
        Ratings as they were given, 0 where there is none.
    given : numpy.ndarray of bool, shape (items, varying raters)
        Where there is a rating.
    counter : numpy.ndarray, shape (items, varying raters)
        The same as 0 and 1 in single precision.
    differences : numpy.ndarray, shape (items, varying raters)
        Ratings shifted and scaled by rater, which changes no correlation; single precision where sums of squares stay
        exact in it.
    exact : bool
        Whether all are whole numbers so small that sums of their products are exact.
    """

    varying: BoolArray
    ratings: FloatArray
    given: BoolArray
    counter: npt.NDArray[np.float32]
    differences: _Floats
    exact: bool

    @classmethod
    def of(cls, table: FloatArray) -> "MaskedRatings":
        """Prepare ratings of shape (items, raters), NaN where there is none; not empty.

        Raises
        ------
        DataError
            If a rating is infinite or beyond 1e140.
        """
        given = ~np.isnan(table)
        ratings = np.where(given, table, 0)
        sizes = np.maximum(ratings.max(axis=0), -ratings.min(axis=0))
        finite_vector(sizes, name="ratings")
        counter = given.astype(np.float32)
        whole = sizes.max() < _EXACT_DOUBLE / len(ratings) and _whole(ratings)
        # Sums in single precision are exact for so many 0 and 1 as fit into memory.
        means = ratings.sum(axis=0) / np.maximum(counter.sum(axis=0), 1)
        differences = ratings - (np.rint(means) if whole else means)
        differences *= given
        largest = np.maximum(differences.max(axis=0), -differences.min(axis=0))
        varying = largest > 0
        for column in np.flatnonzero(largest <= _SUSPICIOUS * sizes):
            values = ratings[given[:, column], column]
            varying[column] = values.size > 0 and not is_constant(values, centred(values)[1])
        if not varying.all():
            ratings, given, counter = ratings[:, varying], given[:, varying], counter[:, varying]
            differences, largest = differences[:, varying], largest[varying]
        bound = len(ratings) * float(largest.max(initial=0)) ** 2
        exact = bool(whole and bound < _EXACT_DOUBLE / len(ratings))
        products: _Floats = differences
        if exact and bound < _EXACT_SINGLE:
            products = differences.astype(np.float32)
        elif not exact and (largest.max(initial=1) > _MODERATE or largest.min(initial=1) < 1 / _MODERATE):
            differences /= largest
        return cls(varying=varying, ratings=ratings, given=given, counter=counter, differences=products, exact=exact)

    @property
    def raters(self) -> int:
        """Number of raters who vary."""
        return int(self.given.shape[1])

    def blocks(self) -> Iterator[Block]:
        """Yield the correlations of all pairs, block by block."""
        kind = self.differences.dtype
        mask = self.counter if kind == self.counter.dtype else self.given.astype(kind)
        factors = _Factors(values=self.differences, squares=self.differences**2, mask=mask, counter=self.counter)
        for first in range(0, self.raters, _TILE):
            left = slice(first, min(first + _TILE, self.raters))
            for second in range(first, self.raters, _TILE):
                right = slice(second, min(second + _TILE, self.raters))
                yield from self._tile(factors.products(left, right), left, right)

    def _tile(self, products: "_Products", left: slice, right: slice) -> Iterator[Block]:
        for start in range(left.start, left.stop, _ROWS):
            rows = slice(start, min(start + _ROWS, left.stop))
            columns = slice(max(start, right.start), right.stop)
            part = products.part(
                slice(rows.start - left.start, rows.stop - left.start),
                slice(columns.start - right.start, columns.stop - right.start),
            )
            yield self._block(part, rows, columns)

    def _block(self, sums: "_Products", rows: slice, columns: slice) -> Block:
        common = sums.common
        left_spread, right_spread = common * sums.left_squares, common * sums.right_squares
        threshold = 0 if self.exact else _ILL_SPREAD * left_spread * right_spread
        left_spread -= sums.left_sums**2
        right_spread -= sums.right_sums**2
        scale = left_spread * right_spread
        enough = common >= FEWEST_COMMON
        height, width = enough.shape
        # Pairs on and below the diagonal are in no block, or in this one the other way round.
        lower = np.tri(height, min(width, max(rows.stop - columns.start, 0)), dtype=bool)
        enough[:, : lower.shape[1]] &= ~lower
        used = enough & (scale > threshold)
        # A pair that has no correlation gets 0.
        scale = np.sqrt(np.where(used, scale, np.inf))
        correlations = common * sums.products
        correlations -= sums.left_sums * sums.right_sums
        correlations /= scale
        candidates = int(np.count_nonzero(enough))
        if not self.exact and np.count_nonzero(used) < candidates:
            places = np.nonzero(enough & ~used)
            correlations[places], used[places] = self._one_by_one(places[0] + rows.start, places[1] + columns.start)
        np.minimum(correlations, 1, out=correlations)
        np.maximum(correlations, -1, out=correlations)
        return Block(
            rows=rows,
            columns=columns,
            correlations=correlations,
            common=common,
            used=used,
            few=height * width - int(np.count_nonzero(lower)) - candidates,
            constant=candidates - int(np.count_nonzero(used)),
        )

    def _one_by_one(self, left: IntArray, right: IntArray) -> tuple[FloatArray, BoolArray]:
        correlations, used = np.zeros(left.size), np.zeros(left.size, dtype=bool)
        for start in range(0, left.size, _TILE):
            some = slice(start, start + _TILE)
            both = self.given[:, left[some]] & self.given[:, right[some]]
            (one, varies), (other, too) = (_standardised(self.ratings[:, side[some]], both) for side in (left, right))
            correlations[some], used[some] = np.einsum("ij,ij->j", one, other), varies & too
        return correlations, used


@dataclass(frozen=True, kw_only=True, eq=False)
class _Products:
    """Sums over the common rows of each column on the left with each on the right; squares and sums of either."""

    common: _Floats
    left_sums: _Floats
    right_sums: _Floats
    left_squares: _Floats
    right_squares: _Floats
    products: _Floats

    def part(self, rows: slice, columns: slice) -> "_Products":
        """Return some of the sums, in double precision."""
        return _Products(
            **{name: np.ascontiguousarray(sums[rows, columns], dtype=float) for name, sums in vars(self).items()}
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Factors:
    """What is multiplied: ratings and their squares, and where there are ratings as 0 and 1 (twice)."""

    values: _Floats
    squares: _Floats
    mask: _Floats
    counter: _Floats

    def products(self, left: slice, right: slice) -> _Products:
        """Return the products of some columns with the same or with others."""
        values, mask, counter = self.values[:, left], self.mask[:, left], self.counter[:, left]
        other = self.mask[:, right]
        sums, squares = values.T @ other, self.squares[:, left].T @ other
        if left == right:
            # Written like this, a product with itself takes half the time.
            return _Products(
                common=counter.T @ counter,
                left_sums=sums,
                right_sums=sums.T,
                left_squares=squares,
                right_squares=squares.T,
                products=values.T @ values,
            )
        return _Products(
            common=counter.T @ self.counter[:, right],
            left_sums=sums,
            right_sums=mask.T @ self.values[:, right],
            left_squares=squares,
            right_squares=mask.T @ self.squares[:, right],
            products=values.T @ self.values[:, right],
        )


def _whole(ratings: FloatArray) -> bool:
    # The first row tells of most tables that are not.
    return all(bool((np.rint(part) == part).all()) for part in (ratings[:1], ratings))


def _standardised(ratings: FloatArray, both: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return columns less their means over some of the rows, 0 elsewhere and of length 1; and which of them vary."""
    counts = both.sum(axis=0)
    first = ratings[both.argmax(axis=0), np.arange(ratings.shape[1])]
    differences = (ratings - first) * both
    for _ in range(2):
        differences -= both * (differences.sum(axis=0) / counts)
    largest = np.abs(differences).max(axis=0)
    varying: BoolArray = largest > 4 * np.finfo(float).eps * (np.abs(ratings) * both).max(axis=0)
    differences /= np.where(varying, largest, 1)
    differences /= np.sqrt(np.where(varying, np.einsum("ij,ij->j", differences, differences), 1))
    return differences, varying
