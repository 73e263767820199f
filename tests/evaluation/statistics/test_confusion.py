import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy import stats
from statsmodels.stats.inter_rater import cohens_kappa

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.confusion import confusion, confusion_of_counts, wilson_interval

# Wagner (1993): hits squared over row times column.
COUNTS = [[8, 2, 0], [1, 6, 3], [0, 5, 5]]


def test_by_hand():
    found = confusion_of_counts(COUNTS, labels=["joy", "fear", "anger"])
    assert found.accuracy == pytest.approx(19 / 30)
    assert found.recall == pytest.approx([0.8, 0.6, 0.5])
    assert found.precision == pytest.approx([8 / 9, 6 / 13, 5 / 8])
    assert found.f1 == pytest.approx([16 / 19, 12 / 23, 10 / 18])
    assert found.macro_f1 == pytest.approx(np.mean([16 / 19, 12 / 23, 10 / 18]))
    assert found.hu == pytest.approx([64 / 90, 36 / 130, 25 / 80])
    assert found.hu_chance == pytest.approx([9 / 90, 13 / 90, 8 / 90])
    assert found.kappa == pytest.approx((19 / 30 - 1 / 3) / (2 / 3))
    assert (found.chance, found.n) == (pytest.approx(1 / 3), 30)
    assert found.p_chance == pytest.approx(stats.binomtest(19, 30, 1 / 3, alternative="greater").pvalue)
    assert found.recall_p[2] == pytest.approx(stats.binomtest(5, 10, 1 / 3, alternative="greater").pvalue)
    assert found.matrix().loc["fear", "anger"] == 3
    assert found.to_frame()["hits"].tolist() == [8, 6, 5]


def test_acii_2007_table_4(case):
    published = case("acii2007_table4")
    found = confusion_of_counts(published["data"]["table"])
    table = found.contingency()
    assert table.chi2 == pytest.approx(published["expected"]["chi2"], rel=1e-9)
    assert table.cramers_v == pytest.approx(published["expected"]["V"], rel=1e-9)
    assert table.apa() == table.summary()
    other = cohens_kappa(np.array(published["data"]["table"]))
    assert found.kappa == pytest.approx(other.kappa)
    assert found.kappa_ci == pytest.approx((other.kappa_low, other.kappa_upp))
    assert found.apa() == (
        "accuracy .62, 95% CI [.55, .68], chance .14, p < .001, N = 213, κ = .55, 95% CI [.48, .63], mean Hu = .41"
    )


def test_wilson_against_scipy():
    for hits, n in ((0, 5), (3, 9), (7, 7)):
        expected = stats.binomtest(hits, n).proportion_ci(method="wilson")
        assert wilson_interval([hits], [n])[0] == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert np.isnan(wilson_interval([0], [0])).all()
    with pytest.raises(DataError, match="as many successes"):
        wilson_interval([3], [2])


def test_choices_one_by_one():
    found = confusion(["b", "a", "a"], ["b", "b", "a"])
    assert found.labels == ("b", "a")
    assert found.counts.tolist() == [[1, 0], [1, 1]]
    words = confusion([1, 2, 2], [1, 1, 3], labels=[3, 2, 1])
    assert words.labels == ("3", "2", "1")
    assert words.counts.tolist() == [[0, 0, 0], [1, 0, 1], [0, 0, 1]]
    ordered = confusion(pd.Categorical(["x", "y"], categories=["y", "x", "z"]), ["x", "x"])
    assert ordered.labels == ("y", "x", "z")


def test_what_was_never_intended_or_chosen_is_flagged():
    found = confusion(["a", "a", "b"], ["a", "b", "a"], labels=["a", "b", "c"])
    assert math.isnan(found.recall[2])
    assert math.isnan(found.precision[2])
    assert np.isnan(found.recall_ci[2]).all()
    assert found.flags == (
        "Never intended, and so without recall: c.",
        "Never chosen, and so without precision: c.",
    )
    missed = confusion_of_counts([[0, 3], [0, 2]])
    assert missed.hu.tolist() == [0, pytest.approx(0.4)]


def test_one_category_alone_has_no_kappa():
    found = confusion_of_counts([[5, 0], [0, 0]])
    assert (found.kappa, found.kappa_ci, found.accuracy) == (None, None, 1)
    assert "no kappa" in found.summary()
    with pytest.raises(InsufficientDataError):
        found.contingency()


def test_guessing_is_rarely_significant():
    rng = np.random.default_rng(3)
    p = [confusion(rng.integers(0, 4, 60), rng.integers(0, 4, 60), labels=range(4)).p_chance for _ in range(300)]
    assert np.mean(np.array(p) < 0.05) < 0.08
    found = confusion_of_counts(COUNTS, chance=0.6)
    assert found.p_chance == pytest.approx(stats.binom.sf(18, 30, 0.6))


def test_bad_input():
    with pytest.raises(DataError, match="each needs both"):
        confusion(["a"], ["a", "b"])
    with pytest.raises(DataError, match="what is missing at place 1"):
        confusion(["a", None], ["a", "b"])
    with pytest.raises(DataError, match="'c' at place 0 is no category"):
        confusion(["c"], ["a"], labels=["a", "b"])
    with pytest.raises(DataError, match="differ"):
        confusion(["a"], ["a"], labels=["a", "a"])
    with pytest.raises(InsufficientDataError, match="two categories"):
        confusion(["a"], ["a"])
    with pytest.raises(InsufficientDataError):
        confusion([], [])
    with pytest.raises(InsufficientDataError, match="no choices"):
        confusion_of_counts([[0, 0], [0, 0]])
    for wrong in ([[1, 2]], [[-1, 0], [0, 1]], [[0.5, 0], [0, 1]], [[math.nan, 0], [0, 1]]):
        with pytest.raises(DataError):
            confusion_of_counts(wrong)
    for option, value in (("chance", 1), ("confidence", 2), ("labels", ["a"]), ("labels", ["a", "a"])):
        with pytest.raises(DataError):
            confusion_of_counts([[1, 0], [0, 1]], **{option: value})


@pytest.mark.filterwarnings("error")
@settings(deadline=None)
@given(arrays.arrays(np.int64, st.integers(2, 4).map(lambda k: (k, k)), elements=st.integers(0, 5)))
def test_any_counts_give_shares_or_say_why_not(counts):
    try:
        found = confusion_of_counts(counts)
    except InsufficientDataError:
        assert not counts.any()
        return
    assert 0 <= found.accuracy_ci[0] <= found.accuracy <= found.accuracy_ci[1] <= 1
    assert np.isnan(found.recall).tolist() == (counts.sum(axis=1) == 0).tolist()
    shares = np.concatenate([found.recall, found.precision, found.f1, found.hu, found.recall_p])
    assert ((shares[~np.isnan(shares)] >= 0) & (shares[~np.isnan(shares)] <= 1)).all()
    assert np.isnan(found.recall).any() <= bool(found.flags)
    assert found.kappa is None or found.kappa_ci[0] <= found.kappa <= found.kappa_ci[1]
    rows = np.repeat(np.arange(len(counts)), counts.sum(axis=1))
    columns = np.concatenate([np.repeat(np.arange(len(counts)), row) for row in counts])
    again = confusion(rows.tolist(), columns.tolist(), labels=range(len(counts)))
    assert (again.counts == counts).all()
