"""All statistics of ``evaluation.statistics``, given what they should not be: an error of ours or a flagged result."""

import importlib
import inspect
import itertools
import os
import pkgutil
import typing
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from bad_data import Bad, bad_data, judge, named_data
from hypothesis import HealthCheck, given, settings

import evaluation.statistics as package
from evaluation.instruments import PAD12
from evaluation.statistics import (
    anova,
    assumptions,
    bounded_interval,
    bradley_terry,
    bt500,
    canonical,
    confusion,
    consistency,
    contingency,
    correlation,
    effect_size,
    ellipse,
    emotion_words,
    equivalence,
    factorial,
    leave_one_out,
    min_f,
    multiplicity,
    opinion,
    pad_space,
    posthoc,
    rank_correlation,
    rank_tests,
    rater_model,
    repeated_measures,
    sos,
    t_test,
    unit_means,
    votes,
    votes_needed,
    welch,
)
from evaluation.statistics.agreement import annotation as agreement
from evaluation.statistics.agreement import fleiss as fleiss_kappa
from evaluation.statistics.agreement import icc, kappa, krippendorff, pairwise, rater_pairs
from evaluation.statistics.mixed import models as mixed
from evaluation.statistics.mixed.models import RandomTerm
from evaluation.statistics.ordinal import crossed as ordinal_crossed
from evaluation.statistics.ordinal import fixed as ordinal
from evaluation.statistics.ordinal import mixed as ordinal_mixed
from evaluation.statistics.power import closed_form as power
from evaluation.statistics.power import crossed as crossed_power
from evaluation.statistics.power import simulation as power_simulation
from evaluation.statistics.power.crossed_design import CrossedDesign, VarianceComponents
from evaluation.statistics.regression import linear as regression
from evaluation.statistics.regression import nonlinear as nonlinear_regression
from evaluation.statistics.result import Result
from evaluation.statistics.scale_reliability import alpha as scale_reliability
from evaluation.statistics.scale_reliability import omega, one_factor
from evaluation.statistics.scale_reliability import pad as pad_scale_quality

SOAK = "PADLAB_SOAK" in os.environ
# What only serves other functions, and gets nothing but what these have checked.
INNER = {"mixed_result", "score_test"}


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def stacked(bad: Bad) -> Any:
    """Ratings by item, rater and dimension, the same in all three."""
    return np.stack([bad.table] * 3)


def random_terms(bad: Bad) -> list[RandomTerm]:
    return [RandomTerm(name="rater", labels=bad.raters), RandomTerm(name="item", labels=bad.items)]


def with_slopes(bad: Bad) -> Any:
    term = RandomTerm(name="rater", labels=bad.raters, design=bad.dummies)
    return mixed.mixed_model(bad.values, bad.dummies, [term])


def compared(bad: Bad) -> Any:
    null, full = (
        mixed.mixed_model(bad.values, columns, random_terms(bad), method="ML")
        for columns in (bad.dummies[["(Intercept)"]], bad.dummies)
    )
    return mixed.compare(null, full)


def answers(bad: Bad) -> pd.DataFrame:
    columns = itertools.cycle(range(bad.table.shape[1]))
    return pd.DataFrame({item.id: bad.table[:, place] for item, place in zip(PAD12.items, columns, strict=False)})


def design(bad: Bad) -> CrossedDesign:
    return CrossedDesign(raters=bad.counts[0], items=bad.counts[1], conditions=2)


def components(bad: Bad) -> VarianceComponents:
    return VarianceComponents(rater_sd=bad.numbers[0], item_sd=bad.numbers[1], residual_sd=bad.numbers[2])


def summary(bad: Bad, numbers: Any) -> dict[str, Any]:
    return {f"condition {place}": one for place, one in enumerate(numbers)}


# All public functions that return results; of several calls of one, each name after the first says how it differs.
TABLE: dict[str, Callable[[Bad], Any]] = {
    "agreement.annotation_agreement": lambda bad: agreement.annotation_agreement(stacked(bad)),
    "anova.one_way": lambda bad: anova.one_way(bad.groups),
    "anova.one_way_of_matrix": lambda bad: anova.one_way_of_matrix(bad.ratings),
    "anova.one_way_from_summary": lambda bad: anova.one_way_from_summary(
        summary(bad, bad.numbers), summary(bad, bad.numbers[::-1]), summary(bad, bad.counts)
    ),
    "assumptions.levene": lambda bad: assumptions.levene(bad.groups),
    "assumptions.levene, mean": lambda bad: assumptions.levene(bad.groups, center="mean"),
    "assumptions.bartlett": lambda bad: assumptions.bartlett(bad.groups),
    "assumptions.fligner": lambda bad: assumptions.fligner(bad.groups),
    "assumptions.shapiro": lambda bad: assumptions.shapiro(bad.values),
    "assumptions.shapiro_residuals": lambda bad: assumptions.shapiro_residuals(bad.groups),
    "bounded_interval.bounded_interval": lambda bad: bounded_interval.bounded_interval(bad.values, low=1, high=5),
    "bounded_interval.bounded_interval, wilson": lambda bad: bounded_interval.bounded_interval(
        bad.values, low=bad.numbers[0], high=bad.numbers[1], method="wilson"
    ),
    "bounded_interval.bounded_interval, bootstrap": lambda bad: bounded_interval.bounded_interval(
        bad.values, low=1, high=5, method="bootstrap", rng=rng(), resamples=100
    ),
    "bounded_interval.bounded_table": lambda bad: bounded_interval.bounded_table(
        bad.frame, score="score", by=["item"], low=1, high=5
    ),
    "bounded_interval.bounded_table, bootstrap": lambda bad: bounded_interval.bounded_table(
        bad.frame, score="score", by=["item"], low=1, high=5, method="bootstrap", rng=rng(), resamples=100
    ),
    "bradley_terry.bradley_terry": lambda bad: bradley_terry.bradley_terry(list(bad.first), list(bad.second)),
    "bradley_terry.bradley_terry_of_counts": lambda bad: bradley_terry.bradley_terry_of_counts(bad.ratings),
    "bradley_terry.bradley_terry_of_counts, prior": lambda bad: bradley_terry.bradley_terry_of_counts(
        bad.ratings, prior=bad.numbers[0]
    ),
    "bt500.range_counts": lambda bad: bt500.range_counts(bad.ratings),
    "bt500.bt500_rejection": lambda bad: bt500.bt500_rejection(bad.ratings),
    "canonical.canonical_correlation": lambda bad: canonical.canonical_correlation(bad.table[:, :2], bad.table[:, 2:]),
    "canonical.canonical_correlation, with itself": lambda bad: canonical.canonical_correlation(
        bad.ratings, bad.table[:, ::-1]
    ),
    "confusion.confusion": lambda bad: confusion.confusion(list(bad.first), list(bad.second)),
    "confusion.confusion_of_counts": lambda bad: confusion.confusion_of_counts(bad.ratings),
    "consistency.rater_consistency": lambda bad: consistency.rater_consistency(
        bad.values, raters=bad.raters, items=bad.conditions
    ),
    "contingency.contingency": lambda bad: contingency.contingency(list(bad.first), list(bad.second)),
    "contingency.contingency_of_counts": lambda bad: contingency.contingency_of_counts(bad.ratings),
    "correlation.pearson": lambda bad: correlation.pearson(bad.first, bad.second),
    "crossed_power.crossed_power": lambda bad: crossed_power.crossed_power(
        design(bad), bad.numbers[:2], components(bad)
    ),
    "effect_size.cohens_d": lambda bad: effect_size.cohens_d(bad.first, bad.second),
    "effect_size.cohens_d_paired": lambda bad: effect_size.cohens_d_paired(bad.first, bad.second),
    "effect_size.cohens_d_paired, average": lambda bad: effect_size.cohens_d_paired(
        bad.first, bad.second, standardiser="average"
    ),
    "effect_size.hedges_g": lambda bad: effect_size.hedges_g(bad.first, bad.second),
    "effect_size.hedges_g, paired": lambda bad: effect_size.hedges_g(bad.first, bad.second, paired=True),
    "effect_size.cliffs_delta": lambda bad: effect_size.cliffs_delta(bad.first, bad.second),
    "ellipse.ellipse": lambda bad: ellipse.ellipse(bad.table[:, :2]),
    "ellipse.ellipses": lambda bad: ellipse.ellipses(bad.table[:, :3], [str(one) for one in bad.first], about="mean"),
    "emotion_words.nearest_words": lambda bad: emotion_words.nearest_words(bad.table[:, :3]),
    "emotion_words.nearest_words, mahalanobis": lambda bad: emotion_words.nearest_words(
        bad.table[:, :3], metric="mahalanobis", covariance=bad.table[:3, :3]
    ),
    "equivalence.tost_paired": lambda bad: equivalence.tost_paired(bad.first, bad.second, bounds=bad.numbers[0]),
    "equivalence.tost_one_sample": lambda bad: equivalence.tost_one_sample(
        bad.values, bounds=(bad.numbers[0], bad.numbers[1])
    ),
    "equivalence.tost_independent": lambda bad: equivalence.tost_independent(
        bad.first, bad.second, bounds=bad.numbers[0]
    ),
    "equivalence.tost_independent, standardised": lambda bad: equivalence.tost_independent(
        bad.first, bad.second, bounds=0.5, standardised=True
    ),
    "factorial.two_way": lambda bad: factorial.two_way(bad.values, bad.conditions, bad.raters),
    "factorial.two_way, sequential": lambda bad: factorial.two_way(bad.values, bad.items, bad.raters, ss_type=1),
    "fleiss_kappa.fleiss_kappa": lambda bad: fleiss_kappa.fleiss_kappa(bad.ratings),
    "fleiss_kappa.fleiss_kappa_of_labels": lambda bad: fleiss_kappa.fleiss_kappa_of_labels(
        bad.ratings, rng=rng(), replicates=100
    ),
    "icc.intraclass_correlations": lambda bad: icc.intraclass_correlations(bad.ratings),
    "kappa.cohen_kappa": lambda bad: kappa.cohen_kappa(bad.first, bad.second),
    "kappa.cohen_kappa, weighted": lambda bad: kappa.cohen_kappa(bad.first, bad.second, weights="quadratic"),
    "kappa.light_kappa": lambda bad: kappa.light_kappa(bad.ratings),
    **{
        f"krippendorff.krippendorff_alpha{name}": (
            lambda bad, level=level: krippendorff.krippendorff_alpha(
                bad.ratings, level=level, rng=rng(), replicates=100
            )
        )
        for level, name in (("interval", ""), ("nominal", ", nominal"), ("ordinal", ", ordinal"), ("ratio", ", ratio"))
    },
    "leave_one_out.leave_one_out": lambda bad: leave_one_out.leave_one_out(bad.ratings),
    "min_f.min_f": lambda bad: min_f.min_f(
        repeated_measures.repeated_measures(bad.ratings), repeated_measures.repeated_measures(bad.table[1:])
    ),
    "mixed.mixed_model": lambda bad: mixed.mixed_model(bad.values, bad.dummies, random_terms(bad)),
    "mixed.mixed_model, slopes": with_slopes,
    "mixed.crossed_mixed_model": lambda bad: mixed.crossed_mixed_model(
        bad.values, bad.conditions, bad.raters, bad.items
    ),
    "mixed.crossed_mixed_model, slopes": lambda bad: mixed.crossed_mixed_model(
        bad.values, bad.raters, bad.items, bad.conditions, slopes=True
    ),
    "mixed.compare": compared,
    "multiplicity.adjust": lambda bad: multiplicity.adjust(bad.values),
    "multiplicity.adjust, BH": lambda bad: multiplicity.adjust(bad.numbers, method="BH"),
    "nonlinear_regression.nonlinear_fit": lambda bad: nonlinear_regression.nonlinear_fit(
        lambda x, a, b: a * np.exp(b * x), np.arange(len(bad.first)), bad.first, bad.numbers[:2]
    ),
    "omega.mcdonald_omega": lambda bad: omega.mcdonald_omega(bad.ratings, rng=rng(), replicates=100),
    "omega.mcdonald_omega, minres": lambda bad: omega.mcdonald_omega(bad.ratings, extraction="minres"),
    "one_factor.one_factor_check": lambda bad: one_factor.one_factor_check(bad.ratings, rng=rng(), replicates=100),
    "opinion.opinion_score": lambda bad: opinion.opinion_score(bad.values),
    "ordinal.cumulative_logit": lambda bad: ordinal.cumulative_logit(bad.values, bad.dummies[["second"]]),
    "ordinal.cumulative_logit, separated": lambda bad: ordinal.cumulative_logit(bad.first, bad.table[:, :2]),
    "ordinal_crossed.crossed_cumulative_logit": lambda bad: ordinal_crossed.crossed_cumulative_logit(
        bad.values, bad.conditions, bad.raters, bad.items
    ),
    "ordinal_mixed.cumulative_logit_mixed": lambda bad: ordinal_mixed.cumulative_logit_mixed(
        bad.values, bad.dummies[["second"]], [("rater", bad.raters), ("item", bad.items)]
    ),
    "ordinal_mixed.cumulative_logit_mixed, quadrature": lambda bad: ordinal_mixed.cumulative_logit_mixed(
        bad.values, bad.dummies[["second"]], [("rater", bad.raters)], nodes=5
    ),
    "pad_scale_quality.pad_scale_quality": lambda bad: pad_scale_quality.pad_scale_quality(
        answers(bad), rng=rng(), replicates=100
    ),
    "pad_space.compare_pad": lambda bad: pad_space.compare_pad(bad.table[:, :3], bad.table[::-1, :3]),
    "pairwise.mean_pairwise_pearson": lambda bad: pairwise.mean_pairwise_pearson(bad.ratings),
    "posthoc.tukey_hsd": lambda bad: posthoc.tukey_hsd(bad.groups),
    "posthoc.games_howell": lambda bad: posthoc.games_howell(bad.groups),
    "posthoc.dunn": lambda bad: posthoc.dunn(bad.groups),
    "posthoc.paired_comparisons": lambda bad: posthoc.paired_comparisons(bad.ratings),
    "power.one_way_power": lambda bad: power.one_way_power(bad.numbers[0], bad.counts[0], bad.counts[1]),
    "power.repeated_measures_power": lambda bad: power.repeated_measures_power(
        bad.numbers[0], bad.counts[0], bad.counts[1], correlation=bad.numbers[1], epsilon=bad.numbers[2]
    ),
    "power.independent_t_power": lambda bad: power.independent_t_power(bad.numbers[0], bad.counts[0], bad.counts[1]),
    "power.paired_t_power": lambda bad: power.paired_t_power(
        bad.numbers[0], bad.counts[0], alpha=bad.numbers[1], alternative="greater"
    ),
    "power.correlation_power": lambda bad: power.correlation_power(bad.numbers[0], min(bad.counts[0], 200)),
    "power_simulation.simulate_power": lambda bad: power_simulation.simulate_power(
        CrossedDesign(raters=min(bad.counts[0], 6), items=min(bad.counts[1], 6), conditions=2),
        bad.numbers[:2],
        components(bad),
        seed=1,
        replications=20,
    ),
    "rank_correlation.spearman": lambda bad: rank_correlation.spearman(bad.first, bad.second),
    "rank_correlation.kendall": lambda bad: rank_correlation.kendall(bad.first, bad.second),
    "rank_tests.kruskal_wallis": lambda bad: rank_tests.kruskal_wallis(bad.groups),
    "rank_tests.friedman": lambda bad: rank_tests.friedman(bad.ratings),
    "rank_tests.mann_whitney": lambda bad: rank_tests.mann_whitney(bad.first, bad.second),
    "rank_tests.wilcoxon": lambda bad: rank_tests.wilcoxon(bad.first, bad.second),
    "rater_model.rater_model": lambda bad: rater_model.rater_model(bad.ratings),
    "rater_pairs.pairwise_pearson": lambda bad: rater_pairs.pairwise_pearson(bad.ratings),
    "regression.linear_fit": lambda bad: regression.linear_fit(bad.table[:, :-1], bad.table[:, -1]),
    "regression.linear_fit, constant": lambda bad: regression.linear_fit(bad.dummies, bad.values),
    "regression.simple_regression": lambda bad: regression.simple_regression(bad.first, bad.second),
    "repeated_measures.repeated_measures": lambda bad: repeated_measures.repeated_measures(bad.ratings),
    "repeated_measures.repeated_measures_by_unit": lambda bad: repeated_measures.repeated_measures_by_unit(
        bad.values, bad.conditions, bad.raters
    ),
    "scale_reliability.cronbach_alpha": lambda bad: scale_reliability.cronbach_alpha(bad.ratings),
    "sos.sos": lambda bad: sos.sos(bad.groups, low=1, high=5, rng=rng(), resamples=100),
    "sos.sos_from_summary": lambda bad: sos.sos_from_summary(
        bad.first, bad.second, low=1, high=5, rng=rng(), resamples=100
    ),
    "t_test.paired_t": lambda bad: t_test.paired_t(bad.first, bad.second),
    "t_test.student_t": lambda bad: t_test.student_t(bad.first, bad.second),
    "t_test.welch_t": lambda bad: t_test.welch_t(bad.first, bad.second),
    "unit_means.unit_means": lambda bad: unit_means.unit_means(bad.values, bad.raters, bad.items),
    "votes.votes": lambda bad: votes.votes({1: "one", 2: "two", 3: "three"}, bad.values),
    "votes.votes_of_counts": lambda bad: votes.votes_of_counts(
        [str(place) for place in range(len(bad.first))], bad.first
    ),
    "votes_needed.votes_needed": lambda bad: votes_needed.votes_needed(bad.groups, half_width=0.5),
    "votes_needed.votes_needed, assured": lambda bad: votes_needed.votes_needed(
        bad.groups, half_width=bad.numbers[0], prior_votes=bad.numbers[1], assurance=0.9, scale=(1, 5)
    ),
    "votes_needed.votes_needed_from_summary": lambda bad: votes_needed.votes_needed_from_summary(
        bad.counts, bad.numbers, half_width=0.5
    ),
    "welch.welch": lambda bad: welch.welch(bad.groups),
}


def _returns_results(function: Any) -> bool:
    returned = typing.get_type_hints(function).get("return")
    parts = [part for part in (returned, *typing.get_args(returned)) if inspect.isclass(part)]
    return any(issubclass(part, Result) for part in parts if not typing.get_origin(part))


def test_the_table_has_all_public_statistics():
    public = set()
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        for name, value in vars(importlib.import_module(module.name)).items():
            own = inspect.isfunction(value) and value.__module__ == module.name
            if own and not name.startswith("_") and _returns_results(value):
                public.add(name)
    assert public - INNER == {name.partition(",")[0].rpartition(".")[2] for name in TABLE}


@pytest.mark.parametrize("name", TABLE)
def test_what_goes_wrong_in_studies(name):
    faults = {problem: judge(TABLE[name], bad) for problem, bad in named_data().items()}
    assert {problem: found for problem, found in faults.items() if found} == {}


@pytest.mark.parametrize("name", TABLE)
@settings(
    max_examples=800 if SOAK else 12,
    derandomize=not SOAK,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(bad_data())
def test_bad_data_give_an_error_or_a_flag(name, bad):
    assert judge(TABLE[name], bad) == []
