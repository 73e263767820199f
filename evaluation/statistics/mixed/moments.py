"""Sums of squares and products through which data enter the fit of a linear mixed model."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from evaluation.statistics.arrays import FloatArray

IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True, kw_only=True, eq=False)
class Grouping:
    """The columns of Z that belong to one random term.

    Attributes
    ----------
    codes : numpy.ndarray of int, shape (n,)
        Level of each value, from 0.
    levels : int
        How many levels there are.
    design : numpy.ndarray, shape (n, q), or None
        What the q effects of a level are multiplied by; None for one effect times 1.
    """

    codes: IntArray
    levels: int
    design: FloatArray | None = None

    @property
    def width(self) -> int:
        """How many effects each level has: q."""
        return 1 if self.design is None else int(self.design.shape[1])

    @property
    def size(self) -> int:
        """How many columns of Z the term has."""
        return self.levels * self.width

    def column(self, place: int) -> FloatArray | None:
        """Return one column of the design, None for ones."""
        return None if self.design is None else self.design[:, place]


@dataclass(frozen=True, kw_only=True, eq=False)
class Moments:
    """Everything that a fit needs to know of y, X and Z.

    The term with most columns leads: its part of Z'Z is block diagonal and eliminated block by block. E stands for all
    other columns: those of the other terms, then those of X.

    Attributes
    ----------
    n : int
        Number of values.
    order : tuple of int
        The terms' places in the order given, the leading one first.
    levels, widths : tuple of int
        Levels and effects of the terms, in that order.
    leading : numpy.ndarray, shape (J, q, q)
        Blocks of Z1'Z1.
    leading_y : numpy.ndarray, shape (J, q)
        Z1'y.
    others_leading : numpy.ndarray, shape (e, J, q)
        E'Z1.
    others : numpy.ndarray, shape (e, e)
        E'E.
    others_y : numpy.ndarray, shape (e,)
        E'y.
    yy : float
        y'y.
    places : tuple of slice
        Where the other terms are in E, and last where X is.
    """

    n: int
    order: tuple[int, ...]
    levels: tuple[int, ...]
    widths: tuple[int, ...]
    leading: FloatArray
    leading_y: FloatArray
    others_leading: FloatArray
    others: FloatArray
    others_y: FloatArray
    yy: float
    places: tuple[slice, ...]

    @property
    def fixed(self) -> slice:
        """Where the columns of X are in E."""
        return self.places[-1]

    @property
    def p(self) -> int:
        """How many columns X has."""
        return int(self.fixed.stop - self.fixed.start)

    @property
    def random(self) -> slice:
        """Where the columns of the other terms are in E."""
        return slice(0, self.fixed.start)


def moments(groupings: Sequence[Grouping], fixed: FloatArray, y: FloatArray) -> Moments:
    """Return the sums of squares and products of y, X and Z; Z itself is never formed.

    Parameters
    ----------
    groupings : sequence of Grouping
        Random terms, at least one.
    fixed : numpy.ndarray, shape (n, p)
        X.
    y : numpy.ndarray, shape (n,)
        Values.

    Returns
    -------
    Moments
        The sums; cross tabulations of two terms are counted in one pass over the data.
    """
    first = max(range(len(groupings)), key=lambda place: groupings[place].size)
    order = (first, *(place for place in range(len(groupings)) if place != first))
    ordered = [groupings[place] for place in order]
    leading, rest = ordered[0], ordered[1:]
    bounds = np.cumsum([0, *(term.size for term in rest), fixed.shape[1]]).tolist()
    places = tuple(slice(low, high) for low, high in itertools.pairwise(bounds))
    others = np.zeros((bounds[-1], bounds[-1]))
    others_leading = np.empty((bounds[-1], leading.levels, leading.width))
    others_y = np.empty(bounds[-1])
    x = places[-1]
    others[x, x], others_y[x] = fixed.T @ fixed, fixed.T @ y
    others_leading[x] = _with_columns(leading, fixed).transpose(2, 0, 1)
    for number, (term, place) in enumerate(zip(rest, places[:-1], strict=True)):
        others[place, place] = _block_diagonal(_within(term))
        others_leading[place] = _between(term, leading).reshape(term.size, leading.levels, leading.width)
        others_y[place] = _with_columns(term, y[:, None]).ravel()
        others[place, x] = _with_columns(term, fixed).reshape(term.size, -1)
        others[x, place] = others[place, x].T
        for later, later_place in zip(rest[number + 1 :], places[number + 1 : -1], strict=True):
            others[place, later_place] = _between(term, later).reshape(term.size, later.size)
            others[later_place, place] = others[place, later_place].T
    return Moments(
        n=y.size,
        order=order,
        levels=tuple(term.levels for term in ordered),
        widths=tuple(term.width for term in ordered),
        leading=_within(leading),
        leading_y=_with_columns(leading, y[:, None])[:, :, 0],
        others_leading=others_leading,
        others=others,
        others_y=others_y,
        yy=float(y @ y),
        places=places,
    )


def _product(first: FloatArray | None, second: FloatArray | None) -> FloatArray | None:
    if first is None or second is None:
        return second if first is None else first
    return first * second


def _within(term: Grouping) -> FloatArray:
    """Return the diagonal blocks of the term's part of Z'Z, shape (levels, q, q)."""
    blocks = np.empty((term.levels, term.width, term.width))
    for a in range(term.width):
        for b in range(a + 1):
            weights = _product(term.column(a), term.column(b))
            blocks[:, a, b] = blocks[:, b, a] = np.bincount(term.codes, weights, minlength=term.levels)
    return blocks


def _between(first: Grouping, second: Grouping) -> FloatArray:
    """Return the products of two terms' columns, shape (levels, q, levels, q)."""
    cells = first.codes * second.levels + second.codes
    table = np.empty((first.levels, first.width, second.levels, second.width))
    for a in range(first.width):
        for b in range(second.width):
            sums = np.bincount(cells, _product(first.column(a), second.column(b)), first.levels * second.levels)
            table[:, a, :, b] = sums.reshape(first.levels, second.levels)
    return table


def _with_columns(term: Grouping, columns: FloatArray) -> FloatArray:
    """Return the products of a term's columns with others, shape (levels, q, columns)."""
    sums = np.empty((term.levels, term.width, columns.shape[1]))
    for a in range(term.width):
        for b in range(columns.shape[1]):
            sums[:, a, b] = np.bincount(term.codes, _product(term.column(a), columns[:, b]), minlength=term.levels)
    return sums


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    levels, width, _ = blocks.shape
    matrix = np.zeros((levels, width, levels, width))
    matrix[np.arange(levels), :, np.arange(levels), :] = blocks
    return matrix.reshape(levels * width, levels * width)
