"""Ordered categories, fixed predictors and labels, prepared for the cumulative-logit models."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.label_codes import IntArray
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array

_MOST_CATEGORIES = 256
_MOST_PREDICTORS = 200
# A predictor of which less than this share is new is a combination of the others.
_LEAST_NEW_SHARE = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class Categories:
    """Ordered categories.

    Attributes
    ----------
    codes : numpy.ndarray of int, shape (n,)
        Place of each answer among the labels.
    labels : tuple
        The categories that occur, the lowest first.
    flags : tuple of str
        Categories that never occur.
    """

    codes: IntArray
    labels: tuple[Hashable, ...]
    flags: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Predictors:
    """Fixed predictors in columns that are centred, uncorrelated and of variance 1.

    Attributes
    ----------
    names : tuple of str, length p
        What the columns were called.
    x : numpy.ndarray, shape (n, p)
        The new columns: (old - means) @ mixing.
    means : numpy.ndarray, shape (p,)
        Means of the old columns.
    mixing : numpy.ndarray, shape (p, p)
        Coefficients of the old columns are `mixing` @ those of the new ones.
    """

    names: tuple[str, ...]
    x: FloatArray
    means: FloatArray
    mixing: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """Distinct rows of the data: between which thresholds the answer lies, and what predicts it.

    Attributes
    ----------
    upper, lower : numpy.ndarray of int, shape (m,)
        Places of the thresholds above and below the answer, in all thresholds followed by plus and minus infinity.
    x : numpy.ndarray, shape (m, p)
        Predictors, as in `Predictors`.
    weight : numpy.ndarray, shape (m,)
        How often the row occurs.
    sets, cuts : int
        How many sets of thresholds there are, and how many thresholds there are in each.
    factors : tuple of numpy.ndarray of int, each of shape (m,)
        Level of each random factor.
    """

    upper: IntArray
    lower: IntArray
    x: FloatArray
    weight: FloatArray
    sets: int
    cuts: int
    factors: tuple[IntArray, ...] = ()

    @property
    def inner(self) -> FloatArray:
        """How many answers lie between two thresholds, by the place of the upper one; shape (sets, cuts - 1)."""
        total = self.sets * self.cuts
        between = (self.upper < total) & (self.lower < total)
        counts = np.bincount(self.upper[between], self.weight[between], minlength=total)
        return counts.astype(float).reshape(self.sets, self.cuts)[:, 1:]

    def bounds(self, thresholds: FloatArray, eta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far the thresholds above and below each answer are from the linear predictor."""
        extended = np.concatenate([thresholds, [np.inf, -np.inf]])
        return extended[self.upper] - eta, extended[self.lower] - eta

    def with_factors(self, factors: Sequence[IntArray]) -> "Rows":
        """Return the same rows with other random factors."""
        return replace(self, factors=tuple(factors))


def ordered_categories(y: npt.ArrayLike | pd.Series | pd.Categorical, *, name: str = "y") -> Categories:
    """Return the categories of ordered answers.

    Parameters
    ----------
    y : array_like, shape (n,)
        Numbers, whose order is theirs, or an ordered pandas categorical.
    name : str
        What they are, for messages.

    Returns
    -------
    Categories
        Those that occur, with a flag for others.

    Raises
    ------
    DataError
        If an answer is missing or infinite, the labels have no order, or more than 256 differ.
    InsufficientDataError
        If there are fewer than two answers or categories.
    """
    if isinstance(y, pd.Categorical):
        codes, labels, unused = _of_categorical(y, name)
    elif isinstance(y, pd.Series) and isinstance(y.dtype, pd.CategoricalDtype):
        codes, labels, unused = _of_categorical(pd.Categorical(y), name)
    else:
        codes, labels, unused = _of_numbers(y, name)
    if not codes.size:
        raise InsufficientDataError(f"{name}: there are no answers.")
    if len(labels) < 2:
        raise InsufficientDataError(
            f"{name}: all {codes.size} answers are {labels[0]}; an ordinal model needs two categories or more."
        )
    if len(labels) > _MOST_CATEGORIES:
        raise DataError(
            f"{name}: there are {len(labels)} different values, but an ordinal model takes at most {_MOST_CATEGORIES}; "
            "use a model for continuous values."
        )
    flags: tuple[str, ...] = ()
    if unused:
        which = "category " + str(unused[0]) if len(unused) == 1 else "categories " + ", ".join(map(str, unused))
        flags = (f"Nobody chose the {which}; the model knows only the categories that were used.",)
    return Categories(codes=codes.astype(np.intp), labels=labels, flags=flags)


def _of_categorical(y: "pd.Categorical[Any]", name: str) -> tuple[IntArray, tuple[Hashable, ...], list[Hashable]]:
    if (y.codes < 0).any():
        raise DataError(f"{name}: {int((y.codes < 0).sum())} of {len(y)} answers are missing; leave them out first.")
    if not y.ordered:
        if pd.api.types.is_numeric_dtype(y.categories.dtype):
            return _of_numbers(np.asarray(y), name)
        raise DataError(f"{name}: the categories have no order; use an ordered pandas categorical.")
    used, codes = np.unique(y.codes, return_inverse=True)
    labels = tuple(y.categories[k] for k in used)
    return codes, labels, [label for label in y.categories if label not in labels]


def _of_numbers(y: npt.ArrayLike, name: str) -> tuple[IntArray, tuple[Hashable, ...], list[Hashable]]:
    array = np.asarray(y)
    if array.dtype.kind in "OUS" and any(isinstance(value, str | bytes) for value in array.ravel()):
        raise DataError(f"{name}: text has no order of its own; use an ordered pandas categorical, or numbers.")
    values, codes = np.unique(finite_vector(array, name=name), return_inverse=True)
    if values.size and (values == np.round(values)).all() and np.abs(values).max() < 2**53:
        whole = [int(value) for value in values]
        between = range(whole[0], whole[-1] + 1)
        unused = sorted(set(between) - set(whole)) if len(between) <= _MOST_CATEGORIES else []
        return codes, tuple(whole), list(unused)
    return codes, tuple(float(value) for value in values), []


def predictors(fixed: npt.ArrayLike | pd.DataFrame, *, n: int, names: Sequence[str] | None = None) -> Predictors:
    """Return fixed predictors in columns that are easy to compute with.

    Parameters
    ----------
    fixed : array_like or pandas.DataFrame, shape (n, p)
        Predictors without a column for the intercept, which the thresholds are.
    n : int
        How many answers there are.
    names : sequence of str, optional
        Names of the columns; left out, those of the frame, or x1, x2 and so on.

    Returns
    -------
    Predictors
        The new columns and the way back.

    Raises
    ------
    DataError
        If the predictors are no table of `n` rows of finite numbers, or the names do not fit.
    InsufficientDataError
        If a column is constant or a combination of others.
    """
    matrix = finite_array(fixed, axes=("answers", "predictors"), name="fixed")
    p = matrix.shape[1]
    if len(matrix) != n:
        raise DataError(f"fixed has {len(matrix)} rows for {n} answers; each answer needs one.")
    if p > _MOST_PREDICTORS:
        raise DataError(f"fixed has {p} columns, but an ordinal model takes at most {_MOST_PREDICTORS}.")
    if names is None:
        names = [str(c) for c in fixed.columns] if isinstance(fixed, pd.DataFrame) else [f"x{k + 1}" for k in range(p)]
    if len(names) != p or len(set(names)) != p:
        raise DataError(f"There are {len(set(names))} different names for {p} columns; each column needs its own.")
    means, differences = centred_columns(matrix)
    constant = np.flatnonzero(constant_columns(matrix, differences))
    if constant.size:
        raise InsufficientDataError(
            f"The predictor {names[constant[0]]} is the same for all answers, so it has no effect that could be seen "
            "(the thresholds are the intercept)."
        )
    largest = np.abs(differences).max(axis=0)
    scales = largest * np.sqrt(((differences / largest) ** 2).mean(axis=0))
    new, triangle = np.linalg.qr(differences / scales)
    share = np.abs(np.diag(triangle)) / np.sqrt(n)
    if (share < _LEAST_NEW_SHARE).any():
        name = names[int(np.flatnonzero(share < _LEAST_NEW_SHARE)[0])]
        raise InsufficientDataError(
            f"The predictor {name} is a combination of those before it, so its effect cannot be told from theirs."
        )
    mixing = np.linalg.solve(triangle, np.eye(p)) * np.sqrt(n) / scales[:, None]
    return Predictors(names=tuple(map(str, names)), x=new * np.sqrt(n), means=means, mixing=mixing)


def distinct_rows(
    answers: IntArray, categories: int, x: FloatArray, factors: Sequence[IntArray] = (), sets: IntArray | None = None
) -> Rows:
    """Return the distinct rows of the data and how often each occurs.

    Parameters
    ----------
    answers : numpy.ndarray of int, shape (n,)
        Codes of the answers.
    categories : int
        How many categories there are.
    x : numpy.ndarray, shape (n, p)
        Predictors.
    factors : sequence of numpy.ndarray of int, each of shape (n,)
        Levels of random factors.
    sets : numpy.ndarray of int, shape (n,), optional
        Which set of thresholds each row has; left out, there is one set.
    """
    columns = [answers, *(np.unique(column, return_inverse=True)[1] for column in x.T), *factors]
    if sets is not None:
        columns.append(sets)
    together: IntArray = np.zeros(len(answers), dtype=np.intp)
    for column in columns:
        _, together = np.unique(together * (int(column.max()) + 1) + column, return_inverse=True)
    _, first, weight = np.unique(together, return_index=True, return_counts=True)
    cuts = categories - 1
    number = 1 if sets is None else int(sets.max()) + 1
    start = 0 if sets is None else sets[first] * cuts
    answer = answers[first]
    return Rows(
        upper=np.where(answer < cuts, start + answer, number * cuts),
        lower=np.where(answer > 0, start + answer - 1, number * cuts + 1),
        x=x[first],
        weight=weight.astype(float),
        sets=number,
        cuts=cuts,
        factors=tuple(factor[first] for factor in factors),
    )
