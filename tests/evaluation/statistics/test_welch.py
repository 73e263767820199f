import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.t_test import welch_t
from evaluation.statistics.welch import welch


def grouped(data):
    """The groups of a published case."""
    values, names = np.array(data["y"], dtype=float), np.array(data["group"])
    return {name: values[names == name] for name in dict.fromkeys(data["group"])}


@pytest.mark.parametrize("name", ["plantgrowth", "insectsprays"])
def test_published_cases(case, name):
    published = case(name)
    expected, rtol = published["expected"], published["tolerance"]["rtol"]
    found = welch(grouped(published["data"]))
    assert [found.F, found.df_within, found.p] == pytest.approx(
        [expected["welch_F"], expected["welch_df2"], expected["welch_p"]], rel=rtol
    )
    assert found.df_between == expected["df"][0]


def test_the_sentence_and_the_frame(case):
    found = welch(grouped(case("plantgrowth")["data"]))
    assert found.apa() == "Welch's F(2, 17.13) = 5.18, p = .017, ω² = .22"
    assert found.to_frame()["df_within"].item() == found.df_within
    # Omega squared from F: 2 (F - 1) / (2 (F - 1) + 30).
    assert found.omega_squared == pytest.approx(2 * (found.F - 1) / (2 * (found.F - 1) + 30))


@given(st.integers(2, 9), st.integers(2, 9), st.integers(0, 2**32), st.sampled_from([1e-150, 1e-3, 1.0, 1e130]))
def test_of_two_groups_it_is_the_square_of_welchs_t_in_any_units(n, m, seed, unit):
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=n), rng.normal(1, 3, size=m)
    assume(min(np.ptp(x), np.ptp(y)) > 1e-3)
    found, expected = welch({"x": x * unit, "y": y * unit}), welch_t(x, y)
    assert pytest.approx(expected.t**2, rel=1e-9, abs=1e-12) == found.F
    assert found.df_within == pytest.approx(expected.df, rel=1e-9)
    assert found.p == pytest.approx(expected.p, rel=1e-7)


def test_a_large_common_part_costs_no_digits():
    groups = {"a": np.array([0.25, 0.5, 1]), "b": np.array([1, 2, 4.0]), "c": np.array([0.5, 3, 8, 9])}
    shifted = {name: values + 1e9 for name, values in groups.items()}
    assert pytest.approx(welch(groups).F, rel=1e-12) == welch(shifted).F


@pytest.mark.parametrize("constant", [[2.0], [1e9 + 0.1] * 3, [0.0, 0.0]])
def test_a_group_that_does_not_vary(constant):
    with pytest.raises(InsufficientDataError, match="group b do not vary"):
        welch({"a": [1, 2, 3], "b": constant})


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="two groups"):
        welch({"a": [1, 2]})
    with pytest.raises(InsufficientDataError, match="group b has no values"):
        welch({"a": [1, 2], "b": []})
    with pytest.raises(DataError, match="group b"):
        welch({"a": [1, 2], "b": [1, math.nan]})
