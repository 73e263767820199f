"""Two-way analysis of variance between groups: two factors and their interaction."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.groups import EPSILON, upper_tail
from evaluation.statistics.label_codes import level_codes
from evaluation.statistics.result import Result


class Effect(NamedTuple):
    """A factor, or the interaction, in an analysis of variance.

    Attributes
    ----------
    name : str
        Name of the factor, or of both with × between them.
    SS : float
        Sum of squares.
    df : int
        Degrees of freedom.
    F : float
        Variance ratio; infinite if no cell varies within itself.
    p : float
        Probability of an F at least as large if there were no effect; 1 if the effect is exactly none.
    partial_eta_squared : float
        Share of the variance that the effect explains of what other effects leave.
    """

    name: str
    SS: float
    df: int
    F: float
    p: float
    partial_eta_squared: float


@dataclass(frozen=True, kw_only=True)
class TwoWayAnova(Result):
    """A two-way analysis of variance.

    Attributes
    ----------
    first, second, interaction : Effect
        The three effects.
    SS_error : float
        Sum of squares within cells.
    df_error : int
        Its degrees of freedom.
    ss_type : int
        Type of the sums of squares: 1, 2 or 3. All are the same if the cells are of one size.
    cells : tuple of tuple
        First level, second level, n, mean and standard deviation (None for one value) of each cell.
    """

    first: Effect
    second: Effect
    interaction: Effect
    SS_error: float
    df_error: int
    ss_type: int
    cells: tuple[tuple[str, str, int, float, float | None], ...]

    @property
    def effects(self) -> tuple[Effect, Effect, Effect]:
        """First factor, second factor and interaction."""
        return self.first, self.second, self.interaction

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``supp: F(1, 54) = 15.57, p < .001, ηp² = .22; dose: …``."""
        return "; ".join(
            f"{name}: F({df}, {self.df_error}) = {wording.number(F)}, {wording.p_value(p)}, ηp² = {wording.share(size)}"
            for name, _, df, F, p, size in self.effects
        )

    def to_frame(self) -> pd.DataFrame:
        """Return the usual table: one row for each effect and one for the error."""
        table = pd.DataFrame(self.effects).rename(columns={"name": "source", "SS": "sum_of_squares"})
        error = {"source": "error", "sum_of_squares": self.SS_error, "df": self.df_error}
        return pd.concat([table, pd.DataFrame([error])], ignore_index=True)


def two_way(
    values: npt.ArrayLike,
    first: Sequence[Hashable],
    second: Sequence[Hashable],
    *,
    names: tuple[str, str] = ("first", "second"),
    ss_type: Literal[1, 2, 3] = 3,
) -> TwoWayAnova:
    """Compare the means of groups that differ in two factors.

    Parameters
    ----------
    values : array_like, shape (n,)
        Finite numbers.
    first, second : sequence, shape (n,)
        Level of the first and of the second factor of each value.
    names : tuple of str
        Names of the two factors, for the result.
    ss_type : {1, 2, 3}
        How cells of different sizes share out the sum of squares. 1: the first factor alone, then what the second adds
        (R's `aov`). 2: what each factor adds to the other (`car::Anova`). 3: each factor's unweighted means (afex and
        SPSS); the hypothesis does not depend on the sizes of the cells.

    Returns
    -------
    TwoWayAnova
        Both main effects and the interaction; a flag if the cells differ in size.

    Raises
    ------
    DataError
        If a value is not a finite number, a level is missing, the lengths differ, or `ss_type` is another number.
    InsufficientDataError
        If a factor has fewer than two levels, a cell is empty, no cell has two values, or all values are the same.

    References
    ----------
    Yates (1934), The analysis of multiple classifications with unequal numbers in the different classes, Journal of the
    American Statistical Association 29:51; the types by Speed, Hocking and Hackney (1978), same journal 73:105.
    """
    if ss_type not in (1, 2, 3):
        raise DataError(f"ss_type is {ss_type!r}, but must be 1, 2 or 3.")
    vector = finite_vector(values, name="values")
    (rows, _), (columns, _) = found = level_codes(first, name=names[0]), level_codes(second, name=names[1])
    row_names, column_names = found[0].titles(names[0]), found[1].titles(names[1])
    if not vector.size == rows.size == columns.size:
        raise DataError(
            f"There are {vector.size} values, {rows.size} levels of {names[0]} and {columns.size} of {names[1]}; they "
            "must be as many."
        )
    cells = _Cells.of(vector, rows, columns, levels=(row_names, column_names), names=names)
    negligible = vector.size * (4 * EPSILON * float(np.abs(vector).max())) ** 2
    parts = [0.0 if squares <= negligible else squares for squares in cells.sums_of_squares(ss_type)]
    if sum(parts) == 0:
        raise InsufficientDataError("All values are the same, so there is no variance to analyse.")
    *squares, error = parts
    a, b = cells.counts.shape
    df_error = vector.size - a * b
    freedoms = (a - 1, b - 1, (a - 1) * (b - 1))
    titles = (*names, " × ".join(names))
    effects = [_effect(title, SS, df, error, df_error) for title, SS, df in zip(titles, squares, freedoms, strict=True)]
    flags = []
    if np.ptp(cells.counts):
        flags.append(f"The cells differ in size, so the sums of squares depend on their type: this is type {ss_type}.")
    if error == 0:
        flags.append("No cell varies within itself, so F is infinite where there is an effect.")
    return TwoWayAnova(
        first=effects[0],
        second=effects[1],
        interaction=effects[2],
        SS_error=error,
        df_error=df_error,
        ss_type=ss_type,
        cells=cells.described(row_names, column_names),
        flags=tuple(flags),
    )


def _effect(name: str, SS: float, df: int, error: float, df_error: int) -> Effect:
    if SS == 0:
        return Effect(name, 0.0, df, 0.0, 1.0, 0.0)
    F = (SS / df) / (error / df_error) if error > 0 else math.inf
    return Effect(name, SS, df, F, upper_tail(F, df, df_error), SS / (SS + error))


class _Cells(NamedTuple):
    """Number of values, mean less the origin and sum of squares of each cell, shape (levels, levels)."""

    counts: FloatArray
    means: FloatArray
    squares: FloatArray
    origin: float

    @classmethod
    def of(
        cls,
        vector: FloatArray,
        rows: npt.NDArray[np.int64],
        columns: npt.NDArray[np.int64],
        *,
        levels: tuple[tuple[str, ...], tuple[str, ...]],
        names: tuple[str, str],
    ) -> "_Cells":
        """Collect the cells of both factors, or raise InsufficientDataError if there are too few or too small ones."""
        shape = len(levels[0]), len(levels[1])
        for name, number in zip(names, shape, strict=True):
            if number < 2:
                raise InsufficientDataError(f"{name} has {number or 'no'} level, but a factor needs two or more.")
        cells, number = rows * shape[1] + columns, shape[0] * shape[1]
        counts = np.bincount(cells, minlength=number).astype(float)
        empty = np.flatnonzero(counts == 0)
        if empty.size:
            i, j = divmod(int(empty[0]), shape[1])
            raise InsufficientDataError(
                f"{empty.size} of {number} cells are empty, the first where {names[0]} is {levels[0][i]} and "
                f"{names[1]} is {levels[1][j]}; each combination needs values."
            )
        if counts.max() < 2:
            raise InsufficientDataError("Each cell has only one value; at least one needs two or more.")
        origin = float(vector[0])
        means = np.bincount(cells, weights=vector - origin) / counts
        differences = (vector - origin) - means[cells]
        # What rounding left of the means of the differences, which would be zero in exact arithmetic.
        corrections = np.bincount(cells, weights=differences) / counts
        squares = np.bincount(cells, weights=(differences - corrections[cells]) ** 2).astype(float)
        return cls(counts.reshape(shape), (means + corrections).reshape(shape), squares.reshape(shape), origin)

    def sums_of_squares(self, ss_type: int) -> tuple[float, float, float, float]:
        """Return the sums of squares of the first factor, the second, their interaction, and within cells."""
        first, interaction = self.additive(0)
        second, _ = self.additive(1)
        if ss_type == 1:
            first = self.alone(0)
        elif ss_type == 3:
            first, second = self.unweighted(0), self.unweighted(1)
        return first, second, interaction, float(self.squares.sum())

    def alone(self, axis: int) -> float:
        """Return the sum of squares between the levels of one factor, with no regard to the other."""
        sizes = self.counts.sum(axis=1 - axis)
        means = (self.counts * self.means).sum(axis=1 - axis) / sizes
        return _between(means, sizes)

    def unweighted(self, axis: int) -> float:
        """Return the sum of squares between the unweighted means of the levels of one factor (Yates)."""
        means = self.means.mean(axis=1 - axis)
        weights = self.means.shape[1 - axis] ** 2 / (1 / self.counts).sum(axis=1 - axis)
        return _between(means, weights)

    def additive(self, axis: int) -> tuple[float, float]:
        """Return what a factor adds to the other one's sum of squares, and what the two leave to their interaction."""
        counts, means = (self.counts, self.means) if axis == 0 else (self.counts.T, self.means.T)
        sizes = counts.sum(axis=0)
        averages = (counts * means).sum(axis=0) / sizes
        # The normal equations of both factors, of which the levels of the other one have been eliminated.
        shares = counts / sizes
        matrix = np.diag(counts.sum(axis=1)) - shares @ counts.T
        adjusted = (counts * (means - averages)).sum(axis=1)
        own = np.zeros(len(matrix))
        own[1:] = np.linalg.solve(matrix[1:, 1:], adjusted[1:])
        rest = means - averages - (own[:, np.newaxis] - own @ shares)
        return float(own @ adjusted), float((counts * rest**2).sum())

    def described(
        self, first: Sequence[str], second: Sequence[str]
    ) -> tuple[tuple[str, str, int, float, float | None], ...]:
        """Return levels, size, mean and standard deviation of each cell."""
        found = []
        for (i, j), n in np.ndenumerate(self.counts):
            sd = math.sqrt(self.squares[i, j] / (n - 1)) if n > 1 else None
            found.append((first[i], second[j], int(n), self.origin + float(self.means[i, j]), sd))
        return tuple(found)


def _between(means: FloatArray, weights: FloatArray) -> float:
    centred = means - means[0]
    centred -= (weights @ centred) / weights.sum()
    return float(weights @ centred**2)
