"""The check whether odds are proportional: whether predictors act alike at all thresholds."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import special

from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.ordinal.data import Rows
from evaluation.statistics.ordinal.fit import FixedFit
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class ProportionalOdds(Result):
    """A test of proportional odds; a small p speaks against them.

    Attributes
    ----------
    method : str
        ``score`` or ``likelihood ratio``.
    chi2, df, p : float, int, float
        The test.
    """

    method: str
    chi2: float
    df: int
    p: float

    def apa(self) -> str:
        """Return for instance ``Proportional odds (score test): χ²(6) = 4.21, p = .648``."""
        test = f"χ²({self.df}) = {wording.number(self.chi2)}, {wording.p_value(self.p)}"
        return f"Proportional odds ({self.method} test): {test}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row."""
        return pd.DataFrame({"method": [self.method], "chi2": [self.chi2], "df": [self.df], "p": [self.p]})

    @property
    def warning(self) -> tuple[str, ...]:
        """A flag if the odds do not seem proportional at the level of .05."""
        if self.p >= 0.05:
            return ()
        return (f"The predictors do not act alike at all thresholds ({self.apa()}): odds ratios average over them.",)


def score_test(rows: Rows, fit: FixedFit) -> ProportionalOdds | None:
    """Return the score test against coefficients of their own at each threshold.

    Parameters
    ----------
    rows : Rows
        The data, with one set of thresholds.
    fit : FixedFit
        The model of proportional odds.

    Returns
    -------
    ProportionalOdds, or None
        With p (J - 2) degrees of freedom for p predictors and J categories; None if there is nothing to test.

    Notes
    -----
    The score is squared in the metric of Fisher's expected information. The test tends to reject too often if cells of
    predictors and categories are thinly filled (Brant, 1990, Biometrics 46:1171, has the same aim and this weakness).

    References
    ----------
    Peterson and Harrell (1990), Applied Statistics 39:205.
    """
    cuts, p = rows.cuts, rows.x.shape[1]
    if cuts < 2 or p == 0:
        return None
    eta = rows.x @ fit.coefficients
    above, below = rows.bounds(fit.thresholds, eta)
    # What each row adds to the slope in its two thresholds.
    total = cuts + 2
    gaps = np.concatenate([[np.inf], np.diff(fit.thresholds), [np.inf]])
    # Answers in the lowest and the highest category have no threshold on one side.
    answer = np.where(rows.upper < cuts, rows.upper, cuts)
    between = (np.exp(-gaps) / -np.expm1(-gaps))[answer]
    of_upper = rows.weight * (special.expit(-above) + between)
    of_lower = -rows.weight * (special.expit(below) + between)
    design = np.hstack([np.ones((len(eta), 1)), -rows.x])
    score = np.stack(
        [
            np.bincount(rows.upper, of_upper * column, total) + np.bincount(rows.lower, of_lower * column, total)
            for column in design.T
        ],
        axis=1,
    )[:cuts]
    information = _expected_information(rows, fit.thresholds, eta, design)
    solved, *_ = np.linalg.lstsq(information, score.ravel(), rcond=1e-12)
    chi2 = max(float(score.ravel() @ solved), 0.0)
    df = p * (cuts - 1)
    return ProportionalOdds(method="score", chi2=chi2, df=df, p=float(special.chdtrc(df, chi2)))


def _expected_information(rows: Rows, thresholds: FloatArray, eta: FloatArray, design: FloatArray) -> FloatArray:
    cuts, width = thresholds.size, design.shape[1]
    bounds = thresholds - eta[:, None]
    upper, lower = special.expit(-bounds), special.expit(bounds)
    density = upper * lower
    tops = np.hstack([lower, np.ones((len(eta), 1))])
    bottoms = np.hstack([np.ones((len(eta), 1)), upper])
    gaps = np.concatenate([[np.inf], np.diff(thresholds), [np.inf]])
    chance = np.maximum(tops * bottoms * -np.expm1(-gaps), np.finfo(float).tiny)
    information = np.zeros((cuts, width, cuts, width))
    for j in range(cuts):
        own = rows.weight * density[:, j] * (density[:, j] / chance[:, j] + density[:, j] / chance[:, j + 1])
        information[j, :, j] = (design.T * own) @ design
        if j + 1 < cuts:
            joint = -rows.weight * density[:, j] * (density[:, j + 1] / chance[:, j + 1])
            information[j, :, j + 1] = information[j + 1, :, j] = (design.T * joint) @ design
    return information.reshape(cuts * width, cuts * width)
