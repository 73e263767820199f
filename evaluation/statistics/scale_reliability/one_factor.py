"""Whether one factor is enough for the items of a scale."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import optimize, special, stats

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.result import Result
from evaluation.statistics.scale_reliability.alpha import spearman_brown
from evaluation.statistics.scale_reliability.answer_table import AnswerTable, answer_table
from evaluation.statistics.scale_reliability.factor_fit import fit_one_factor
from evaluation.statistics.scale_reliability.omega import fit_flags

_RMSEA_CONFIDENCE = 0.90


@dataclass(frozen=True, kw_only=True)
class FactorFit:
    """How well a one-factor model fits, where it has degrees of freedom.

    Attributes
    ----------
    chi2 : float
        n times the discrepancy of maximum likelihood.
    df : int
        Degrees of freedom, k (k - 3) / 2 for k items.
    p : float
        Probability of a worse fit if one factor is enough.
    rmsea : float
        Root mean square error of approximation.
    rmsea_ci : tuple of float
        Its 90% interval.
    cfi, tli : float or None
        Comparative fit and Tucker-Lewis index; None if the items hardly correlate, so that there is nothing to compare
        with.
    """

    chi2: float
    df: int
    p: float
    rmsea: float
    rmsea_ci: tuple[float, float]
    cfi: float | None
    tli: float | None


@dataclass(frozen=True, kw_only=True)
class OneFactorCheck(Result):
    """A one-factor model of the items of a scale, and what their correlations look like.

    Attributes
    ----------
    rows : int
        Number of complete rows.
    names : tuple of str
        Names of the items.
    fit : FactorFit or None
        Fit of the model; None for two or three items, which one factor always fits.
    srmr : float or None
        Standardised root mean square residual; None for two items.
    explained : float or None
        Share of the items' variance that the factor explains; None for two items.
    loadings : tuple of float
        Loadings of the standardised items; empty for two items.
    heywood : tuple of str
        Items whose uniqueness is at its lower bound.
    eigenvalues : tuple of float
        Of the correlations, from the largest.
    eigenvalue_ratio : float or None
        The first over the second; None if the second is 0.
    thresholds : tuple of float
        95th percentiles of the eigenvalues of random numbers (Horn's parallel analysis); empty if not asked for.
    factors : int or None
        How many eigenvalues from the first on exceed their threshold; None if not asked for.
    two_items : float or None
        Spearman-Brown reliability if there are only two items.
    """

    rows: int
    names: tuple[str, ...]
    fit: FactorFit | None
    srmr: float | None
    explained: float | None
    loadings: tuple[float, ...]
    heywood: tuple[str, ...]
    eigenvalues: tuple[float, ...]
    eigenvalue_ratio: float | None
    thresholds: tuple[float, ...]
    factors: int | None
    two_items: float | None

    def apa(self) -> str:
        """Return a sentence with the fit, or why there is none."""
        head = f"One-factor model by maximum likelihood ({len(self.names)} items, n = {self.rows})"
        if self.explained is None:
            if self.two_items is None:
                return f"{head}: not identified by 2 items."
            return f"{head}: not identified by 2 items; Spearman-Brown reliability = {wording.share(self.two_items)}."
        tail = f"the factor explains {100 * self.explained:.0f}% of the variance."
        if self.fit is None or self.srmr is None:
            return f"{head}: 3 items leave no degrees of freedom to test it; {tail}"
        return f"{head}: {_fit_text(self.fit)}, SRMR = {wording.share(self.srmr, 3)}; {tail}"

    def to_frame(self) -> pd.DataFrame:
        """Return the fit as a frame of one row, NaN where there is no value; `item_frame` has the loadings."""
        fit = self.fit
        low, high = fit.rmsea_ci if fit else (math.nan, math.nan)
        numbers = {
            "chi2": fit.chi2 if fit else None,
            "df": fit.df if fit else None,
            "p": fit.p if fit else None,
            "rmsea": fit.rmsea if fit else None,
            "rmsea_low": low,
            "rmsea_high": high,
            "cfi": fit.cfi if fit else None,
            "tli": fit.tli if fit else None,
            "srmr": self.srmr,
            "explained": self.explained,
            "eigenvalue_ratio": self.eigenvalue_ratio,
            "factors": self.factors,
            "two_items": self.two_items,
        }
        return pd.DataFrame({"items": [len(self.names)], "n": [self.rows]}).assign(
            **{name: math.nan if value is None else float(value) for name, value in numbers.items()}
        )

    def item_frame(self) -> pd.DataFrame:
        """Return a row for each item; NaN where there is no loading."""
        loadings = self.loadings or (math.nan,) * len(self.names)
        return pd.DataFrame({"item": self.names, "loading": loadings})


def one_factor_check(
    answers: npt.ArrayLike | pd.DataFrame,
    *,
    names: Sequence[str] | None = None,
    rng: np.random.Generator | None = None,
    replicates: int = 500,
) -> OneFactorCheck:
    """Return how well one factor, found by maximum likelihood, explains the items of a scale.

    Parameters
    ----------
    answers : array_like or pandas.DataFrame, shape (rows, items)
        Answers, those to items of opposite meaning reversed; rows with a missing answer (NaN) are left out.
    names : sequence of str, optional
        Names of the items; the columns of a frame or else ``item 1`` ... without it.
    rng : numpy.random.Generator, optional
        Source of random tables for a parallel analysis; without it there is none.
    replicates : int
        Number of random tables, at least 100.

    Returns
    -------
    OneFactorCheck
        Fit, loadings and eigenvalues. One factor always fits three items, and is not identified by two; the result
        then says so.

    Raises
    ------
    DataError
        If the answers are no table of numbers, one is infinite, or an option is wrong.
    InsufficientDataError
        If there are fewer than two items, no more complete rows than items, an item does not vary, or some item is a
        sum of others.

    Notes
    -----
    chi2 = n F, RMSEA = sqrt(max(chi2 - df, 0) / (df n)), CFI and TLI against items that do not correlate at all, and
    SRMR over the k (k + 1) / 2 correlations with the diagonal, as structural equation software has them. The answers
    are taken as normal; those on few points make chi2 too large.

    References
    ----------
    Joreskog (1967), Psychometrika 32:443. Fit: Steiger (1990), Multivariate Behavioral Research 25:173; Bentler (1990),
    Psychological Bulletin 107:238; Tucker and Lewis (1973), Psychometrika 38:1; Hu and Bentler (1999), Structural
    Equation Modeling 6:1. Parallel analysis: Horn (1965), Psychometrika 30:179, with the 95th percentile.
    """
    if rng is not None and replicates < 100:
        raise DataError(f"replicates is {replicates}, but a parallel analysis needs at least 100.")
    table = answer_table(answers, names=names, for_factor=True)
    items = len(table.names)
    correlations = table.correlations
    roots: FloatArray = np.linalg.eigvalsh(correlations)[::-1].astype(float)
    thresholds = _thresholds(table.rows, items, rng, replicates) if rng is not None else np.empty(0)
    if items == 2:
        return _two_items(table, roots, thresholds)
    model = fit_one_factor(correlations, extraction="ml")
    residuals = correlations - np.outer(model.loadings, model.loadings) - np.diag(model.uniquenesses)
    srmr = math.sqrt(float((np.tril(residuals) ** 2).sum()) / (items * (items + 1) / 2))
    fit = None
    flags = table.flags + fit_flags(model, table.names)
    if items > 3:
        fit = _fit(table.rows, items, model.discrepancy, -float(np.log(roots).sum()))
        flags += _verdict(fit, srmr)
    else:
        flags += ("With 3 items the model has no degrees of freedom, so that its fit says nothing.",)
    return OneFactorCheck(
        rows=table.rows,
        names=table.names,
        fit=fit,
        srmr=srmr,
        explained=float((model.loadings**2).mean()),
        loadings=tuple(model.loadings.tolist()),
        heywood=tuple(table.names[place] for place in model.heywood),
        eigenvalues=tuple(roots.tolist()),
        eigenvalue_ratio=float(roots[0] / roots[1]),
        thresholds=tuple(thresholds.tolist()),
        factors=_factors(roots, thresholds),
        two_items=None,
        flags=flags,
    )


def _two_items(table: AnswerTable, roots: FloatArray, thresholds: FloatArray) -> OneFactorCheck:
    correlation = float(table.correlations[0, 1])
    flags = [*table.flags]
    flags.append(
        "With 2 items one factor is not identified: report their correlation and the Spearman-Brown reliability."
    )
    if correlation <= 0:
        flags.append("The two items do not correlate positively; is one of them not reversed?")
    return OneFactorCheck(
        rows=table.rows,
        names=table.names,
        fit=None,
        srmr=None,
        explained=None,
        loadings=(),
        heywood=(),
        eigenvalues=tuple(roots.tolist()),
        eigenvalue_ratio=float(roots[0] / roots[1]) if roots[1] > 1e-12 else None,
        thresholds=tuple(thresholds.tolist()),
        factors=_factors(roots, thresholds),
        two_items=spearman_brown(correlation) if correlation > 0 else None,
        flags=tuple(flags),
    )


def _fit(n: int, items: int, discrepancy: float, independence: float) -> FactorFit:
    df, baseline_df = items * (items - 3) // 2, items * (items - 1) // 2
    chi2, baseline = n * discrepancy, n * independence
    excess, worst = max(chi2 - df, 0), max(baseline - baseline_df, 0)
    low, high = _noncentrality(chi2, df, 0.95), _noncentrality(chi2, df, 0.05)
    return FactorFit(
        chi2=chi2,
        df=df,
        p=float(stats.chi2.sf(chi2, df)),
        rmsea=math.sqrt(excess / (df * n)),
        rmsea_ci=(math.sqrt(low / (df * n)), math.sqrt(high / (df * n))),
        cfi=1 - excess / max(excess, worst) if worst > 0 else None,
        tli=(baseline / baseline_df - chi2 / df) / (baseline / baseline_df - 1) if worst > 0 else None,
    )


def _noncentrality(chi2: float, df: int, probability: float) -> float:
    """Return the noncentrality at which a chi-squared variable is at most `chi2` with a probability; 0 if none is."""
    if special.chdtr(df, chi2) <= probability:
        return 0.0
    # Four normal deviations on either side of what the normal approximation gives hold the root.
    high = chi2 + 8 * math.sqrt(chi2 + df) + 20
    return float(optimize.brentq(lambda shift: special.chndtr(chi2, df, shift) - probability, 0, high, xtol=1e-9))


def _thresholds(n: int, items: int, rng: np.random.Generator, replicates: int) -> FloatArray:
    """Return the 95th percentiles of eigenvalues of correlations of independent normal numbers.

    The sums of squares come from Bartlett's decomposition, which needs no rows (Bartlett, 1933, Proceedings of the
    Royal Society of Edinburgh 53:260).
    """
    roots = np.tril(rng.standard_normal((replicates, items, items)), -1)
    place = np.arange(items)
    roots[:, place, place] = np.sqrt(rng.chisquare(n - 1 - place, size=(replicates, items)))
    roots /= np.sqrt((roots**2).sum(axis=2, keepdims=True))
    eigenvalues = np.linalg.eigvalsh(roots @ roots.transpose(0, 2, 1))[:, ::-1]
    thresholds: FloatArray = np.quantile(eigenvalues, 0.95, axis=0)
    return thresholds


def _factors(roots: FloatArray, thresholds: FloatArray) -> int | None:
    if not thresholds.size:
        return None
    return int(np.cumprod(roots > thresholds).sum())


def _verdict(fit: FactorFit, srmr: float) -> tuple[str, ...]:
    flags = []
    poor = [name for name, bad in (("CFI", fit.cfi is not None and fit.cfi < 0.95), ("SRMR", srmr > 0.08)) if bad]
    if fit.rmsea > 0.06:
        poor.append("RMSEA")
    if poor:
        flags.append(
            f"One factor does not fit well by {', '.join(poor)} (limits of Hu and Bentler, 1999: CFI .95, SRMR .08, "
            "RMSEA .06)."
        )
    if fit.cfi is None:
        flags.append("The items hardly correlate, so that there is no CFI or TLI, and little for a factor to explain.")
    return tuple(flags)


def _fit_text(fit: FactorFit) -> str:
    low, high = fit.rmsea_ci
    parts = [
        f"χ²({fit.df}) = {wording.number(fit.chi2)}",
        wording.p_value(fit.p),
        f"RMSEA = {wording.share(fit.rmsea, 3)}",
        wording.interval(low, high, confidence=_RMSEA_CONFIDENCE, bounded=True),
    ]
    if fit.cfi is not None and fit.tli is not None:
        parts += [f"CFI = {wording.share(fit.cfi, 3)}", f"TLI = {wording.share(fit.tli, 3)}"]
    return ", ".join(parts)
