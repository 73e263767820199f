"""The cumulative-logit model (proportional odds) of ordered answers, without random effects."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence, finite_vector
from evaluation.statistics.ordinal.data import Categories, Predictors, distinct_rows, ordered_categories, predictors
from evaluation.statistics.ordinal.fit import FixedFit, fit_fixed
from evaluation.statistics.ordinal.odds import ProportionalOdds, score_test
from evaluation.statistics.result import Result

# Logarithms of the largest float, less a little.
_LARGEST_LOG = 700.0


@dataclass(frozen=True, kw_only=True)
class LogOdds:
    """A logarithm of an odds ratio with its Wald test.

    Attributes
    ----------
    name : str
        Name of the predictor or contrast.
    estimate, se : float
        Logarithm of the ratio of the odds of a higher answer, and its standard error.
    z, p : float
        Their ratio, and the two-sided probability of one as large if there were no effect.
    ci : tuple of float
        Interval of the estimate.
    odds_ratio : float
        exp(estimate): above 1, higher answers are likelier.
    odds_ratio_ci : tuple of float
        Interval of the odds ratio.
    """

    name: str
    estimate: float
    se: float
    z: float
    p: float
    ci: tuple[float, float]
    odds_ratio: float
    odds_ratio_ci: tuple[float, float]

    def sentence(self, confidence: float) -> str:
        """Return for instance ``warm: OR = 12.22, 95% CI [4.34, 34.44], z = 4.73, p < .001``."""
        if math.isnan(self.se):
            return self.ratio(confidence)
        return f"{self.ratio(confidence)}, z = {wording.number(self.z)}, {wording.p_value(self.p)}"

    def ratio(self, confidence: float) -> str:
        """Return for instance ``warm: OR = 12.22, 95% CI [4.34, 34.44]``."""
        text = f"{self.name}: OR = {wording.number(self.odds_ratio)}"
        if math.isnan(self.se):
            return f"{text} (without a standard error)"
        return f"{text}, {wording.interval(*self.odds_ratio_ci, confidence=confidence)}"


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """The logit of an answer no higher than `below` where all predictors are 0, and its standard error."""

    below: Hashable
    above: Hashable
    estimate: float
    se: float

    @property
    def name(self) -> str:
        """Return for instance ``2|3``."""
        return f"{self.below}|{self.above}"


@dataclass(frozen=True, kw_only=True, eq=False)
class OrdinalModel(Result):
    """What cumulative-logit models with and without random effects have in common.

    Attributes
    ----------
    coefficients : tuple of LogOdds
        Effects of the predictors; positive ones make higher answers likelier (logit P(y <= j) = threshold j - effects).
    thresholds : tuple of Threshold
        One between each two neighbouring categories.
    loglik, aic : float
        Logarithm of the likelihood at its maximum, and Akaike's criterion.
    parameters : int
        Thresholds, coefficients and standard deviations of random effects.
    n : int
        Number of answers.
    categories : tuple
        The categories that were used, the lowest first.
    converged : bool
        Whether the maximum was found; if not, a flag says so.
    vcov : numpy.ndarray
        Covariance matrix of thresholds and coefficients, in this order; read-only.
    confidence : float
        Of the intervals.
    """

    coefficients: tuple[LogOdds, ...]
    thresholds: tuple[Threshold, ...]
    loglik: float
    aic: float
    parameters: int
    n: int
    categories: tuple[Hashable, ...]
    converged: bool
    vcov: FloatArray
    confidence: float

    def contrast(self, weights: npt.ArrayLike, *, name: str = "contrast") -> LogOdds:
        """Return a weighted sum of the coefficients with its Wald test.

        Parameters
        ----------
        weights : array_like, shape (p,)
            A weight for each coefficient.
        name : str
            What to call it.

        Raises
        ------
        DataError
            If there is not one finite weight for each coefficient.
        """
        row = finite_vector(weights, name="weights")
        if row.size != len(self.coefficients):
            raise DataError(f"There are {row.size} weights for {len(self.coefficients)} coefficients.")
        covariance = self.vcov[len(self.thresholds) :, len(self.thresholds) :]
        estimate = float(row @ [one.estimate for one in self.coefficients])
        return log_odds(name, estimate, float(row @ covariance @ row), self.confidence)

    def apa(self) -> str:
        """Return the coefficients, separated by semicolons; without any, the log-likelihood."""
        if not self.coefficients:
            return f"log-likelihood = {wording.number(self.loglik)}, AIC = {wording.number(self.aic)}, n = {self.n}"
        return "; ".join(one.sentence(self.confidence) for one in self.coefficients)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each estimate, thresholds first; NaN where a kind of estimate has no such number."""
        columns = ["kind", "name", "estimate", "se", "z", "p", "ci_low", "ci_high"]
        return pd.DataFrame(self._rows(), columns=[*columns, "odds_ratio", "odds_ratio_low", "odds_ratio_high"])

    def _rows(self) -> list[dict[str, object]]:
        thresholds = [
            {"kind": "threshold", "name": one.name, "estimate": one.estimate, "se": one.se} for one in self.thresholds
        ]
        return [*thresholds, *({"kind": "coefficient", **log_odds_row(one)} for one in self.coefficients)]


@dataclass(frozen=True, kw_only=True, eq=False)
class CumulativeLogit(OrdinalModel):
    """A cumulative-logit model without random effects: see `OrdinalModel`.

    Attributes
    ----------
    proportional_odds : ProportionalOdds or None
        Score test of whether the predictors act alike at all thresholds; None for two categories or no predictor.
    """

    proportional_odds: ProportionalOdds | None


def cumulative_logit(
    y: npt.ArrayLike | pd.Series | pd.Categorical,
    fixed: npt.ArrayLike | pd.DataFrame,
    *,
    names: Sequence[str] | None = None,
    confidence: float = 0.95,
) -> CumulativeLogit:
    """Fit logit P(y <= j) = threshold j - fixed @ coefficients by maximum likelihood.

    Parameters
    ----------
    y : array_like, shape (n,)
        Ordered answers: numbers, or an ordered pandas categorical. Categories that nobody chose are left out.
    fixed : array_like or pandas.DataFrame, shape (n, p)
        Predictors, without a column for the intercept, which the thresholds are.
    names : sequence of str, optional
        Names of the predictors; left out, those of the frame's columns, or x1, x2 and so on.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    CumulativeLogit
        Estimates with standard errors from the observed information, and a check of proportional odds.

    Raises
    ------
    DataError
        If an answer or predictor is missing or infinite, answers have no order, or lengths and names do not fit.
    InsufficientDataError
        If all answers are alike, a predictor is constant or a combination of others, or the answers are separated
        perfectly, so that an estimate would be infinite.

    References
    ----------
    McCullagh (1980), Regression models for ordinal data, J. R. Stat. Soc. B 42:109; as ``clm`` of the R package ordinal
    (Christensen, 2019).
    """
    check_confidence(confidence)
    answers = ordered_categories(y)
    found = predictors(fixed, n=answers.codes.size, names=names)
    rows = distinct_rows(answers.codes, len(answers.labels), found.x)
    fit = fit_fixed(rows, found)
    odds = score_test(rows, fit)
    parameters = fit.thresholds.size + fit.coefficients.size
    thresholds, coefficients, vcov = in_old_columns(answers, found, fit, confidence)
    return CumulativeLogit(
        coefficients=coefficients,
        thresholds=thresholds,
        loglik=fit.log_likelihood,
        aic=2 * (parameters - fit.log_likelihood),
        parameters=parameters,
        n=answers.codes.size,
        categories=answers.labels,
        converged=fit.converged,
        vcov=vcov,
        confidence=confidence,
        proportional_odds=odds,
        flags=(*answers.flags, *fit_flags(fit.converged, coefficients), *(odds.warning if odds else ())),
    )


def log_odds(name: str, estimate: float, variance: float, confidence: float) -> LogOdds:
    """Return an estimate with its test and intervals; all but the estimate NaN if the variance is."""
    se = math.sqrt(variance) if not variance < 0 else math.nan
    z = estimate / se if se else math.nan
    half = float(stats.norm.ppf((1 + confidence) / 2)) * se
    low, high = estimate - half, estimate + half
    return LogOdds(
        name=name,
        estimate=estimate,
        se=se,
        z=z,
        p=float(2 * stats.norm.sf(abs(z))),
        ci=(low, high),
        odds_ratio=_exponential(estimate),
        odds_ratio_ci=(_exponential(low), _exponential(high)),
    )


def log_odds_row(one: LogOdds) -> dict[str, object]:
    """Return an estimate as a row of a table, the intervals as two columns each."""
    row: dict[str, object] = dict(vars(one))
    del row["ci"], row["odds_ratio_ci"]
    row["ci_low"], row["ci_high"] = one.ci
    row["odds_ratio_low"], row["odds_ratio_high"] = one.odds_ratio_ci
    return row


def in_old_columns(
    answers: Categories, fixed: Predictors, fit: FixedFit, confidence: float
) -> tuple[tuple[Threshold, ...], tuple[LogOdds, ...], FloatArray]:
    """Return thresholds, coefficients and their covariance for the predictors as they were given."""
    cuts, p = fit.thresholds.size, fit.coefficients.size
    change = np.eye(cuts + p)
    change[cuts:, cuts:] = fixed.mixing
    change[:cuts, cuts:] = fixed.means @ fixed.mixing
    estimates = change @ np.concatenate([fit.thresholds, fit.coefficients])
    vcov = change @ fit.covariance @ change.T
    vcov.flags.writeable = False
    thresholds = tuple(
        Threshold(
            below=answers.labels[j],
            above=answers.labels[j + 1],
            estimate=float(estimates[j]),
            se=math.sqrt(vcov[j, j]) if vcov[j, j] >= 0 else math.nan,
        )
        for j in range(cuts)
    )
    coefficients = tuple(
        log_odds(name, float(estimates[k]), float(vcov[k, k]), confidence)
        for k, name in enumerate(fixed.names, start=cuts)
    )
    return thresholds, coefficients, vcov


def fit_flags(converged: bool, coefficients: Sequence[LogOdds]) -> tuple[str, ...]:
    """Return what must be said of a fit and its odds ratios."""
    flags = []
    if not converged:
        flags.append("The search for the maximum of the likelihood did not come to rest: do not trust the estimates.")
    if any(math.isnan(one.se) for one in coefficients):
        flags.append("There are no standard errors, as the likelihood does not curve downwards in all directions.")
    large = [one.name for one in coefficients if max(abs(one.ci[0]), abs(one.ci[1])) > _LARGEST_LOG]
    if large:
        flags.append(f"The odds ratio of {', '.join(large)} leaves the range of numbers; use larger units.")
    return tuple(flags)


def _exponential(value: float) -> float:
    if math.isnan(value):
        return value
    return math.exp(value) if value <= _LARGEST_LOG else math.inf
