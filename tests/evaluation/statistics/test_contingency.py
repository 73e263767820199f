import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.contingency import contingency, contingency_of_counts

EMOTIONS = ["neutral", "happy", "sad", "surprise", "angry", "fear", "disgust"]
labels = st.lists(st.tuples(st.integers(0, 4), st.sampled_from("abc")), min_size=4, max_size=60)


@pytest.fixture
def table_4(case):
    return contingency_of_counts(case("acii2007_table4")["data"]["table"], column_names=EMOTIONS)


def test_acii_2007_table_4(case, table_4):
    published = case("acii2007_table4")
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    assert list(table_4.row_sums) == expected["rows"]
    assert list(table_4.column_sums) == expected["cols"]
    assert table_4.total == expected["total"]
    assert table_4.chi2 == pytest.approx(expected["chi2"], rel=rtol)
    assert table_4.cramers_v == pytest.approx(expected["V"], rel=rtol)
    assert table_4.purity == pytest.approx(expected["purity"], rel=rtol)
    assert table_4.df == 36
    assert table_4.p < 1e-80


def test_the_matching_of_table_4_gives_each_cluster_its_own_emotion(table_4):
    matched = dict(table_4.matching)
    assert sorted(matched) == list("1234567")
    assert sorted(matched.values()) == sorted(EMOTIONS)
    # The largest count of each row happens to be in a column of its own, so that matching and purity agree.
    assert table_4.share_matched == table_4.purity


def test_the_sentence_and_the_frame(table_4):
    assert table_4.summary() == (
        "χ²(36, N = 213) = 505.54, p < .001, V = .63, purity = .62 (smallest expected count 2.72: p is approximate)"
    )
    frame = table_4.to_frame()
    assert frame.loc["3", "angry"] == 9
    assert frame.loc["sum", "sum"] == 213
    assert frame["sum"].tolist()[:2] == [29, 29]


def test_a_table_of_two_by_two_has_no_continuity_correction():
    # n (ad - bc)² over the product of the four sums.
    found = contingency_of_counts([[12, 5], [6, 14]])
    assert found.chi2 == pytest.approx(37 * (12 * 14 - 5 * 6) ** 2 / (17 * 20 * 18 * 19))
    assert found.df == 1
    assert found.p == pytest.approx(math.erfc(math.sqrt(found.chi2 / 2)))
    assert found.cramers_v == pytest.approx(math.sqrt(found.chi2 / 37))
    assert "approximate" not in found.summary()


def test_a_matching_need_not_take_the_largest_cell():
    found = contingency_of_counts([[10, 9], [9, 0]], row_names=["x", "y"], column_names=["a", "b"])
    assert found.matching == (("x", "b"), ("y", "a"))
    assert found.share_matched == pytest.approx(18 / 28)
    assert found.purity == pytest.approx(19 / 28)


@given(labels)
def test_counts_are_those_of_pandas(pairs):
    rows, columns = zip(*pairs, strict=True)
    assume(len(set(rows)) > 1 and len(set(columns)) > 1)
    found = contingency(rows, columns)
    expected = pd.crosstab(np.array(rows), np.array(columns))
    assert np.array(found.counts).tolist() == expected.to_numpy().tolist()
    assert found.row_names == tuple(str(name) for name in expected.index)
    assert found.column_names == tuple(expected.columns)
    assert 0 <= found.cramers_v <= 1
    assert found.share_matched <= found.purity <= 1


@given(labels)
def test_turning_the_table_changes_neither_chi_square_nor_matching(pairs):
    rows, columns = zip(*pairs, strict=True)
    assume(len(set(rows)) > 1 and len(set(columns)) > 1)
    one, other = contingency(rows, columns), contingency(columns, rows)
    assert (other.chi2, other.df, other.p) == pytest.approx((one.chi2, one.df, one.p))
    assert other.share_matched == pytest.approx(one.share_matched)


def test_the_same_division_twice_is_perfect():
    kinds = ["a", "b", "c"] * 5
    found = contingency([{"a": 2, "b": 0, "c": 1}[kind] for kind in kinds], kinds)
    assert found.cramers_v == pytest.approx(1)
    assert found.purity == found.share_matched == 1
    assert set(found.matching) == {("2", "a"), ("0", "b"), ("1", "c")}


def test_rows_without_counts_do_not_count():
    found = contingency_of_counts([[12, 5], [0, 0], [6, 14]])
    without = contingency_of_counts([[12, 5], [6, 14]])
    assert (found.chi2, found.df, found.cramers_v) == pytest.approx((without.chi2, without.df, without.cramers_v))
    assert found.row_sums == (17, 0, 20)


def test_categories_that_have_no_order_keep_that_of_their_appearance():
    assert contingency(["b", 1, "b", 1], [1, 2, 1, 2]).row_names == ("b", "1")


def test_bad_input():
    with pytest.raises(DataError, match="3 row and 2 column categories"):
        contingency([1, 2, 3], ["a", "b"])
    with pytest.raises(DataError, match="columns: the label at place 1 is missing"):
        contingency([1, 2, 3], ["a", None, "b"])
    with pytest.raises(DataError, match="whole numbers of 0 or more"):
        contingency_of_counts([[1, 2], [3, -4]])
    with pytest.raises(DataError, match="whole numbers of 0 or more"):
        contingency_of_counts([[1, 2], [3, 0.5]])
    with pytest.raises(DataError, match="missing or infinite"):
        contingency_of_counts([[1, 2], [3, math.nan]])
    with pytest.raises(DataError, match="There are 2 rows, but 1 names"):
        contingency_of_counts([[1, 2], [3, 4]], row_names=["a"])
    with pytest.raises(DataError, match="columns must differ"):
        contingency_of_counts([[1, 2], [3, 4]], column_names=["a", "a"])
    with pytest.raises(InsufficientDataError, match="in 2 rows and 1 columns"):
        contingency_of_counts([[1, 0], [3, 0]])
    with pytest.raises(InsufficientDataError, match="in 0 rows and 0 columns"):
        contingency([], [])
