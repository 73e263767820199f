import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.assumptions import bartlett, fligner, levene, shapiro, shapiro_residuals

TESTS = [levene, bartlett, fligner, shapiro_residuals]

# Whole numbers, so that rounding ties or unties no distances.
group = hnp.arrays(float, st.integers(3, 12), elements=st.integers(-20, 20).map(float))
groups = st.lists(group, min_size=2, max_size=5).map(lambda found: {str(n): values for n, values in enumerate(found)})


def grouped(data):
    """The groups of a published case."""
    values, names = np.array(data["y"], dtype=float), np.array(data["group"])
    return {name: values[names == name] for name in dict.fromkeys(data["group"])}


@pytest.mark.parametrize("name", ["plantgrowth", "insectsprays"])
@pytest.mark.parametrize(
    ("test", "statistic", "p"),
    [
        (levene, "brown_forsythe_F", "brown_forsythe_p"),
        (bartlett, "bartlett", "bartlett_p"),
        (fligner, "fligner", "fligner_p"),
        (shapiro_residuals, "shapiro_resid_W", "shapiro_resid_p"),
    ],
)
def test_published_cases(case, name, test, statistic, p):
    published = case(name)
    found = test(grouped(published["data"]))
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    assert [found.statistic, found.p] == pytest.approx([expected[statistic], expected[p]], rel=rtol)
    assert found.n == len(published["data"]["y"])


def test_the_sentences(case):
    data = grouped(case("plantgrowth")["data"])
    assert levene(data).apa() == "Brown-Forsythe: F(2, 27) = 1.12, p = .341"
    assert levene(data, center="mean").apa().startswith("Levene: F(2, 27) = ")
    assert bartlett(data).apa() == "Bartlett: K²(2) = 2.88, p = .237"
    assert fligner(data).apa() == "Fligner-Killeen: χ²(2) = 2.35, p = .309"
    assert shapiro_residuals(data).apa() == "Shapiro-Wilk: W = .97, p = .438"


def test_the_frame(case):
    row = levene(grouped(case("plantgrowth")["data"])).to_frame().iloc[0]
    assert (row["df"], row["df_within"], row["n"]) == (2, 27, 30)
    assert math.isnan(shapiro([1, 2, 4]).to_frame()["df"].item())


def test_ties_that_rounding_broke_are_flagged(case):
    decimal = grouped(case("plantgrowth")["data"])
    whole = {name: np.round(values * 1000) for name, values in decimal.items()}
    exact = fligner(whole)
    assert not exact.flags
    assert fligner(decimal).statistic != pytest.approx(exact.statistic, rel=1e-6)
    assert f"χ²(2) = {exact.statistic:.4f}" in fligner(decimal).flags[0]


@given(groups)
@settings(max_examples=40)
def test_they_agree_with_scipy(data):
    assume(all(np.var(values) > 0 for values in data.values()))
    assume(np.ptp(np.concatenate([np.abs(values - np.median(values)) for values in data.values()])) > 0)
    for center in ("median", "mean"):
        distances = [np.abs(values - getattr(np, center)(values)) for values in data.values()]
        if sum(float(np.var(values)) for values in distances) > 1e-9:
            expected = stats.levene(*data.values(), center=center)
            found = levene(data, center=center)
            assert [found.statistic, found.p] == pytest.approx(
                [expected.statistic, expected.pvalue], rel=1e-6, abs=1e-9
            )
    for ours, theirs in ((bartlett, stats.bartlett), (fligner, stats.fligner)):
        found, expected = ours(data), theirs(*data.values())
        assert found.statistic == pytest.approx(expected.statistic, rel=1e-7, abs=1e-9)
        # Of equal variances scipy may find a statistic of Bartlett's below 0 by rounding, and then no p.
        p = 1.0 if math.isnan(expected.pvalue) else expected.pvalue
        assert found.p == pytest.approx(p, rel=1e-7, abs=1e-9)


@given(groups, st.sampled_from([2.0**-400, 0.5, 2.0**300]), st.sampled_from([0.0, 2.0**20]))
@settings(max_examples=30)
def test_units_and_a_common_part_change_nothing(data, unit, shift):
    assume(all(np.var(values) > 0 for values in data.values()))
    moved = {name: (values + shift) * unit for name, values in data.items()}
    for test in TESTS:
        try:
            expected = test(data)
        except InsufficientDataError:
            continue
        found = test(moved)
        assert [found.statistic, found.p] == pytest.approx([expected.statistic, expected.p], rel=1e-8, abs=1e-12)


def test_more_values_than_royston_fitted():
    values = np.random.default_rng(1).normal(size=5001)
    assert "5001 values" in shapiro(values).flags[0]
    assert not shapiro(values[:5000]).flags


@pytest.mark.parametrize("test", TESTS)
def test_bad_groups(test):
    with pytest.raises(InsufficientDataError, match="two groups"):
        test({})
    with pytest.raises(InsufficientDataError, match="two groups"):
        test({"a": [1, 2, 3]})
    with pytest.raises(InsufficientDataError, match="group b has no values"):
        test({"a": [1, 2, 3], "b": []})
    with pytest.raises(InsufficientDataError):
        test({"a": [0.1] * 3, "b": [1e6 + 0.1] * 4})
    with pytest.raises(InsufficientDataError):
        test({"a": [1], "b": [2]})
    for wrong in (math.nan, math.inf, None, "x", 1e300):
        with pytest.raises(DataError, match=r"^group b: "):
            test({"a": [1, 2, 3], "b": [1, wrong, 2]})


def test_what_each_cannot_answer():
    with pytest.raises(DataError, match="'median' or 'mean'"):
        levene({"a": [1, 2, 3], "b": [1, 2, 4]}, center="trimmed")
    with pytest.raises(InsufficientDataError, match="three values"):
        levene({"a": [1, 2], "b": [1, 4]})
    # Steps of a tenth beside a million: the distances are the same but for rounding.
    far = [1e6 + 0.1, 1e6 + 0.3, 1e6 + 0.1, 1e6 + 0.3]
    for test in (levene, fligner):
        with pytest.raises(InsufficientDataError, match="equally far"):
            test({"a": far, "b": [value + 0.7 for value in far]})
    with pytest.raises(InsufficientDataError, match="group b do not vary"):
        bartlett({"a": [1, 2, 3], "b": [4]})
    with pytest.raises(InsufficientDataError, match="three values or more; there are 2"):
        shapiro([1, 2])
    with pytest.raises(InsufficientDataError, match="do not vary"):
        shapiro([1e9 + 0.1] * 5)
    with pytest.raises(DataError, match=r"^values: "):
        shapiro([1, 2, math.nan])


def test_groups_each_of_one_spread():
    found = levene({"a": [0, 2, 0, 2], "b": [0, 4, 0, 4]})
    assert (found.statistic, found.p) == (math.inf, 0)
    assert "infinite" in found.flags[0]
