import math
import warnings

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize, special

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.ordinal.fixed import cumulative_logit

# Bitterness of wine by nine judges, each two bottles of cold and warm, without and with contact: Randall (1989), as in
# the R package ordinal.
WINE = np.array(
    [int(c) for c in "233444551213235423325544323232532343333332322454112223232223333412323244"], dtype=float
)
WARM = np.tile([0, 0, 0, 0, 1, 1, 1, 1], 9)
CONTACT = np.tile([0, 0, 1, 1, 0, 0, 1, 1], 9)
TREATMENTS = pd.DataFrame({"warm": WARM, "contact": CONTACT})


def log_likelihood(y, x, thresholds, coefficients):
    """The log-likelihood of categories 0, 1, ..., from plain differences of distribution functions."""
    ends = np.concatenate([[-np.inf], thresholds, [np.inf]])
    eta = x @ coefficients
    return np.log(special.expit(ends[y + 1] - eta) - special.expit(ends[y] - eta)).sum()


@st.composite
def overlapping(draw):
    """Answers in 2 to 4 categories, each of which occurs with all combinations of two predictors' values; and more."""
    categories = draw(st.integers(2, 4))
    every = [(k, a, b) for k in range(categories) for a in (0, 1) for b in (-1, 1)]
    more = draw(st.lists(st.tuples(st.integers(0, categories - 1), st.integers(0, 1), st.integers(-1, 1)), max_size=20))
    rows = np.array(every + more)
    return rows[:, 0], rows[:, 1:].astype(float)


class TestWine:
    """Published numbers: ``clm(rating ~ temp + contact, data = wine)``, Christensen (2019), vignette of ordinal."""

    found = cumulative_logit(WINE, TREATMENTS)

    def test_the_estimates(self):
        assert [one.estimate for one in self.found.coefficients] == pytest.approx([2.50310201, 1.52779766], rel=1e-7)
        assert [one.se for one in self.found.coefficients] == pytest.approx([0.5286801, 0.4766226], rel=1e-6)
        published = [-1.34438341, 1.25080880, 3.46688693, 5.00640420]
        assert [one.estimate for one in self.found.thresholds] == pytest.approx(published, rel=1e-7)
        # Printed in the vignette.
        assert [round(one.se, 4) for one in self.found.thresholds] == [0.5171, 0.4379, 0.5978, 0.7309]

    def test_the_fit(self):
        assert self.found.loglik == pytest.approx(-86.4919233656, rel=1e-10)
        assert self.found.aic == pytest.approx(184.98, abs=0.005)
        assert (self.found.parameters, self.found.n, self.found.categories) == (6, 72, (1, 2, 3, 4, 5))
        assert self.found.converged
        assert not self.found.flags

    def test_the_tests(self):
        warm, contact = self.found.coefficients
        assert (round(warm.z, 3), round(contact.z, 3)) == (4.735, 3.205)
        assert warm.p == pytest.approx(2.19e-06, rel=0.01)
        assert contact.p == pytest.approx(0.00135, abs=5e-6)
        assert warm.ci == pytest.approx((warm.estimate - 1.959964 * warm.se, warm.estimate + 1.959964 * warm.se))
        assert warm.odds_ratio == pytest.approx(12.22, abs=0.005)

    def test_words_and_tables(self):
        assert self.found.apa() == (
            "warm: OR = 12.22, 95% CI [4.34, 34.44], z = 4.73, p < .001; "
            "contact: OR = 4.61, 95% CI [1.81, 11.73], z = 3.21, p = .001"
        )
        frame = self.found.to_frame()
        assert frame["name"].tolist() == ["1|2", "2|3", "3|4", "4|5", "warm", "contact"]
        assert frame["odds_ratio"].isna().tolist() == [True] * 4 + [False] * 2

    def test_a_contrast_of_coefficients(self):
        one = self.found.contrast([1, -1])
        assert one.estimate == pytest.approx(2.50310201 - 1.52779766, rel=1e-6)
        cov = self.found.vcov[4:, 4:]
        assert one.se == pytest.approx(math.sqrt(cov[0, 0] + cov[1, 1] - 2 * cov[0, 1]))
        with pytest.raises(DataError, match="3 weights for 2"):
            self.found.contrast([1, 0, 0])

    def test_the_covariance_cannot_be_changed(self):
        with pytest.raises(ValueError, match="read-only"):
            self.found.vcov[0, 0] = 1


def test_two_groups_and_two_categories_are_a_table():
    y = [0] * 30 + [1] * 10 + [0] * 12 + [1] * 18
    found = cumulative_logit(y, [[0]] * 40 + [[1]] * 30)
    (one,) = found.coefficients
    assert one.odds_ratio == pytest.approx(30 * 18 / (10 * 12))
    assert one.se == pytest.approx(math.sqrt(1 / 30 + 1 / 10 + 1 / 12 + 1 / 18))
    assert found.thresholds[0].estimate == pytest.approx(math.log(3))
    assert found.proportional_odds is None


def test_without_predictors_thresholds_are_logits_of_shares():
    found = cumulative_logit(WINE, np.empty((72, 0)))
    assert [one.estimate for one in found.thresholds] == pytest.approx(
        special.logit(np.array([5, 27, 53, 65]) / 72).tolist()
    )
    counts = np.array([5, 22, 26, 12, 7])
    assert found.loglik == pytest.approx(counts @ np.log(counts / 72))
    assert found.apa().startswith("log-likelihood = ")


@given(overlapping())
@settings(max_examples=25)
def test_no_other_parameters_are_likelier(data):
    y, x = data
    found = cumulative_logit(y, x)
    thresholds = np.array([one.estimate for one in found.thresholds])
    coefficients = np.array([one.estimate for one in found.coefficients])
    assert found.loglik == pytest.approx(log_likelihood(y, x, thresholds, coefficients))
    packed = np.concatenate([thresholds, coefficients])

    def loss(values):
        return -log_likelihood(y, x, values[: thresholds.size], values[thresholds.size :])

    slope = optimize.approx_fprime(packed, loss, 1e-7)
    assert slope == pytest.approx(np.zeros(packed.size), abs=1e-4)


@given(overlapping(), st.floats(-1e6, 1e6), st.sampled_from([1e-3, 1.0, 1e6]), st.randoms())
@settings(max_examples=25)
def test_shifts_units_and_order_do_not_matter(data, shift, unit, random):
    y, x = data
    order = list(range(len(y)))
    random.shuffle(order)
    one, other = cumulative_logit(y, x), cumulative_logit(10.0 * y[order], x[order] * unit + shift * unit)
    for before, after in zip(one.coefficients, other.coefficients, strict=True):
        assert after.estimate * unit == pytest.approx(before.estimate, rel=1e-5, abs=1e-6)
        assert after.se * unit == pytest.approx(before.se, rel=1e-5)
    assert other.loglik == pytest.approx(one.loglik, abs=1e-7)


@given(overlapping())
@settings(max_examples=15)
def test_a_scale_turned_about_turns_the_signs(data):
    y, x = data
    one, other = cumulative_logit(y, x), cumulative_logit(-y, x)
    assert [c.estimate for c in other.coefficients] == pytest.approx([-c.estimate for c in one.coefficients], abs=1e-6)
    turned = [-c.estimate for c in one.thresholds][::-1]
    assert [c.estimate for c in other.thresholds] == pytest.approx(turned, abs=1e-6)
    if one.proportional_odds:
        assert other.proportional_odds.chi2 == pytest.approx(one.proportional_odds.chi2, abs=1e-5)


class TestProportionalOdds:
    def test_the_score_and_information_are_those_of_free_coefficients(self):
        found = cumulative_logit(WINE, TREATMENTS)
        y, x = WINE.astype(int) - 1, TREATMENTS.to_numpy(float)
        start = [[one.estimate, *(c.estimate for c in found.coefficients)] for one in found.thresholds]

        def chances(free, row):
            below = np.concatenate([[0], special.expit(free[:, 0] - free[:, 1:] @ row), [1]])
            return np.diff(below)

        def slopes(row, k):
            flat = np.ravel(start)
            return np.array(
                [
                    (
                        math.log(chances((flat + step).reshape(4, 3), row)[k])
                        - math.log(chances((flat - step).reshape(4, 3), row)[k])
                    )
                    / 2e-5
                    for step in 1e-5 * np.eye(12)
                ]
            )

        score = sum(slopes(row, k) for row, k in zip(x, y, strict=True))
        information = sum(
            p * np.outer(slopes(row, k), slopes(row, k))
            for row in x
            for k, p in enumerate(chances(np.array(start), row))
        )
        odds = found.proportional_odds
        assert odds.chi2 == pytest.approx(score @ np.linalg.solve(information, score), rel=1e-5)
        assert (odds.df, odds.method) == (6, "score")
        assert odds.p == pytest.approx(special.chdtrc(6, odds.chi2))
        assert odds.to_frame()["chi2"].tolist() == [odds.chi2]

    def test_an_effect_at_one_threshold_alone_is_seen(self):
        low = [1] * 60 + [2] * 60 + [3] * 60
        high = [1] * 60 + [2] * 10 + [3] * 110
        found = cumulative_logit(low + high, [[0]] * 180 + [[1]] * 180)
        assert found.proportional_odds.p < 1e-6
        assert any("do not act alike" in flag for flag in found.flags)


class TestAnswers:
    def test_ordered_categories_keep_their_order_and_unused_ones_are_named(self):
        words = pd.Categorical(
            ["mid", "low", "high", "low", "mid", "high"], categories=["low", "mid", "top", "high"], ordered=True
        )
        x = [[0], [0], [0], [1], [1], [1]]
        found = cumulative_logit(words, x)
        assert [one.name for one in found.thresholds] == ["low|mid", "mid|high"]
        assert found.flags == ("Nobody chose the category top; the model knows only the categories that were used.",)
        assert found.loglik == pytest.approx(cumulative_logit([2, 1, 4, 1, 2, 4], x).loglik)

    def test_a_gap_in_whole_numbers_is_named(self):
        assert "category 3" in cumulative_logit([1, 2, 4, 1, 2, 4], [[0]] * 3 + [[1]] * 3).flags[0]

    @pytest.mark.parametrize(
        ("y", "message"),
        [
            ([1, 2, math.nan, 1], "missing or infinite"),
            ([1, 2, math.inf, 1], "missing or infinite"),
            ([1, 2, None, 1], "missing or infinite"),
            (["a", "b", "a", "b"], "no order"),
            (pd.Series(["a", "b", "a", "b"], dtype="category"), "no order"),
            (pd.Categorical([1, 2, None, 1], ordered=True), "missing"),
            ([[1, 2], [2, 1]], "2 dimensions"),
            ([1, 2, 1], "4 rows for 3"),
        ],
    )
    def test_what_cannot_be_ordered_is_refused(self, y, message):
        with pytest.raises(DataError, match=message):
            cumulative_logit(y, [[0], [1], [1], [0]])

    def test_many_different_values_are_refused(self):
        with pytest.raises(DataError, match="300 different values"):
            cumulative_logit(np.arange(300) / 7, np.empty((300, 0)))

    @pytest.mark.parametrize("y", [[], [3], [3, 3, 3, 3]])
    def test_too_few_kinds_of_answers_are_refused(self, y):
        with pytest.raises(InsufficientDataError, match="y: "):
            cumulative_logit(y, np.empty((len(y), 0)))


class TestPredictors:
    @pytest.mark.parametrize(
        ("column", "message"),
        [
            ([1, 1, 1, 1, 1], "same for all"),
            ([1e9 + 1, 1e9 + 1, 1e9 + 1, 1e9 + 1, 1e9 + 1], "same for all"),
            ([2, 4, 6, 0, 2], "combination"),
        ],
    )
    def test_columns_without_an_effect_of_their_own_are_refused(self, column, message):
        with pytest.raises(InsufficientDataError, match=message):
            cumulative_logit([1, 2, 1, 2, 1], np.column_stack([[1, 2, 3, 0, 1], column]))

    @pytest.mark.parametrize("value", [math.nan, math.inf, "a"])
    def test_what_is_no_number_is_refused(self, value):
        with pytest.raises(DataError, match="fixed"):
            cumulative_logit([1, 2, 1], [[0], [1], [value]])

    def test_names_must_fit(self):
        with pytest.raises(DataError, match="names"):
            cumulative_logit(WINE, TREATMENTS, names=["a", "a"])
        assert cumulative_logit(WINE, TREATMENTS.to_numpy()).coefficients[1].name == "x2"

    def test_the_confidence_must_be_one(self):
        with pytest.raises(DataError, match="confidence"):
            cumulative_logit(WINE, TREATMENTS, confidence=95)

    def test_an_odds_ratio_beyond_all_numbers_is_flagged(self):
        found = cumulative_logit(WINE, TREATMENTS * 1e-6)
        assert any("use larger units" in flag for flag in found.flags)


class TestSeparation:
    @pytest.mark.parametrize(
        ("y", "x"),
        [
            ([1, 1, 2, 2, 3, 3], [1, 2, 3, 4, 5, 6]),
            # One group at an end of the scale.
            ([1, 2, 3, 3, 3, 3], [0, 0, 0, 1, 1, 1]),
            # Groups share a category, but the likelihood still rises for ever.
            ([1, 2, 2, 1, 2, 3, 3, 2], [0, 0, 0, 0, 1, 1, 1, 1]),
            ([1] * 50 + [2] * 50, [*range(50), *range(49, 99)]),
        ],
    )
    def test_it_is_named(self, y, x):
        with pytest.raises(InsufficientDataError, match="separated perfectly by dose"):
            cumulative_logit(y, np.array(x)[:, None], names=["dose"])

    def test_an_overlap_of_two_answers_is_enough(self):
        y = np.repeat([1, 2], 50)
        x = np.concatenate([np.arange(50), np.arange(48, 98)])[:, None]
        (one,) = cumulative_logit(y, x).coefficients
        assert math.isfinite(one.se)

    def test_a_combination_that_separates_is_found(self):
        random = np.random.default_rng(2)
        x = random.normal(size=(80, 2))
        y = (x @ [1, -2] > 0.3).astype(int)
        with pytest.raises(InsufficientDataError, match="a, b"):
            cumulative_logit(y, x, names=["a", "b"])


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.sampled_from([0.0, 1.0, 2.0, 1e9, math.nan, math.inf]), st.integers(0, 1)),
        max_size=12,
    )
)
@settings(max_examples=100)
def test_any_data_gives_numbers_or_a_sentence(rows):
    y, x = [row[0] for row in rows], np.array([row[1:] for row in rows], dtype=float).reshape(len(rows), 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = cumulative_logit(y, x)
        except EvaluationError as error:
            assert str(error).endswith(".")
            return
    numbers = [value for one in found.coefficients for value in (one.estimate, one.se, one.p)]
    assert np.isfinite(numbers).all() or found.flags
