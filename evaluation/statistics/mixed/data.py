"""Values, labels and designs of a mixed model: checked, and put into the form in which they are fitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, check_squares
from evaluation.statistics.matrices import finite_array

# A column of which less than this share is left after regression on the columns before it depends on them.
_DEPENDENT = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """A matrix as orthonormal columns times a triangular matrix.

    Attributes
    ----------
    orthonormal : numpy.ndarray, shape (n, q)
        Columns of length 1 that span those of the matrix.
    triangle : numpy.ndarray, shape (q, q)
        What they have to be multiplied by to give the matrix.
    names : tuple of str
        Names of the matrix's columns.
    """

    orthonormal: FloatArray
    triangle: FloatArray
    names: tuple[str, ...]


def named_columns(matrix: Any, names: Sequence[str] | None, *, n: int, what: str) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the columns of a matrix or frame as numbers, and their names.

    Raises
    ------
    DataError
        If the matrix is no table of finite numbers with n rows, has no columns, or the names are not as many.
    """
    if isinstance(matrix, pd.DataFrame) and names is None:
        names = [str(column) for column in matrix.columns]
    columns = finite_array(matrix, axes=("values", "columns"), name=what)
    if len(columns) != n or not columns.shape[1]:
        raise DataError(f"{what} has the shape {columns.shape}, but must have {n} rows and at least one column.")
    names = tuple(f"x{place + 1}" for place in range(columns.shape[1])) if names is None else tuple(map(str, names))
    if len(names) != columns.shape[1]:
        raise DataError(f"{what} has {columns.shape[1]} columns, but {len(names)} names.")
    for title, column in zip(names, columns.T, strict=True):
        check_squares(column, name=f"{what}, {title}")
    return columns, names


def orthonormal(columns: FloatArray, names: tuple[str, ...], *, what: str) -> Design:
    """Return a matrix with full column rank in orthonormal form.

    Raises
    ------
    DataError
        If a column is zero or a combination of those before it.
    InsufficientDataError
        If there are as many columns as rows, or more.
    """
    if columns.shape[1] >= len(columns):
        raise InsufficientDataError(
            f"{what} has {columns.shape[1]} columns for {len(columns)} values; it takes more values than columns."
        )
    lengths = np.linalg.norm(columns, axis=0)
    basis, triangle = np.linalg.qr(columns)
    dependent = np.flatnonzero(np.abs(np.diag(triangle)) <= _DEPENDENT * lengths)
    if dependent.size:
        place = int(dependent[0])
        why = "is zero throughout" if lengths[place] == 0 else "is a combination of the columns before it"
        raise DataError(f"{what}: the column {names[place]} {why}; leave it out.")
    return Design(orthonormal=basis, triangle=triangle, names=names)


def residual(values: FloatArray, design: Design) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients of the orthonormal columns, and what is left of the values.

    What is left is projected twice, so that a large part in common costs no digits.

    Raises
    ------
    InsufficientDataError
        If nothing but rounding is left.
    """
    coefficients: npt.NDArray[np.float64] = np.zeros(design.orthonormal.shape[1])
    left = values
    for _ in range(2):
        part = design.orthonormal.T @ left
        coefficients = coefficients + part
        left = left - design.orthonormal @ part
    largest = float(np.abs(values).max())
    if float(np.abs(left).max()) <= 64 * float(np.finfo(float).eps) * largest:
        if float(np.ptp(values)) <= 4 * float(np.finfo(float).eps) * largest:
            raise InsufficientDataError("All values are the same, so there is no variance to explain.")
        raise InsufficientDataError("The fixed effects explain the values exactly, so nothing is left to explain.")
    return coefficients, left
