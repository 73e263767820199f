"""How good the questionnaire for pleasure, arousal and dominance is as a scale, in the answers at hand."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments.base import Score
from evaluation.instruments.pad12 import PAD12
from evaluation.statistics import wording
from evaluation.statistics.result import Result
from evaluation.statistics.scale_reliability.alpha import CronbachAlpha, cronbach_alpha
from evaluation.statistics.scale_reliability.factor_fit import Extraction
from evaluation.statistics.scale_reliability.omega import McdonaldOmega, mcdonald_omega
from evaluation.statistics.scale_reliability.one_factor import OneFactorCheck, one_factor_check

Unit = Literal["answer", "stimulus", "rater"]

_AROUSAL = (
    "Arousal is known to be the weak side of the abbreviated scale: Li et al. (2005) found the reliability of its "
    "Chinese version good for P, moderate for D and quite low for A. Read results about A with this in mind"
)
_UNITS = {
    "answer": "each rating of a clip is a row",
    "stimulus": "each row is the mean of a stimulus over its raters",
    "rater": "each row is the mean of a rater over the stimuli",
}


@dataclass(frozen=True, kw_only=True)
class DimensionQuality:
    """Quality of the items of one dimension.

    Attributes
    ----------
    dimension : str
        Its name.
    items : tuple of str
        Its items, those with negative weight marked by a minus sign.
    alpha : CronbachAlpha or None
        Cronbach's alpha with its interval, the item-total correlations and alpha without each item.
    omega : McdonaldOmega or None
        McDonald's omega.
    factor : OneFactorCheck or None
        Whether one factor is enough.
    flags : tuple of str
        What could not be computed and why, and what the three have to say.
    """

    dimension: str
    items: tuple[str, ...]
    alpha: CronbachAlpha | None
    omega: McdonaldOmega | None
    factor: OneFactorCheck | None
    flags: tuple[str, ...]

    def apa(self) -> str:
        """Return the sentences of what could be computed, or that nothing could."""
        known = [part for part in (self.alpha, self.omega, self.factor) if part is not None]
        return f"{self.dimension}: " + (" ".join(part.apa() for part in known) or "no reliability can be computed.")


@dataclass(frozen=True, kw_only=True)
class PadScaleQuality(Result):
    """Quality of the scale, dimension by dimension.

    Attributes
    ----------
    unit : str
        What a row is: an ``answer``, or the mean of a ``stimulus`` or of a ``rater``.
    rows, raters, stimuli : int or None
        Number of answers, and of raters and stimuli if their columns are known.
    dimensions : tuple of DimensionQuality
        The dimensions in the order of the scores.
    """

    unit: Unit
    rows: int
    raters: int | None
    stimuli: int | None
    dimensions: tuple[DimensionQuality, ...]

    def __getitem__(self, dimension: str) -> DimensionQuality:
        for found in self.dimensions:
            if found.dimension == dimension:
                return found
        names = ", ".join(found.dimension for found in self.dimensions)
        raise DataError(f"There is no dimension {dimension!r}; there are {names}.")

    def apa(self) -> str:
        """Return the alphas of all dimensions in one sentence."""
        parts = []
        for found in self.dimensions:
            if found.alpha is None:
                parts.append(f"none for {found.dimension}")
            else:
                interval = wording.interval(*found.alpha.ci, confidence=found.alpha.confidence, bounded=True)
                parts.append(f"{wording.share(found.alpha.alpha)}, {interval}, for {found.dimension}")
        return f"Cronbach's alpha ({_UNITS[self.unit]}) = {'; '.join(parts)}."

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each dimension; NaN where there is no value."""
        return pd.DataFrame([_row(found, self.unit) for found in self.dimensions])

    def item_frame(self) -> pd.DataFrame:
        """Return a row for each item of the dimensions that have an alpha; NaN where there is no loading."""
        parts = []
        for found in self.dimensions:
            if found.alpha is not None:
                frame = found.alpha.item_frame()
                loadings = found.omega.loadings if found.omega else (math.nan,) * len(frame)
                frame.insert(0, "dimension", found.dimension)
                parts.append(frame.assign(loading=loadings))
        columns = ["dimension", "item", "mean", "sd", "rest_r", "alpha_if_dropped", "loading"]
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=columns)


def pad_scale_quality(
    answers: pd.DataFrame,
    *,
    scores: Sequence[Score] = PAD12.scores,
    unit: Unit = "answer",
    rater: str | None = None,
    stimulus: str | None = None,
    extraction: Extraction = "ml",
    rng: np.random.Generator | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
) -> PadScaleQuality:
    """Return reliability, item statistics and a one-factor check of each dimension of the questionnaire.

    Parameters
    ----------
    answers : pandas.DataFrame
        One row for each rating of a clip, one numeric column for each item (``Q1`` ... ``Q12``, -4 to 4, as answered);
        NaN where an answer is missing. Items of negative weight are reversed here.
    scores : sequence of Score
        The dimensions: which items they are made of, with which weights; those of `pad12` (Eq. 13 of the paper) without
        it.
    unit : {"answer", "stimulus", "rater"}
        What a row of the analysis is: each answer; or the mean of each stimulus over its raters, which asks whether the
        items order the stimuli alike; or that of each rater over the stimuli.
    rater, stimulus : str, optional
        Columns that name them, needed for the unit of that name.
    extraction : {"ml", "minres"}
        Of the factor for omega, as `mcdonald_omega`.
    rng : numpy.random.Generator, optional
        Source of the bootstrap for omega's interval and of the parallel analysis; without it there are none.
    replicates : int
        Number of bootstrap samples, at least 100.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    PadScaleQuality
        The three dimensions. What cannot be computed is None, with the reason in the dimension's flags.

    Raises
    ------
    DataError
        If a column is missing, an answer is infinite or no number, or an option is wrong.
    InsufficientDataError
        If there are no answers.

    References
    ----------
    Scores: Jia et al. (2013), Multimedia Tools and Applications, Eq. 13. The scale: Li, Zhou, Song, Ran and Fu (2005),
    The Reliability and Validity of the Chinese Version of Abbreviated PAD Emotion Scales, ACII, 513-518. The rest as
    `cronbach_alpha`, `mcdonald_omega` and `one_factor_check`.
    """
    _check_columns(answers, scores, unit, {"rater": rater, "stimulus": stimulus})
    by = {"answer": None, "stimulus": stimulus, "rater": rater}[unit]
    dimensions = tuple(
        _dimension(
            *_keyed(answers, score, by),
            score.name,
            extraction=extraction,
            rng=rng,
            replicates=replicates,
            confidence=confidence,
        )
        for score in scores
    )
    raters, stimuli = (None if column is None else int(answers[column].nunique()) for column in (rater, stimulus))
    return PadScaleQuality(
        unit=unit,
        rows=len(answers),
        raters=raters,
        stimuli=stimuli,
        dimensions=dimensions,
        flags=(
            *_nesting(unit, raters, stimuli),
            *_arousal(dimensions, scores),
            *(flag for found in dimensions for flag in found.flags),
        ),
    )


def _check_columns(answers: pd.DataFrame, scores: Sequence[Score], unit: str, names: dict[str, str | None]) -> None:
    if unit not in _UNITS:
        raise DataError(f"unit is {unit!r}, but must be one of {', '.join(_UNITS)}.")
    if not scores:
        raise DataError("There are no scores, so that no dimension is known.")
    if unit != "answer" and names[unit] is None:
        raise DataError(f"To average by {unit}, the column that names the {unit} is needed: give {unit}=.")
    needed = [item for score in scores for item in score.weights]
    needed += [column for column in names.values() if column is not None]
    missing = [column for column in dict.fromkeys(needed) if column not in answers.columns]
    if missing:
        raise DataError(f"The frame has no column {', '.join(missing)}; it has {', '.join(map(str, answers.columns))}.")
    if answers.empty:
        raise InsufficientDataError("There are no answers, so that nothing can be said of the scale.")


def _keyed(answers: pd.DataFrame, score: Score, by: str | None) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return the answers times their weights, which turns all items the same way, averaged if asked for; and flags."""
    named = {item: f"{'-' if weight < 0 else ''}{item}" for item, weight in score.weights.items()}
    try:
        numbers = answers[list(named)].astype(float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{score.name}: the answers are not all numbers.") from error
    if np.isinf(numbers.to_numpy()).any():
        raise DataError(f"{score.name}: an answer is infinite; leave it out first.")
    keyed = (numbers * [float(weight) for weight in score.weights.values()]).rename(columns=named)
    if by is None:
        return keyed, ()
    # An incomplete set of answers would give the items of a mean different raters.
    complete = (keyed.notna().all(axis=1) & answers[by].notna()).to_numpy()
    means = keyed[complete].groupby(answers.loc[complete, by], sort=False, observed=True).mean()
    lost = int((~complete).sum())
    return means, (
        f"Left out of the means, lacking an answer or a name: {lost} of {len(answers)} rows.",
    ) if lost else ()


def _dimension(
    keyed: pd.DataFrame,
    about: tuple[str, ...],
    name: str,
    *,
    extraction: Extraction,
    rng: np.random.Generator | None,
    replicates: int,
    confidence: float,
) -> DimensionQuality:
    alpha, omega, factor = None, None, None
    flags = list(about)
    try:
        alpha = cronbach_alpha(keyed, confidence=confidence)
        flags += alpha.flags
        factor = one_factor_check(keyed, rng=rng)
        flags += factor.flags
        omega = mcdonald_omega(keyed, extraction=extraction, rng=rng, replicates=replicates, confidence=confidence)
        flags += omega.flags
    except InsufficientDataError as error:
        flags.append(str(error))
    return DimensionQuality(
        dimension=name,
        items=tuple(map(str, keyed.columns)),
        alpha=alpha,
        omega=omega,
        factor=factor,
        flags=tuple(dict.fromkeys(f"{name}: {flag}" for flag in flags)),
    )


def _nesting(unit: Unit, raters: int | None, stimuli: int | None) -> tuple[str, ...]:
    if unit == "stimulus":
        return (
            "Rows are means of stimuli over raters: they say how well the items agree about stimuli, not about single "
            "answers, and are more reliable than these.",
        )
    if unit == "rater":
        return ("Rows are means of raters over stimuli: they say how raters differ, not how stimuli do.",)
    counts = [f"{number} {what}" for number, what in ((raters, "raters"), (stimuli, "stimuli")) if number is not None]
    inside = f" ({' and '.join(counts)})" if counts else ""
    return (
        f"Rows are nested in raters and in stimuli{inside} and not independent: reliabilities mix differences between "
        "stimuli and between raters, and intervals and p values, which take rows as independent, are too narrow "
        "and too small.",
    )


def _arousal(dimensions: tuple[DimensionQuality, ...], scores: Sequence[Score]) -> tuple[str, ...]:
    if not any(score in PAD12.scores and score.name == "A" for score in scores):
        return ()
    alphas = {found.dimension: found.alpha.alpha for found in dimensions if found.alpha is not None}
    if "A" not in alphas:
        return (f"{_AROUSAL}; here it has no alpha.",)
    here = f"here its alpha is {wording.share(alphas['A'])}"
    if len(alphas) > 1:
        lowest = min(alphas, key=lambda name: alphas[name]) == "A"
        here = f"{here}, {'the lowest' if lowest else 'not the lowest'} of the {len(alphas)} dimensions"
    return (f"{_AROUSAL}; {here}.",)


def _row(found: DimensionQuality, unit: Unit) -> dict[str, object]:
    alpha, omega, factor = found.alpha, found.omega, found.factor
    fit = factor.fit if factor else None
    omega_low, omega_high = (omega.ci if omega else None) or (math.nan, math.nan)
    numbers = {
        "alpha": alpha.alpha if alpha else None,
        "alpha_low": alpha.ci[0] if alpha else None,
        "alpha_high": alpha.ci[1] if alpha else None,
        "standardized_alpha": alpha.standardized if alpha else None,
        "omega": omega.omega if omega else None,
        "omega_low": omega_low,
        "omega_high": omega_high,
        "chi2": fit.chi2 if fit else None,
        "df": fit.df if fit else None,
        "p": fit.p if fit else None,
        "rmsea": fit.rmsea if fit else None,
        "cfi": fit.cfi if fit else None,
        "tli": fit.tli if fit else None,
        "srmr": factor.srmr if factor else None,
        "explained": factor.explained if factor else None,
        "eigenvalue_ratio": factor.eigenvalue_ratio if factor else None,
    }
    return {
        "dimension": found.dimension,
        "items": " ".join(found.items),
        "unit": unit,
        "n": alpha.rows if alpha else 0,
        "extraction": omega.extraction if omega else "",
        **{name: math.nan if value is None else float(value) for name, value in numbers.items()},
    }
