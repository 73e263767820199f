import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.statistics.label_codes import level_codes

LABELS = ["b", "a", "b", "c"]


@pytest.mark.parametrize("kind", [list, tuple, np.array, pd.Series, pd.Index, lambda one: np.array(one, dtype=object)])
def test_levels_come_in_the_order_of_their_first_appearance(kind):
    found = level_codes(kind(LABELS), name="x", n=4)
    assert (found.codes.tolist(), found.kinds) == ([0, 1, 0, 2], ("b", "a", "c"))
    numbers = level_codes(kind([3, 1, 3, 2]), name="x")
    assert (numbers.codes.tolist(), numbers.kinds) == ([0, 1, 0, 2], (3, 1, 2))
    assert numbers.titles("x") == ("3", "1", "2")


@pytest.mark.parametrize("series", [False, True])
def test_categories_keep_their_order(series):
    categories = pd.Categorical(LABELS, categories=["a", "z", "c", "b"])
    labels = pd.Series(categories) if series else categories
    assert level_codes(labels, name="x").kinds == ("a", "z", "c", "b")
    used = level_codes(labels, name="x", unused=False)
    assert (used.codes.tolist(), used.kinds) == ([2, 0, 2, 1], ("a", "c", "b"))


def test_numbers_may_be_sorted():
    found = level_codes([3, 1, 3, 2.5], name="x", sort_numbers=True)
    assert (found.codes.tolist(), found.kinds) == ([2, 0, 2, 1], (1, 2.5, 3))
    assert level_codes(LABELS, name="x", sort_numbers=True).kinds == ("b", "a", "c")
    assert level_codes(pd.Categorical([2, 1], categories=[2, 1]), name="x", sort_numbers=True).kinds == (2, 1)


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (["a", None], "x: the label at place 1 is missing"),
        ([1, float("nan")], "x: the label at place 1 is missing"),
        (pd.Categorical(["a", None]), "x: the label at place 1 is missing"),
        (pd.Series(["a", pd.NA], dtype="string"), "x: the label at place 1 is missing"),
        (["a", ["b"]], "x: the labels must be a flat list"),
        (np.array([["a", "b"]]), "x: the labels must be a flat list"),
        (5, "x: the labels must be a flat list"),
        (["a"], "x: there are 1 labels for 2 values"),
    ],
)
def test_bad_labels(labels, message):
    with pytest.raises(DataError, match=message):
        level_codes(labels, name="x", n=2)


def test_different_labels_may_not_be_written_alike():
    found = level_codes([1, "1", 1.0], name="x")
    assert found.kinds == (1, "1")
    with pytest.raises(DataError, match="x: two different labels are written alike"):
        found.titles("x")
