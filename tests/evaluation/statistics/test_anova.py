import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.anova import one_way, one_way_from_summary, one_way_of_matrix, pooled_sd_from_f

NIST = ["SiRstv", "SmLs01", "SmLs03", "SmLs04", "SmLs06", "SmLs07", "SmLs09"]
KEYS = {
    "F": "F",
    "p": "p",
    "SSB": "SSB",
    "SSW": "SSW",
    "eta2": "eta_squared",
    "R2": "eta_squared",
    "omega2": "omega_squared",
}

group = hnp.arrays(float, st.integers(2, 12), elements=st.floats(-10, 10).map(lambda value: round(value, 3)))
groups = st.lists(group, min_size=2, max_size=5).map(
    lambda arrays: {f"g{n}": values for n, values in enumerate(arrays)}
)


def grouped(data) -> dict[str, list[float]]:
    """The groups of a published case."""
    if "generator" in data:
        pairs = (data["replicates"] - 1) // 2
        return {
            f"treatment {number}": [data["base"] + first] + [data["base"] + odd, data["base"] + even] * pairs
            for number, (first, odd, even) in enumerate(zip(data["first"], data["odd"], data["even"], strict=True))
        }
    found: dict[str, list[float]] = {}
    values, names = data.get("y") or data["response"], data.get("group") or data["treatment"]
    for value, name in zip(values, names, strict=True):
        found.setdefault(str(name), []).append(float(value))
    return found


@pytest.mark.parametrize("name", ["plantgrowth", "insectsprays", *(f"nist_{name}" for name in NIST)])
def test_published_cases(case, name):
    published = case(name)
    found = one_way(grouped(published["data"]))
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    assert [found.df_between, found.df_within] == expected["df"]
    for key in set(KEYS) & set(expected):
        assert getattr(found, KEYS[key]) == pytest.approx(expected[key], rel=rtol), key


@pytest.mark.parametrize("name", ["nist_NumAcc1", "nist_NumAcc3"])
def test_means_and_standard_deviations_keep_their_digits(case, name):
    published = case(name)
    base = published["data"].get("base")
    values = published["data"].get("y") or [base, *([base - 0.1, base + 0.1] * 500)]
    found = one_way({"all": values, "other": [0.0, 1.0]}).groups[0]
    rtol = published["tolerance"]["rtol"]
    assert found.mean == pytest.approx(published["expected"]["mean"], rel=rtol)
    assert found.sd == pytest.approx(published["expected"]["sd"], rel=rtol)


@pytest.mark.parametrize("experiment", ["head", "face", "avatar"])
def test_mtap_2013_table_10(case, experiment):
    published = case(f"mtap2013_table10_{experiment}")
    means, n, F = (published["data"][key] for key in ("means", "n", "F"))
    sd = pooled_sd_from_f(means, n, F)
    assert sd == pytest.approx(published["expected"]["pooled_sd"], rel=published["tolerance"]["rtol"])
    names = ["I", "II", "III"]
    found = one_way_from_summary(dict(zip(names, means, strict=True)), dict.fromkeys(names, sd), n)
    assert (found.df_between, found.df_within) == (2, 57)
    assert pytest.approx(F, rel=1e-12) == found.F
    assert found.eta_squared == pytest.approx(published["expected"]["eta2"], rel=published["tolerance"]["rtol"])
    assert found.p < 0.01


def test_the_sentence_is_in_apa_style(case):
    found = one_way(grouped(case("plantgrowth")["data"]))
    assert found.apa() == "F(2, 27) = 4.85, p = .016, η² = .26, ω² = .20"


def test_the_table_adds_up(case):
    table = one_way(grouped(case("plantgrowth")["data"])).to_frame().set_index("source")
    assert table.loc["total", "sum_of_squares"] == pytest.approx(
        table.loc["between", "sum_of_squares"] + table.loc["within", "sum_of_squares"]
    )
    assert table["df"].to_dict() == {"between": 2, "within": 27, "total": 29}
    assert table.loc["between", "mean_square"] == pytest.approx(3.76634 / 2)


@given(groups)
def test_it_agrees_with_scipy(data):
    within = sum(float(np.var(values)) for values in data.values())
    assume(within > 1e-6)
    found, expected = one_way(data), stats.f_oneway(*data.values())
    assume(expected.statistic > 1e-9)
    assert pytest.approx(expected.statistic, rel=1e-7, abs=1e-9) == found.F
    assert found.p == pytest.approx(expected.pvalue, rel=1e-6, abs=1e-12)


@given(groups, st.floats(-1e4, 1e4))
def test_a_shift_of_everything_changes_nothing(data, shift):
    assume(sum(float(np.var(values)) for values in data.values()) > 1e-4)
    found, moved = one_way(data), one_way({name: values + shift for name, values in data.items()})
    assert pytest.approx(found.F, rel=1e-5, abs=1e-7) == moved.F
    assert pytest.approx(found.SSW, rel=1e-6, abs=1e-9) == moved.SSW


@given(group, group)
def test_of_two_groups_f_is_t_squared(one, other):
    assume(np.var(one) + np.var(other) > 1e-4)
    n, m = len(one), len(other)
    pooled = ((n - 1) * np.var(one, ddof=1) + (m - 1) * np.var(other, ddof=1)) / (n + m - 2)
    t = (one.mean() - other.mean()) / math.sqrt(pooled * (1 / n + 1 / m))
    found = one_way({"one": one, "other": other})
    assert pytest.approx(t**2, rel=1e-7, abs=1e-9) == found.F
    assert found.p == pytest.approx(2 * stats.t.sf(abs(t), n + m - 2), rel=1e-6, abs=1e-6)


@given(groups)
def test_a_summary_is_as_good_as_the_values(data):
    assume(sum(float(np.var(values)) for values in data.values()) > 1e-4)
    found = one_way(data)
    again = one_way_from_summary(
        {group.name: group.mean for group in found.groups},
        {group.name: group.sd or 0.0 for group in found.groups},
        {group.name: group.n for group in found.groups},
    )
    assert pytest.approx(found.F, rel=1e-6, abs=1e-9) == again.F
    assert again.omega_squared == pytest.approx(found.omega_squared, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", [f"nist_{name}" for name in NIST])
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_matrix_keeps_as_many_digits_of_published_cases(case, name, order):
    published = case(name)
    groups = grouped(published["data"])
    matrix = np.array(list(groups.values())).T
    found = one_way_of_matrix(np.asarray(matrix, order=order), list(groups))
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    assert [found.df_between, found.df_within] == expected["df"]
    for key in set(KEYS) & set(expected):
        assert getattr(found, KEYS[key]) == pytest.approx(expected[key], rel=rtol), key


@given(st.integers(2, 90), st.integers(2, 150), st.floats(-1e6, 1e6), st.sampled_from("CF"), st.integers(0, 2**32))
@settings(max_examples=40)
def test_a_matrix_gives_what_its_columns_give(n, k, shift, order, seed):
    matrix = np.random.default_rng(seed).normal(size=(n, k)) + shift
    found = one_way_of_matrix(np.asarray(matrix, order=order))
    expected = one_way({str(number + 1): column for number, column in enumerate(matrix.T)})
    assert found.to_frame().to_numpy()[:, 1:].astype(float) == pytest.approx(
        expected.to_frame().to_numpy()[:, 1:].astype(float), rel=1e-8, abs=1e-12, nan_ok=True
    )
    assert [group.name for group in found.groups] == [group.name for group in expected.groups]
    assert [group.sd for group in found.groups] == pytest.approx([group.sd for group in expected.groups], rel=1e-8)


def test_rows_unlike_the_first_cost_a_matrix_no_digits():
    matrix = np.full((160, 3), 0.1)
    matrix[:10] = 1e6
    matrix += np.random.default_rng(1).normal(size=matrix.shape)
    found, expected = one_way_of_matrix(matrix), one_way(dict(zip("123", matrix.T, strict=True)))
    assert pytest.approx(expected.SSW, rel=1e-14) == found.SSW
    assert pytest.approx(expected.F, rel=1e-8) == found.F


@pytest.mark.parametrize(
    ("matrix", "error", "message"),
    [
        ([[1, 2], [1, math.nan]], DataError, "1 of 4 values are missing or infinite"),
        ([[1, 2], [1, math.inf]], DataError, "1 of 4 values are missing or infinite"),
        ([[1, 2], [1, 1e200]], DataError, "exceeds 1e\\+140"),
        ([1, 2, 3], DataError, "must have values x groups"),
        ([[1, 2], [1]], DataError, "not all numbers"),
        (np.empty((0, 3)), InsufficientDataError, "no rows"),
        (np.empty((3, 0)), InsufficientDataError, "two groups are needed"),
        (np.ones((3, 1)), InsufficientDataError, "two groups are needed"),
        (np.ones((1, 3)), InsufficientDataError, "only one value"),
        (np.full((200, 3), 1e9 + 0.1), InsufficientDataError, "All values are the same"),
    ],
)
def test_matrices_without_an_answer(matrix, error, message):
    with pytest.raises(error, match=message):
        one_way_of_matrix(matrix)


def test_names_of_columns():
    found = one_way_of_matrix([[1, 2], [3, 5]], ["I", "II"])
    assert [group.name for group in found.groups] == ["I", "II"]
    for names in (["I"], ["I", "I"]):
        with pytest.raises(DataError, match="2 different names"):
            one_way_of_matrix([[1, 2], [3, 5]], names)
    with pytest.raises(DataError, match="same name in writing"):
        one_way({1: [1, 2], "1": [3, 5]})


def test_groups_that_differ_without_any_variance_within():
    found = one_way({"a": [1.0, 1.0], "b": [2.0, 2.0]})
    assert (found.F, found.p, found.eta_squared) == (math.inf, 0.0, 1.0)
    assert found.summary().endswith("No group varies within itself, so F is infinite.")


def test_a_group_of_one_value_is_flagged():
    found = one_way({"a": [1.0, 2.0], "b": [2.0]})
    assert found.groups[1].sd is None
    assert "only one value" in found.flags[0]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({}, "two groups are needed to compare means; there is none"),
        ({"a": [1, 2]}, "two groups are needed to compare means; there is 1"),
        ({"a": [1, 2], "b": []}, "group b has no values"),
        ({"a": [1], "b": [2]}, "only one value"),
        ({"a": [0.1, 0.1], "b": [0.1, 0.1, 0.1]}, "All values are the same"),
        ({"a": [1e9 + 0.1] * 3, "b": [1e9 + 0.1] * 4}, "All values are the same"),
    ],
)
def test_too_little(data, message):
    with pytest.raises(InsufficientDataError, match=message):
        one_way(data)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, None, "x"])
def test_what_is_no_finite_number_is_told_with_its_group(wrong):
    with pytest.raises(DataError, match=r"^group b: "):
        one_way({"a": [1, 2], "b": [1, wrong]})


def test_bad_summaries():
    means = {"a": 1.0, "b": 2.0}
    with pytest.raises(DataError, match="same groups"):
        one_way_from_summary(means, {"a": 1.0}, 5)
    with pytest.raises(DataError, match="negative"):
        one_way_from_summary(means, {"a": 1.0, "b": -1.0}, 5)
    with pytest.raises(DataError, match="not positive"):
        one_way_from_summary(means, {"a": 1.0, "b": 1.0}, 0)
    with pytest.raises(DataError, match="whole number"):
        one_way_from_summary(means, {"a": 1.0, "b": 1.0}, 2.5)
    with pytest.raises(DataError, match="must be positive"):
        pooled_sd_from_f([1, 2], 20, 0)
    with pytest.raises(InsufficientDataError, match="two different means"):
        pooled_sd_from_f([2, 2], 20, 5)
