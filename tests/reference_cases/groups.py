"""Adapters of comparisons of groups and of conditions."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from evaluation.statistics.anova import one_way
from evaluation.statistics.assumptions import bartlett, fligner, levene, shapiro_residuals
from evaluation.statistics.comparisons import Comparisons
from evaluation.statistics.factorial import two_way
from evaluation.statistics.opinion import opinion_score
from evaluation.statistics.posthoc import dunn, games_howell, tukey_hsd
from evaluation.statistics.rank_tests import friedman, kruskal_wallis
from evaluation.statistics.repeated_measures import repeated_measures
from evaluation.statistics.t_test import paired_t, student_t, welch_t
from evaluation.statistics.welch import welch
from reference_cases.cases import Case
from reference_cases.formulas import formula

GROUP_NAMES = ("group", "treatment", "condition", "label", "labels", "level")


def _numbers(values: Sequence[Any]) -> np.ndarray:
    return np.array([math.nan if value is None else float(value) for value in values])


def _generated(data: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Groups of the NIST generator: a first value, then two in turn, all on one base."""
    pairs = (data["replicates"] - 1) // 2
    columns = zip(data["first"], data["odd"], data["even"], strict=True)
    return {
        str(place): data["base"] + np.array([first, *[odd, even] * pairs])
        for place, (first, odd, even) in enumerate(columns)
    }


def grouped(data: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Groups of values, whatever the two columns are called; rows without a value are left out, as R does."""
    if "generator" in data:
        return _generated(data)
    if "groups" in data:
        return {str(name): _numbers(values) for name, values in data["groups"].items()}
    columns = {name: values for name, values in data.items() if isinstance(values, list)}
    by = next((name for name in GROUP_NAMES if name in columns), None)
    if by is None:
        by = min(columns, key=lambda name: len(set(columns[name])))
    response = next(name for name in columns if name != by)
    values, labels = _numbers(columns[response]), np.array([str(label) for label in columns[by]], dtype=object)
    kept = ~np.isnan(values)
    return {str(label): values[kept & (labels == label)] for label in dict.fromkeys(labels[kept])}


def one_way_family(case: Case) -> Mapping[str, Any]:
    groups = grouped(case.data)
    found = one_way(groups)
    values: dict[str, Any] = {
        "F": found.F,
        "p": found.p,
        "df": [found.df_between, found.df_within],
        "SSB": found.SSB,
        "SSW": found.SSW,
        "MSB": found.SSB / found.df_between,
        "MSW": found.SSW / found.df_within,
        "R2": found.eta_squared,
        "eta2": found.eta_squared,
        "omega2": found.omega_squared,
        "resid_sd": math.sqrt(found.SSW / found.df_within),
        "means": [group.mean for group in found.groups],
        "sds": [group.sd for group in found.groups],
    }
    wanted = {key.split("_")[0] for key in case.expected}
    if "welch" in wanted:
        unequal = welch(groups)
        values |= {"welch_F": unequal.F, "welch_p": unequal.p, "welch_df2": unequal.df_within}
    if "kruskal" in wanted:
        ranks = kruskal_wallis(groups)
        values |= {"kruskal_H": ranks.H, "kruskal_p": ranks.p, "kruskal_df": ranks.df}
    tests: dict[str, Callable[[], Any]] = {
        "bartlett": lambda: bartlett(groups),
        "fligner": lambda: fligner(groups),
        "brown": lambda: levene(groups),
        "levene": lambda: levene(groups, center="mean"),
        "shapiro": lambda: shapiro_residuals(groups),
    }
    keys = {
        "bartlett": ("bartlett", "bartlett_p"),
        "fligner": ("fligner", "fligner_p"),
        "brown": ("brown_forsythe_F", "brown_forsythe_p"),
        "levene": ("levene_F", "levene_p"),
        "shapiro": ("shapiro_resid_W", "shapiro_resid_p"),
    }
    for name in wanted & set(tests):
        test = tests[name]()
        values |= dict(zip(keys[name], (test.statistic, test.p), strict=True))
    return values


def _pair(name: str, labels: Sequence[str]) -> tuple[str, str]:
    """The two labels that a name such as ``trt1-ctrl`` joins; labels may have hyphens themselves."""
    for place, letter in enumerate(name):
        first, second = name[:place], name[place + 1 :]
        if letter == "-" and first in labels and second in labels:
            return first, second
    raise KeyError(f"{name} does not join two of {', '.join(labels)}.")


def _pairs(case: Case, test: Callable[[Mapping[str, Any]], Comparisons], standard: tuple[str, ...]) -> dict[str, Any]:
    groups = grouped(case.data)
    result, fields = test(groups), case.fields(standard)
    found = {}
    for name in case.expected:
        pair = result.pair(*_pair(name, tuple(groups)))
        low, high = pair.ci or (None, None)
        numbers = {
            "diff": pair.difference,
            "lwr": low,
            "upr": high,
            "p_adj": pair.p_adjusted,
            "p": pair.p_adjusted,
            "p_unadj": pair.p,
            "t": pair.statistic,
            "z": pair.statistic,
            "Z": pair.statistic,
            "q": pair.statistic,
            "df": pair.df,
        }
        found[name] = [numbers[field] for field in fields]
    return found


def tukey(case: Case) -> Mapping[str, Any]:
    return _pairs(case, tukey_hsd, ("diff", "lwr", "upr", "p_adj"))


def games(case: Case) -> Mapping[str, Any]:
    return _pairs(case, games_howell, ("diff", "t", "df", "p"))


def dunns(case: Case) -> Mapping[str, Any]:
    method = "BH" if "hochberg" in (case.topic + case.source).lower() else "holm"
    return _pairs(case, lambda groups: dunn(groups, method=method), ("z", "p_unadj", "p_adj"))


def two_factors(case: Case) -> Mapping[str, Any]:
    written = formula(case.source, "aov|lm|Anova")
    if written is not None:
        response, factors = written.response, [term[0] for term in written.fixed if len(term) == 1]
    else:
        factors = [name for name in case.data if name in case.expected]
        response = next(name for name in case.data if name not in factors)
    about = (case.topic + " " + case.source).lower()
    ss_type = 3 if "type iii" in about or "type 3" in about else 2 if "type ii" in about or "type 2" in about else 1
    frame = pd.DataFrame({name: case.data[name] for name in (response, *factors)}).dropna()
    found = two_way(
        frame[response], frame[factors[0]].tolist(), frame[factors[1]].tolist(), names=tuple(factors), ss_type=ss_type
    )
    fields = case.fields(("SS", "F"))
    rows = {
        name: [{"SS": one.SS, "F": one.F, "df": one.df, "Df": one.df, "p": one.p}[field] for field in fields]
        for name, one in zip((*factors, "inter"), found.effects, strict=True)
    }
    return rows | {
        "interaction": rows["inter"],
        ":".join(factors): rows["inter"],
        "resid_SS": found.SS_error,
        "resid_df": found.df_error,
        "df_resid": found.df_error,
        "p": [one.p for one in found.effects],
        "df": [one.df for one in found.effects],
        "pes": [one.partial_eta_squared for one in found.effects],
    }


def univariate(case: Case) -> Mapping[str, Any]:
    if "generator" in case.data:
        base, step = case.data["base"], case.data.get("step", 0.1)
        values = [base, *[base - step, base + step] * 500]
    else:
        values = case.data["y" if "y" in case.data else "x"]
    found = opinion_score(values)
    low, high = found.ci or (None, None)
    return {"mean": found.mean, "sd": found.sd, "n": found.n, "ci_lower": low, "ci_upper": high}


def within_subjects(case: Case) -> Mapping[str, Any]:
    table = np.array([_numbers(row) for row in case.data["subject_by_condition"]])
    complete = table[~np.isnan(table).any(axis=1)]
    found, ranks = repeated_measures(complete), friedman(complete)
    return {
        "F": found.F,
        "p": found.p,
        "df": [found.df_conditions, found.df_error],
        "gg_eps": found.gg_epsilon,
        "p_gg": found.p_gg,
        "hf_eps": found.hf_epsilon,
        "p_hf": found.p_hf,
        "mauchly_W": found.mauchly_w,
        "mauchly_p": found.mauchly_p,
        "ges": found.ges,
        "pes": found.pes,
        "friedman": ranks.chi_squared,
        "friedman_p": ranks.p,
        "kendall_W": ranks.W,
    }


def t_tests(case: Case) -> Mapping[str, Any]:
    about = case.topic.lower()
    test = paired_t if "paired" in about else welch_t if "welch" in about else student_t
    found = test(_numbers(case.data["x"]), _numbers(case.data["y"]))
    return {
        "t": found.t,
        "df": found.df,
        "p": found.p,
        "diff": found.difference,
        "mean_diff": found.difference,
        "ci": found.ci,
        "ci_lower": found.ci[0],
        "ci_upper": found.ci[1],
        "d": found.d,
    }
