"""Results of linear mixed models."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy.typing as npt
import pandas as pd

from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.mixed.satterthwaite import Coefficient, Contrast, Estimate, FTest, Satterthwaite
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class RandomEffect:
    """The spread of one effect of a random term among its levels."""

    term: str
    effect: str
    sd: float
    levels: int

    @property
    def variance(self) -> float:
        """The square of the standard deviation."""
        return self.sd**2


@dataclass(frozen=True, kw_only=True)
class RandomCorrelation:
    """The correlation of two effects of a random term; `r` is None where one of them has no variance."""

    term: str
    first: str
    second: str
    r: float | None


@dataclass(frozen=True, kw_only=True)
class FittedTo:
    """What two models must have in common to be compared: the values, and for REML the fixed effects."""

    n: int
    mean: float
    squares: float
    design: float


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedModel(Result):
    """A linear mixed model.

    Attributes
    ----------
    fixed : tuple of Coefficient
        Fixed effects with t tests; degrees of freedom after Satterthwaite.
    random : tuple of RandomEffect
        Standard deviations of the random effects.
    correlations : tuple of RandomCorrelation
        Correlations within each random term.
    sigma : float
        Residual standard deviation.
    loglik : float
        Logarithm of the likelihood, restricted for REML.
    aic, bic : float
        Information criteria, of n values and `parameters` parameters.
    parameters : int
        Fixed effects, variances and covariances, and the residual variance.
    method : str
        ``REML`` or ``ML``.
    n : int
        Number of values.
    groups : mapping of str to int
        Levels of each random term.
    shares : mapping of str to float
        Share of each random term and of the residual in the variance about the fixed effects, averaged over the values
        (for random intercepts: intraclass correlations).
    singular : bool
        Whether a variance is estimated as zero, or a correlation as 1 in size.
    converged : bool
        Whether the search for the variances ended at an optimum.
    vcov : numpy.ndarray, shape (p, p)
        Covariance matrix of the fixed effects; read-only.
    confidence : float
        Of the intervals.
    tests : Satterthwaite
        What further tests are computed from.
    fitted_to : FittedTo
        What tells whether another model is of the same data.
    """

    fixed: tuple[Coefficient, ...]
    random: tuple[RandomEffect, ...]
    correlations: tuple[RandomCorrelation, ...]
    sigma: float
    loglik: float
    aic: float
    bic: float
    parameters: int
    method: str
    n: int
    groups: Mapping[str, int]
    shares: Mapping[str, float]
    singular: bool
    converged: bool
    vcov: FloatArray
    confidence: float
    tests: Satterthwaite = field(repr=False)
    fitted_to: FittedTo = field(repr=False)

    def contrast(self, weights: npt.ArrayLike, *, name: str = "contrast") -> Coefficient:
        """Return a weighted sum of the fixed effects with its t test.

        Parameters
        ----------
        weights : array_like, shape (p,)
            A weight for each fixed effect.
        name : str
            What to call it.

        Raises
        ------
        DataError
            If there is not one finite weight for each fixed effect, or all are zero.
        """
        return self.tests.coefficient(weights, name=name, confidence=self.confidence)

    def f_test(self, weights: npt.ArrayLike, *, name: str = "contrasts") -> FTest:
        """Test whether several weighted sums of the fixed effects are all zero.

        Parameters
        ----------
        weights : array_like, shape (k, p)
            A row of weights for each.
        name : str
            What to call them.

        Raises
        ------
        DataError
            As `contrast`.
        """
        return self.tests.f_test(weights, name=name)

    def apa(self) -> str:
        """Return the fixed effects, without an intercept where there are others, separated by semicolons."""
        shown = [one for one in self.fixed if one.name.lower().strip("()") != "intercept"] or list(self.fixed)
        return "; ".join(self._sentence(one) for one in shown)

    def to_frame(self) -> pd.DataFrame:
        """Return the fixed effects, a row each."""
        return estimates_frame(self.fixed)

    def random_frame(self) -> pd.DataFrame:
        """Return standard deviations and variances, a row for each random effect and one for the residual."""
        rows = [(one.term, one.effect, one.levels, one.variance, one.sd) for one in self.random]
        rows.append(("residual", "", self.n, self.sigma**2, self.sigma))
        return pd.DataFrame(rows, columns=["term", "effect", "levels", "variance", "sd"])

    def _sentence(self, one: Coefficient) -> str:
        test = f"t({wording.number(one.df, 1)}) = {wording.number(one.t)}, {wording.p_value(one.p)}"
        interval = wording.interval(*one.ci, confidence=self.confidence)
        return f"{one.name}: b = {wording.number(one.estimate)}, SE = {wording.number(one.se)}, {test}, {interval}"


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossedMixedModel(MixedModel):
    """A linear mixed model of conditions, with raters and stimuli as crossed random effects.

    Attributes
    ----------
    condition : FTest
        Whether the conditions differ at all.
    means : tuple of Estimate
        Mean of each condition as the model estimates it, for raters and stimuli like these.
    contrasts : tuple of Contrast
        Differences of all pairs of conditions, the earlier less the later.
    """

    condition: FTest
    means: tuple[Estimate, ...]
    contrasts: tuple[Contrast, ...]

    def apa(self) -> str:
        """Return the test of the conditions, for instance ``F(2, 57.3) = 12.31, p < .001``."""
        return self.condition.apa()

    def means_frame(self) -> pd.DataFrame:
        """Return the means of the conditions, a row each."""
        return estimates_frame(self.means)

    def contrasts_frame(self) -> pd.DataFrame:
        """Return the differences between conditions, a row each."""
        return estimates_frame(self.contrasts)


@dataclass(frozen=True, kw_only=True)
class LikelihoodRatio(Result):
    """A comparison of a model with one that it contains.

    Attributes
    ----------
    chi2 : float
        Twice the difference of the log likelihoods.
    df : int
        How many parameters more the full model has.
    p : float
        Probability of a chi-square at least as large if the null model held.
    method : str
        ``REML`` or ``ML``.
    loglik_null, loglik_full, aic_null, aic_full, bic_null, bic_full : float
        Of the two models.
    """

    chi2: float
    df: int
    p: float
    method: str
    loglik_null: float
    loglik_full: float
    aic_null: float
    aic_full: float
    bic_null: float
    bic_full: float

    def apa(self) -> str:
        """Return for instance ``χ²(2) = 42.14, p < .001``."""
        return f"χ²({self.df}) = {wording.number(self.chi2)}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row each for the null and the full model; the test is in the latter's."""
        return pd.DataFrame(
            {
                "model": ["null", "full"],
                "loglik": [self.loglik_null, self.loglik_full],
                "aic": [self.aic_null, self.aic_full],
                "bic": [self.bic_null, self.bic_full],
                "chi2": [None, self.chi2],
                "df": [None, self.df],
                "p": [None, self.p],
            }
        )


def estimates_frame(estimates: tuple[Estimate, ...]) -> pd.DataFrame:
    """Return estimates as a table with a row each and their interval as two columns."""
    rows = []
    for one in estimates:
        row = dict(vars(one))
        row["ci_low"], row["ci_high"] = row.pop("ci")
        rows.append(row)
    order = ["name", "estimate", "se", "df", "t", "p", "p_holm", "ci_low", "ci_high"]
    table = pd.DataFrame(rows)
    return table[[column for column in order if column in table]]
