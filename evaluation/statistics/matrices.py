"""Checks that statistics of tables and stacks of numbers make of their data first."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray, finite_vector


def finite_array(values: npt.ArrayLike, *, axes: Sequence[str], name: str) -> FloatArray:
    """Return the values as an array of finite numbers with as many axes as are named.

    Parameters
    ----------
    values : array_like
        Numbers.
    axes : sequence of str
        What runs along each axis, for instance ``("rows", "columns")``.
    name : str
        What the values are, for the message.

    Returns
    -------
    numpy.ndarray
        The values as floats.

    Raises
    ------
    DataError
        If they are not numbers, have another number of axes, or one is missing, infinite or beyond 1e140.
    """
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name}: these values are not all numbers, or the rows differ in length.") from error
    if array.ndim != len(axes):
        raise DataError(f"{name} has the shape {array.shape}, but must have {' x '.join(axes)}.")
    if not array.size:
        return array
    # The extremes are NaN or infinite if any value is; of large arrays this is the quickest way to know.
    extremes = np.array([array.min(), array.max()])
    if not np.isfinite(extremes).all():
        wrong = np.argwhere(~np.isfinite(array))
        place = ", ".join(str(index) for index in wrong[0])
        raise DataError(
            f"{name}: {len(wrong)} of {array.size} values are missing or infinite (the first at [{place}]); "
            "leave them out first."
        )
    finite_vector(extremes, name=name)
    return array


def centred_columns(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the means of the columns and the differences from them, as `evaluation.statistics.arrays.centred` does.

    Parameters
    ----------
    matrix : numpy.ndarray, shape (n, ...)
        Finite numbers, n at least 1.

    Returns
    -------
    tuple of numpy.ndarray, shapes (...) and (n, ...)
        Means over the first axis, and differences.
    """
    shifted = matrix - matrix[0]
    offset = shifted.mean(axis=0)
    differences = shifted - offset
    correction = differences.mean(axis=0)
    return matrix[0] + (offset + correction), differences - correction


def constant_columns(matrix: FloatArray, differences: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which columns differ by no more than the rounding of their values."""
    largest = np.abs(matrix).max(axis=0)
    constant: npt.NDArray[np.bool_] = np.abs(differences).max(axis=0) <= 4 * np.finfo(float).eps * largest
    return constant


def ratings_table(ratings: npt.ArrayLike) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return ratings some of which may be missing, and which are there.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.

    Returns
    -------
    tuple of numpy.ndarray, both of shape (items, raters)
        The ratings in a new array, 0 where there is none; and True where there is one.

    Raises
    ------
    DataError
        If they are no table of numbers, or one is infinite or beyond 1e140.
    """
    try:
        table = np.array(ratings, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("ratings: these values are not all numbers, or the rows differ in length.") from error
    given = ~np.isnan(table)
    table[~given] = 0
    return finite_array(table, axes=("items", "raters"), name="ratings"), given
