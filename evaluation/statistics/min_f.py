"""The smallest quasi-F: one test of conditions for other raters and other stimuli, from the tests by each."""

from dataclasses import dataclass

import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.repeated_measures import RepeatedMeasuresAnova
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class MinF(Result):
    """The quasi-F ratio min F'.

    Attributes
    ----------
    F : float
        The ratio.
    df1 : int
        Degrees of freedom of the conditions.
    df2 : float
        Approximate degrees of freedom of the error.
    p : float
        Probability of a ratio at least as large if the conditions did not differ.
    """

    F: float
    df1: int
    df2: float
    p: float

    def apa(self) -> str:
        """Return for instance ``min F'(2, 54.1) = 12.31, p < .001``."""
        ratio = f"min F′({self.df1}, {wording.number(self.df2, 1)}) = {wording.number(self.F)}"
        return f"{ratio}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the numbers as a frame of one row."""
        return pd.DataFrame({"F": [self.F], "df1": [self.df1], "df2": [self.df2], "p": [self.p]})


def min_f(by_rater: RepeatedMeasuresAnova, by_stimulus: RepeatedMeasuresAnova) -> MinF:
    """Return min F', F1 F2 / (F1 + F2), of the analyses of variance by rater (F1) and by stimulus (F2).

    Both raters and stimuli are samples for it. It never exceeds the quasi-F of the single ratings, and needs nothing
    but the two analyses.

    Parameters
    ----------
    by_rater, by_stimulus : RepeatedMeasuresAnova
        Analyses of the same conditions with raters, and with stimuli, as units.

    Returns
    -------
    MinF
        The ratio and its probability, by the F distribution with df2 = (F1 + F2)² / (F1² / m + F2² / n), where n and m
        are the degrees of freedom of the errors by rater and by stimulus. Sphericity is taken for granted.

    Raises
    ------
    DataError
        If the two analyses have different numbers of conditions.
    InsufficientDataError
        If the conditions do not differ at all in both, so that there is no ratio, or a ratio is infinite.

    References
    ----------
    Clark (1973), The language-as-fixed-effect fallacy, Journal of Verbal Learning and Verbal Behavior 12:335.
    """
    if by_rater.df_conditions != by_stimulus.df_conditions:
        raise DataError("The analyses by rater and by stimulus have different numbers of conditions.")
    first, second = by_rater.F, by_stimulus.F
    total = first + second
    if not 0 < total < float("inf"):
        raise InsufficientDataError("There is no min F′: F by rater and by stimulus are both 0, or one is infinite.")
    df1 = by_rater.df_conditions
    df2 = total**2 / (first**2 / by_stimulus.df_error + second**2 / by_rater.df_error)
    ratio = first * second / total
    return MinF(F=ratio, df1=df1, df2=df2, p=float(special.fdtrc(df1, df2, ratio)))
