import numpy as np
import pandas as pd
import pytest
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from evaluation.errors import DataError
from evaluation.statistics.mixed.models import crossed_mixed_model
from evaluation.statistics.power import mean_squares
from evaluation.statistics.power.crossed_design import ASSIGNMENTS, CrossedDesign, VarianceComponents


def ratings_and_labels(assignment, conditions=3, seed=1):
    """Ratings of one study with effects of everything, and the labels of each."""
    rng = np.random.default_rng(seed)
    design = CrossedDesign(raters=2 * conditions, items=2 * conditions, conditions=conditions, assignment=assignment)
    shape = mean_squares.shape(design)
    axes = [axis.ravel() for axis in np.indices(shape)]
    if assignment == "full":
        rater, item, condition = axes
    elif assignment == "between":
        condition, rater, item = axes[0], 2 * axes[0] + axes[1], axes[2]
    else:
        rater, item, condition = 2 * axes[0] + axes[1], 2 * axes[2] + axes[3], (axes[0] + axes[2]) % conditions
    size = 2 * conditions
    effects = rng.normal(size=size)[rater] + rng.normal(size=size)[item] + rng.normal(size=conditions)[condition]
    effects += rng.normal(size=(size, conditions))[rater, condition]
    effects += rng.normal(size=(size, conditions))[item, condition]
    y = effects + rng.normal(size=effects.size)
    return design, y.reshape(shape), pd.DataFrame({"y": y, "rater": rater, "item": item, "condition": condition})


def left_over(frame, *terms):
    """Sum of squares that is left when each combination of the labels of each term has a mean of its own."""
    columns = pd.concat([pd.get_dummies(frame.groupby(term).ngroup(), dtype=float) for term in terms], axis=1)
    matrix, y = columns.to_numpy(), frame["y"].to_numpy()
    return float(((y - matrix @ np.linalg.lstsq(matrix, y)[0]) ** 2).sum())


@pytest.mark.parametrize("conditions", [2, 3, 4])
@pytest.mark.parametrize("assignment", ASSIGNMENTS)
def test_all_lines_add_up(assignment, conditions):
    design, y, _ = ratings_and_labels(assignment, conditions)
    squares = mean_squares.of(design, np.stack([y, 3 * y + 1e6]))
    total = ((y - y.mean()) ** 2).sum()
    assert sum(squares.values()) == pytest.approx([total, 9 * total], rel=1e-8)


def test_a_full_design_is_statsmodels_analysis_of_variance():
    design, y, frame = ratings_and_labels("full")
    model = "y ~ C(condition) + C(rater) + C(item) + C(rater):C(condition) + C(item):C(condition) + C(rater):C(item)"
    table = anova_lm(ols(model, frame).fit())
    squares = {name: float(value[0]) for name, value in mean_squares.of(design, y[None]).items()}
    rows = {
        "condition": "C(condition)",
        "rater": "C(rater):C(condition)",
        "item": "C(item):C(condition)",
        "error": "Residual",
        "items": "C(item)",
        "rater_items": "C(rater):C(item)",
    }
    df = mean_squares.degrees_of_freedom(design)
    for name, row in rows.items():
        assert squares[name] == pytest.approx(table.loc[row, "sum_sq"], rel=1e-9), name
        assert df[name] == table.loc[row, "df"], name


@pytest.mark.parametrize("assignment", ["between", "latin_square"])
def test_lines_of_the_other_designs_are_what_is_left_after_others(assignment):
    design, y, frame = ratings_and_labels(assignment)
    squares = {name: float(value[0]) for name, value in mean_squares.of(design, y[None]).items()}
    fit = {
        "condition": ols("y ~ C(condition)", frame).fit().ess,
        # Raters and items in cells of group and set, of which each has one condition.
        "error": left_over(frame, ["rater", "condition"], ["item", "condition"]),
    }
    assert squares["condition"] == pytest.approx(fit["condition"], rel=1e-9)
    assert squares["error"] == pytest.approx(fit["error"], rel=1e-9)


@pytest.mark.parametrize("assignment", ASSIGNMENTS)
def test_the_mixed_model_without_slopes_has_the_f_of_the_pooled_lines(assignment):
    design, y, frame = ratings_and_labels(assignment)
    squares, df = mean_squares.of(design, y[None]), mean_squares.degrees_of_freedom(design)
    pooled = design.denominator("mixed_model")
    total = sum(df[name] for name in pooled)
    F = squares["condition"] / df["condition"] / (sum(squares[name] for name in pooled) / total)
    found = crossed_mixed_model(frame["y"], frame["condition"], frame["rater"], frame["item"]).condition
    assert pytest.approx(F[0], rel=1e-4) == found.F


@pytest.mark.parametrize("assignment", ASSIGNMENTS)
def test_expected_mean_squares_are_the_means_of_many_studies(assignment):
    sd = VarianceComponents(
        rater_sd=0.5, item_sd=0.6, residual_sd=0.7, rater_condition_sd=0.4, item_condition_sd=0.3, rater_item_sd=0.35
    )
    design = CrossedDesign(raters=6, items=6, conditions=3, assignment=assignment)
    rng = np.random.default_rng(2)
    studies, axes = 4000, [axis.ravel() for axis in np.indices(mean_squares.shape(design))]
    if assignment == "full":
        rater, item, condition = axes
    elif assignment == "between":
        condition, rater, item = axes[0], 2 * axes[0] + axes[1], axes[2]
    else:
        rater, item, condition = 2 * axes[0] + axes[1], 2 * axes[2] + axes[3], (axes[0] + axes[2]) % 3
    y = sd.rater_sd * rng.normal(size=(studies, 6))[:, rater] + sd.item_sd * rng.normal(size=(studies, 6))[:, item]
    y += sd.rater_condition_sd * rng.normal(size=(studies, 6, 3))[:, rater, condition]
    y += sd.item_condition_sd * rng.normal(size=(studies, 6, 3))[:, item, condition]
    y += sd.rater_item_sd * rng.normal(size=(studies, 6, 6))[:, rater, item] + sd.residual_sd * rng.normal(size=y.shape)
    squares = mean_squares.of(design, y.reshape(studies, *mean_squares.shape(design)))
    for name, (df, expected) in design.strata(sd).items():
        if df:
            # Four standard errors of a mean of correlated chi-squared variables.
            tolerance = 4 * expected * np.sqrt(2 / (df * studies)) * 1.2
            assert float(squares[name].mean()) / df == pytest.approx(expected, abs=tolerance), name


def test_another_shape_is_refused():
    design, y, _ = ratings_and_labels("full")
    with pytest.raises(DataError, match="shape"):
        mean_squares.of(design, y)
