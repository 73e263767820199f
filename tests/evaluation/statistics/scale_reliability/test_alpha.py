import math
import warnings

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.multivariate.factor import Factor

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.scale_reliability.alpha import cronbach_alpha, spearman_brown
from evaluation.statistics.scale_reliability.factor_fit import fit_one_factor
from evaluation.statistics.scale_reliability.omega import mcdonald_omega
from evaluation.statistics.scale_reliability.one_factor import one_factor_check

NAN = math.nan
seeds = st.integers(0, 2**32)
extractions = st.sampled_from(["ml", "minres"])

# The data frame `attitude` of R: Chatterjee and Price (1977), favourable answers in 30 departments, in percent.
ATTITUDE = pd.DataFrame(
    [
        [43, 51, 30, 39, 61, 92, 45], [63, 64, 51, 54, 63, 73, 47], [71, 70, 68, 69, 76, 86, 48],
        [61, 63, 45, 47, 54, 84, 35], [81, 78, 56, 66, 71, 83, 47], [43, 55, 49, 44, 54, 49, 34],
        [58, 67, 42, 56, 66, 68, 35], [71, 75, 50, 55, 70, 66, 41], [72, 82, 72, 67, 71, 83, 31],
        [67, 61, 45, 47, 62, 80, 41], [64, 53, 53, 58, 58, 67, 34], [67, 60, 47, 39, 59, 74, 41],
        [69, 62, 57, 42, 55, 63, 25], [68, 83, 83, 45, 59, 77, 35], [77, 77, 54, 72, 79, 77, 46],
        [81, 90, 50, 72, 60, 54, 36], [74, 85, 64, 69, 79, 79, 63], [65, 60, 65, 75, 55, 80, 60],
        [65, 70, 46, 57, 75, 85, 46], [50, 58, 68, 54, 64, 78, 52], [50, 40, 33, 34, 43, 64, 33],
        [64, 61, 52, 62, 66, 80, 41], [53, 66, 52, 50, 63, 80, 37], [40, 37, 42, 58, 50, 57, 49],
        [63, 54, 42, 48, 66, 75, 33], [66, 77, 66, 63, 88, 76, 72], [78, 75, 58, 74, 80, 78, 49],
        [48, 57, 44, 45, 51, 83, 38], [85, 85, 71, 71, 77, 74, 55], [82, 82, 39, 59, 64, 78, 39],
    ],
    columns=["rating", "complaints", "privileges", "learning", "raises", "critical", "advance"],
)  # fmt: skip


def some_answers(seed, *, rows=40, items=5, common=1.0):
    rng = np.random.default_rng(seed)
    return common * rng.normal(size=(rows, 1)) + rng.normal(size=(rows, items)) * rng.uniform(0.5, 2, size=items)


class TestAlpha:
    def test_it_gives_the_published_values(self):
        # R's psych::alpha(attitude), version 2.2.9; pingouin has the same interval.
        found = cronbach_alpha(ATTITUDE)
        assert found.alpha == pytest.approx(0.84314276956476)
        assert found.standardized == pytest.approx(0.839083803029511)
        assert found.ci == pytest.approx((0.739, 0.916), abs=0.0005)
        assert [item.rest_r for item in found.items] == pytest.approx(
            [0.67, 0.74, 0.56, 0.71, 0.79, 0.27, 0.46], abs=0.005
        )
        assert [item.alpha_if_dropped for item in found.items] == pytest.approx(
            [0.81, 0.80, 0.83, 0.80, 0.80, 0.86, 0.84], abs=0.005
        )
        assert found.flags == ()
        assert found.apa() == "Cronbach's alpha (7 items, n = 30) = .84, 95% CI [.74, .92]."

    @given(seeds)
    @settings(deadline=None, max_examples=30)
    def test_it_agrees_with_the_formula(self, seed):
        answers = some_answers(seed)
        found = cronbach_alpha(answers)
        covariance = np.cov(answers.T)
        assert found.alpha == pytest.approx(5 / 4 * (1 - np.trace(covariance) / covariance.sum()))
        for place, item in enumerate(found.items):
            rest = np.delete(answers, place, axis=1)
            assert item.rest_r == pytest.approx(stats.pearsonr(answers[:, place], rest.sum(axis=1)).statistic)
            assert item.alpha_if_dropped == pytest.approx(cronbach_alpha(rest).alpha)
            assert (item.mean, item.sd) == pytest.approx((answers[:, place].mean(), answers[:, place].std(ddof=1)))

    @given(seeds, st.sampled_from([1e-100, 0.1, 1e6, 1e100]), st.sampled_from([0, 1e6]))
    @settings(deadline=None, max_examples=20)
    def test_unit_and_common_part_do_not_matter(self, seed, unit, shift):
        answers = np.rint(8 * some_answers(seed)) / 8
        one, two = cronbach_alpha(answers), cronbach_alpha((answers + shift) * unit)
        assert (two.alpha, two.mean_r) == pytest.approx((one.alpha, one.mean_r), abs=1e-9)

    def test_the_interval_covers(self):
        # Parallel items, variance 1 in common and 1 each: alpha is 4 / 5.
        hits = 0
        for seed in range(300):
            rng = np.random.default_rng(seed)
            low, high = cronbach_alpha(rng.normal(size=(25, 1)) + rng.normal(size=(25, 4))).ci
            hits += low < 0.8 < high
        assert 275 <= hits <= 296

    def test_special_cases(self):
        pair = cronbach_alpha([[1, 2], [2, 3], [3, 3], [NAN, 1]])
        assert pair.flags == ("Left out, lacking an answer: 1 of 4 rows.",)
        assert [item.alpha_if_dropped for item in pair.items] == [None, None]
        assert pair.standardized == pytest.approx(spearman_brown(pair.mean_r))
        same = cronbach_alpha([[1, 1, 1], [2, 2, 2], [4, 4, 4]])
        assert (same.alpha, same.ci) == (1, (1, 1))
        wrong = cronbach_alpha([[1, 4, 1], [2, 3, 2], [4, 2, 3], [5, 1, 5]])
        assert "item 2" in wrong.flags[-1]
        negative = cronbach_alpha([[1, 4], [2, 3.5], [4, 2]])
        assert negative.alpha < 0
        assert "Alpha is negative" in negative.flags[0]
        rest = cronbach_alpha([[1, 2, -2], [2, 5, -5], [3, 1, -1]])
        assert rest.items[0].rest_r is None
        assert "item 1" in rest.flags[-1]
        assert math.isnan(rest.item_frame()["rest_r"][0])

    def test_bad_data(self):
        with pytest.raises(InsufficientDataError, match="same answer throughout must be left out first: b"):
            cronbach_alpha(pd.DataFrame({"a": [1, 2, 3], "b": [0.1] * 3}))
        with pytest.raises(InsufficientDataError, match="at least 2 items; there is 1"):
            cronbach_alpha([[1], [2], [3]])
        with pytest.raises(InsufficientDataError, match="3 complete rows are needed; there are 0"):
            cronbach_alpha(np.full((5, 3), NAN))
        with pytest.raises(InsufficientDataError, match="sum of the items does not vary"):
            cronbach_alpha([[1, -1], [2, -2], [3, -3]])
        with pytest.raises(DataError, match="infinite"):
            cronbach_alpha([[1, 2], [math.inf, 3], [2, 2]])
        with pytest.raises(DataError, match="not all numbers"):
            cronbach_alpha([["a", "b"]])
        with pytest.raises(DataError, match="rows x items"):
            cronbach_alpha([1, 2, 3])
        with pytest.raises(DataError, match="but 1 names"):
            cronbach_alpha(ATTITUDE.to_numpy(), names=["a"])


class TestOmega:
    def test_it_gives_the_published_values(self):
        # R's psych::fa(attitude, 1) with fm = "ml" and "minres".
        found = mcdonald_omega(ATTITUDE)
        assert found.omega == pytest.approx(0.840544816900635, rel=1e-5)
        loadings = [0.852477611, 0.902238263, 0.592706101, 0.730699092, 0.764994952, 0.246093055, 0.377847920]
        assert found.loadings == pytest.approx(loadings, rel=1e-4)
        assert "maximum likelihood" in found.apa()
        minres = mcdonald_omega(ATTITUDE, extraction="minres")
        assert minres.omega == pytest.approx(0.850682, abs=1e-6)
        assert "minimum residuals" in minres.apa()
        assert found.flags == minres.flags == ()

    @given(seeds)
    @settings(deadline=None, max_examples=10)
    def test_loadings_agree_with_statsmodels(self, seed):
        answers = some_answers(seed, rows=200, items=6)
        found = mcdonald_omega(answers)
        expected = Factor(answers, n_factor=1, method="ml").fit(maxiter=500).loadings[:, 0]
        assert np.array(found.loadings) == pytest.approx(np.abs(expected), abs=1e-3)

    @given(seeds, extractions)
    @settings(deadline=None, max_examples=20)
    def test_a_model_that_holds_is_found(self, seed, extraction):
        loadings = np.random.default_rng(seed).uniform(0.3, 0.95, size=6)
        correlations = np.outer(loadings, loadings) + np.diag(1 - loadings**2)
        found = fit_one_factor(correlations, extraction=extraction)
        assert found.loadings == pytest.approx(loadings, abs=1e-5)
        assert found.converged

    @given(seeds, extractions, st.sampled_from([1e-100, 0.1, 1e6]))
    @settings(deadline=None, max_examples=20)
    def test_order_and_unit_do_not_matter(self, seed, extraction, unit):
        answers = some_answers(seed)
        one = mcdonald_omega(answers, extraction=extraction)
        two = mcdonald_omega(answers[:, ::-1] * unit, extraction=extraction)
        assert (two.omega, two.omega_raw) == pytest.approx((one.omega, one.omega_raw), abs=1e-6)

    def test_raw_omega_is_the_reliability_of_the_sum(self):
        rng = np.random.default_rng(1)
        scale = np.array([1, 2, 5, 0.5])
        common = rng.normal(size=(20_000, 1))
        answers = (common + rng.normal(size=(20_000, 4))) * scale
        reliability = np.corrcoef(answers.sum(axis=1), common[:, 0])[0, 1] ** 2
        found = mcdonald_omega(answers)
        assert found.omega_raw == pytest.approx(reliability, abs=0.01)
        assert found.omega == pytest.approx(0.8, abs=0.01)

    @pytest.mark.parametrize("extraction", ["ml", "minres"])
    def test_the_interval_is_that_of_resampled_rows(self, extraction):
        found = mcdonald_omega(ATTITUDE, extraction=extraction, rng=np.random.default_rng(1))
        rng = np.random.default_rng(2)
        omegas = [
            mcdonald_omega(ATTITUDE.iloc[rng.integers(30, size=30)], extraction=extraction).omega for _ in range(120)
        ]
        assert found.ci == pytest.approx(tuple(np.quantile(omegas, [0.025, 0.975])), abs=0.06)
        assert found.replicates > 950
        assert found == mcdonald_omega(ATTITUDE, extraction=extraction, rng=np.random.default_rng(1))

    def test_special_cases(self):
        rng = np.random.default_rng(3)
        base = rng.normal(size=30)
        answers = np.stack([base, base + 0.01 * rng.normal(size=30), base + 3 * rng.normal(size=30)], axis=1)
        found = mcdonald_omega(answers, names=["a", "b", "c"])
        assert found.heywood
        assert found.flags[0].startswith("Heywood case")
        against = mcdonald_omega(some_answers(1, common=2) * [1, 1, -1, 1, 1], names=list("abcde"))
        assert against.flags == ("Items that load negatively: c; are they reversed?",)

    def test_bad_data(self):
        with pytest.raises(InsufficientDataError, match="Spearman-Brown"):
            mcdonald_omega(ATTITUDE.iloc[:, :2])
        with pytest.raises(InsufficientDataError, match="At least 8 complete rows"):
            mcdonald_omega(ATTITUDE.iloc[:7])
        doubled = ATTITUDE.assign(again=ATTITUDE["raises"])
        with pytest.raises(InsufficientDataError, match="a sum of others"):
            mcdonald_omega(doubled)
        assert 0 < mcdonald_omega(doubled, extraction="minres").omega < 1
        with pytest.raises(DataError, match="extraction is 'pca'"):
            mcdonald_omega(ATTITUDE, extraction="pca")
        with pytest.raises(DataError, match="at least 100"):
            mcdonald_omega(ATTITUDE, rng=np.random.default_rng(1), replicates=9)


class TestOneFactor:
    def test_fit_by_the_covariances_themselves(self):
        found = one_factor_check(ATTITUDE)
        correlations = np.corrcoef(ATTITUDE.to_numpy().T)
        loadings = np.array(found.loadings)
        model = np.outer(loadings, loadings) + np.diag(1 - loadings**2)
        discrepancy = (
            np.linalg.slogdet(model)[1]
            - np.linalg.slogdet(correlations)[1]
            + np.trace(correlations @ np.linalg.inv(model))
            - 7
        )
        baseline = -30 * np.linalg.slogdet(correlations)[1]
        fit = found.fit
        assert (fit.df, fit.chi2) == (14, pytest.approx(30 * discrepancy, abs=1e-8))
        assert fit.p == pytest.approx(stats.chi2.sf(fit.chi2, 14))
        assert fit.rmsea == pytest.approx(math.sqrt((fit.chi2 - 14) / (14 * 30)))
        assert fit.cfi == pytest.approx(1 - (fit.chi2 - 14) / (baseline - 21))
        assert fit.tli == pytest.approx((baseline / 21 - fit.chi2 / 14) / (baseline / 21 - 1))
        low, high = (14 * 30 * end**2 for end in fit.rmsea_ci)
        assert (stats.ncx2.cdf(fit.chi2, 14, low), stats.ncx2.cdf(fit.chi2, 14, high)) == pytest.approx((0.95, 0.05))
        residuals = (correlations - model)[np.tril_indices(7)]
        assert found.srmr == pytest.approx(math.sqrt((residuals**2).mean()))
        assert found.explained == pytest.approx((loadings**2).mean())
        assert found.eigenvalues == pytest.approx(np.linalg.eigvalsh(correlations)[::-1])
        assert "does not fit well by CFI, SRMR, RMSEA" in found.flags[0]

    def test_p_is_uniform_if_one_factor_holds(self):
        p = [one_factor_check(some_answers(seed, rows=300)).fit.p for seed in range(100)]
        assert stats.kstest(p, "uniform").pvalue > 0.01

    def test_parallel_analysis_counts_factors(self):
        rng = np.random.default_rng(1)
        factors = rng.normal(size=(400, 2))
        answers = np.repeat(factors, 4, axis=1) + rng.normal(size=(400, 8))
        assert one_factor_check(answers, rng=rng).factors == 2
        assert one_factor_check(answers[:, :4], rng=rng).factors == 1
        assert one_factor_check(answers[:, :4]).factors is None
        noise = np.array([np.linalg.eigvalsh(np.corrcoef(rng.normal(size=(8, 400))))[::-1] for _ in range(300)])
        expected = np.quantile(noise, 0.95, axis=0)
        assert one_factor_check(answers, rng=rng).thresholds == pytest.approx(expected, abs=0.03)

    def test_three_items_leave_nothing_to_test(self):
        found = one_factor_check(ATTITUDE[["rating", "privileges", "learning"]])
        assert found.fit is None
        assert found.srmr == pytest.approx(0, abs=1e-6)
        assert "no degrees of freedom" in found.apa()
        assert "no degrees of freedom" in found.flags[-1]
        assert math.isnan(found.to_frame().iloc[0]["chi2"])

    def test_two_items_have_no_factor(self):
        found = one_factor_check(ATTITUDE[["rating", "privileges"]])
        r = np.corrcoef(ATTITUDE["rating"], ATTITUDE["privileges"])[0, 1]
        assert found.two_items == pytest.approx(2 * r / (1 + r))
        assert (found.fit, found.srmr, found.loadings) == (None, None, ())
        assert "Spearman-Brown reliability = .60" in found.apa()
        assert found.item_frame()["loading"].isna().all()
        against = one_factor_check(ATTITUDE[["rating", "privileges"]] * [1, -1])
        assert against.two_items is None
        assert "not reversed" in against.flags[-1]

    def test_items_that_do_not_correlate(self):
        answers = np.array(np.meshgrid(*[[-1, 1]] * 4)).reshape(4, -1).T
        found = one_factor_check(answers)
        assert (found.fit.cfi, found.fit.tli) == (None, None)
        assert "hardly correlate" in found.flags[-1]
        assert found.explained < 0.01

    def test_the_sentence(self):
        text = one_factor_check(ATTITUDE.iloc[:, :4]).apa()
        assert text.startswith("One-factor model by maximum likelihood (4 items, n = 30): χ²(2) = 3.55, p = .169")
        assert text.endswith("the factor explains 61% of the variance.")


def test_spearman_brown():
    assert spearman_brown(0.5) == pytest.approx(2 / 3)
    assert spearman_brown(0.8, times=0.5) == pytest.approx(2 / 3)
    for r, times in ((-1, 2), (1.2, 2), (NAN, 2), (0.5, 0), (0.5, math.inf), (-0.9, 3)):
        with pytest.raises(DataError):
            spearman_brown(r, times=times)


@given(
    st.integers(1, 5).flatmap(
        lambda items: st.lists(
            st.lists(st.sampled_from([NAN, -4.0, 0.0, 1.0, 4.0, 1e-200, 1e139]), min_size=items, max_size=items),
            min_size=1,
            max_size=9,
        )
    ),
    st.sampled_from([cronbach_alpha, mcdonald_omega, one_factor_check]),
)
@settings(deadline=None, max_examples=60)
def test_a_result_or_an_error_and_no_warning(answers, function):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = function(answers)
        except (DataError, InsufficientDataError):
            return
        assert found.summary()
        assert len(found.to_frame()) == 1
        assert "nan" not in found.summary()
