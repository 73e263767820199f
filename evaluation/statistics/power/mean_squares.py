"""Sums of squares of many complete, balanced studies at once."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.power.crossed_design import CrossedDesign, VarianceComponents

_ANY = VarianceComponents(rater_sd=0, item_sd=0, residual_sd=1)


def latin_square(conditions: int) -> npt.NDArray[np.intp]:
    """Return which condition each group of raters (rows) sees of each set of items (columns)."""
    return np.add.outer(np.arange(conditions), np.arange(conditions)) % conditions


def shape(design: CrossedDesign) -> tuple[int, ...]:
    """Return the shape of a study's ratings.

    Raters x items x conditions of a "full" design; conditions x raters of the group x items of a "between" design;
    groups x raters of the group x sets x items of the set of a "latin_square".
    """
    R, S, c = design.raters, design.items, design.conditions
    return {"full": (R, S, c), "between": (c, R // c, S), "latin_square": (c, R // c, c, S // c)}[design.assignment]


def degrees_of_freedom(design: CrossedDesign) -> dict[str, int]:
    """Return the degrees of freedom of each line; the lines are those of `CrossedDesign.strata`."""
    return {name: stratum.df for name, stratum in design.strata(_ANY).items()}


def of(design: CrossedDesign, ratings: FloatArray) -> Mapping[str, FloatArray]:
    """Return the sums of squares of studies, line by line.

    Parameters
    ----------
    design : CrossedDesign
        The design of all studies.
    ratings : numpy.ndarray, shape (studies, ...)
        Finite numbers; those of each study in the order of `shape`.

    Returns
    -------
    dict of str to numpy.ndarray, shape (studies,)
        Each line of `CrossedDesign.strata` with its sum of squares, and, if raters see all conditions, "raters", which
        no test needs; they add up to that around the grand mean.

    Raises
    ------
    DataError
        If the ratings have another shape.

    References
    ----------
    Winer (1971), Statistical Principles in Experimental Design, 2nd ed., chapters 5, 7 and 9 (Latin squares with
    repeated measures).
    """
    if ratings.shape[1:] != shape(design):
        raise DataError(f"The ratings have the shape {ratings.shape[1:]}, but the design has {shape(design)}.")
    build = {"full": _full, "between": _between, "latin_square": _latin_square}
    return build[design.assignment](design, ratings)


def _sum(values: FloatArray, times: float) -> FloatArray:
    """Return the sum of squares of each study's values, each of which stands for so many ratings."""
    flat = values.reshape(len(values), -1)
    squares: FloatArray = times * np.einsum("ij,ij->i", flat, flat)
    return squares


def _full(design: CrossedDesign, y: FloatArray) -> dict[str, FloatArray]:
    R, S, c = design.raters, design.items, design.conditions
    y = y - y.mean(axis=(1, 2, 3), keepdims=True)
    rater_item, rater_condition = y.mean(axis=3, keepdims=True), y.mean(axis=2, keepdims=True)
    item_condition = y.mean(axis=1, keepdims=True)
    rater, item = rater_item.mean(axis=2, keepdims=True), rater_item.mean(axis=1, keepdims=True)
    condition = item_condition.mean(axis=2, keepdims=True)
    rater_item -= rater + item
    rater_condition -= rater + condition
    item_condition -= item + condition
    return {
        "condition": _sum(condition, R * S),
        "rater": _sum(rater_condition, S),
        "item": _sum(item_condition, R),
        "error": _sum(y - rater_item - rater_condition - item_condition - rater - item - condition, 1),
        "items": _sum(item, R * c),
        "rater_items": _sum(rater_item, c),
        "raters": _sum(rater, S * c),
    }


def _between(design: CrossedDesign, y: FloatArray) -> dict[str, FloatArray]:
    R, S, c = design.raters, design.items, design.conditions
    y = y - y.mean(axis=(1, 2, 3), keepdims=True)
    condition = y.mean(axis=(2, 3), keepdims=True)
    rater = y.mean(axis=3, keepdims=True) - condition
    cells = y.mean(axis=2, keepdims=True)
    item = cells.mean(axis=1, keepdims=True)
    interaction = cells - condition - item
    return {
        "condition": _sum(condition, R // c * S),
        "rater": _sum(rater, S),
        "item": _sum(interaction, R // c),
        "error": _sum(y - rater - cells, 1),
        "items": _sum(item, R),
    }


def _latin_square(design: CrossedDesign, y: FloatArray) -> dict[str, FloatArray]:
    R, S, c = design.raters, design.items, design.conditions
    raters, items = R // c, S // c
    y = y - y.mean(axis=(1, 2, 3, 4), keepdims=True)
    of_rater, of_item = y.mean(axis=4, keepdims=True), y.mean(axis=2, keepdims=True)
    cells = of_rater.mean(axis=2, keepdims=True)
    error = y - of_rater - of_item + cells
    # Inside each group and set, so that nothing of the square is left.
    of_rater -= cells
    of_item -= cells
    square = cells[:, :, 0, :, 0]
    groups, sets = square.mean(axis=2, keepdims=True), square.mean(axis=1, keepdims=True)
    shown = latin_square(c)
    condition = np.stack([square[:, shown == number].mean(axis=1) for number in range(c)], axis=1)
    between_raters, between_items = of_rater.mean(axis=3, keepdims=True), of_item.mean(axis=1, keepdims=True)
    return {
        "condition": _sum(condition, raters * S),
        "rater": _sum(of_rater - between_raters, items),
        "item": _sum(of_item - between_items, raters),
        "error": _sum(error, 1),
        "items": _sum(between_items, R),
        "sets": _sum(sets, raters * c * items),
        "groups": _sum(groups, raters * c * items),
        "square": _sum(square - groups - sets - condition[:, shown], raters * items),
        "raters": _sum(between_raters, S),
    }
