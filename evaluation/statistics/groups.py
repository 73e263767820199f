"""Groups of values, and what every comparison of groups needs to know of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.matrices import finite_array

EPSILON = float(np.finfo(float).eps)
# Rows or columns of a matrix that are taken at a time: so few that they stay in the cache of the processor.
_TILE = 64
# Sums of squares of larger values may overflow; `finite_array` says so in words.
_LARGEST = 1e140


@dataclass(frozen=True, kw_only=True, eq=False)
class Moments:
    """Sizes, means and sums of squares of groups.

    Attributes
    ----------
    names : tuple of str
        Names of the groups.
    sizes : numpy.ndarray, shape (k,)
        Number of values of each group.
    origin : float
        A value near all others.
    offsets : numpy.ndarray, shape (k,)
        Means less `origin`.
    squares : numpy.ndarray, shape (k,)
        Sums of squared differences from the group's mean.
    largest : float
        Size of the largest value, or somewhat more: what tells rounding from variance.
    """

    names: tuple[str, ...]
    sizes: npt.NDArray[np.int64]
    origin: float
    offsets: FloatArray
    squares: FloatArray
    largest: float

    @property
    def negligible(self) -> float:
        """Sum of squares that rounding of the values alone may cause."""
        return float(self.sizes.sum()) * (4 * EPSILON * self.largest) ** 2


class VarianceRatio(NamedTuple):
    """Sums of squares between and within groups, and their ratio with its probability."""

    SSB: float
    SSW: float
    df_between: int
    df_within: int
    F: float
    p: float


def group_vectors(groups: Mapping[str, npt.ArrayLike]) -> dict[str, FloatArray]:
    """Return the values of groups as vectors.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n_i,)
        The same, checked, in the same order.

    Raises
    ------
    DataError
        If a value is not a finite number, or two groups are written alike.
    InsufficientDataError
        If there are fewer than two groups or a group is empty.
    """
    vectors = {str(name): finite_vector(values, name=f"group {name}") for name, values in groups.items()}
    if len(vectors) < len(groups):
        raise DataError("Two groups have the same name in writing; names must differ as text.")
    for name, vector in vectors.items():
        if vector.size == 0:
            raise InsufficientDataError(f"The group {name} has no values, so the groups cannot be compared.")
    check_number(len(vectors))
    return vectors


def column_names(names: Sequence[str] | None, number: int) -> tuple[str, ...]:
    """Return the names of the columns of a matrix: those given, or 1, 2, 3 and so on.

    Raises
    ------
    DataError
        If their number is wrong or two are the same.
    """
    titles = tuple(map(str, range(1, number + 1) if names is None else names))
    if len(titles) != number or len(set(titles)) != number:
        raise DataError(f"There are {number} columns, so {number} different names are needed.")
    return titles


def segment_sums(values: FloatArray, sizes: npt.NDArray[np.int64]) -> FloatArray:
    """Return the sum of each group of values that stand one group after the other, none of them empty."""
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    sums: FloatArray = np.add.reduceat(values, starts)
    return sums


def check_number(number: int) -> None:
    """Raise InsufficientDataError if there are fewer than two groups."""
    if number < 2:
        raise InsufficientDataError(f"At least two groups are needed to compare means; there is {number or 'none'}.")


def check_sizes(sizes: npt.NDArray[np.int64]) -> None:
    """Raise InsufficientDataError unless there are two groups and one of them has two values."""
    check_number(sizes.size)
    if sizes.max() < 2:
        raise InsufficientDataError("Each group has only one value; at least one group needs two or more.")


def moments(vectors: Mapping[str, FloatArray], *, largest: float | None = None) -> Moments:
    """Return the moments of groups of finite numbers.

    Sums of squares are formed from differences to the group's mean, which is formed from differences to a nearby
    value, so that a large common part costs no digits (Chan, Golub and LeVeque, 1983, The American Statistician
    37:242).

    Parameters
    ----------
    vectors : mapping of str to numpy.ndarray, shape (n_i,)
        Values of each group, n_i at least 1.
    largest : float, optional
        Size of what the values were computed from, if they are differences themselves.
    """
    values = np.concatenate(list(vectors.values()))
    sizes = np.array([vector.size for vector in vectors.values()])
    origin = float(values[0])
    offsets = segment_sums(values - origin, sizes) / sizes
    differences = (values - origin) - np.repeat(offsets, sizes)
    # What rounding left of the means of the differences, which would be zero in exact arithmetic.
    corrections = segment_sums(differences, sizes) / sizes
    differences -= np.repeat(corrections, sizes)
    return Moments(
        names=tuple(vectors),
        sizes=sizes,
        origin=origin,
        offsets=offsets + corrections,
        squares=segment_sums(differences * differences, sizes),
        largest=float(np.abs(values).max()) if largest is None else largest,
    )


def matrix_moments(matrix: npt.ArrayLike, names: Sequence[str] | None = None) -> Moments:
    """Return the moments of the columns of a matrix, in one pass over it.

    The differences are those from the mean of the first sixteenth of the rows: whatever the values, that mean is so
    near to the mean of all that the sum of squares loses little more than one digit to rounding (by Jensen's
    inequality the difference of the two means, squared, is at most 16 / n times the sum of squares).

    Parameters
    ----------
    matrix : array_like, shape (n, k)
        Finite numbers; the columns are groups of one size.
    names : sequence of str, optional
        Names of the columns; 1, 2, 3, … if not given.

    Raises
    ------
    DataError
        If it is no matrix of finite numbers, or the number of names is wrong or two are the same.
    InsufficientDataError
        If there are fewer than two rows or columns.
    """
    try:
        table = np.asarray(matrix, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("matrix: these values are not all numbers, or the rows differ in length.") from error
    if table.ndim != 2:
        raise DataError(f"matrix has the shape {table.shape}, but must have values x groups.")
    n, k = table.shape
    titles = column_names(names, k)
    if n == 0 and k > 1:
        raise InsufficientDataError("The matrix has no rows, so the groups cannot be compared.")
    sizes = np.full(k, n)
    check_sizes(sizes)
    # What is not finite, or too large, shows in the sums; it is looked for only then.
    with np.errstate(over="ignore", invalid="ignore"):
        centres = table[: max(1, n // 16)].mean(axis=0)
        corrections, squares = _column_sums(table, centres)
        largest = float(np.abs(centres).max() + math.sqrt(squares.max()))
    if not largest < _LARGEST:
        finite_array(table, axes=("values", "groups"), name="matrix")
    corrections /= n
    return Moments(
        names=titles,
        sizes=sizes,
        origin=float(centres[0]),
        offsets=(centres - centres[0]) + corrections,
        squares=np.maximum(squares - n * corrections**2, 0),
        largest=largest,
    )


def _column_sums(table: FloatArray, centres: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sums of the differences from the centres, and of their squares, over the rows."""
    n, k = table.shape
    sums, squares = np.zeros(k), np.zeros(k)
    by_row = table.flags.c_contiguous
    for start in range(0, n if by_row else k, _TILE):
        part = slice(start, start + _TILE)
        rows, columns = (part, slice(None)) if by_row else (slice(None), part)
        differences = table[rows, columns] - centres[columns]
        sums[columns] += differences.sum(axis=0)
        squares[columns] += np.einsum("ij,ij->j", differences, differences)
    return sums, squares


def variance_ratio(found: Moments) -> VarianceRatio:
    """Return Fisher's variance ratio of groups, with its probability if all had one mean.

    Raises
    ------
    InsufficientDataError
        If there are fewer than two groups, no group has two values, or all values are the same.
    """
    check_sizes(found.sizes)
    number = int(found.sizes.sum())
    df_between, df_within = found.sizes.size - 1, number - found.sizes.size
    grand = float(found.sizes @ found.offsets) / number
    sums = math.fsum((found.sizes * (found.offsets - grand) ** 2).tolist()), math.fsum(found.squares.tolist())
    # Squares of differences that are no more than the rounding of the values mean that nothing varies.
    SSB, SSW = (0.0 if squares <= found.negligible else squares for squares in sums)
    if SSB + SSW == 0:
        raise InsufficientDataError("All values are the same, so there is no variance to analyse.")
    F = (SSB / df_between) / (SSW / df_within) if SSW > 0 else math.inf
    return VarianceRatio(SSB, SSW, df_between, df_within, F, upper_tail(F, df_between, df_within))


def upper_tail(F: float, df_between: float, df_within: float) -> float:
    """Return the probability of an F at least as large."""
    return float(special.fdtrc(df_between, df_within, F))
