"""Which public functions a case is for: by its topic, from the special to the general."""

import re

from reference_cases import anchors, groups, models, ratings
from reference_cases.cases import Adapter, Case

ADAPTERS: tuple[tuple[str, Adapter], ...] = (
    (r"anova from summary", anchors.anova_from_summary),
    (r"counts? -> percent", anchors.percentages),
    (r"contingency", anchors.contingency_table),
    (r"averages", anchors.column_means),
    (r"pearson .*over|paper anchor: pearson", anchors.columnwise_pearson),
    (r"pad scoring", anchors.pad_scores),
    (r"ellipse", anchors.ellipse_quantiles),
    (r"ordinal mixed|cumulative .*random|clmm", models.ordinal_mixed),
    (r"cumulative link|proportional odds|ordinal regression", models.ordinal),
    (r"mixed model|random effects?|random slope|random intercept", models.linear_mixed),
    (r"tukey", groups.tukey),
    (r"games-howell", groups.games),
    (r"dunn", groups.dunns),
    (r"two-way", groups.two_factors),
    (r"repeated.measures|friedman", groups.within_subjects),
    (r"one-way", groups.one_way_family),
    (r"mean/sd|univariate", groups.univariate),
    (r"icc|intraclass", ratings.icc),
    (r"krippendorff", ratings.krippendorff),
    (r"fleiss", ratings.fleiss),
    (r"cohen.*kappa", ratings.cohen),
    (r"canonical", ratings.canonical),
    (r"cronbach|omega", ratings.reliability),
    (r"p\.910|p\.913|subject.bias", ratings.rater_bias),
    (r"nonlinear", models.nonlinear),
    (r"simple regression", models.line),
    (r"linear least squares|polynomial|multiple regression|linear regression", models.linear),
    (r"\bt$|\bt[- ]test|paired t|student|welch", groups.t_tests),
    (r"pearson|spearman|kendall|correlation", ratings.correlation),
)


def adapter_of(case: Case) -> Adapter:
    """Return the adapter of a case's topic."""
    for pattern, adapter in ADAPTERS:
        if re.search(pattern, case.topic.lower()):
            return adapter
    raise LookupError(f"{case.id}: there is no adapter for {case.topic}.")
