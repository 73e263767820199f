"""Adapters of what the two papers print, of scores and of spreads of points."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy import linalg

from evaluation.instruments import PAD12
from evaluation.statistics.anova import one_way_from_summary, pooled_sd_from_f
from evaluation.statistics.contingency import contingency_of_counts
from evaluation.statistics.correlation import pearson
from evaluation.statistics.ellipse import ellipse
from evaluation.statistics.opinion import opinion_score
from evaluation.statistics.votes import votes_of_counts
from reference_cases.cases import Case, Each


def columnwise_pearson(case: Case) -> Mapping[str, Any]:
    pairs = zip(np.transpose(case.data["input"]), np.transpose(case.data["evaluated"]), strict=True)
    found = [pearson(x, y) for x, y in pairs]
    return {
        "r": [one.r for one in found],
        "p": [one.p for one in found],
        "slope": [one.slope for one in found],
        "intercept": [one.intercept for one in found],
        "n": found[0].n,
    }


def anova_from_summary(case: Case) -> Mapping[str, Any]:
    data = case.data
    means = {f"condition {place}": mean for place, mean in enumerate(data["means"])}
    n = data["n"] if isinstance(data["n"], int) else dict(zip(means, data["n"], strict=True))
    if "F" in data:
        sds = dict.fromkeys(means, pooled_sd_from_f(data["means"], data["n"], data["F"]))
    else:
        sds = dict(zip(means, data["sds" if "sds" in data else "sd"], strict=True))
    found = one_way_from_summary(means, sds, n)
    return {
        "pooled_sd": (found.SSW / found.df_within) ** 0.5,
        "eta2": found.eta_squared,
        "omega2": found.omega_squared,
        "F": found.F,
        "p": found.p,
        "df": [found.df_between, found.df_within],
        "SSB": found.SSB,
        "SSW": found.SSW,
    }


def percentages(case: Case) -> Mapping[str, Any]:
    counts = case.data["counts"]
    found = votes_of_counts(case.data.get("labels", [f"answer {place}" for place in range(len(counts))]), counts)
    return {"total": found.n, "percent": [100 * share for share in found.shares]}


def column_means(case: Case) -> Mapping[str, Any]:
    found = [opinion_score(column) for column in np.transpose(case.data["rows"])]
    return {"mean": [one.mean for one in found], "sd": [one.sd for one in found]}


def contingency_table(case: Case) -> Mapping[str, Any]:
    found = contingency_of_counts(case.data["table"])
    return {
        "rows": found.row_sums,
        "cols": found.column_sums,
        "total": found.total,
        "chi2": found.chi2,
        "df": found.df,
        "p": found.p,
        "V": found.cramers_v,
        "purity": found.purity,
        "matched": found.share_matched,
    }


def pad_scores(case: Case) -> Mapping[str, Any]:
    items = [item.id for item in PAD12.items]
    return {
        name: list(PAD12.score(dict(zip(items, answers, strict=True))).values())
        for name, answers in case.data["answers"].items()
    }


def ellipse_quantiles(case: Case) -> Mapping[str, Any]:
    """Squared half-axes of ellipses of points whose covariance is 1, by keys such as ``p95_2d``."""
    found = {}
    for key in case.expected:
        percent, dimensions = (int(part) for part in re.fullmatch(r"p(\d+)_(\d)d", key).groups())
        points = np.random.default_rng(1).normal(size=(30, dimensions))
        unit = linalg.qr(points - points.mean(axis=0), mode="economic")[0] * np.sqrt(29)
        found[key] = Each(ellipse(unit, coverage=percent / 100).half_axes ** 2)
    return found
