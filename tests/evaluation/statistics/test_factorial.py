import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from statsmodels.stats.anova import anova_lm

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.factorial import two_way

# R's ToothGrowth (Crampton, 1947, Journal of Nutrition 33:491): ten guinea pigs in each cell.
TOOTH_LENGTHS = [
    *(4.2, 11.5, 7.3, 5.8, 6.4, 10.0, 11.2, 11.2, 5.2, 7.0),
    *(16.5, 16.5, 15.2, 17.3, 22.5, 17.3, 13.6, 14.5, 18.8, 15.5),
    *(23.6, 18.5, 33.9, 25.5, 26.4, 32.5, 26.7, 21.5, 23.3, 29.5),
    *(15.2, 21.5, 17.6, 9.7, 14.5, 10.0, 8.2, 9.4, 16.5, 9.7),
    *(19.7, 23.3, 23.6, 26.4, 20.0, 25.2, 25.8, 21.2, 14.5, 27.3),
    *(25.5, 26.4, 22.4, 24.5, 24.8, 30.9, 26.4, 27.3, 29.4, 23.0),
]
SUPPLEMENT = ["VC"] * 30 + ["OJ"] * 30
DOSE = ([0.5] * 10 + [1.0] * 10 + [2.0] * 10) * 2


@pytest.mark.parametrize("ss_type", [1, 2, 3])
def test_tooth_growth(ss_type):
    found = two_way(TOOTH_LENGTHS, SUPPLEMENT, DOSE, names=("supp", "dose"), ss_type=ss_type)
    # R: aov(len ~ supp * factor(dose)).
    expected = [(205.35, 15.5719794524973), (2426.43433333, 91.9999648928671), (108.319, 4.10699109402253)]
    for effect, (SS, F) in zip(found.effects, expected, strict=True):
        assert pytest.approx((effect.SS, effect.F), rel=1e-8) == (SS, F)
    assert [effect.p for effect in found.effects] == pytest.approx(
        [0.000231182809773421, 4.04629119599216e-18, 0.0218602689647909], rel=1e-9
    )
    assert (found.SS_error, found.df_error) == (pytest.approx(712.106), 54)
    assert found.flags == ()
    assert found.cells[0] == ("VC", "0.5", 10, pytest.approx(7.98), pytest.approx(2.746634, rel=1e-6))


def test_the_sentence_and_the_table():
    found = two_way(TOOTH_LENGTHS, SUPPLEMENT, DOSE, names=("supp", "dose"))
    assert found.apa() == (
        "supp: F(1, 54) = 15.57, p < .001, ηp² = .22; dose: F(2, 54) = 92.00, p < .001, ηp² = .77; "
        "supp × dose: F(2, 54) = 4.11, p = .022, ηp² = .13"
    )
    table = found.to_frame().set_index("source")
    total = np.var(TOOTH_LENGTHS) * 60
    assert table["sum_of_squares"].sum() == pytest.approx(total)
    assert table["df"].sum() == 59
    assert math.isnan(table.loc["error", "F"])


@pytest.mark.parametrize("ss_type", [1, 2, 3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_unbalanced_cells_agree_with_statsmodels(ss_type, seed):
    rng = np.random.default_rng(seed)
    cells = np.repeat(np.arange(12), rng.integers(1, 9, size=12))
    a, b = cells % 3, cells // 3
    y = rng.normal(size=cells.size) + a * 0.5 + a * b * 0.3
    frame = pd.DataFrame({"y": y, "a": a, "b": b})
    expected = anova_lm(smf.ols("y ~ C(a, Sum) * C(b, Sum)", frame).fit(), typ=ss_type)
    expected = expected.drop(index="Intercept", errors="ignore")
    found = two_way(y, a, b, ss_type=ss_type)
    assert [effect.SS for effect in found.effects] == pytest.approx(expected["sum_sq"].tolist()[:3], rel=1e-9)
    assert [effect.p for effect in found.effects] == pytest.approx(expected["PR(>F)"].tolist()[:3], rel=1e-8)
    assert f"this is type {ss_type}" in found.flags[0]


@given(st.integers(2, 4), st.integers(2, 4), st.integers(0, 2**32), st.sampled_from([1, 2, 3]))
@settings(max_examples=40)
def test_units_a_common_part_and_the_order_of_rows_change_nothing(a, b, seed, ss_type):
    rng = np.random.default_rng(seed)
    cells = np.repeat(np.arange(a * b), rng.integers(2, 5, size=a * b))
    y = rng.integers(-20, 20, size=cells.size).astype(float)
    found = two_way(y, cells % a, cells // a, ss_type=ss_type)
    assume(found.SS_error > 0)
    order = rng.permutation(cells.size)
    moved = two_way((y[order] + 2.0**20) * 2.0**-90, cells[order] % a, cells[order] // a, ss_type=ss_type)
    for one, other in zip(found.effects, moved.effects, strict=True):
        assert (one.F, one.p) == pytest.approx((other.F, other.p), rel=1e-7, abs=1e-9)
    # Exchanging the factors exchanges what types 2 and 3 find.
    turned = two_way(y, cells // a, cells % a, ss_type=ss_type)
    assert pytest.approx(turned.interaction.SS, rel=1e-7, abs=1e-9) == found.interaction.SS
    if ss_type > 1:
        expected = turned.second.SS, turned.first.SS
        assert pytest.approx(expected, rel=1e-7, abs=1e-9) == (found.first.SS, found.second.SS)


def test_no_variance_within_cells():
    found = two_way([1e6 + 0.1, 1e6 + 0.1, 1e6 + 0.2, 1e6 + 1.1, 1e6 + 1.2], [1, 1, 1, 2, 2], [1, 1, 2, 1, 2])
    assert (found.first.F, found.second.p, found.SS_error) == (math.inf, 0, 0)
    # The factors add up, so nothing is left to their interaction.
    assert (found.interaction.F, found.interaction.p) == (0, 1)
    assert "No cell varies" in found.flags[1]


def test_categories_set_the_order():
    levels = pd.Categorical(["b", "a", "b", "a", "a"], ["a", "b"])
    found = two_way([1, 2, 3, 4, 6], levels, ["x", "x", "y", "y", "y"])
    assert [(first, second, n) for first, second, n, _, _ in found.cells] == [
        ("a", "x", 1),
        ("a", "y", 2),
        ("b", "x", 1),
        ("b", "y", 1),
    ]
    assert found.cells[0][4] is None


@pytest.mark.parametrize(
    ("values", "first", "second", "error", "message"),
    [
        ([], [], [], InsufficientDataError, "A has no level"),
        ([1, 2, 3], [1, 1, 1], [1, 2, 2], InsufficientDataError, "A has 1 level"),
        ([1, 2, 3], [1, 2, 2], ["x", "x", "x"], InsufficientDataError, "B has 1 level"),
        ([1, 2, 3], [1, 2, 2], ["x", "y", "x"], InsufficientDataError, "1 of 4 cells are empty.*A is 1 and B is y"),
        ([1, 2, 3, 5], [1, 1, 2, 2], [1, 2, 1, 2], InsufficientDataError, "only one value"),
        ([0.1] * 5, [1, 1, 2, 2, 2], [1, 2, 1, 2, 2], InsufficientDataError, "All values are the same"),
        ([1, 2, math.nan], [1, 2, 2], [1, 2, 1], DataError, "values: 1 of 3"),
        ([1, 2, math.inf], [1, 2, 2], [1, 2, 1], DataError, "values: 1 of 3"),
        ([1, 2, 3], [1, 2, None], [1, 2, 1], DataError, "A: the label at place 2 is missing"),
        ([1, 2, 3], [1, 2], [1, 2, 1], DataError, "must be as many"),
    ],
)
def test_bad_input(values, first, second, error, message):
    with pytest.raises(error, match=message):
        two_way(values, first, second, names=("A", "B"))


def test_another_type():
    with pytest.raises(DataError, match="must be 1, 2 or 3"):
        two_way(TOOTH_LENGTHS, SUPPLEMENT, DOSE, ss_type=4)
