"""Ratings of which some are missing: a rater withdrew, or rated only some of the samples."""

import numpy as np
import numpy.typing as npt

from evaluation.statistics.agreement.annotation import deviation
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array

AXES = ("samples", "raters", "dimensions")


def array_with_gaps(ratings: npt.ArrayLike, *, name: str = "ratings") -> FloatArray:
    """Return ratings as floats, NaN where one is missing.

    Parameters
    ----------
    ratings : array_like, shape (samples, raters, dimensions)
        Ratings; None or NaN where one is missing.
    name : str
        What they are, for the message.

    Returns
    -------
    numpy.ndarray, shape (samples, raters, dimensions)
        The ratings.

    Raises
    ------
    DataError
        If they are no stack of numbers, or one is infinite or beyond 1e140.
    """
    try:
        stack = np.asarray(ratings, dtype=float)
    except (TypeError, ValueError):
        # It fails there too, and says what is wrong.
        return finite_array(ratings, axes=AXES, name=name)
    missing = np.isnan(stack)
    finite_array(np.where(missing, 0, stack) if missing.any() else stack, axes=AXES, name=name)
    return stack


def known_deviation(ratings: npt.ArrayLike) -> FloatArray:
    """Return the standard deviation over those raters who rated a sample.

    Parameters
    ----------
    ratings : array_like, shape (samples, raters, dimensions)
        Ratings; NaN where one is missing.

    Returns
    -------
    numpy.ndarray, shape (samples, dimensions)
        Standard deviation with n - 1, exactly 0 where all agree; NaN where there are fewer than two ratings. For
        complete ratings it is that of `evaluation.statistics.agreement.annotation.deviation`.

    Raises
    ------
    DataError
        As `array_with_gaps`.
    """
    stack = array_with_gaps(ratings)
    samples, raters, dimensions = stack.shape
    if raters < 2:
        return np.full((samples, dimensions), np.nan)
    result = np.empty((samples, dimensions))
    gaps = np.isnan(stack.reshape(samples, raters * dimensions)).any(axis=1)
    result[~gaps] = deviation(stack[~gaps] if gaps.any() else stack)
    result[gaps] = _deviation_with_gaps(stack[gaps])
    return result


def _deviation_with_gaps(stack: FloatArray) -> FloatArray:
    known = ~np.isnan(stack)
    number = known.sum(axis=1)
    # As in `deviation`, differences from one of the ratings: here from the first that is there.
    first = np.take_along_axis(stack, known.argmax(axis=1)[:, None], axis=1)
    differences = np.where(known, stack - first, 0)
    squares = np.einsum("irk,irk->ik", differences, differences)
    sums = np.maximum(squares - differences.sum(axis=1) ** 2 / np.maximum(number, 1), 0)
    return np.where(number >= 2, np.sqrt(sums / np.maximum(number - 1, 1)), np.nan)
