"""t and F tests of fixed effects of a mixed model, with degrees of freedom after Satterthwaite."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An estimate with its standard error, degrees of freedom and confidence interval."""

    name: str
    estimate: float
    se: float
    df: float
    ci: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Coefficient(Estimate):
    """An estimate with a two-sided t test of whether it is zero."""

    t: float
    p: float


@dataclass(frozen=True, kw_only=True)
class Contrast(Coefficient):
    """A difference that is one of several; `p_holm` is its probability adjusted for their number (Holm, 1979)."""

    p_holm: float


@dataclass(frozen=True, kw_only=True)
class FTest(Result):
    """A test of whether several combinations of fixed effects are all zero.

    Attributes
    ----------
    name : str
        What is tested.
    F : float
        Variance ratio.
    df1 : int
        How many independent combinations there are.
    df2 : float
        Degrees of freedom of the denominator.
    p : float
        Probability of an F at least as large if all were zero.
    """

    name: str
    F: float
    df1: int
    df2: float
    p: float

    def apa(self) -> str:
        """Return for instance ``F(2, 57.3) = 12.31, p < .001``."""
        ratio = f"F({self.df1}, {wording.number(self.df2, 1)}) = {wording.number(self.F)}"
        return f"{ratio}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row."""
        return pd.DataFrame({"effect": [self.name], "F": [self.F], "df1": [self.df1], "df2": [self.df2], "p": [self.p]})


@dataclass(frozen=True, kw_only=True, eq=False)
class Satterthwaite:
    """What tests of linear combinations of fixed effects need.

    Attributes
    ----------
    beta : numpy.ndarray, shape (p,)
        Fixed effects.
    vcov : numpy.ndarray, shape (p, p)
        Their covariance matrix.
    slopes : numpy.ndarray, shape (s, p, p)
        Derivatives of the covariance matrix by the variance parameters.
    hessian : numpy.ndarray, shape (s, s)
        Second derivatives of the deviance by the variance parameters.

    Notes
    -----
    The variance of a combination L is f = L'vcov L, and its degrees of freedom are 2 f^2 / (g'A g), where g are the
    derivatives of f by the variance parameters and A = 2 hessian^-1 is their asymptotic covariance (Giesbrecht and
    Burns, 1985, Biometrics 41:477; as lmerTest: Kuznetsova, Brockhoff and Christensen, 2017, Journal of Statistical
    Software 82(13)). Directions in which the deviance does not curve upwards are left out of A, as lmerTest does. The
    derivatives here are exact. A test of several combinations splits them into independent ones, whose degrees of
    freedom are merged after Fai and Cornelius (1996, Journal of Statistical Computation and Simulation 54:363).
    """

    beta: FloatArray
    vcov: FloatArray
    slopes: FloatArray
    hessian: FloatArray

    def df(self, weights: FloatArray) -> float:
        """Return the degrees of freedom of one combination, shape (p,)."""
        variance = float(weights @ self.vcov @ weights)
        values, vectors = np.linalg.eigh(self.hessian)
        upwards = values > 1e-9 * values[-1]
        changes = vectors[:, upwards].T @ (self.slopes @ weights @ weights / variance)
        return 1 / float(np.sum(changes**2 / values[upwards]))

    def estimate(self, weights: npt.ArrayLike, *, name: str, confidence: float) -> Estimate:
        """Return a combination of fixed effects without a test, for instance a mean."""
        found = self.coefficient(weights, name=name, confidence=confidence)
        return Estimate(name=name, estimate=found.estimate, se=found.se, df=found.df, ci=found.ci)

    def coefficient(self, weights: npt.ArrayLike, *, name: str, confidence: float) -> Coefficient:
        """Return a combination of fixed effects and its t test.

        Raises
        ------
        DataError
            If there is not one finite weight for each fixed effect, or all are zero.
        """
        (row,) = self._rows(np.asarray(weights)[None])
        estimate = float(row @ self.beta)
        se = math.sqrt(float(row @ self.vcov @ row))
        df = self.df(row)
        half = float(special.stdtrit(df, (1 + confidence) / 2)) * se
        t = estimate / se
        return Coefficient(
            name=name,
            estimate=estimate,
            se=se,
            df=df,
            ci=(estimate - half, estimate + half),
            t=t,
            p=float(2 * special.stdtr(df, -abs(t))),
        )

    def contrasts(self, weights: Sequence[npt.ArrayLike], *, names: Sequence[str], confidence: float) -> list[Contrast]:
        """Return several combinations with their t tests, and Holm's probabilities for all of them together."""
        found = [
            self.coefficient(row, name=name, confidence=confidence) for row, name in zip(weights, names, strict=True)
        ]
        order = np.argsort([one.p for one in found], kind="stable")
        adjusted = np.empty(len(found))
        steps = (len(found) - np.arange(len(found))) * np.array([found[place].p for place in order])
        adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1)
        return [Contrast(**vars(one), p_holm=float(p)) for one, p in zip(found, adjusted, strict=True)]

    def f_test(self, weights: npt.ArrayLike, *, name: str) -> FTest:
        """Return the test of whether all combinations are zero; those that follow from others are not counted twice.

        Raises
        ------
        DataError
            If the rows do not have one finite weight for each fixed effect, or one is zero throughout.
        """
        rows = self._rows(weights)
        values, vectors = np.linalg.eigh(rows @ self.vcov @ rows.T)
        kept = values > 1e-10 * values[-1]
        independent = vectors[:, kept].T @ rows
        ratios = (independent @ self.beta) ** 2 / values[kept]
        F, df1 = float(ratios.mean()), int(kept.sum())
        df2 = _merged([self.df(row) for row in independent])
        return FTest(name=name, F=F, df1=df1, df2=df2, p=float(stats.f.sf(F, df1, df2)))

    def _rows(self, weights: npt.ArrayLike) -> FloatArray:
        rows = finite_array(weights, axes=("combinations", "fixed effects"), name="weights")
        if rows.shape[1] != self.beta.size or not len(rows):
            raise DataError(f"weights has the shape {rows.shape}, but needs {self.beta.size} weights in each row.")
        if not rows.any(axis=1).all():
            raise DataError("weights: a combination has the weight 0 for every fixed effect, so nothing is tested.")
        return rows


def _merged(dfs: Sequence[float]) -> float:
    """Return the degrees of freedom of a mean of squared t statistics, which an F variable then matches in its mean."""
    if max(dfs) - min(dfs) < 1e-8 * max(dfs):
        return float(np.mean(dfs))
    if min(dfs) <= 2:
        return 2.0
    mean = sum(df / (df - 2) for df in dfs)
    return 2 * mean / (mean - len(dfs))
