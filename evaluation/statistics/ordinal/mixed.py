"""The cumulative-logit model of ordered answers with random intercepts, of raters and stimuli for instance."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import check_confidence
from evaluation.statistics.label_codes import IntArray, level_codes
from evaluation.statistics.ordinal.data import (
    Categories,
    Predictors,
    distinct_rows,
    ordered_categories,
    predictors,
)
from evaluation.statistics.ordinal.fixed import OrdinalModel, fit_flags, in_old_columns
from evaluation.statistics.ordinal.maximum import NO_SD, MixedFit, fit_mixed

_MOST_NODES = 100
# With intercepts this far apart most answers are at an end of the scale, and a parabola fits the integrand badly.
_WIDE_SD = 8.0


@dataclass(frozen=True, kw_only=True, eq=False)
class CumulativeLogitMixed(OrdinalModel):
    """A cumulative-logit model with random intercepts: see `OrdinalModel`.

    Attributes
    ----------
    random_sds : mapping of str to float
        Standard deviation of the intercepts of each random factor, in logits; 0 on the boundary.
    groups : mapping of str to int
        Levels of each random factor.
    nodes : int
        1: Laplace's approximation; more: nodes of adaptive Gauss-Hermite quadrature.
    singular : bool
        Whether a standard deviation is on its boundary; if so, a flag names it.
    """

    random_sds: Mapping[str, float]
    groups: Mapping[str, int]
    nodes: int
    singular: bool

    def _rows(self) -> list[dict[str, object]]:
        spreads = [{"kind": "random sd", "name": name, "estimate": sd} for name, sd in self.random_sds.items()]
        return [*super()._rows(), *spreads]


def cumulative_logit_mixed(
    y: npt.ArrayLike | pd.Series | pd.Categorical,
    fixed: npt.ArrayLike | pd.DataFrame,
    random: Sequence[tuple[str, Sequence[Hashable]]],
    *,
    names: Sequence[str] | None = None,
    nodes: int = 1,
    confidence: float = 0.95,
) -> CumulativeLogitMixed:
    """Fit logit P(y <= j) = threshold j - fixed @ coefficients - intercepts by maximum likelihood.

    The intercepts of each random factor are normal with mean 0 and a standard deviation that is estimated.

    Parameters
    ----------
    y, fixed, names, confidence
        As in `evaluation.statistics.ordinal.fixed.cumulative_logit`; `fixed` may have no columns.
    random : sequence of (str, sequence)
        Name and labels (length n) of each random factor; factors may be crossed or nested.
    nodes : int
        1 integrates the intercepts by Laplace's approximation. More, for one factor only, are the nodes of adaptive
        Gauss-Hermite quadrature; 10 are usually exact to four digits.

    Returns
    -------
    CumulativeLogitMixed
        Estimates; standard errors from the observed information of all parameters together.

    Raises
    ------
    DataError
        As `cumulative_logit`; if a label is missing, there is no random factor or two of one name, or `nodes` does
        not fit.
    InsufficientDataError
        As `cumulative_logit`; if a factor has only one level or as many as there are answers, or the answers are
        separated so far by its levels that its standard deviation would be infinite.

    Notes
    -----
    A standard deviation of no more than 0.01 logits is set to 0 if that costs no likelihood, and flagged. With two
    categories this is the logistic mixed model.

    References
    ----------
    Hedeker and Gibbons (1994), Biometrics 50:933; as ``clmm`` of the R package ordinal (Christensen, 2019). Laplace's
    approximation and adaptive quadrature: Pinheiro and Bates (1995), J. Comput. Graph. Stat. 4:12.
    """
    check_confidence(confidence)
    answers = ordered_categories(y)
    found = predictors(fixed, n=answers.codes.size, names=names)
    factors = random_factors(random, n=answers.codes.size)
    if not (isinstance(nodes, int) and 1 <= nodes <= _MOST_NODES):
        raise DataError(f"nodes is {nodes}, but must be a whole number from 1 to {_MOST_NODES}.")
    if nodes > 1 and len(factors) > 1:
        raise DataError(f"{nodes} nodes need exactly one random factor, and there are {len(factors)}; use nodes=1.")
    rows = distinct_rows(answers.codes, len(answers.labels), found.x, list(factors.values()))
    fit = fit_mixed(rows, found, nodes=nodes, names=tuple(factors))
    return mixed_result(answers, found, factors, fit, nodes=nodes, confidence=confidence)


def random_factors(random: Sequence[tuple[str, Sequence[Hashable]]], *, n: int) -> dict[str, IntArray]:
    """Return the levels of each random factor as numbers.

    Raises
    ------
    DataError
        If there is none, two have one name, or labels are missing.
    InsufficientDataError
        If a factor has only one level, or as many as there are answers.
    """
    factors = {str(name): level_codes(labels, name=str(name), n=n, unused=False).codes for name, labels in random}
    if not factors or len(factors) < len(random):
        raise DataError("A mixed model needs at least one random factor, and each needs a name of its own.")
    for name, codes in factors.items():
        levels = int(codes.max()) + 1
        if levels < 2:
            raise InsufficientDataError(
                f"There is only one {name}, so it cannot be seen how they differ; leave this factor out, or get "
                "answers of more."
            )
        if levels >= n:
            raise InsufficientDataError(
                f"Each {name} has a single answer, so it cannot be told from chance how they differ."
            )
    return factors


def mixed_result(
    answers: Categories,
    fixed: Predictors,
    factors: Mapping[str, IntArray],
    fit: MixedFit,
    *,
    nodes: int,
    confidence: float,
) -> CumulativeLogitMixed:
    """Return a fit as a result with its flags."""
    sds = {name: float(sd) for name, sd in zip(factors, fit.sds, strict=True)}
    thresholds, coefficients, vcov = in_old_columns(answers, fixed, fit, confidence)
    parameters = len(thresholds) + len(coefficients) + len(sds)
    vanished = [name for name, sd in sds.items() if sd <= NO_SD]
    flags = [*answers.flags, *fit_flags(fit.converged, coefficients)]
    if vanished:
        flags.append(
            f"Singular fit: on its boundary, 0, is the spread of {' and of '.join(vanished)}; the data show "
            "no differences there beyond chance."
        )
    flags.extend(
        f"The intercepts of {name} have a standard deviation of {sd:.1f} logits; so wide a spread is estimated badly."
        for name, sd in sds.items()
        if sd > _WIDE_SD
    )
    return CumulativeLogitMixed(
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
        random_sds=sds,
        groups={name: int(codes.max()) + 1 for name, codes in factors.items()},
        nodes=nodes,
        singular=bool(vanished),
        flags=tuple(flags),
    )
