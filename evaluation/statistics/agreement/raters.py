"""Tables of ratings whose columns are raters with names."""

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray

# So many names are spelt out in a sentence.
_SPELT_OUT = 10


def named_table(ratings: npt.ArrayLike | pd.DataFrame) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of the raters and their ratings, which are not copied if they are floats already.

    Parameters
    ----------
    ratings : array_like or pandas.DataFrame, shape (items, raters)
        Ratings; NaN (or the missing value of pandas) where a rater did not rate an item.

    Returns
    -------
    tuple of (tuple of str, numpy.ndarray of shape (items, raters))
        The columns' labels, or 1, 2, 3 ... if there are none; and the ratings, which the caller must not change.

    Raises
    ------
    DataError
        If the ratings are no table of numbers. Infinite ratings are not looked for.
    """
    try:
        if isinstance(ratings, pd.DataFrame):
            # Columns of objects may hold the missing value of pandas, which is no number.
            objects = any(pd.api.types.is_object_dtype(kind) for kind in ratings.dtypes)
            frame = ratings.where(ratings.notna(), np.nan) if objects else ratings
            table = frame.to_numpy(dtype=float, na_value=np.nan)
        else:
            table = np.asarray(ratings, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("ratings: these values are not all numbers, or the rows differ in length.") from error
    if table.ndim != 2:
        raise DataError(f"ratings has the shape {table.shape}, but must have items x raters.")
    labels: Iterable[object] = ratings.columns if isinstance(ratings, pd.DataFrame) else range(1, table.shape[1] + 1)
    return tuple(str(label) for label in labels), table


def listed(names: Sequence[str]) -> str:
    """Return names for a sentence: all of them, or the first ten and how many there are besides."""
    if len(names) <= _SPELT_OUT:
        return ", ".join(names)
    return f"{', '.join(names[:_SPELT_OUT])} and {len(names) - _SPELT_OUT} more"
