import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.posthoc import dunn, games_howell, paired_comparisons, tukey_hsd

# R 4.2.2, TukeyHSD(aov(…)): difference, lower, upper, adjusted p.
TUKEY = {
    ("plantgrowth", "trt1", "ctrl"): [-0.371, -1.062216051410459, 0.320216051410458, 0.3908711442021247],
    ("plantgrowth", "trt2", "ctrl"): [0.494, -0.197216051410459, 1.185216051410458, 0.1979959912997082],
    ("plantgrowth", "trt2", "trt1"): [0.865, 0.173783948589542, 1.556216051410459, 0.0120064239794527],
    ("insectsprays", "B", "A"): [0.833333333333336, -3.86607518062257, 5.53274184728924, 0.99518103136661],
    ("insectsprays", "F", "D"): [11.75, 7.05059148604409, 16.44940851395589, 5.99853067217992e-09],
    ("insectsprays", "D", "C"): [2.833333333333369, -1.86607518062254, 7.53274184728927, 0.492070744579934],
}
# R 4.2.2, by ptukey: difference, t, degrees of freedom, p.
GAMES_HOWELL = {
    ("plantgrowth", "ctrl", "trt1"): [0.371, 1.1912603818487, 16.5235850568593, 0.4745549221939801],
    ("plantgrowth", "trt1", "trt2"): [-0.865, -3.01009854212436, 14.1035691227603, 0.0237034547392031],
    ("insectsprays", "A", "D"): [9.583333333333332, 6.214359489959841, 16.7346763542627, 0.000125590069222081],
    ("insectsprays", "D", "F"): [-11.75, -6.076375289078413, 14.4786372865191, 0.000291414610901208],
}
# Student (1908), sleep gained by two drugs.
SLEEP = [
    [0.7, 1.9], [-1.6, 0.8], [-0.2, 1.1], [-1.2, 0.1], [-0.1, -0.1],
    [3.4, 4.4], [3.7, 5.5], [0.8, 1.6], [0, 4.6], [2, 3.4],
]  # fmt: skip

group = hnp.arrays(float, st.integers(0, 6), elements=st.sampled_from([1.0, 2.0, 2.5, 1e6, math.nan, math.inf]))
any_groups = st.lists(group, max_size=4).map(lambda arrays: {f"g{n}": values for n, values in enumerate(arrays)})


@pytest.fixture
def groups(case):
    def of(name):
        data, found = case(name)["data"], {}
        for value, label in zip(data["y"], data["group"], strict=True):
            found.setdefault(label, []).append(value)
        return found

    return of


def shifted(groups, offset, scale=1.0):
    return {name: np.array(values) * scale + offset for name, values in groups.items()}


@pytest.mark.parametrize(("name", "first", "second"), list(TUKEY))
def test_tukey_as_r(groups, name, first, second):
    pair = tukey_hsd(groups(name)).pair(first, second)
    found = [pair.difference, *pair.ci, pair.p_adjusted]
    assert found == pytest.approx(TUKEY[name, first, second], rel=1e-8, abs=1e-8)


def test_tukey_as_scipy_with_unequal_sizes():
    vectors = [[24.5, 23.5, 26.4, 27.1, 29.9], [28.4, 34.2, 29.5, 32.2], [26.1, 28.3, 24.3, 26.2, 27.8, 21.0]]
    expected = stats.tukey_hsd(*vectors)
    interval = expected.confidence_interval(0.9)
    found = tukey_hsd(dict(enumerate(vectors)), confidence=0.9)
    for pair in found.pairs:
        place = int(pair.first), int(pair.second)
        assert pair.p_adjusted == pytest.approx(expected.pvalue[place], rel=1e-8)
        assert pair.ci == pytest.approx([interval.low[place], interval.high[place]], rel=1e-8)
        assert pair.p <= pair.p_adjusted


@pytest.mark.parametrize(("name", "first", "second"), list(GAMES_HOWELL))
def test_games_howell_as_r(groups, name, first, second):
    pair = games_howell(groups(name)).pair(first, second)
    found = [pair.difference, pair.statistic, pair.df, pair.p_adjusted]
    assert found == pytest.approx(GAMES_HOWELL[name, first, second], rel=1e-6)
    half = stats.studentized_range.ppf(0.95, len(groups(name)), pair.df) / math.sqrt(2)
    assert pair.ci[1] - pair.difference == pytest.approx(half * pair.difference / pair.statistic, rel=1e-7)


def test_dunn_by_hand():
    # Ranks with ties: a 1.5 1.5 3, b 4.5 4.5, c 6 7; N = 7, ties take (6 + 6) / (12 * 6) off N (N + 1) / 12.
    found = dunn({"a": [1, 1, 2], "b": [3, 3], "c": [4, 5]}, method="holm")
    variance = 7 * 8 / 12 - 12 / 72
    z = (6.5 - 2) / math.sqrt(variance * (1 / 2 + 1 / 3))
    pair = found.pair("c", "a")
    assert (pair.difference, pair.statistic) == pytest.approx((4.5, z))
    assert pair.p == pytest.approx(2 * stats.norm.sf(z))
    assert pair.p_adjusted == pytest.approx(3 * pair.p)
    assert pair.df is None and pair.ci is None


def test_dunn_of_two_groups_is_kruskal_and_wallis():
    vectors = [[2.1, 3.3, 3.3, 4.0], [3.3, 4.0, 5.2, 6.1, 7.0]]
    pair = dunn(dict(enumerate(vectors)), method="none").pairs[0]
    expected = stats.kruskal(*vectors)
    assert (pair.statistic**2, pair.p) == pytest.approx((expected.statistic, expected.pvalue))


def test_pairs_as_student():
    found = paired_comparisons(SLEEP, conditions=["one", "two"])
    pair = found.pair("one", "two")
    assert (pair.statistic, pair.p, pair.df) == pytest.approx((-4.062127683382, 0.0028328901973843, 9), rel=1e-11)
    assert pair.ci == pytest.approx((-2.4598858, -0.7001142), abs=1e-7)  # R: t.test(…, paired = TRUE)


def test_pairs_of_three_conditions():
    table = np.random.default_rng(3).normal([0, 0.5, 2], 1, (12, 3))
    found = paired_comparisons(table)
    p = [stats.ttest_rel(table[:, int(pair.first) - 1], table[:, int(pair.second) - 1]).pvalue for pair in found.pairs]
    assert [pair.p for pair in found.pairs] == pytest.approx(p)
    order = np.argsort(p)
    assert found.pairs[order[0]].p_adjusted == pytest.approx(3 * p[order[0]])


def test_a_pair_without_variance_is_flagged_and_not_counted():
    found = paired_comparisons([[1, 2, 4], [2, 3, 9], [4, 5, 2.0]])
    assert "2-1" in found.flags[0]
    assert math.isnan(found.pair(2, 1).p_adjusted) and found.pair(2, 1).ci is None
    assert found.pair(3, 1).p_adjusted == pytest.approx(min(1, 2 * found.pair(3, 1).p))
    welch = games_howell({"a": [1, 1], "b": [2, 2], "c": [1, 3]})
    assert "b-a" in welch.flags[0] and math.isnan(welch.pair("a", "b").p_adjusted)


def test_the_sentence_names_the_pairs(groups):
    assert tukey_hsd(groups("plantgrowth")).apa() == (
        "Tukey's HSD, p adjusted by the studentised range: 1 of 3 pairs differs significantly at the .05 level: "
        "trt2 > trt1 (difference = 0.86, 95% CI [0.17, 1.56], t(27) = 3.10, p = .012)"
    )
    quiet = tukey_hsd({"a": [1, 2, 3], "b": [1, 2, 3.5]}).summary()
    assert "no pair differs significantly at the .05 level, smallest p = " in quiet
    assert games_howell(groups("insectsprays")).apa().endswith("; and 1 more")
    frame = dunn(groups("plantgrowth"), method="BH").to_frame()
    assert list(frame["first"]) == ["trt1", "trt2", "trt2"] and "z" in frame and frame["df"].isna().all()


@pytest.mark.parametrize("test", [tukey_hsd, games_howell, dunn])
def test_offset_scale_and_order_change_nothing(groups, test):
    plain = groups("plantgrowth")
    turned = test(dict(reversed(list(shifted(plain, 1e7, 4).items()))))
    for pair in test(plain).pairs:
        other = turned.pair(pair.first, pair.second)
        assert other.statistic == pytest.approx(pair.statistic, rel=1e-7)
        assert other.p_adjusted == pytest.approx(pair.p_adjusted, rel=1e-6)


def test_many_groups_take_no_minutes():
    table = np.random.default_rng(1).normal(size=(25, 5))
    found = games_howell({f"g{n}": row for n, row in enumerate(table)})
    assert len(found.pairs) == 25 * 24 // 2
    assert all(0 <= pair.p <= pair.p_adjusted <= 1 for pair in found.pairs)


@pytest.mark.parametrize("test", [tukey_hsd, games_howell, dunn])
@given(data=any_groups)
@settings(max_examples=40, deadline=None)
@pytest.mark.filterwarnings("error")
def test_bad_data_give_an_error_or_a_flag(test, data):
    try:
        found = test(data)
    except EvaluationError:
        return
    unknown = [pair for pair in found.pairs if math.isnan(pair.p_adjusted)]
    assert bool(unknown) == bool(found.flags)


def test_what_cannot_be_compared_is_refused():
    for test in (tukey_hsd, games_howell, dunn):
        with pytest.raises(InsufficientDataError):
            test({"a": [3, 3], "b": [3, 3]})
        with pytest.raises(DataError, match="confidence"):
            test({"a": [1, 2], "b": [3, 4]}, confidence=95)
    with pytest.raises(InsufficientDataError, match="only one value"):
        games_howell({"a": [1], "b": [2, 3]})
    with pytest.raises(InsufficientDataError, match="only one value"):
        tukey_hsd({"a": [1], "b": [2]})
    with pytest.raises(DataError, match="method"):
        dunn({"a": [1, 2], "b": [3, 4]}, method="tukey")
    with pytest.raises(DataError, match="not compared"):
        dunn({"a": [1, 2], "b": [3, 4]}).pair("a", "c")
    with pytest.raises(InsufficientDataError):
        paired_comparisons([[1, 2], [2, 3]])
    with pytest.raises(InsufficientDataError):
        paired_comparisons([[1, 2.0]])
    with pytest.raises(DataError, match="missing"):
        paired_comparisons([[1, math.nan], [2, 3]])
    with pytest.raises(DataError, match="names"):
        paired_comparisons(SLEEP, conditions=["same", "same"])
