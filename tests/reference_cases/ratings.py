"""Adapters of agreement of raters, reliability of scales, and correlation."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evaluation.statistics.agreement.fleiss import fleiss_kappa, fleiss_kappa_of_labels
from evaluation.statistics.agreement.icc import intraclass_correlations
from evaluation.statistics.agreement.kappa import cohen_kappa
from evaluation.statistics.agreement.krippendorff import krippendorff_alpha
from evaluation.statistics.canonical import canonical_correlation
from evaluation.statistics.correlation import pearson
from evaluation.statistics.opinion import opinion_score
from evaluation.statistics.rank_correlation import kendall, spearman
from evaluation.statistics.rater_model import rater_model
from evaluation.statistics.scale_reliability.alpha import cronbach_alpha
from evaluation.statistics.scale_reliability.omega import mcdonald_omega
from reference_cases.cases import Case


def _table(rows: Sequence[Sequence[Any]]) -> np.ndarray:
    """A table of numbers, NaN for what is missing; or of labels, if some are not numbers."""
    if any(isinstance(value, str) for row in rows for value in row):
        return np.array(rows, dtype=object)
    return np.array([[math.nan if value is None else value for value in row] for row in rows], dtype=float)


def _first(data: Mapping[str, Any], *names: str) -> Any:
    return next(data[name] for name in names if name in data)


def icc(case: Case) -> Mapping[str, Any]:
    found = intraclass_correlations(_table(_first(case.data, "ratings", "items_by_raters")))
    squares = found.mean_squares
    return {
        "ICC": [one.value for one in found.forms],
        "F": [one.F for one in found.forms],
        "p": [one.p for one in found.forms],
        "df1": [one.df1 for one in found.forms],
        "df2": [one.df2 for one in found.forms],
        "ms": [squares.between_items, squares.within_items, squares.between_raters, squares.residual],
        "ci_lower": [one.ci[0] for one in found.forms],
        "ci_upper": [one.ci[1] for one in found.forms],
    }


def krippendorff(case: Case) -> Mapping[str, Any]:
    if "raters_by_units" in case.data:
        ratings = _table(case.data["raters_by_units"]).T
    else:
        ratings = _table(_first(case.data, "units_by_raters", "ratings"))
    wanted = dict.fromkeys([*case.expected, *case.full_digits])
    return {level: krippendorff_alpha(ratings, level=level).alpha for level in wanted}


def fleiss(case: Case) -> Mapping[str, Any]:
    if "counts" in case.data:
        found = fleiss_kappa(case.data["counts"])
    else:
        found = fleiss_kappa_of_labels(_table(_first(case.data, "ratings", "labels")))
    return {
        "kappa": found.kappa,
        "Pbar": found.p_bar,
        "Pe": found.p_e,
        "se": found.se,
        "z": found.z,
        "p": found.p,
        "category_kappa": [one.kappa for one in found.categories],
    }


def cohen(case: Case) -> Mapping[str, Any]:
    ratings = case.data["ratings"] if "ratings" in case.data else list(zip(*case.data.values(), strict=True))
    first, second = zip(*ratings, strict=True)
    found = {
        name: cohen_kappa(first, second, weights=weights)
        for name, weights in (("kappa", "unweighted"), ("kappa_linear", "linear"), ("kappa_quadratic", "quadratic"))
    }
    values = {name: one.kappa for name, one in found.items()}
    return values | {"z": found["kappa"].z, "p": found["kappa"].p, "weighted_kappa": values["kappa_quadratic"]}


def reliability(case: Case) -> Mapping[str, Any]:
    answers = _table(case.data["X"])
    alpha = cronbach_alpha(answers)
    values: dict[str, Any] = {
        "alpha": alpha.alpha,
        "std_alpha": alpha.standardized,
        "mean_r": alpha.mean_r,
        "item_rest_r": [item.rest_r for item in alpha.items],
        "alpha_drop": [item.alpha_if_dropped for item in alpha.items],
    }
    for extraction in ("ml", "minres"):
        if any(key.endswith(f"_{extraction}") for key in case.expected):
            omega = mcdonald_omega(answers, extraction=extraction)
            values |= {f"omega_{extraction}": omega.omega, f"loadings_{extraction}": omega.loadings}
    return values


def canonical(case: Case) -> Mapping[str, Any]:
    x, y = (np.array(table, dtype=float) for table in case.data.values() if isinstance(table, list))
    found = canonical_correlation(x, y)
    overall = {test.statistic: test for test in found.overall}
    values: dict[str, Any] = {
        "cancorr": found.correlations,
        "wilks": [test.value for test in found.sequence],
        "F": [test.F for test in found.sequence],
        "df1": [test.df1 for test in found.sequence],
        "df2": [test.df2 for test in found.sequence],
        "p": [test.p for test in found.sequence],
    }
    for place in range(len(found.sequence)):
        values |= {f"{name}{place + 1}": values[name][place] for name in ("wilks", "F", "p")}
    values |= {
        re.split(r"[\s-]", statistic)[0].lower().removesuffix("'s"): test.value for statistic, test in overall.items()
    }
    return values


def correlation(case: Case) -> Mapping[str, Any]:
    x, y = (np.array(case.data[name], dtype=float) for name in ("x", "y"))
    line, ranks, concordance = pearson(x, y), spearman(x, y), kendall(x, y)
    low, high = line.ci or (None, None)
    return {
        "r": line.r,
        "p": line.p,
        "ci_lower": low,
        "ci_upper": high,
        "rho": ranks.value,
        "rho_p": ranks.p,
        "tau": concordance.value,
        "tau_p": concordance.p,
    }


def rater_bias(case: Case) -> Mapping[str, Any]:
    ratings = _table(_first(case.data, "ratings_videos_by_subjects", "ratings"))
    found = rater_model(ratings)
    means = np.array([opinion_score(row[~np.isnan(row)]).mean for row in ratings])
    return {
        "mos_mean": means.mean(),
        "mos_var": means.var(),
        "mle_first3": found.quality[:3],
        "mle_mean": found.quality.mean(),
        "mle_var": found.quality.var(),
        "mle": found.quality,
        "bias": found.bias,
        "bias_mean": found.bias.mean(),
        "bias_var": found.bias.var(),
        "inconsistency": found.inconsistency,
        "inconsistency_mean": found.inconsistency.mean(),
        "inconsistency_var": found.inconsistency.var(),
    }
