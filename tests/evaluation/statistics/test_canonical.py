import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.canonical import canonical_correlation
from evaluation.statistics.correlation import pearson

seeds = st.integers(0, 2**32)
widths = st.integers(1, 4)


def related(rng, n, p, q):
    x = rng.normal(size=(n, p))
    return x, x @ rng.normal(size=(p, q)) + 2 * rng.normal(size=(n, q))


def with_correlations(rng, n, p, q, correlations):
    """Data whose canonical correlations are these."""
    noise = rng.normal(size=(n, p + q))
    basis = linalg.qr(noise - noise.mean(axis=0), mode="economic")[0]
    x, y = basis[:, :p], basis[:, p:].copy()
    for place, r in enumerate(correlations):
        y[:, place] = r * x[:, place] + math.sqrt(1 - r**2) * y[:, place]
    return x @ rng.normal(size=(p, p)) + 5, y @ rng.normal(size=(q, q)) - 3


def same_tests(one, other):
    for first, second in zip(one.sequence + one.overall, other.sequence + other.overall, strict=True):
        for name in ("value", "F", "df1", "df2", "p"):
            assert getattr(first, name) == pytest.approx(getattr(second, name), rel=1e-7, abs=1e-12)


@pytest.fixture
def linnerud(case):
    data = case("cca_linnerud")["data"]
    x_names, y_names = ["weight", "waist", "pulse"], ["chins", "situps", "jumps"]
    return canonical_correlation(data["physiological"], data["exercise"], x_names=x_names, y_names=y_names)


class TestLinnerud:
    def test_correlations_and_the_sequence_of_wilks(self, case, linnerud):
        expected = case("cca_linnerud")["expected_full_digits"]
        assert linnerud.correlations == pytest.approx(expected["cancorr"], rel=1e-12)
        assert [test.value for test in linnerud.sequence] == pytest.approx(expected["wilks"], rel=1e-12)
        assert [test.F for test in linnerud.sequence] == pytest.approx(expected["F"], rel=1e-11)
        assert [test.df2 for test in linnerud.sequence] == pytest.approx(expected["df2"], rel=1e-12)
        assert [test.p for test in linnerud.sequence] == pytest.approx(expected["p"], rel=1e-10)

    def test_the_four_overall_tests_are_those_that_sas_prints(self, case, linnerud):
        expected = case("cca_linnerud")["expected"]
        wilks, pillai, lawley, roy = linnerud.overall
        assert wilks.value == pytest.approx(expected["wilks1"], abs=5e-9)
        assert pillai.value == pytest.approx(expected["pillai"], abs=5e-9)
        assert lawley.value == pytest.approx(expected["hotelling"], abs=5e-9)
        assert roy.value == pytest.approx(expected["roy"], abs=5e-9)
        assert (wilks.F, wilks.df1, wilks.df2) == pytest.approx((2.05, 9, 34.223), abs=0.005)
        assert (pillai.F, pillai.df1, pillai.df2, pillai.p) == pytest.approx((1.56, 9, 48, 0.1551), abs=0.005)
        assert (lawley.F, lawley.df1, lawley.df2, lawley.p) == pytest.approx((2.64, 9, 19.053, 0.0357), abs=0.0005)
        assert (roy.F, roy.df1, roy.df2, roy.p) == pytest.approx((9.20, 3, 16, 0.0009), abs=0.005)

    def test_weights_and_structure_are_those_that_sas_prints(self, linnerud):
        # The printed signs of the first pair are those of the house: the largest of x, the waist, is positive.
        assert linnerud.x_weights[:, 0] == pytest.approx([-0.7754, 1.5793, -0.0591], abs=5e-5)
        assert linnerud.y_weights[:, 0] == pytest.approx([-0.3495, -1.0540, 0.7164], abs=5e-5)
        assert linnerud.x_structure[:, 0] == pytest.approx([0.6206, 0.9254, -0.3328], abs=5e-5)
        assert linnerud.y_structure[:, 0] == pytest.approx([-0.7276, -0.8177, -0.1622], abs=5e-5)
        assert linnerud.x_redundancy[0] == pytest.approx(0.2854, abs=5e-5)
        assert linnerud.y_redundancy[0] == pytest.approx(0.2584, abs=5e-5)

    def test_the_sentence(self, linnerud):
        assert linnerud.apa() == linnerud.summary() == "Rc = .80, Wilks' Λ = .35, F(9, 34.22) = 2.05, p = .064"
        assert linnerud.overall[3].summary() == "Roy's root = 1.72, F(3, 16) = 9.20, p < .001"

    def test_the_frames(self, linnerud):
        frame = linnerud.to_frame()
        assert frame["correlation"].tolist() == list(linnerud.correlations)
        assert frame["df1"].tolist() == [9, 4, 1]
        variables = linnerud.variables_to_frame().set_index(["side", "variable", "pair"])
        assert len(variables) == 18
        assert variables.loc[("y", "situps", 1), "weight"] == linnerud.y_weights[1, 0]
        assert linnerud.tests_to_frame()["statistic"].str[:3].tolist() == ["Wil", "Pil", "Hot", "Roy"]


def test_sides_of_different_width_as_r_prints_them(case):
    published = case("cca_mmreg")
    data, expected, rtol = published["data"], published["expected"], published["tolerance"]["rtol"]
    remainders = np.divide(data["wilks"], [*data["wilks"][1:], 1])
    correlations = np.sqrt(1 - remainders)
    assert correlations == pytest.approx(expected["cancorr"], abs=5e-5)
    rng = np.random.default_rng(7)
    found = canonical_correlation(*with_correlations(rng, data["n"], data["p"], data["q"], correlations))
    assert found.correlations == pytest.approx(correlations, rel=1e-10)
    for name in ("F", "df1", "df2", "p"):
        assert [getattr(test, name) for test in found.sequence] == pytest.approx(expected[name], rel=rtol)


@settings(max_examples=60)
@given(seeds, widths, widths)
def test_an_affine_transformation_of_either_side_changes_nothing(seed, p, q):
    rng = np.random.default_rng(seed)
    x, y = related(rng, 30, p, q)
    found = canonical_correlation(x, y)
    turned = canonical_correlation(
        x @ (rng.normal(size=(p, p)) + 4 * np.eye(p)) + 100, 1e-3 * y @ (rng.normal(size=(q, q)) + 4 * np.eye(q)) - 7
    )
    assert turned.correlations == pytest.approx(found.correlations, rel=1e-7)
    same_tests(found, turned)


@settings(max_examples=60)
@given(seeds, widths, widths)
def test_the_sides_can_change_places(seed, p, q):
    x, y = related(np.random.default_rng(seed), 25, p, q)
    one, other = canonical_correlation(x, y), canonical_correlation(y, x)
    assert other.correlations == pytest.approx(one.correlations, rel=1e-9, abs=1e-12)
    same_tests(one, other)
    assert other.x_redundancy == pytest.approx(one.y_redundancy, rel=1e-7)
    assert np.abs(other.y_weights) == pytest.approx(np.abs(one.x_weights), rel=1e-5, abs=1e-7)


@given(seeds, st.integers(3, 20))
def test_one_column_on_each_side_is_pearson(seed, n):
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(2, n))
    found, expected = canonical_correlation(x[:, None], y[:, None]), pearson(x, y)
    assert found.correlations == pytest.approx([abs(expected.r)], rel=1e-10, abs=1e-12)
    assert [test.p for test in found.overall] == pytest.approx([expected.p] * 4, rel=1e-7)
    assert {(test.df1, test.df2) for test in found.overall} == {(1, n - 2)}
    assert found.x_weights[0, 0] == pytest.approx(1)
    assert found.y_weights[0, 0] == pytest.approx(math.copysign(1, expected.r))


@given(seeds, widths)
def test_one_column_on_one_side_is_multiple_regression(seed, p):
    rng = np.random.default_rng(seed)
    n = 20
    x, y = related(rng, n, p, 1)
    design = np.column_stack([np.ones(n), x])
    residual = float(linalg.lstsq(design, y)[1].sum())
    total = float(((y - y.mean()) ** 2).sum())
    F = (total - residual) / p / (residual / (n - p - 1))
    found = canonical_correlation(x, y)
    assert found.correlations == pytest.approx([math.sqrt(1 - residual / total)], rel=1e-9)
    for test in found.overall:
        assert (test.F, test.df1, test.df2) == pytest.approx((F, p, n - p - 1), rel=1e-8)
        assert test.p == pytest.approx(float(stats.f.sf(F, p, n - p - 1)), rel=1e-6, abs=1e-15)


@given(seeds, widths, widths)
def test_the_statistics_are_those_of_the_matrices_of_squares(seed, p, q):
    rng = np.random.default_rng(seed)
    n = 30
    x, y = related(rng, n, p, q)
    centred = y - y.mean(axis=0)
    design = np.column_stack([np.ones(n), x])
    residuals = y - design @ linalg.lstsq(design, y)[0]
    total, error = centred.T @ centred, residuals.T @ residuals
    hypothesis = total - error
    wilks, pillai, lawley, roy = canonical_correlation(x, y).overall
    assert wilks.value == pytest.approx(linalg.det(error) / linalg.det(total), rel=1e-6)
    assert pillai.value == pytest.approx(np.trace(linalg.solve(total, hypothesis)), rel=1e-7)
    assert lawley.value == pytest.approx(np.trace(linalg.solve(error, hypothesis)), rel=1e-6)
    assert roy.value == pytest.approx(linalg.eigvals(linalg.solve(error, hypothesis)).real.max(), rel=1e-6)


@given(seeds, st.integers(1, 3), widths)
def test_variates_are_what_weights_and_structure_say(seed, p, q):
    x, y = related(np.random.default_rng(seed), 25, p, q)
    found = canonical_correlation(x, y)
    u = stats.zscore(x, ddof=1) @ found.x_weights
    v = stats.zscore(y, ddof=1) @ found.y_weights
    pairs = len(found.correlations)
    assert np.cov(u.T).reshape(pairs, pairs) == pytest.approx(np.eye(pairs), abs=1e-9)
    assert np.cov(v.T).reshape(pairs, pairs) == pytest.approx(np.eye(pairs), abs=1e-9)
    together = np.corrcoef(np.column_stack([u, v, x]).T)
    assert together[:pairs, pairs : 2 * pairs] == pytest.approx(np.diag(found.correlations), abs=1e-9)
    assert together[2 * pairs :, :pairs] == pytest.approx(found.x_structure, abs=1e-9)
    assert (found.x_structure[np.abs(found.x_structure).argmax(axis=0), range(pairs)] > 0).all()


@pytest.mark.parametrize(("p", "q"), [(3, 9), (2, 1), (4, 3)])
def test_p_is_uniform_when_rows_are_shuffled(p, q):
    rng = np.random.default_rng(11)
    x, y = related(rng, 40, p, q)
    shuffled = [canonical_correlation(x, rng.permutation(y)) for _ in range(400)]
    assert canonical_correlation(x, y).sequence[0].p < 0.01
    for place in range(3):
        # Wilks, Pillai and Hotelling-Lawley; Roy's p is only a lower bound.
        assert stats.kstest([found.overall[place].p for found in shuffled], "uniform").pvalue > 0.01
    assert np.mean([found.overall[3].p for found in shuffled]) < 0.55


class TestDependentColumns:
    def test_a_combination_is_left_out_and_named(self, case):
        data = case("cca_linnerud")["data"]
        x = np.array(data["physiological"])
        more = np.column_stack([x[:, 0], x[:, 0] * 3 + 7, x[:, 1:], x.sum(axis=1)])
        names = ["weight", "again", "waist", "pulse", "sum"]
        found = canonical_correlation(more, data["exercise"], x_names=names)
        plain = canonical_correlation(x, data["exercise"])
        assert found.x_left_out == ("again", "sum")
        assert found.correlations == pytest.approx(plain.correlations, rel=1e-10)
        same_tests(found, plain)
        assert found.x_weights[[0, 2, 3]] == pytest.approx(plain.x_weights, rel=1e-8)
        assert not found.x_weights[[1, 4]].any()
        assert found.x_structure[1] == pytest.approx(found.x_structure[0])
        assert found.flags == ("Combinations of other columns, left out: again, sum.",)

    def test_a_large_common_part_does_not_hide_it(self):
        rng = np.random.default_rng(3)
        x, y = related(rng, 30, 2, 2)
        x = 1e7 + x
        found = canonical_correlation(np.column_stack([x, x[:, 0] + x[:, 1]]), y)
        assert found.x_left_out == ("x3",)
        assert found.sequence[0].df1 == 4

    def test_nearly_the_same_columns_are_kept(self):
        rng = np.random.default_rng(3)
        x, y = related(rng, 30, 1, 2)
        near = np.column_stack([x, x[:, 0] + 1e-6 * rng.normal(size=30)])
        assert canonical_correlation(near, y).x_left_out == ()

    def test_a_column_that_does_not_vary(self):
        x, y = related(np.random.default_rng(3), 30, 2, 2)
        with pytest.raises(InsufficientDataError, match="The column y2 of y does not vary"):
            canonical_correlation(x, np.column_stack([y[:, 0], np.full(30, 0.1)]))


class TestPerfectCorrelation:
    def test_it_is_found_and_tested(self):
        rng = np.random.default_rng(5)
        x = rng.normal(size=(20, 2))
        y = np.column_stack([x @ [2, -3] + 1, rng.normal(size=20)])
        found = canonical_correlation(x, y)
        assert found.correlations[0] == 1
        assert found.correlations[1] < 1
        wilks, pillai, lawley, roy = found.overall
        assert (wilks.p, lawley.p, roy.p) == (0, 0, 0)
        assert 0 < pillai.p < 1e-4
        assert (found.sequence[0].value, found.sequence[0].F, found.sequence[0].p) == (0, math.inf, 0)
        assert found.overall[2].value == math.inf
        assert found.sequence[1].p > 0.001
        assert found.summary().startswith("Rc = 1.00, Wilks' Λ = .00, F(4, 32) = inf, p < .001")

    def test_the_same_data_on_both_sides(self):
        x = np.random.default_rng(5).normal(size=(20, 3))
        found = canonical_correlation(x, x)
        assert found.correlations == (1, 1, 1)
        assert [test.F for test in found.overall] == [math.inf] * 4

    def test_what_is_only_nearly_perfect_keeps_its_digits(self):
        x, y = with_correlations(np.random.default_rng(5), 50, 2, 3, [math.sqrt(1 - 1e-10), 0.5])
        found = canonical_correlation(x, y)
        assert found.sequence[0].value == pytest.approx(1e-10 * 0.75, rel=1e-3)


class TestFewRows:
    @pytest.mark.parametrize("n", [6, 7])
    def test_with_the_fewest_rows_hotelling_has_no_f(self, n):
        x, y = np.random.default_rng(2).normal(size=(2, n, 2))
        found = canonical_correlation(x[:, :2], np.column_stack([y, x[:, 0] ** 2])[:, :3])
        lawley = found.overall[2]
        assert (lawley.F, lawley.p) == (None, None)
        assert lawley.summary() == f"{lawley.apa()}\nHotelling-Lawley U: too few rows for an F."
        assert found.flags == lawley.flags
        assert all(math.isfinite(test.F) for test in (found.overall[0], found.overall[1], found.overall[3]))

    def test_too_few(self):
        x, y = np.random.default_rng(2).normal(size=(2, 5, 2))
        with pytest.raises(InsufficientDataError, match="of 2 with 2 columns needs at least 5 rows; there are 4"):
            canonical_correlation(x[:4], y[:4])
        assert canonical_correlation(x, y).n == 5


def test_names_come_from_frames():
    x, y = related(np.random.default_rng(3), 30, 3, 2)
    found = canonical_correlation(pd.DataFrame(x, columns=["P", "A", "D"]), y)
    assert (found.x_names, found.y_names) == (("P", "A", "D"), ("y1", "y2"))


def test_results_cannot_be_changed():
    found = canonical_correlation(*related(np.random.default_rng(3), 30, 3, 2))
    with pytest.raises(ValueError, match="read-only"):
        found.x_weights[0, 0] = 1


def test_bad_input():
    x, y = related(np.random.default_rng(3), 30, 3, 2)
    broken = x.copy()
    broken[4, 1] = math.nan
    with pytest.raises(DataError, match=r"x: 1 of 90 values are missing or infinite \(the first at \[4, 1\]\)"):
        canonical_correlation(broken, y)
    with pytest.raises(DataError, match=r"y has the shape \(30,\), but must have rows x columns"):
        canonical_correlation(x, y[:, 0])
    with pytest.raises(DataError, match="x has 30 rows and y has 29"):
        canonical_correlation(x, y[:29])
    with pytest.raises(DataError, match="x has 3 columns, but 2 names"):
        canonical_correlation(x, y, x_names=["a", "b"])
    with pytest.raises(DataError, match="not all numbers"):
        canonical_correlation([["a", "b"]], y)
    with pytest.raises(InsufficientDataError, match="x has 0 rows"):
        canonical_correlation(np.empty((0, 2)), np.empty((0, 2)))
    with pytest.raises(InsufficientDataError, match="0 columns"):
        canonical_correlation(np.empty((5, 0)), y[:5])


def test_columns_that_are_rounding_beside_their_common_part():
    x = 1e15 + np.array([[2.5, 0.25], [-0.375, -2.25], [0.75, -1.75], [-3.125, 0.75]])
    y = 1e15 + np.array([[-4.25], [-4.25], [-3.125], [1.125]])
    with pytest.raises(InsufficientDataError, match="hardly more than the rounding"):
        canonical_correlation(x, y)


def test_a_perfect_correlation_is_flagged_once():
    found = canonical_correlation([[5.0], [4], [3]], [[5.0], [4], [3]])
    assert found.correlations == (1.0,) and math.isinf(found.sequence[0].F)
    assert (
        found.flags == found.sequence[0].flags == ("A canonical correlation is 1 to rounding, so that F has no bound.",)
    )
