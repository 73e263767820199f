import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.icc import intraclass_correlations

seeds = st.integers(0, 2**32)
# Shrout and Fleiss (1979), table 2; the digits beyond table 4 and the intervals are those of R's psych 2.2.9.
SHROUT_AND_FLEISS = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
SINGLE = {
    "value": [0.165741768405476, 0.289763779527559, 0.714840714840715],
    "F": [1.79467849223947, 11.02724795640327, 11.02724795640327],
    "p": [0.1647688, 0.000134566, 0.000134566],
    "low": [-0.1329323248747509, 0.018786513374712, 0.3424647650339254],
    "high": [0.722560062328121, 0.761084369648953, 0.94585825995536],
}
MEAN_OF_FOUR = {
    "value": [0.442797133679269, 0.620050547598989, 0.909315542377069],
    "low": [-0.884442155238119, 0.0711368153025035, 0.6756747138163047],
    "high": [0.912415420340776, 0.927232040167722, 0.985891678169062],
}
MEAN_SQUARES = [11.2416666666667, 6.26388888888889, 32.4861111111111, 1.0194444444444]
FORMS = ["ICC1", "ICC2", "ICC3", "ICC1k", "ICC2k", "ICC3k"]


def values(found):
    return [form.value for form in found.forms]


def same(one, other, rel=1e-9):
    for first, second in zip(one.forms, other.forms, strict=True):
        assert (second.value, second.F, second.p) == pytest.approx((first.value, first.F, first.p), rel=rel, abs=1e-12)
        assert second.ci == pytest.approx(first.ci, rel=rel, abs=1e-12)


def some_ratings(rng, items, raters):
    return rng.normal(size=(items, 1)) + rng.normal(size=raters) + rng.normal(size=(items, raters))


class TestShroutAndFleiss:
    @pytest.mark.parametrize("shift", [0, 2**30])
    def test_all_numbers(self, shift):
        found = intraclass_correlations(np.array(SHROUT_AND_FLEISS) + shift)
        assert [form.form for form in found.forms] == FORMS
        for forms, expected in ((found.forms[:3], SINGLE), (found.forms[3:], SINGLE | MEAN_OF_FOUR)):
            assert [form.value for form in forms] == pytest.approx(expected["value"], rel=1e-12)
            assert [form.F for form in forms] == pytest.approx(expected["F"], rel=1e-12)
            assert [form.p for form in forms] == pytest.approx(expected["p"], rel=1e-5)
            assert [form.ci[0] for form in forms] == pytest.approx(expected["low"], rel=1e-9)
            assert [form.ci[1] for form in forms] == pytest.approx(expected["high"], rel=1e-9)
        ms = found.mean_squares
        squares = [ms.between_items, ms.within_items, ms.between_raters, ms.residual]
        assert squares == pytest.approx(MEAN_SQUARES, rel=1e-12)

    def test_sentences_and_frames(self):
        found = intraclass_correlations(SHROUT_AND_FLEISS)
        assert found["ICC2"].apa() == "ICC(2,1) = .29, 95% CI [.02, .76], F(5, 15) = 11.03, p < .001"
        assert found["ICC1k"].apa() == "ICC(1,4) = .44, 95% CI [-.88, .91], F(5, 18) = 1.79, p = .165"
        assert found.summary().count("; ICC(") == 5
        frame = found.to_frame().set_index("form")
        assert frame.loc["ICC3k", "value"] == found["ICC3k"].value
        assert frame["model"].tolist() == ["ICC(1)", "ICC(A,1)", "ICC(C,1)", "ICC(k)", "ICC(A,k)", "ICC(C,k)"]
        with pytest.raises(DataError, match="no form 'ICC4'; there are ICC1, ICC2"):
            found["ICC4"]

    def test_a_missing_rating_costs_its_item(self):
        ratings = np.array(SHROUT_AND_FLEISS, dtype=float)
        gap = np.vstack([ratings[:3], [5, math.nan, 2, 7], ratings[3:]])
        found = intraclass_correlations(gap)
        same(found, intraclass_correlations(ratings), rel=1e-12)
        assert found.flags == ("1 item of 7 with a missing rating left out.",)

    def test_a_rater_without_ratings_is_left_out(self):
        frame = pd.DataFrame(SHROUT_AND_FLEISS, columns=list("abcd")).assign(e=pd.NA)
        found = intraclass_correlations(frame)
        assert values(found) == pytest.approx([*SINGLE["value"], *MEAN_OF_FOUR["value"]], rel=1e-12)
        assert found.flags == ("Raters without any rating were left out: e.",)


@settings(max_examples=40)
@given(seeds, st.integers(2, 12), st.integers(2, 6))
def test_the_mean_squares_are_those_of_the_definition(seed, items, raters):
    x = some_ratings(np.random.default_rng(seed), items, raters)
    of_items, of_raters = x.mean(axis=1, keepdims=True), x.mean(axis=0)
    ms = intraclass_correlations(x).mean_squares
    assert ms.between_items == pytest.approx(raters * np.var(of_items, ddof=1), rel=1e-9)
    assert ms.within_items == pytest.approx(np.var(x, axis=1, ddof=1).mean(), rel=1e-9)
    assert ms.between_raters == pytest.approx(items * np.var(of_raters, ddof=1), rel=1e-9)
    residual = ((x - of_items - of_raters + x.mean()) ** 2).sum()
    assert ms.residual == pytest.approx(residual / ((items - 1) * (raters - 1)), rel=1e-9)


@settings(max_examples=40)
@given(seeds, st.floats(0.01, 1000), st.floats(-1e6, 1e6))
def test_scale_place_and_order_do_not_matter(seed, scale, shift):
    rng = np.random.default_rng(seed)
    x = some_ratings(rng, 8, 4)
    found = intraclass_correlations(x)
    moved = scale * rng.permutation(rng.permutation(x), axis=1) + shift
    # A small scale beside a large shift rounds the ratings themselves.
    same(found, intraclass_correlations(moved), rel=1e-9 + 1e-15 * abs(shift) / scale * 100)


def test_a_rater_who_is_stricter_lowers_agreement_but_not_consistency():
    x = some_ratings(np.random.default_rng(1), 10, 3)
    stricter = x - [0, 0, 5]
    one, other = intraclass_correlations(x), intraclass_correlations(stricter)
    assert other["ICC3"].value == pytest.approx(one["ICC3"].value, rel=1e-9)
    assert other["ICC2"].value < one["ICC2"].value / 2


def test_intervals_cover_as_often_as_they_say():
    rng = np.random.default_rng(5)
    covered = np.zeros(6)
    for _ in range(400):
        x = rng.normal(size=(12, 1)) + 0.7 * rng.normal(size=(1, 8)) + rng.normal(size=(12, 8))
        found = intraclass_correlations(x, confidence=0.8)
        agreed, consistent = 1 / 2.49, 1 / 2
        truth = [agreed, agreed, consistent, *(8 * rho / (1 + 7 * rho) for rho in (agreed, agreed, consistent))]
        covered += [form.ci[0] < rho < form.ci[1] for form, rho in zip(found.forms, truth, strict=True)]
    # ICC1 supposes other raters for each item, so its interval need not hold here.
    assert covered[[1, 2, 4, 5]] / 400 == pytest.approx(0.8, abs=0.06)


class TestLimits:
    def test_raters_who_agree_completely(self):
        found = intraclass_correlations(np.repeat([[0.1], [0.2], [0.7]], 4, axis=1) + 1e6)
        assert values(found) == [1] * 6
        assert [(form.F, form.p, form.ci) for form in found.forms] == [(math.inf, 0, (1, 1))] * 6
        assert "ICC(1,1): the raters leave no error at all, so F is infinite." in found.flags

    def test_raters_who_differ_in_level_only(self):
        found = intraclass_correlations(np.add.outer([1.0, 2, 4, 7], [0.0, 3, 1]))
        assert (found["ICC3"].value, found["ICC3"].ci, found["ICC3k"].value) == (1, (1, 1), 1)
        assert 0 < found["ICC2"].ci[0] < found["ICC2"].value < found["ICC2"].ci[1] < 1

    def test_nearly_complete_agreement_keeps_its_digits(self):
        rng = np.random.default_rng(1)
        items, errors = rng.normal(size=(20, 1)), rng.normal(size=(20, 5))
        expected = intraclass_correlations(np.zeros((20, 1)) + errors).mean_squares.residual
        found = intraclass_correlations(items + 2.0**-20 * errors).mean_squares.residual
        assert found == pytest.approx(2.0**-40 * expected, rel=1e-8)

    def test_items_with_the_same_mean(self):
        found = intraclass_correlations([[1, 3], [3, 1], [2, 2], [1.5, 2.5]])
        assert found["ICC1"].value == found["ICC3"].value == -1
        assert (found["ICC1k"].value, found["ICC1k"].ci) == (None, None)
        assert found["ICC3"].p == 1
        assert "ICC(1,2) has no value: the items differ less" in found.summary()
        assert math.isnan(found.to_frame()["value"][3])

    def test_small_numbers(self):
        x = some_ratings(np.random.default_rng(1), 6, 3)
        same(intraclass_correlations(x), intraclass_correlations(x * 2.0**-400))


@settings(max_examples=100)
@given(seeds, st.integers(2, 5), st.integers(2, 4), st.integers(1, 4), st.floats(0, 0.5))
def test_whatever_the_ratings_the_result_is_sound_or_flagged(seed, items, raters, steps, missing):
    rng = np.random.default_rng(seed)
    x = rng.integers(0, steps, size=(items, raters)).astype(float)
    x[rng.random(x.shape) < missing] = math.nan
    try:
        found = intraclass_correlations(x)
    except InsufficientDataError:
        return
    for form in found.forms:
        assert 0 <= form.p <= 1
        assert form.F >= 0
        if form.value is None or form.ci is None:
            assert form.flags
        else:
            assert form.value <= 1 + 1e-12
            assert form.ci[0] - 1e-9 <= form.value <= form.ci[1] + 1e-9


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="there are 4 items and 1 raters"):
        intraclass_correlations([[1], [2], [3], [4]])
    with pytest.raises(InsufficientDataError, match="at least 2 items and 2 raters; there are 1 items"):
        intraclass_correlations([[1, 2, 3]])
    with pytest.raises(InsufficientDataError, match="at least 2 items without a missing rating"):
        intraclass_correlations([[1, 2], [math.nan, 1], [2, math.nan]])
    with pytest.raises(InsufficientDataError):
        intraclass_correlations(np.full((3, 3), math.nan))
    with pytest.raises(InsufficientDataError, match="gave all items the same rating"):
        intraclass_correlations(np.tile([0.1, 1.1, 2.1], (4, 1)))
    with pytest.raises(InsufficientDataError):
        intraclass_correlations(np.empty((0, 0)))
    for wrong in (math.inf, 1e200):
        with pytest.raises(DataError, match="ratings"):
            intraclass_correlations([[1, 2], [2, wrong], [3, 4]])
    with pytest.raises(DataError, match="not all numbers"):
        intraclass_correlations([["a", "b"], ["c", "d"]])
    with pytest.raises(DataError, match="items x raters"):
        intraclass_correlations([1, 2, 3])
    with pytest.raises(DataError, match="between 0 and 1"):
        intraclass_correlations([[1, 2], [2, 3]], confidence=0)
