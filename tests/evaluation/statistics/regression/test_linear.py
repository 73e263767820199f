import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.regression.linear import linear_fit, simple_regression
from evaluation.statistics.regression.nonlinear import nonlinear_fit

# NIST Statistical Reference Datasets, certified values.
NIST = {
    row["id"]: row
    for row in json.loads((Path(__file__).parents[3] / "data" / "nist_cases.json").read_text(encoding="utf-8"))
}
CURVES = {
    "Misra1a": lambda x, b1, b2: b1 * (1 - np.exp(-b2 * x)),
    "Hahn1": lambda x, b1, b2, b3, b4, b5, b6, b7: (
        (b1 + b2 * x + b3 * x**2 + b4 * x**3) / (1 + b5 * x + b6 * x**2 + b7 * x**3)
    ),
    "MGH09": lambda x, b1, b2, b3, b4: b1 * (x**2 + x * b2) / (x**2 + x * b3 + b4),
    "Rat43": lambda x, b1, b2, b3, b4: b1 / (1 + np.exp(b2 - b3 * x)) ** (1 / b4),
    "Eckerle4": lambda x, b1, b2, b3: b1 / b2 * np.exp(-0.5 * ((x - b3) / b2) ** 2),
    "Bennett5": lambda x, b1, b2, b3: b1 * (b2 + x) ** (-1 / b3),
    "DanWood": lambda x, b1, b2: b1 * x**b2,
}


def exactly(X, y):
    """Coefficients, standard errors and rss in rational arithmetic."""
    rows, target = [[Fraction(float(v)) for v in row] for row in X], [Fraction(float(v)) for v in y]
    p = len(rows[0])
    table = [
        [sum(row[i] * row[j] for row in rows) for j in range(p)]
        + [sum(row[i] * v for row, v in zip(rows, target, strict=True))]
        + [Fraction(int(i == j)) for j in range(p)]
        for i in range(p)
    ]
    for i in range(p):
        table[i] = [v / table[i][i] for v in table[i]]
        for j in set(range(p)) - {i}:
            table[j] = [a - table[j][i] * b for a, b in zip(table[j], table[i], strict=True)]
    b = [row[p] for row in table]
    rss = sum((v - sum(map(lambda a, c: a * c, row, b))) ** 2 for row, v in zip(rows, target, strict=True))
    se = [math.sqrt(rss / (len(target) - p) * table[i][p + 1 + i]) for i in range(p)]
    return [float(v) for v in b], se, float(rss)


def test_longley():
    data, expected = NIST["nist_Longley"]["data"], NIST["nist_Longley"]["expected"]
    found = linear_fit(data["X_with_const"], data["y"])
    assert found.estimates == pytest.approx(expected["params"], rel=1e-13)
    assert found.se == pytest.approx(expected["sd_params"], rel=1e-13)
    assert (found.F, found.R2, found.rss) == pytest.approx((expected["F"], expected["R2"], expected["rss"]), rel=1e-13)
    assert found.apa().startswith("R² = .995, F(6, 9) = 330.29, p < .001; 1: b = -3.48e+06, 95% CI [")


def test_an_exact_fit_is_flagged():
    data = NIST["nist_Wampler1"]["data"]
    found = linear_fit(np.vander(data["x"], 6, increasing=True), data["y"])
    assert found.estimates == pytest.approx(np.ones(6), rel=1e-13)
    assert (found.rss, found.R2, found.F) == (0, 1, math.inf)
    assert np.isnan(found.t).all() and "reproduces y" in found.flags[0]


def test_norris():
    data, expected = NIST["nist_Norris"]["data"], NIST["nist_Norris"]["expected"]
    found = simple_regression(data["x"], data["y"])
    assert [found.slope, found.intercept, found.se_slope, found.se_intercept, found.R2] == pytest.approx(
        [expected[key] for key in ("slope", "intercept", "se_slope", "se_int", "R2")], rel=1e-12
    )


def test_without_a_constant():
    # NIST NoInt1.
    found = linear_fit(np.arange(60.0, 71)[:, None], np.arange(130.0, 141))
    assert not found.has_constant
    assert [found.estimates[0], found.se[0], found.R2, found.F, found.rss] == pytest.approx(
        [2.07438016528926, 0.0165289256198347, 0.999365492298663, 15750.25, 127.272727272727], rel=1e-12
    )


def test_nearly_dependent_columns_against_rational_arithmetic():
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(-9, -3, 30))
    X, y = np.vander(x, 10, increasing=True), 0.8 + 0.05 * np.sin(x) + 0.003 * rng.normal(size=30)
    found, (b, se, rss) = linear_fit(X, y), exactly(X, y)
    assert found.estimates == pytest.approx(b, rel=1e-13)
    assert found.se == pytest.approx(se, rel=1e-13)
    assert found.rss == pytest.approx(rss, rel=1e-13)


@pytest.mark.parametrize("offset", [1e6, 1e12])
def test_an_offset_costs_no_digits(offset):
    x = offset + 0.1 * np.arange(20)
    y = 3 * offset + 0.1 * np.random.default_rng(2).integers(0, 9, 20)
    found, (b, se, _) = simple_regression(x, y), exactly(np.column_stack([np.ones(20), x]), y)
    assert found.estimates == pytest.approx(b, rel=1e-13)
    assert found.se == pytest.approx(se, rel=1e-13)


def test_groups_instead_of_a_constant_count_as_one():
    X = np.kron(np.eye(2), np.ones((3, 1)))
    found = linear_fit(X, [1, 2, 3, 4, 6, 5.0], names=["a", "b"])
    assert found.has_constant and found.df_model == 1
    assert found.estimates == pytest.approx([2, 5])
    assert found.to_frame()["term"].tolist() == ["a", "b"]


@pytest.mark.parametrize("start", ["start1", "start2"])
@pytest.mark.parametrize("name", list(CURVES))
def test_curves_of_nist(name, start):
    data, expected = NIST[f"nist_nls_{name}"]["data"], NIST[f"nist_nls_{name}"]["expected"]

    def real_only(x, *b):
        return CURVES[name](x, *(float(v) for v in b))

    for model in (CURVES[name], real_only) if start == "start2" else (CURVES[name],):
        found = nonlinear_fit(model, np.array(data["x"]), data["y"], data[start])
        assert found.estimates == pytest.approx(expected["params"], rel=1e-8)
        assert found.se == pytest.approx(expected["sd_params"], rel=1e-7)
        assert found.rss == pytest.approx(expected["rss"], rel=1e-9)
        assert found.derivatives == ("complex step" if model is CURVES[name] else "differences")


def test_a_jacobian_may_be_given():
    data, expected = NIST["nist_nls_DanWood"]["data"], NIST["nist_nls_DanWood"]["expected"]
    found = nonlinear_fit(
        CURVES["DanWood"],
        np.array(data["x"]),
        data["y"],
        data["start1"],
        jacobian=lambda x, b1, b2: np.column_stack([x**b2, b1 * x**b2 * np.log(x)]),
        names=["scale", "power"],
    )
    assert found.derivatives == "given"
    assert found.se == pytest.approx(expected["sd_params"], rel=1e-9)
    assert found.apa().startswith("scale = 0.769 (SE = 0.0183, 95% CI [0.718, 0.820]), power = 3.86 (")


def test_a_model_that_loses_imaginary_parts_is_noticed():
    x = np.linspace(0, 1, 9)
    found = nonlinear_fit(lambda x, a, b: np.abs(a) + b * x + 0j, x, 2 + 3 * x + 0.1 * (-1) ** np.arange(9), [1, 1])
    assert found.derivatives == "differences"
    assert found.estimates == pytest.approx(np.polyfit(x, 2 + 3 * x + 0.1 * (-1) ** np.arange(9), 1)[::-1])


def test_what_cannot_be_fitted_is_refused():
    x, y = np.arange(5.0), [1, 2, 4, 4, 6]
    with pytest.raises(InsufficientDataError, match="b2"):
        nonlinear_fit(lambda x, a, b: a + b + x, x, y, [1, 1])
    with pytest.raises(InsufficientDataError, match="more values"):
        nonlinear_fit(lambda x, a: a * x, x[:1], y[:1], [1])
    with pytest.raises(DataError, match="shape"):
        nonlinear_fit(lambda x, a: a, x, y, [1])
    with pytest.raises(DataError, match="start"):
        nonlinear_fit(lambda x, a: x * np.nan, x, y, [1])
    with pytest.raises(DataError, match="jacobian"):
        nonlinear_fit(lambda x, a: a * x, x, y, [1], jacobian=lambda x, a: x)
    with pytest.raises(InsufficientDataError, match="column c"):
        linear_fit([[1, 1, 2], [1, 2, 3], [1, 3, 4], [1, 4, 5]], y[:4], names=["a", "b", "c"])
    with pytest.raises(InsufficientDataError, match="not vary"):
        simple_regression(x, [2, 2, 2, 2, 2])
    with pytest.raises(InsufficientDataError, match="same"):
        simple_regression([1, 1, 1], [2, 3, 4])
    with pytest.raises(InsufficientDataError, match="more rows"):
        simple_regression([1, 2], [2, 3])
    with pytest.raises(DataError, match="5 rows"):
        linear_fit(x[:, None], y[:4])


numbers = st.sampled_from([0.0, 1.0, 2.0, 2.5, 1e6, math.nan, math.inf])


@given(
    X=hnp.arrays(float, hnp.array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=5), elements=numbers),
    y=hnp.arrays(float, st.integers(0, 5), elements=numbers),
)
@settings(max_examples=80, deadline=None)
@pytest.mark.filterwarnings("error")
def test_bad_data_give_an_error_or_a_flag(X, y):
    for fit in (lambda: linear_fit(X, y), lambda: simple_regression(X[:, 0] if X.shape[1] else [], y)):
        try:
            found = fit()
        except EvaluationError:
            continue
        assert np.isfinite(found.estimates).all() and np.isfinite(found.se).all()
        assert np.isfinite(found.t).all() or found.flags


@pytest.mark.parametrize(("x", "y", "name"), [(1, 1e-300, "y"), (1e-300, 1, "x"), (1e-160, 1e-160, "x")])
def test_values_whose_squares_vanish_are_refused(x, y, name):
    with pytest.raises(DataError, match=f"{name}: no value exceeds 1e-140"):
        simple_regression(np.array([5, 4, 3, 1.0]) * x, np.array([4, 2, 3, 1.0]) * y)


def test_standard_errors_of_very_different_units():
    x, y = np.array([5, 4, 3, 1.0]), np.array([4, 2, 3, 1.0])
    assert simple_regression(x * 1e130, y * 1e-130).t == pytest.approx(simple_regression(x, y).t)


@pytest.mark.parametrize("start", [[1.2, 0.3, 5.6, 5.5, 6.5, 7.6], [0.0951, 1, 0.8607, 3, 1.5576, 5]])
def test_residuals_near_rounding(start):
    # NIST's Lanczos1, whose y are the model's with 13 digits; certified values.
    def model(x, *b):
        return b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x)

    x = np.arange(24) / 20
    y = [float(f"{value:.12e}") for value in model(x, 0.0951, 1, 0.8607, 3, 1.5576, 5)]
    found = nonlinear_fit(model, x, y, start)
    assert found.estimates == pytest.approx([0.0951, 1, 0.8607, 3, 1.5576, 5], rel=1e-8)
    assert (found.rss, found.se[0]) == pytest.approx((1.4307867721e-25, 5.3347304234e-11), rel=0.01)
    assert found.flags == ("The residuals are so small that rounding costs the standard errors digits.",)
