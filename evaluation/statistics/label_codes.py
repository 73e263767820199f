"""Labels of any kind as whole numbers."""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError

IntArray = npt.NDArray[np.intp]


class LabelCodes(NamedTuple):
    """Labels as places in a list of categories.

    Attributes
    ----------
    codes : numpy.ndarray of int
        Place of each label's category, in the shape of the labels; -1 where a label is missing.
    categories : tuple
        The categories.
    ordered : bool
        Whether their order is known: it was given, they are numbers, or they come from a pandas categorical.
    """

    codes: IntArray
    categories: tuple[Hashable, ...]
    ordered: bool


def label_codes(labels: npt.ArrayLike, *, categories: Sequence[Hashable] | None = None, name: str) -> LabelCodes:
    """Return labels as places in the list of their categories.

    Parameters
    ----------
    labels : array_like
        Labels (text, numbers or anything that can be looked up), in any shape; None or NaN where one is missing.
    categories : sequence, optional
        All categories in their order. Without it, those of a pandas categorical; else the numbers that occur, from
        small to large; else the labels that occur, by first appearance.
    name : str
        What the labels are, for the message.

    Returns
    -------
    LabelCodes
        Places, categories, and whether their order means something.

    Raises
    ------
    DataError
        If a label is not among the categories, infinite or no single value, or a category is named twice or missing.
    """
    if categories is None and isinstance(labels, pd.Series) and isinstance(labels.dtype, pd.CategoricalDtype):
        categories = labels.cat.categories.tolist()
    elif categories is None and isinstance(labels, pd.Categorical):
        categories = labels.categories.tolist()
    array = _as_objects(labels, name)
    flat = pd.Series(array.ravel(), dtype=object)
    missing = flat.isna().to_numpy()
    if any(_is_infinite(label) for label in flat[~missing].unique()):
        raise DataError(f"{name}: a label is infinite; leave it out first.")
    known, ordered = _categories(flat[~missing], categories, name)
    codes = pd.Index(known, dtype=object, tupleize_cols=False).get_indexer(pd.Index(flat, tupleize_cols=False))
    codes[missing] = -1
    unknown = np.flatnonzero((codes < 0) & ~missing)
    if unknown.size:
        listed = ", ".join(str(category) for category in known)
        raise DataError(f"{name}: the label {flat[unknown[0]]!r} is not among the categories ({listed}).")
    return LabelCodes(codes.astype(np.intp).reshape(array.shape), known, ordered)


def _as_objects(labels: npt.ArrayLike, name: str) -> npt.NDArray[np.object_]:
    try:
        array = np.asarray(labels)
        if array.dtype.kind in "US":
            # Mixed lists would have become text, the missing labels and the numbers in them too.
            array = np.asarray(labels, dtype=object)
    except ValueError as error:
        raise DataError(f"{name}: the rows of labels differ in length.") from error
    return array.astype(object)


def _is_infinite(label: object) -> bool:
    return isinstance(label, float | np.floating) and bool(np.isinf(label))


def _categories(
    given: pd.Series, categories: Sequence[Hashable] | None, name: str
) -> tuple[tuple[Hashable, ...], bool]:
    try:
        found = tuple(given.unique())
    except TypeError as error:
        raise DataError(f"{name}: each label must be a single value, such as a text or a number.") from error
    if categories is None:
        numbers = all(isinstance(label, int | float | np.number | np.bool_) for label in found)
        return (tuple(sorted(found)), True) if numbers else (found, False)
    known = tuple(categories)
    if len(set(known)) < len(known):
        raise DataError(f"{name}: a category is named twice.")
    if pd.Series(list(known), dtype=object).isna().any():
        raise DataError(f"{name}: a category is missing.")
    return known, True
