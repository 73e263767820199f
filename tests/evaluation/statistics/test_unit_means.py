import math

import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.unit_means import unit_means


def test_means_and_counts():
    found = unit_means([1, 2, 4, 3, math.nan, 5], ["I", "I", "II", "II", "II", "I"], [7, 7, 7, 8, 8, 8])
    assert found.matrix.tolist() == [[1.5, 4], [5, 3]]
    assert found.counts.tolist() == [[2, 1], [1, 1]]
    assert (found.units, found.conditions) == (("7", "8"), ("I", "II"))
    assert found.apa() == "Mean ratings of 2 units in 2 conditions"
    assert found.to_frame().loc["8", "II"] == 3
    assert not found.flags
    assert not found.matrix.flags.writeable


@pytest.mark.parametrize(
    "labels",
    [
        ["x", "y", "x", "y"],
        np.array(["x", "y", "x", "y"]),
        pd.Series(["x", "y", "x", "y"]),
        pd.Series(["x", "y", "x", "y"], index=[9, 9, 9, 9]),
        np.array([0.5, 2, 0.5, 2]),
        ("x", 1, "x", 1),
    ],
)
def test_labels_of_every_kind_keep_the_order_of_appearance(labels):
    found = unit_means([1, 2, 3, 4], labels, ["b", "b", "a", "a"])
    assert found.matrix.tolist() == [[1, 2], [3, 4]]
    assert found.conditions == tuple(map(str, list(labels)[:2]))
    assert found.units == ("b", "a")


@pytest.mark.parametrize("wrap", [pd.Categorical, pd.CategoricalIndex, lambda *args: pd.Series(pd.Categorical(*args))])
def test_categories_set_the_order(wrap):
    found = unit_means([1, 2, 3, 4], wrap(["x", "y", "x", "y"], ["y", "x"]), ["b", "b", "a", "a"])
    assert found.conditions == ("y", "x")
    assert found.matrix.tolist() == [[2, 1], [4, 3]]
    with pytest.raises(InsufficientDataError, match="condition z has no ratings"):
        unit_means([1, 2, 3, 4], wrap(["x", "y", "x", "y"], ["x", "z", "y"]), ["b", "b", "a", "a"])
    with pytest.raises(DataError, match="conditions: the label at place 1 is missing"):
        unit_means([1, 2, 3, 4], wrap(["x", None, "x", "y"], ["x", "y"]), ["b", "b", "a", "a"])


def test_unused_units_of_a_categorical_are_not_lost_ones():
    units = pd.Categorical(["b", "b"], ["a", "b"])
    found = unit_means([1, 2], ["x", "y"], units)
    assert (found.units, found.left_out, found.flags) == (("b",), (), ())


def test_incomplete_units_are_left_out_and_named():
    units = [*range(9), *range(2)]
    found = unit_means(np.arange(11.0), ["I"] * 9 + ["II"] * 2, units)
    assert found.matrix.tolist() == [[0, 9], [1, 10]]
    assert found.left_out == ("2", "3", "4", "5", "6", "7", "8")
    assert found.flags == ("Units left out because they lack ratings in a condition: 2, 3, 4, 5, 6 and 2 more.",)


def test_a_large_common_part_costs_no_digits():
    found = unit_means([1e12 + 1, 1e12 + 2, 1e12 + 4], ["I", "I", "II"], ["a"] * 3)
    assert found.matrix.tolist() == [[1e12 + 1.5, 1e12 + 4]]


@pytest.mark.parametrize(
    ("values", "conditions", "units", "error", "message"),
    [
        ([], [], [], InsufficientDataError, "no ratings"),
        ([math.nan], ["I"], ["a"], InsufficientDataError, "no ratings"),
        ([1, math.nan], ["I", "II"], ["a", "a"], InsufficientDataError, "condition II has no ratings"),
        ([1, 2], ["I", "II"], ["a", "b"], InsufficientDataError, "No unit has ratings in all conditions"),
        ([1, 2], ["I"], ["a", "b"], DataError, "must be as many"),
        ([1, math.inf], ["I", "II"], ["a", "a"], DataError, "ratings: 1 of 2"),
        (["x", 1], ["I", "II"], ["a", "a"], DataError, "not all numbers"),
        ([[1, 2]], ["I", "II"], ["a", "a"], DataError, "2 dimensions"),
        ([1, 2], ["I", None], ["a", "a"], DataError, "conditions: the label at place 1 is missing"),
        ([1, 2], ["I", "II"], [math.nan, 1], DataError, "units: the label at place 0 is missing"),
        ([1, 2], [1, "1"], ["a", "a"], DataError, "conditions: two different labels are written alike"),
        ([1, 2], ["I", ["II"]], ["a", "a"], DataError, "single value"),
        ([1, 2], np.array([["I", "II"]]), ["a", "a"], DataError, "flat list"),
    ],
)
def test_bad_input(values, conditions, units, error, message):
    with pytest.raises(error, match=message):
        unit_means(values, conditions, units)
