"""Labels of any kind as whole numbers: the levels of a factor, and categories, among which some may be missing."""

from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError

IntArray = npt.NDArray[np.intp]


class Levels(NamedTuple):
    """The levels of a factor, as conditions, raters or items are.

    Attributes
    ----------
    codes : numpy.ndarray of int, shape (n,)
        Place of each label among the levels.
    kinds : tuple
        The different labels.
    """

    codes: IntArray
    kinds: tuple[Any, ...]

    def titles(self, name: str) -> tuple[str, ...]:
        """Return the different labels as text; `name` says what they are.

        Raises
        ------
        DataError
            If two different labels are written alike.
        """
        titles = tuple(map(str, self.kinds))
        if len(set(titles)) < len(titles):
            raise DataError(f"{name}: two different labels are written alike; labels must differ as text.")
        return titles


def level_codes(
    labels: Any, *, name: str, n: int | None = None, unused: bool = True, sort_numbers: bool = False
) -> Levels:
    """Return the levels of a factor in the order of their first appearance, or that of a pandas categorical.

    Parameters
    ----------
    labels : sequence, shape (n,)
        Text, numbers, or a pandas categorical.
    name : str
        What they are, for messages.
    n : int, optional
        How many there must be.
    unused : bool
        Whether categories of a categorical that do not occur are levels too.
    sort_numbers : bool
        Whether levels that are all numbers come from small to large.

    Raises
    ------
    DataError
        If the labels are no flat list, one is missing, or there are not `n`.
    """
    try:
        codes, kinds = _factorised(labels, unused=unused)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name}: the labels must be a flat list of single values, such as text or numbers.") from error
    if n is not None and codes.size != n:
        raise DataError(f"{name}: there are {codes.size} labels for {n} values; each value needs one.")
    missing = np.flatnonzero(codes < 0)
    if missing.size:
        raise DataError(f"{name}: the label at place {missing[0]} is missing; leave its value out first.")
    if sort_numbers and not isinstance(getattr(labels, "dtype", None), pd.CategoricalDtype) and _are_numbers(kinds):
        order = sorted(range(len(kinds)), key=lambda place: kinds[place])
        codes, kinds = np.argsort(order)[codes], [kinds[place] for place in order]
    return Levels(codes, tuple(kinds))


def _factorised(labels: Any, *, unused: bool) -> tuple[IntArray, list[Any]]:
    dtype = getattr(labels, "dtype", None)
    if isinstance(dtype, pd.CategoricalDtype):
        categorical = pd.Categorical(labels)
        kept = categorical if unused else categorical.remove_unused_categories()
        return np.asarray(kept.codes, dtype=np.intp), kept.categories.tolist()
    # As objects, numbers and text keep their kinds, and a missing label does not turn into text.
    array = np.fromiter(labels, dtype=object, count=len(labels)) if dtype is None else labels
    if array.ndim != 1:
        raise ValueError
    codes, kinds = pd.factorize(pd.Index(array, tupleize_cols=False))
    return np.asarray(codes, dtype=np.intp), kinds.tolist()


def _are_numbers(kinds: Sequence[object]) -> bool:
    return all(isinstance(kind, int | float | np.number | np.bool_) for kind in kinds)


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
        return (tuple(sorted(found)), True) if _are_numbers(found) else (found, False)
    known = tuple(categories)
    if len(set(known)) < len(known):
        raise DataError(f"{name}: a category is named twice.")
    if pd.Series(list(known), dtype=object).isna().any():
        raise DataError(f"{name}: a category is missing.")
    return known, True
