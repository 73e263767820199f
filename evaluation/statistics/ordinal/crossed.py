"""Ordered ratings by several raters of several stimuli, compared between conditions."""

import itertools
import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.label_codes import IntArray, level_codes
from evaluation.statistics.multiplicity import adjusted_p
from evaluation.statistics.ordinal.data import Categories, distinct_rows, ordered_categories, predictors
from evaluation.statistics.ordinal.fixed import LogOdds, log_odds_row
from evaluation.statistics.ordinal.maximum import fit_mixed
from evaluation.statistics.ordinal.mixed import CumulativeLogitMixed, mixed_result, random_factors
from evaluation.statistics.ordinal.odds import ProportionalOdds
from evaluation.statistics.result import Result

_FACTORS = ("rater", "stimulus")


@dataclass(frozen=True, kw_only=True)
class ConditionContrast(LogOdds):
    """The odds of a higher rating in one condition against those in another.

    Attributes
    ----------
    first, second : hashable
        The conditions; the odds ratio is above 1 if the second is rated higher.
    p_holm : float
        Probability adjusted for the number of contrasts (Holm, 1979, Scandinavian Journal of Statistics 6:65).
    """

    first: Hashable
    second: Hashable
    p_holm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossedCumulativeLogit(Result):
    """Conditions compared by a cumulative-logit model with random intercepts of raters and stimuli.

    Attributes
    ----------
    model : CumulativeLogitMixed
        The model; its coefficients compare each other condition with the first.
    conditions : tuple
        The conditions; the first is the reference.
    chi2, df, p : float, int, float
        Likelihood-ratio test against the model without conditions.
    contrasts : tuple of ConditionContrast
        Every two conditions.
    proportional_odds : ProportionalOdds or None
        Likelihood-ratio test against thresholds of its own for each condition, with random intercepts as well; None if
        it cannot be made.

    Notes
    -----
    Raters and stimuli have intercepts, which are alike in all conditions. If raters differ in what they think of the
    conditions, the test of the conditions rejects too often.

    The check of proportional odds merges neighbouring categories until every condition uses each; it has
    (k - 1)(J - 2) degrees of freedom for k conditions and J categories that are left.
    """

    model: CumulativeLogitMixed
    conditions: tuple[Hashable, ...]
    chi2: float
    df: int
    p: float
    contrasts: tuple[ConditionContrast, ...]
    proportional_odds: ProportionalOdds | None

    def apa(self) -> str:
        """Return the test of the conditions and the odds ratios of all contrasts with Holm's probabilities."""
        verb = "differed" if self.p < 0.05 else "did not differ reliably"
        test = f"The conditions {verb}, χ²({self.df}) = {wording.number(self.chi2)}, {wording.p_value(self.p)}"
        ratios = [
            one.ratio(self.model.confidence)
            + ("" if math.isnan(one.p_holm) else f", Holm-adjusted {wording.p_value(one.p_holm)}")
            for one in self.contrasts
        ]
        return "; ".join([test, *ratios])

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each contrast."""
        table = pd.DataFrame([log_odds_row(one) for one in self.contrasts])
        order = ["first", "second", "estimate", "se", "z", "p", "p_holm", "ci_low", "ci_high"]
        return table[[*order, "odds_ratio", "odds_ratio_low", "odds_ratio_high"]]


def crossed_cumulative_logit(
    ratings: npt.ArrayLike | pd.Series | pd.Categorical,
    conditions: Sequence[Hashable],
    raters: Sequence[Hashable],
    stimuli: Sequence[Hashable],
    *,
    confidence: float = 0.95,
) -> CrossedCumulativeLogit:
    """Compare conditions by ordered ratings, where raters and stimuli are samples.

    Parameters
    ----------
    ratings : array_like, shape (n,)
        Ordered ratings: numbers, or an ordered pandas categorical.
    conditions, raters, stimuli : sequence, shape (n,)
        Labels of each rating. The first condition is the reference: that of a pandas categorical, of numbers the
        smallest, else the first to appear. A stimulus has one label in all conditions if it is the same sentence or
        face, and labels of its own if it is not.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    CrossedCumulativeLogit
        The model, the test of the conditions, odds ratios of every two, and a check of proportional odds.

    Raises
    ------
    DataError
        If a rating is missing or infinite, ratings have no order, a label is missing, or lengths differ.
    InsufficientDataError
        If there are fewer than two conditions, raters, stimuli or categories used, a condition has no ratings, or all
        ratings of a condition are at one end of the scale, or separated from the others' otherwise, so that its odds
        ratio would be infinite.

    References
    ----------
    Christensen (2019), vignettes of the R package ordinal: ``clmm(rating ~ condition + (1|rater) + (1|stimulus))``.
    Taylor, Rousselet, Scheepers and Sereno (2023), Rating norms should be calculated from cumulative link mixed effects
    models, Behavior Research Methods 55:2175, on why ratings ask for this model.
    """
    check_confidence(confidence)
    answers = ordered_categories(ratings, name="ratings")
    n = answers.codes.size
    codes, names = level_codes(conditions, name="conditions", n=n, sort_numbers=True)
    factors = random_factors(list(zip(_FACTORS, (raters, stimuli), strict=True)), n=n)
    counts = _counts(codes, names, answers)
    fixed = predictors(_dummies(codes, len(names)), n=n, names=[str(name) for name in names[1:]])
    rows = distinct_rows(answers.codes, len(answers.labels), fixed.x, list(factors.values()))
    fit = fit_mixed(rows, fixed, names=_FACTORS)
    model = mixed_result(answers, fixed, factors, fit, nodes=1, confidence=confidence)
    loglik, sure = _thresholds_alone(answers.codes, len(answers.labels), factors)
    # The model contains the one without conditions: what is less than 0 is rounding.
    chi2, df = max(2 * (model.loglik - loglik), 0.0), len(names) - 1
    odds, remarks = _proportional_odds(answers.codes, codes, counts, answers.labels, factors)
    flags = [*model.flags, *_unused(counts, names, answers), *_repeated(codes, factors), *remarks]
    if not sure:
        flags.append("The model without conditions was not fitted well: do not trust the test of the conditions.")
    return CrossedCumulativeLogit(
        model=model,
        conditions=names,
        chi2=chi2,
        df=df,
        p=float(special.chdtrc(df, chi2)),
        contrasts=_contrasts(model, names),
        proportional_odds=odds,
        flags=tuple(flags),
    )


def _dummies(codes: IntArray, number: int) -> FloatArray:
    return np.equal.outer(codes, np.arange(1, number)).astype(np.float64)


def _counts(codes: IntArray, names: tuple[Hashable, ...], answers: Categories) -> IntArray:
    """Return how often each condition has each category."""
    if len(names) < 2:
        raise InsufficientDataError(f"There is only the condition {names[0]}; at least two are needed to compare them.")
    width = len(answers.labels)
    counts: IntArray = np.bincount(codes * width + answers.codes, minlength=len(names) * width)
    counts = counts.reshape(len(names), width)
    for name, row in zip(names, counts, strict=True):
        if not row.any():
            raise InsufficientDataError(f"The condition {name} has no ratings, so it cannot be compared.")
        used = np.flatnonzero(row)
        if used.size == 1 and used[0] in (0, width - 1):
            end = "lowest" if used[0] == 0 else "highest"
            raise InsufficientDataError(
                f"All ratings of the condition {name} are in the {end} category ({answers.labels[used[0]]}), so its "
                "odds ratio would be infinite; compare the conditions by a method for tables instead."
            )
    return counts


def _thresholds_alone(
    answers: IntArray, categories: int, factors: dict[str, IntArray], sets: IntArray | None = None
) -> tuple[float, bool]:
    """Return the largest log-likelihood of a model that has thresholds only, in sets, and whether it was found."""
    fixed = predictors(np.empty((answers.size, 0)), n=answers.size)
    rows = distinct_rows(answers, categories, fixed.x, list(factors.values()), sets)
    fit = fit_mixed(rows, fixed, names=_FACTORS)
    return fit.log_likelihood, fit.converged


def _contrasts(model: CumulativeLogitMixed, names: tuple[Hashable, ...]) -> tuple[ConditionContrast, ...]:
    weights = np.eye(len(names))[:, 1:]
    pairs = list(itertools.combinations(range(len(names)), 2))
    found = [model.contrast(weights[j] - weights[i], name=f"{names[j]} against {names[i]}") for i, j in pairs]
    adjusted = adjusted_p([one.p for one in found], method="holm")
    return tuple(
        ConditionContrast(**vars(one), first=names[i], second=names[j], p_holm=float(p))
        for one, (i, j), p in zip(found, pairs, adjusted, strict=True)
    )


def _unused(counts: IntArray, names: tuple[Hashable, ...], answers: Categories) -> list[str]:
    flags = []
    for name, row in zip(names, counts, strict=True):
        unused = [str(answers.labels[k]) for k in np.flatnonzero(row == 0)]
        if unused:
            which = "category" if len(unused) == 1 else "categories"
            flags.append(
                f"No rating of the condition {name} is in the {which} {', '.join(unused)}; its odds ratio rests on the "
                "assumption of proportional odds there."
            )
    return flags


def _repeated(codes: IntArray, factors: dict[str, IntArray]) -> list[str]:
    columns = np.column_stack([codes, *factors.values()])
    repeats = len(columns) - len(np.unique(columns, axis=0))
    if not repeats:
        return []
    return [
        f"{repeats} of {len(columns)} ratings repeat one by the same rater of the same stimulus in the same condition; "
        "they count as independent ones."
    ]


def _merged(counts: IntArray) -> IntArray:
    """Return the group of each category, where neighbours are merged until all conditions use each group."""
    groups, group, open_counts = [], 0, np.zeros(len(counts), dtype=np.intp)
    for column in counts.T:
        groups.append(group)
        open_counts = open_counts + column
        if (open_counts > 0).all():
            group, open_counts = group + 1, np.zeros(len(counts), dtype=np.intp)
    # What is left over at the upper end joins the last full group.
    return np.minimum(np.array(groups, dtype=np.intp), max(group - 1, 0))


def _proportional_odds(
    answers: IntArray,
    conditions: IntArray,
    counts: IntArray,
    labels: tuple[Hashable, ...],
    factors: dict[str, IntArray],
) -> tuple[ProportionalOdds | None, list[str]]:
    groups = _merged(counts)
    left = int(groups.max()) + 1
    if len(labels) == 2:
        return None, []
    if left < 3:
        return None, ["Proportional odds cannot be checked, as the conditions share too few categories."]
    flags: tuple[str, ...] = ()
    if left < len(labels):
        listed = ", ".join("+".join(str(labels[k]) for k in np.flatnonzero(groups == group)) for group in range(left))
        flags = (f"For this check categories were merged: {listed}.",)
    fixed = predictors(_dummies(conditions, len(counts)), n=answers.size)
    merged = groups[answers]
    try:
        alike = fit_mixed(distinct_rows(merged, left, fixed.x, list(factors.values())), fixed, names=_FACTORS)
        loglik, sure = _thresholds_alone(merged, left, factors, conditions)
    except InsufficientDataError:
        return None, ["Proportional odds cannot be checked, as the categories that the conditions share separate them."]
    if not (sure and alike.converged):
        return None, ["Proportional odds could not be checked, as the model to compare with was not fitted well."]
    chi2, df = max(2 * (loglik - alike.log_likelihood), 0.0), (len(counts) - 1) * (left - 2)
    odds = ProportionalOdds(method="likelihood ratio", chi2=chi2, df=df, p=float(special.chdtrc(df, chi2)), flags=flags)
    return odds, list(odds.warning)
