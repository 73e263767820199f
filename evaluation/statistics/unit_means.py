"""From ratings to one value for each unit of analysis, an item or a rater, in each condition."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.label_codes import level_codes
from evaluation.statistics.result import Result

# Units that a flag names before it says how many more there are.
_NAMED = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitMeans(Result):
    """Mean ratings of units in conditions.

    Attributes
    ----------
    matrix : numpy.ndarray, shape (units, conditions)
        Mean rating of each unit in each condition; read-only.
    counts : numpy.ndarray, shape (units, conditions)
        Number of ratings of each mean; read-only.
    units, conditions : tuple of str
        Names of the rows and of the columns: in the order in which they first appear, or that of the categories.
    left_out : tuple of str
        Units that lack ratings in a condition.
    """

    matrix: FloatArray
    counts: npt.NDArray[np.int64]
    units: tuple[str, ...]
    conditions: tuple[str, ...]
    left_out: tuple[str, ...]

    def apa(self) -> str:
        """Return how many units there are in a sentence."""
        return f"Mean ratings of {len(self.units)} units in {len(self.conditions)} conditions"

    def to_frame(self) -> pd.DataFrame:
        """Return the means as a frame with a row for each unit and a column for each condition."""
        return pd.DataFrame(self.matrix, index=pd.Index(self.units, name="unit"), columns=list(self.conditions))


def unit_means(values: npt.ArrayLike, conditions: Sequence[Hashable], units: Sequence[Hashable]) -> UnitMeans:
    """Average ratings to one value for each unit in each condition.

    Parameters
    ----------
    values : array_like, shape (n,)
        Ratings; NaN where one is missing.
    conditions, units : sequence, shape (n,)
        Condition of each rating, and its unit: the item to average over raters, the rater to average over items.

    Returns
    -------
    UnitMeans
        The means of the units that have ratings in all conditions; a flag names those left out.

    Raises
    ------
    DataError
        If the three differ in length, a rating is infinite or no number, or a condition or unit is missing.
    InsufficientDataError
        If there are no ratings, a condition has none, or no unit has ratings in all conditions.

    References
    ----------
    Jia et al. (2013), section 5.4 and Table 10, average the ratings of each sentence over raters.
    """
    ratings, given = _ratings(values)
    (rows, _), (columns, _) = found = level_codes(units, name="units"), level_codes(conditions, name="conditions")
    row_names, column_names = found[0].titles("units"), found[1].titles("conditions")
    if not ratings.size == rows.size == columns.size:
        raise DataError(
            f"There are {ratings.size} ratings, {columns.size} conditions and {rows.size} units; they must be as many."
        )
    if not given.any():
        raise InsufficientDataError("There are no ratings.")
    shape = len(row_names), len(column_names)
    cells = (rows * shape[1] + columns)[given]
    counts = np.bincount(cells, minlength=shape[0] * shape[1]).reshape(shape)
    for name, number in zip(column_names, counts.sum(axis=0), strict=True):
        if number == 0:
            raise InsufficientDataError(f"The condition {name} has no ratings.")
    origin = float(ratings[given][0])
    sums = np.bincount(cells, weights=ratings[given] - origin, minlength=counts.size).reshape(shape)
    complete = np.asarray((counts > 0).all(axis=1))
    if not complete.any():
        raise InsufficientDataError("No unit has ratings in all conditions.")
    matrix, kept = origin + sums[complete] / counts[complete], counts[complete]
    matrix.flags.writeable = kept.flags.writeable = False
    # A category without any rating is no unit that was lost.
    lost = np.bincount(rows, minlength=shape[0]).astype(bool) & ~complete
    left_out = tuple(name for name, out in zip(row_names, lost.tolist(), strict=True) if out)
    return UnitMeans(
        matrix=matrix,
        counts=kept,
        units=tuple(name for name, whole in zip(row_names, complete, strict=True) if whole),
        conditions=column_names,
        left_out=left_out,
        flags=_left_out_flag(left_out),
    )


def _ratings(values: npt.ArrayLike) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return ratings, 0 where one is missing, and which are there."""
    try:
        ratings = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("ratings: these values are not all numbers.") from error
    given = ~np.isnan(ratings)
    ratings[~given] = 0
    return finite_vector(ratings, name="ratings"), given


def _left_out_flag(units: Sequence[str]) -> tuple[str, ...]:
    if not units:
        return ()
    more = f" and {len(units) - _NAMED} more" if len(units) > _NAMED else ""
    return (f"Units left out because they lack ratings in a condition: {', '.join(units[:_NAMED])}{more}.",)
