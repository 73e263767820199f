import math

import numpy as np
import pandas as pd
import pytest
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.ordinal.crossed import crossed_cumulative_logit
from evaluation.statistics.ordinal.fixed import cumulative_logit
from evaluation.statistics.ordinal.mixed import cumulative_logit_mixed


def study(seed, *, effects=(0, 0.7, 1.4), raters=12, stimuli=8, cuts=(-1.5, 0, 1.5, 3)):
    """Ratings, conditions, raters and stimuli of a complete design with intercepts of raters and stimuli."""
    random = np.random.default_rng(seed)
    grids = np.meshgrid(np.arange(len(effects)), np.arange(raters), np.arange(stimuli), indexing="ij")
    condition, rater, stimulus = (grid.ravel() for grid in grids)
    latent = np.array(effects)[condition] + random.normal(size=raters)[rater]
    latent += 0.6 * random.normal(size=stimuli)[stimulus] + random.logistic(size=rater.size)
    return np.digitize(latent, cuts) + 1, np.array(["none", "head", "face"])[condition], rater, stimulus


RATINGS, CONDITIONS, RATERS, STIMULI = study(1)
FOUND = crossed_cumulative_logit(RATINGS, CONDITIONS, RATERS, STIMULI)


def test_the_model_is_that_of_treatment_codes():
    codes = np.equal.outer(CONDITIONS, ["head", "face"]).astype(float)
    random = [("rater", RATERS), ("stimulus", STIMULI)]
    model = cumulative_logit_mixed(RATINGS, codes, random, names=["head", "face"])
    assert FOUND.conditions == ("none", "head", "face")
    assert FOUND.model.coefficients == model.coefficients
    assert FOUND.model.random_sds == model.random_sds
    without = cumulative_logit_mixed(RATINGS, np.empty((len(RATINGS), 0)), random)
    assert FOUND.chi2 == pytest.approx(2 * (model.loglik - without.loglik), abs=1e-6)
    assert FOUND.df == 2
    assert FOUND.p == pytest.approx(special.chdtrc(2, FOUND.chi2))


def test_what_was_simulated_comes_back():
    head, face = FOUND.model.coefficients
    assert head.ci[0] < 0.7 < head.ci[1]
    assert face.ci[0] < 1.4 < face.ci[1]
    assert FOUND.p < 0.001


def test_contrasts_do_not_depend_on_the_reference():
    order = pd.Categorical(CONDITIONS, categories=["face", "none", "head"])
    other = crossed_cumulative_logit(RATINGS, order, RATERS, STIMULI)
    assert other.conditions == ("face", "none", "head")
    assert other.chi2 == pytest.approx(FOUND.chi2, abs=1e-6)
    head_face = FOUND.contrasts[2]
    assert (head_face.first, head_face.second) == ("head", "face")
    face_head = other.contrasts[1]
    assert (face_head.first, face_head.second) == ("face", "head")
    assert face_head.estimate == pytest.approx(-head_face.estimate, rel=1e-4)
    assert face_head.se == pytest.approx(head_face.se, rel=1e-4)
    assert face_head.odds_ratio == pytest.approx(1 / head_face.odds_ratio, rel=1e-4)


def test_probabilities_are_adjusted_by_holm():
    ps = sorted((one.p, one.p_holm) for one in FOUND.contrasts)
    expected = np.maximum.accumulate([min(1, ps[0][0] * 3), min(1, ps[1][0] * 2), ps[2][0]])
    assert [holm for _, holm in ps] == pytest.approx(expected)


def test_words_and_tables():
    text = FOUND.apa()
    assert text.startswith("The conditions differed, χ²(2) = ")
    assert "head against none: OR = " in text
    assert FOUND.to_frame()["second"].tolist() == ["head", "face", "face"]
    assert FOUND.proportional_odds.apa().startswith("Proportional odds (likelihood ratio test): χ²(6) = ")
    same = crossed_cumulative_logit(*study(3, effects=(0, 0, 0)))
    assert same.p > 0.05
    assert same.apa().startswith("The conditions did not differ reliably, ")


def test_a_condition_that_spreads_ratings_is_seen():
    random = np.random.default_rng(4)
    n = 12 * 10
    narrow = random.choice([2, 3, 4], p=[0.2, 0.6, 0.2], size=n)
    wide = random.choice([1, 2, 3, 4, 5], p=[0.3, 0.15, 0.1, 0.15, 0.3], size=n)
    narrow[:2] = 1, 5
    rater, stimulus = np.tile(np.repeat(np.arange(12), 10), 2), np.tile(np.arange(10), 24)
    found = crossed_cumulative_logit(np.concatenate([narrow, wide]), ["a"] * n + ["b"] * n, rater, stimulus)
    assert found.proportional_odds.df == 3
    assert found.proportional_odds.p < 1e-6
    assert any("do not act alike" in flag for flag in found.flags)


def test_tests_without_random_spread_are_those_of_counts():
    """Where all raters and all stimuli have the same ratings, the models are known from the table of counts."""
    patterns = np.array([[1, 1, 1, 2, 2, 3], [1, 2, 2, 3, 3, 3], [1, 1, 2, 2, 3, 3]])
    condition, rater, stimulus = (grid.ravel() for grid in np.indices((3, 6, 6)))
    ratings = patterns[condition, (rater + stimulus) % 6]
    found = crossed_cumulative_logit(ratings, condition, rater, stimulus)
    assert found.model.random_sds == {"rater": 0, "stimulus": 0}
    assert found.model.singular
    counts = np.array([np.bincount(row)[1:] * 6 for row in patterns])
    simple = cumulative_logit(ratings, np.equal.outer(condition, [1, 2]).astype(float)).loglik
    alike = (counts.sum(axis=0) * np.log(counts.sum(axis=0) / 108)).sum()
    free = (counts * np.log(counts / 36)).sum()
    assert found.chi2 == pytest.approx(2 * (simple - alike), abs=1e-8)
    assert found.proportional_odds.chi2 == pytest.approx(2 * (free - simple), abs=1e-8)
    assert found.proportional_odds.df == 2


def test_categories_that_a_condition_lacks_are_named_and_merged_for_the_check():
    ratings = np.where((CONDITIONS == "none") & (RATINGS == 5), 4, RATINGS)
    found = crossed_cumulative_logit(ratings, CONDITIONS, RATERS, STIMULI)
    assert any("condition none is in the category 5" in flag for flag in found.flags)
    assert found.proportional_odds.flags == ("For this check categories were merged: 1, 2, 3, 4+5.",)
    assert found.proportional_odds.df == 4


def test_repeated_ratings_are_flagged():
    twice = [np.append(values, values[:2]) for values in (RATINGS, CONDITIONS, RATERS, STIMULI)]
    assert any(flag.startswith("2 of 290 ratings repeat") for flag in crossed_cumulative_logit(*twice).flags)


def test_two_categories_have_no_check():
    found = crossed_cumulative_logit(RATINGS > 2, CONDITIONS, RATERS, STIMULI)
    assert found.proportional_odds is None
    assert len(found.model.thresholds) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"conditions": ["one"] * 288}, "only the condition one"),
        ({"conditions": pd.Categorical(CONDITIONS, categories=["none", "head", "face", "x"])}, "x has no ratings"),
        ({"raters": ["r"] * 288}, "only one rater"),
        ({"stimuli": ["s"] * 288}, "only one stimulus"),
        ({"ratings": [3] * 288}, "two categories or more"),
        ({"ratings": np.where(CONDITIONS == "face", 5, RATINGS)}, "condition face are in the highest category"),
        ({"ratings": np.where(CONDITIONS == "head", 1, RATINGS)}, "condition head are in the lowest category"),
        ({"ratings": np.where(CONDITIONS == "head", 3 + RATINGS, np.minimum(RATINGS, 3))}, "separated perfectly"),
    ],
)
def test_too_little_to_compare_is_refused(change, message):
    data = {"ratings": RATINGS, "conditions": CONDITIONS, "raters": RATERS, "stimuli": STIMULI} | change
    with pytest.raises(InsufficientDataError, match=message):
        crossed_cumulative_logit(**data)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ratings": [math.nan, *RATINGS[1:]]}, "missing"),
        ({"ratings": [math.inf, *RATINGS[1:]]}, "infinite"),
        ({"raters": [None, *RATERS[1:]]}, "rater: the label at place 0"),
        ({"conditions": CONDITIONS[1:]}, "287 labels for 288"),
    ],
)
def test_unsound_data_is_refused(change, message):
    data = {"ratings": RATINGS, "conditions": CONDITIONS, "raters": RATERS, "stimuli": STIMULI} | change
    with pytest.raises(DataError, match=message):
        crossed_cumulative_logit(**data)
