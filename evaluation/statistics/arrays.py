"""Checks that every statistic makes of its data first."""

import math

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError

FloatArray = npt.NDArray[np.float64]

# Squares and sums of what is smaller cannot overflow, and squares of what is larger do not vanish.
_LARGEST = 1e140
_LEAST = 1e-140


def finite_vector(values: npt.ArrayLike, *, name: str) -> FloatArray:
    """Return the values as a vector of finite numbers.

    Parameters
    ----------
    values : array_like, shape (n,)
        Numbers.
    name : str
        What they are, for the message.

    Returns
    -------
    numpy.ndarray, shape (n,)
        The values as floats.

    Raises
    ------
    DataError
        If they are not a flat list of numbers, or one is missing, infinite or beyond 1e140.
    """
    try:
        vector = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name}: these values are not all numbers.") from error
    if vector.ndim != 1:
        raise DataError(f"{name}: the values have {vector.ndim} dimensions, but must be a flat list of numbers.")
    wrong = np.flatnonzero(~np.isfinite(vector))
    if wrong.size:
        raise DataError(
            f"{name}: {wrong.size} of {vector.size} values are missing or infinite (the first at place {wrong[0]}); "
            "leave them out first."
        )
    if vector.size and np.abs(vector).max() > _LARGEST:
        raise DataError(f"{name}: a value exceeds {_LARGEST:g} in size; use larger units.")
    return vector


def check_squares(vector: FloatArray, *, name: str) -> None:
    """Raise DataError if finite numbers are so small that their squares would lose digits or vanish.

    For statistics that are not computed in units of the data; a vector of zeros passes.

    Parameters
    ----------
    vector : numpy.ndarray, shape (n,)
        Finite numbers.
    name : str
        What they are, for the message.
    """
    largest = float(np.abs(vector).max(initial=0.0))
    if 0 < largest < _LEAST:
        raise DataError(f"{name}: no value exceeds {_LEAST:g} in size; use smaller units.")


def standard_deviation(differences: FloatArray) -> float:
    """Return the standard deviation (n - 1) of two or more values, given their differences from their mean.

    It is formed in units of the largest difference, so that squares of small numbers do not vanish.
    """
    largest = float(np.abs(differences).max())
    if not largest:
        return 0.0
    scaled = differences / largest
    return largest * math.sqrt(float(scaled @ scaled) / (differences.size - 1))


def centred(vector: FloatArray) -> tuple[float, FloatArray]:
    """Return the mean and the differences from it, both exact to rounding even when the mean is large.

    The first value is taken away before the mean is formed, so that digits are not lost to a large common part (the
    shifted two-pass algorithm: Chan, Golub and LeVeque, 1983, The American Statistician 37:242).
    """
    shifted = vector - vector[0]
    offset = float(shifted.mean())
    differences = shifted - offset
    # What rounding left of their mean, which would be zero in exact arithmetic.
    correction = float(differences.mean())
    return float(vector[0]) + (offset + correction), differences - correction


def is_constant(vector: FloatArray, differences: FloatArray) -> bool:
    """Return whether values differ by no more than the rounding of the values themselves."""
    largest = float(np.abs(vector).max())
    return float(np.abs(differences).max()) <= 4 * float(np.finfo(float).eps) * largest


def check_confidence(confidence: float) -> None:
    """Raise DataError unless a confidence lies between 0 and 1."""
    if not 0 < confidence < 1:
        raise DataError(f"confidence is {confidence}, but must lie between 0 and 1.")
