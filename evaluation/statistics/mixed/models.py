"""Linear mixed models: raters and stimuli as random effects, conditions as fixed ones.

Data enter the fit through sums of squares and products alone, formed once (`mixed_moments`); `mixed_deviance` has the
profiled deviance and its derivatives, `mixed_fit` the search, `satterthwaite` the tests.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray, centred, check_confidence, check_squares, finite_vector
from evaluation.statistics.label_codes import Levels, level_codes
from evaluation.statistics.mixed.data import Design, named_columns, orthonormal, residual
from evaluation.statistics.mixed.deviance import ProfiledDeviance
from evaluation.statistics.mixed.fit import Optimum, minimise
from evaluation.statistics.mixed.moments import moments
from evaluation.statistics.mixed.result import (
    CrossedMixedModel,
    FittedTo,
    LikelihoodRatio,
    MixedModel,
    RandomCorrelation,
    RandomEffect,
)
from evaluation.statistics.mixed.satterthwaite import Satterthwaite
from evaluation.statistics.mixed.terms import RandomTerm, Term, in_several, prepared, with_conditions
from evaluation.statistics.threads import one_thread

__all__ = ["Method", "RandomTerm", "compare", "crossed_mixed_model", "mixed_model"]

Method = Literal["REML", "ML"]

# With less than this share of the variance, the residual is known to few digits.
_LEAST_RESIDUAL = 1e-7


def mixed_model(
    y: npt.ArrayLike,
    fixed: Any,
    random: Sequence[RandomTerm],
    *,
    names: Sequence[str] | None = None,
    method: Method = "REML",
    confidence: float = 0.95,
) -> MixedModel:
    """Fit a linear mixed model with any number of nested or crossed random terms.

    Parameters
    ----------
    y : array_like, shape (n,)
        Values.
    fixed : array_like or DataFrame, shape (n, p)
        Columns of the fixed effects, intercept included.
    random : sequence of RandomTerm
        Random terms, at least one; independent of each other.
    names : sequence of str, or None
        Names of the fixed effects; those of a frame's columns, or x1, x2, ... if None.
    method : str
        ``REML``, or ``ML`` to compare models with different fixed effects.
    confidence : float
        Of the intervals.

    Returns
    -------
    MixedModel
        Estimates, tests and variances; `flags` says if the fit is singular or did not converge.

    Raises
    ------
    DataError
        If a value is not a finite number, a label is missing, shapes differ, or a column depends on others (the message
        names it).
    InsufficientDataError
        If all values are the same or explained exactly, a term has one level only, or the data cannot tell the
        variances apart.

    Notes
    -----
    Optimum, log likelihood and information criteria are those of lme4's `lmer`, tests those of lmerTest.

    References
    ----------
    Bates, Mächler, Bolker and Walker (2015), Fitting linear mixed-effects models using lme4, Journal of Statistical
    Software 67(1). Kuznetsova, Brockhoff and Christensen (2017), lmerTest package, Journal of Statistical Software
    82(13).
    """
    values = finite_vector(y, name="values")
    check_squares(values, name="values")
    columns, columns_names = named_columns(fixed, names, n=values.size, what="fixed")
    if not random:
        raise DataError("There is no random term; a mixed model needs at least one.")
    if len({term.name for term in random}) < len(random):
        raise DataError("Two random terms have the same name.")
    terms = [prepared(term, n=values.size) for term in random]
    return MixedModel(**_fitted(values, columns, columns_names, terms, method=method, confidence=confidence))


def crossed_mixed_model(
    values: npt.ArrayLike,
    conditions: Any,
    raters: Any,
    stimuli: Any,
    *,
    method: Method = "REML",
    reference: Any = None,
    slopes: bool = False,
    confidence: float = 0.95,
) -> CrossedMixedModel:
    """Compare conditions by ratings, with raters and stimuli as crossed random effects.

    Parameters
    ----------
    values : array_like, shape (n,)
        Ratings, one for each row; combinations that nobody rated are simply not there.
    conditions, raters, stimuli : array_like, shape (n,)
        Labels of each rating. Conditions come in the order of their first appearance, or that of a pandas categorical.
    method : str
        ``REML``, or ``ML`` to compare models with different fixed effects.
    reference : label, or None
        Condition whose mean is the intercept; the first if None.
    slopes : bool
        Whether the difference between conditions may vary: adds random effects of each rater and of each stimulus in
        each condition, all of one variance (where a rater, or stimulus, occurs in several conditions).
    confidence : float
        Of the intervals.

    Returns
    -------
    CrossedMixedModel
        The test of the conditions, their means and differences, and the variances.

    Raises
    ------
    DataError
        If a value is not a finite number, a label is missing, numbers of labels differ, or there is no such reference.
    InsufficientDataError
        If there is one condition, rater or stimulus only, a condition has no values, all values are the same or
        explained exactly, or the data cannot tell the variances apart.

    Notes
    -----
    The cost of a step grows with the cube of the smaller of the numbers of raters and stimuli, not with the number of
    ratings; with `slopes` these numbers are multiplied by that of the conditions (1,000 raters by 1,000 stimuli: a
    second or two without, a minute and 2 GB with them).

    Conditions are labelled in their order of appearance, where R sorts them; with unequal numbers of ratings the
    denominator's degrees of freedom depend on that order in the fourth digit or so.

    Raters and stimuli as random effects: Baayen, Davidson and Bates (2008), Journal of Memory and Language 59:390;
    Judd, Westfall and Kenny (2012), Journal of Personality and Social Psychology 103:54. References of the method: see
    `mixed_model`.
    """
    vector = finite_vector(values, name="values")
    check_squares(vector, name="values")
    condition, titles, first = _conditions(conditions, reference, n=vector.size)
    terms, flags = [], []
    for name, labels in (("rater", raters), ("stimulus", stimuli)):
        what = {"rater": "raters", "stimulus": "stimuli"}[name]
        levels = level_codes(labels, n=vector.size, name=what, unused=False)
        term = prepared(RandomTerm(name=name, labels=labels), n=vector.size, levels=levels)
        if slopes and in_several(levels, condition):
            term = with_conditions(term, condition)
        elif slopes:
            flags.append(f"No {name} occurs in several conditions, so no effects of condition by {name} are fitted.")
        terms.append(term)
    others = [place for place in range(len(titles)) if place != first]
    columns = np.ones((vector.size, len(titles)))
    columns[:, 1:] = condition.codes[:, None] == np.array(others)
    names = ("intercept", *(titles[place] for place in others))
    fit = _fitted(vector, columns, names, terms, method=method, confidence=confidence)
    fit["flags"] = (*flags, *fit["flags"])
    counted = columns.T @ columns
    return CrossedMixedModel(**fit, **_compared(fit["tests"], titles, [first, *others], counted, confidence))


def compare(null: MixedModel, full: MixedModel) -> LikelihoodRatio:
    """Compare a model with a larger one that contains it, by the ratio of their likelihoods.

    Parameters
    ----------
    null, full : MixedModel
        Models of the same values; `full` with all terms of `null` and more. Fitted with ``ML`` if fixed effects differ.

    Returns
    -------
    LikelihoodRatio
        Chi-square test; a flag says where a variance is tested, for which p is too large (Self and Liang, 1987, Journal
        of the American Statistical Association 82:605).

    Raises
    ------
    DataError
        If the models are of different values or methods, are REML fits of different fixed effects, or the first is not
        contained in the second.
    """
    one, other = null.fitted_to, full.fitted_to
    if one.n != other.n or not np.allclose([one.mean, one.squares], [other.mean, other.squares], rtol=1e-9, atol=0):
        raise DataError("The two models are fitted to different values, so they cannot be compared.")
    if null.method != full.method:
        raise DataError(f"One model is fitted by {null.method}, the other by {full.method}; fit both by ML.")
    fixed = len(full.fixed) - len(null.fixed)
    if null.method == "REML" and (fixed or not math.isclose(one.design, other.design, rel_tol=1e-9, abs_tol=1e-9)):
        raise DataError("Restricted likelihoods of models with different fixed effects say nothing; fit both by ML.")
    df = full.parameters - null.parameters
    chi2 = 2 * (full.loglik - null.loglik)
    if df <= 0 or fixed < 0 or chi2 < -1e-6:
        raise DataError("The first model is not contained in the second: give the smaller one first.")
    flags = [*null.flags, *full.flags]
    if df > fixed:
        flags.append(
            "The null model sets a variance to 0, the end of its range, so the true p is smaller than this one."
        )
    return LikelihoodRatio(
        chi2=max(chi2, 0.0),
        df=df,
        p=float(special.chdtrc(df, max(chi2, 0.0))),
        method=full.method,
        loglik_null=null.loglik,
        loglik_full=full.loglik,
        aic_null=null.aic,
        aic_full=full.aic,
        bic_null=null.bic,
        bic_full=full.bic,
        flags=tuple(dict.fromkeys(flags)),
    )


def _conditions(conditions: Any, reference: Any, *, n: int) -> tuple[Levels, tuple[str, ...], int]:
    """Return the conditions, all with values, their names, and the place of the one to refer to."""
    found = level_codes(conditions, n=n, name="conditions")
    names = found.titles("conditions")
    counts = np.bincount(found.codes, minlength=len(names))
    for name, count in zip(names, counts, strict=True):
        if not count:
            raise InsufficientDataError(f"The condition {name} has no values, so it cannot be compared.")
    if len(names) < 2:
        raise InsufficientDataError("Fewer than two conditions have values, so there is nothing to compare.")
    if reference is None:
        return found, names, 0
    if str(reference) not in names:
        raise DataError(f"There is no condition {reference} to refer to; there are {', '.join(names)}.")
    return found, names, names.index(str(reference))


def _fitted(
    values: FloatArray,
    columns: FloatArray,
    names: tuple[str, ...],
    terms: Sequence[Term],
    *,
    method: Method,
    confidence: float,
) -> dict[str, Any]:
    """Return the attributes of a fitted model."""
    check_confidence(confidence)
    if method not in get_args(Method):
        raise DataError(f"method is {method!r}, but must be 'REML' or 'ML'.")
    design = orthonormal(columns, names, what="fixed")
    coefficients, left = residual(values, design)
    largest = float(np.abs(left).max())
    scale = largest * math.sqrt(float(np.mean((left / largest) ** 2)))
    # Factorising a matrix on several threads is slower by far where other processes want the cores.
    with one_thread():
        data = moments([term.grouping for term in terms], design.orthonormal, left / scale)
        profile = ProfiledDeviance(data, [terms[place].structure for place in data.order], reml=method == "REML")
        optimum = minimise(profile)
    solution = optimum.solution
    sigma = scale * math.sqrt(solution.rss / profile.nu)
    tests = _tests(profile, optimum, design, coefficients, scale)
    deviance = solution.deviance + 2 * profile.nu * math.log(scale)
    determinant = 2 * float(np.log(np.abs(np.diag(design.triangle))).sum())
    if method == "REML":
        deviance += determinant
    parameters = len(names) + solution.theta.size + 1
    thetas = dict(zip(data.order, (solution.theta[part] for part in profile.parts), strict=True))
    mean, differences = centred(values)
    return {
        "fixed": tuple(
            tests.coefficient(row, name=name, confidence=confidence)
            for name, row in zip(names, np.eye(len(names)), strict=True)
        ),
        **_random(terms, [thetas[place] for place in range(len(terms))], sigma, converged=optimum.converged),
        "loglik": -deviance / 2,
        "aic": deviance + 2 * parameters,
        "bic": deviance + math.log(values.size) * parameters,
        "parameters": parameters,
        "method": method,
        "n": values.size,
        "singular": optimum.singular,
        "vcov": tests.vcov,
        "confidence": confidence,
        "tests": tests,
        "fitted_to": FittedTo(n=values.size, mean=mean, squares=float(differences @ differences), design=determinant),
    }


def _tests(
    profile: ProfiledDeviance, optimum: Optimum, design: Design, coefficients: FloatArray, scale: float
) -> Satterthwaite:
    """Return what tests need, for the columns of the fixed effects as they were given."""
    solution, found = optimum.solution, optimum.derivatives
    back = np.linalg.inv(design.triangle)
    variance = scale**2 * solution.rss / profile.nu
    by_theta = np.tensordot(profile.jacobian(solution.theta).T, found.unscaled_slopes, axes=1)
    vcov = variance * back @ found.unscaled @ back.T
    vcov.flags.writeable = False
    return Satterthwaite(
        beta=back @ (coefficients + scale * found.beta),
        vcov=vcov,
        # The last parameter is the logarithm of the residual variance.
        slopes=np.concatenate([variance * back @ by_theta @ back.T, vcov[None]]),
        hessian=profile.joint_hessian(solution, found),
    )


def _random(terms: Sequence[Term], thetas: Sequence[FloatArray], sigma: float, *, converged: bool) -> dict[str, Any]:
    """Return the attributes that describe the random terms and the residual."""
    effects: list[RandomEffect] = []
    correlations: list[RandomCorrelation] = []
    variances: dict[str, float] = {}
    flags: list[str] = []
    for term, theta in zip(terms, thetas, strict=True):
        of_term, correlated, mean_variances = term.estimates(theta, sigma)
        effects += of_term
        correlations += correlated
        variances |= mean_variances
        flags += term.singularity(theta)
    if not converged:
        flags.append("The search for the variances did not converge, so the estimates are not to be trusted.")
    variances["residual"] = sigma**2
    whole = sum(variances.values())
    if variances["residual"] < _LEAST_RESIDUAL * whole:
        flags.append("The random terms explain nearly all of the variance, so standard errors are inexact.")
    return {
        "random": tuple(effects),
        "correlations": tuple(correlations),
        "sigma": sigma,
        "groups": {effect.term: effect.levels for effect in effects},
        "shares": {name: variance / whole for name, variance in variances.items()},
        "converged": converged,
        "flags": tuple(flags),
    }


def _compared(
    tests: Satterthwaite, names: tuple[str, ...], order: Sequence[int], squares: FloatArray, confidence: float
) -> dict[str, Any]:
    """Return the test of the conditions, their means and differences; the first in `order` is the intercept.

    `squares` is X'X. The degrees of freedom of an F test depend a little on which independent combinations are tested:
    these are the rows of the unit triangular factor of X'X, as in lmerTest.
    """
    triangle = np.linalg.cholesky(squares, upper=True)
    means = np.zeros((len(names), len(names)))
    means[order, range(len(names))] = 1
    means[:, 0] = 1
    pairs = list(itertools.combinations(range(len(names)), 2))
    return {
        "condition": tests.f_test((triangle / np.diag(triangle)[:, None])[1:], name="condition"),
        "means": tuple(
            tests.estimate(row, name=name, confidence=confidence) for row, name in zip(means, names, strict=True)
        ),
        "contrasts": tuple(
            tests.contrasts(
                [means[a] - means[b] for a, b in pairs],
                names=[f"{names[a]} - {names[b]}" for a, b in pairs],
                confidence=confidence,
            )
        ),
    }
