"""Adapters of regression and of mixed models."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from evaluation.statistics.mixed.models import RandomTerm, compare, mixed_model
from evaluation.statistics.mixed.result import MixedModel
from evaluation.statistics.ordinal.fixed import cumulative_logit
from evaluation.statistics.ordinal.mixed import cumulative_logit_mixed
from evaluation.statistics.regression.linear import linear_fit, simple_regression
from evaluation.statistics.regression.nonlinear import nonlinear_fit
from reference_cases.cases import Case, Each
from reference_cases.formulas import Formula, RandomPart, design, expression, formula


def nonlinear(case: Case) -> Mapping[str, Any]:
    """Fits from all starts, each of which must come to the certified values."""
    data, curve = case.data, expression(case.data["model"])
    parameters, variables = curve.parameters(), curve.variables()
    x = np.array([data[name] for name in variables], dtype=float)
    y = np.array(data["y"], dtype=float)
    if curve.response != "y":
        y = expression(curve.response)(y=y)

    def model(values: np.ndarray, *estimates: Any) -> Any:
        each = dict(zip(variables, values.T if values.ndim > 1 else [values], strict=True))
        return curve(**each, **dict(zip(parameters, estimates, strict=True)))

    starts = [data[name] for name in sorted(data) if name.startswith("start")]
    fits = [nonlinear_fit(model, x[0] if len(x) == 1 else x.T, y, start) for start in starts]
    return {
        "params": Each(fit.estimates for fit in fits),
        "sd_params": Each(fit.se for fit in fits),
        "rss": Each(fit.rss for fit in fits),
        "resid_sd": Each(fit.sigma for fit in fits),
        "sigma": Each(fit.sigma for fit in fits),
        "df": Each(fit.df_residual for fit in fits),
    }


def linear(case: Case) -> Mapping[str, Any]:
    """Least squares of given columns, of columns to which a constant is added, or of a polynomial in x."""
    data = case.data
    if "X_with_const" in data:
        columns = np.array(data["X_with_const"], dtype=float)
    elif "X" in data:
        given = np.array(data["X"], dtype=float)
        short = len(case.expected["params"]) > given.shape[1]
        columns = np.column_stack([np.ones(len(given)), given]) if short else given
    else:
        number, x = len(case.expected["params"]), np.array(data["x"], dtype=float)
        columns = x[:, None] if number == 1 else x[:, None] ** np.arange(number)
    found = linear_fit(columns, data["y"])
    return {
        "params": found.estimates,
        "sd_params": found.se,
        "F": found.F,
        "R2": found.R2,
        "rss": found.rss,
        "sigma": found.sigma,
        "resid_sd": found.sigma,
        "p": found.p,
        "t": found.t,
    }


def line(case: Case) -> Mapping[str, Any]:
    found = simple_regression(case.data["x"], case.data["y"])
    return {
        "slope": found.slope,
        "intercept": found.intercept,
        "se_slope": found.se_slope,
        "se_int": found.se_intercept,
        "R2": found.R2,
        "F": found.F,
        "p": found.F_p,
        "rss": found.rss,
        "sigma": found.sigma,
        "resid_sd": found.sigma,
    }


def _guessed(case: Case) -> Formula:
    """The model where the source has no formula: the first column by the others, labels of repeated rows at random."""
    response, *others = case.data
    named = {key.removesuffix("_ml").removesuffix("_laplace") for key in case.expected}
    groups = [name for name in others if f"sd_{name.lower()}" in {one.lower() for one in named}] or others[-1:]
    fixed = [name for name in others if name not in groups]
    slopes = tuple(fixed) if "sd_slope" in case.expected else ()
    parts = tuple(RandomPart(("1", *slopes), group, True) for group in groups)
    return Formula(response, tuple((name,) for name in fixed), parts, True, frozenset())


def _complete(case: Case, found: Formula) -> pd.DataFrame:
    names = {found.response, *(name for term in found.fixed for name in term)}
    names |= {name for part in found.random for name in (*part.group.split(":"), *part.effects)} - {"1"}
    return pd.DataFrame({name: case.data[name] for name in case.data if name in names}).dropna(ignore_index=True)


def _labels(frame: pd.DataFrame, group: str) -> list[str]:
    return frame[group.split(":")].astype(str).agg(":".join, axis=1).tolist()


class _Mixed:
    """One mixed model, fitted by either method, with or without random slopes."""

    def __init__(self, case: Case) -> None:
        self.formula = formula(case.source, "lmer") or _guessed(case)
        self.frame = _complete(case, self.formula)
        self.fixed = design(self.frame, self.formula.fixed, self.formula)
        if self.formula.intercept:
            self.fixed.insert(0, "(Intercept)", np.ones(len(self.frame)))
        else:
            self.fixed.insert(0, "none", 0)
            self.fixed = self.fixed.drop(columns="none")
        self.fits: dict[tuple[str, bool], MixedModel] = {}

    def terms(self, *, slopes: bool) -> list[RandomTerm]:
        terms, parts = [], [part for part in self.formula.random if slopes or "1" in part.effects]
        for place, part in enumerate(parts):
            columns = pd.DataFrame({"(Intercept)": np.ones(len(self.frame))}) if "1" in part.effects else pd.DataFrame()
            effects = [(name,) for name in part.effects if name != "1"] if slopes else []
            columns = pd.concat([columns, design(self.frame, effects, self.formula)], axis=1)
            repeated = any(other.group == part.group for other in parts[:place])
            name = f"{part.group}.{place}" if repeated else part.group
            terms.append(RandomTerm(name=name, labels=_labels(self.frame, part.group), design=columns))
        return terms

    def fit(self, method: str, *, slopes: bool = True) -> MixedModel:
        if (method, slopes) not in self.fits:
            y = self.frame[self.formula.response].to_numpy(float)
            self.fits[method, slopes] = mixed_model(y, self.fixed, self.terms(slopes=slopes), method=method)
        return self.fits[method, slopes]


def _numbers_of(found: MixedModel) -> dict[str, Any]:
    intercepts = [one for one in found.random if one.effect in {"(Intercept)", "intercept"}]
    slopes = [one for one in found.random if one not in intercepts]
    values: dict[str, Any] = {
        "fixef": [one.estimate for one in found.fixed],
        "se": [one.se for one in found.fixed],
        "t": [one.t for one in found.fixed],
        "p": [one.p for one in found.fixed],
        "satt_df": [one.df for one in found.fixed],
        "intercept": found.fixed[0].estimate,
        "sigma": found.sigma,
        "loglik": found.loglik,
        "reml": -2 * found.loglik,
        "deviance": -2 * found.loglik,
        "aic": found.aic,
        "bic": found.bic,
        "singular": found.singular,
        "corr": [one.r for one in found.correlations],
        "sd_int": [one.sd for one in intercepts],
        "sd_slope": [one.sd for one in slopes],
        "sds": [one.sd for one in found.random],
    }
    for one in found.random:
        values[f"sd_{one.term}_{one.effect}".lower()] = one.sd
    for one in intercepts:
        values[f"sd_{one.term}".lower()] = one.sd
        values[f"var_{one.term}".lower()] = one.variance
    return values


def linear_mixed(case: Case) -> Mapping[str, Any]:
    model, found = _Mixed(case), {}
    for key in case.expected:
        ml = key.endswith("_ml") or key.startswith(("ml_", "lrt_", "deviance"))
        fit = model.fit("ML" if ml else "REML")
        name = key.removesuffix("_ml").removesuffix("_reml")
        names = [one.name.lower() for one in fit.fixed]
        if name.startswith("lrt_"):
            test = compare(model.fit("ML", slopes=False), fit)
            found[key] = {"chi2": test.chi2, "df": test.df, "p": test.p}[name.rpartition("_")[2]]
        elif name.endswith("_F") and name[:-2].lower() in names:
            found[key] = fit.f_test([np.eye(len(names))[names.index(name[:-2].lower())]]).F
        else:
            values = _numbers_of(fit)
            found[key] = values[name] if name in values else values[name.lower()]
    return found


def ordinal(case: Case) -> Mapping[str, Any]:
    written = formula(case.source, "clm") or _guessed(case)
    frame = _complete(case, written)
    found = cumulative_logit(frame[written.response], design(frame, written.fixed, written))
    return {
        "beta": [one.estimate for one in found.coefficients],
        "se_beta": [one.se for one in found.coefficients],
        "z": [one.z for one in found.coefficients],
        "p": [one.p for one in found.coefficients],
        "thresholds": [one.estimate for one in found.thresholds],
        "se_thresholds": [one.se for one in found.thresholds],
        "loglik": found.loglik,
        "aic": found.aic,
    }


def ordinal_mixed(case: Case) -> Mapping[str, Any]:
    """Fits by Laplace's approximation or by quadrature, as the ends of keys say (``beta_laplace``, ``beta_agq10``)."""
    written = formula(case.source, "clmm2?") or _guessed(case)
    frame = _complete(case, written)
    fixed = design(frame, written.fixed, written)
    random = [(part.group, _labels(frame, part.group)) for part in written.random]
    found = {}
    for key in case.expected:
        name, nodes = re.fullmatch(r"(.+?)(?:_laplace|_agq(\d+))?", key).groups()
        fit = cumulative_logit_mixed(frame[written.response], fixed, random, nodes=int(nodes or 1))
        values: dict[str, Any] = {
            "beta": [one.estimate for one in fit.coefficients],
            "se": [one.se for one in fit.coefficients],
            "se_beta": [one.se for one in fit.coefficients],
            "thresholds": [one.estimate for one in fit.thresholds],
            "loglik": fit.loglik,
            "aic": fit.aic,
            "singular": fit.singular,
        }
        values |= {f"sd_{group}": sd for group, sd in fit.random_sds.items()}
        values |= {f"var_{group}": sd**2 for group, sd in fit.random_sds.items()}
        found[key] = values[name]
    return found
