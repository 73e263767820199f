"""The analysis of a study: what its answers say, and what they cannot say yet."""

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import pandas as pd

from evaluation import instruments
from evaluation.errors import InsufficientDataError
from evaluation.responses import DIMENSIONS, INPUT_COLUMNS, RESPONSE_COLUMNS, check_responses, score_trials
from evaluation.statistics.anova import OneWayAnova, one_way
from evaluation.statistics.correlation import Correlation, pearson
from evaluation.statistics.opinion import OpinionScore, opinion_score, opinion_table
from evaluation.study import StudySpec

__all__ = [
    "ANOVA_UNIT",
    "MOS_UNIT",
    "PUBLISHED_R",
    "RESPONSE_COLUMNS",
    "MosOfCondition",
    "ReverseEvaluation",
    "StudyReport",
    "Unavailable",
    "analyse",
]

PUBLISHED_R = MappingProxyType({"P": 0.873, "A": 0.569, "D": 0.624})
"""Correlation of input and evaluated PAD over 14 faces in Jia et al. (2013), section 5.2 and Table 8."""

ANOVA_UNIT = (
    "The unit is the stimulus: each value is the mean opinion score of one stimulus in one condition over its raters, "
    "as in Jia et al. (2013), Table 10. The test treats the conditions as independent groups although they share "
    "stimuli and raters."
)
MOS_UNIT = (
    "Mean over all ratings of the condition. The interval is Student's and takes the ratings as independent, although "
    "each participant gives several."
)

T = TypeVar("T")


@dataclass(frozen=True)
class Unavailable:
    """A result that cannot be computed from what there is, and why."""

    reason: str

    def summary(self) -> str:
        """Return the reason."""
        return self.reason


@dataclass(frozen=True, kw_only=True)
class ReverseEvaluation:
    """Input against evaluated PAD over the stimuli; `condition` is None for the ratings of all conditions together."""

    dimension: str
    condition: str | None
    result: Correlation | Unavailable

    @property
    def published(self) -> float:
        """Return the correlation that Jia et al. (2013) found."""
        return PUBLISHED_R[self.dimension]


@dataclass(frozen=True, kw_only=True)
class MosOfCondition:
    """Mean opinion score of all ratings in a condition."""

    condition: str
    result: OpinionScore | Unavailable


@dataclass(frozen=True, kw_only=True, eq=False)
class StudyReport:
    """What a study's answers say.

    Attributes
    ----------
    spec : StudySpec
        The study.
    participants, trials : int
        How many participants gave an answer, and in how many trials.
    responses : int
        How many questionnaires were answered (one instrument in one trial).
    incomplete : int
        How many of these lack an item, and so have no score.
    scores : pandas.DataFrame
        One row for each trial, as `evaluation.responses.score_trials`.
    pad_by_stimulus : pandas.DataFrame
        For each stimulus over all conditions: n, input_P, input_A, input_D, and the means P, A, D.
    pad_by_cell : pandas.DataFrame
        The same for each stimulus in each condition.
    reverse_evaluation : tuple of ReverseEvaluation
        Pearson's r of input and evaluated PAD over the stimuli: all conditions together, then each.
    mos_by_condition : tuple of MosOfCondition
        In the order of the study file.
    mos_by_cell : pandas.DataFrame
        For each stimulus in each condition: n, mean, sd, ci_low, ci_high.
    mos_anova : OneWayAnova or Unavailable
        Comparison of the conditions; see `ANOVA_UNIT`.
    notes : tuple of str
        What a reader has to know before using the numbers.
    """

    spec: StudySpec
    participants: int
    trials: int
    responses: int
    incomplete: int
    scores: pd.DataFrame
    pad_by_stimulus: pd.DataFrame
    pad_by_cell: pd.DataFrame
    reverse_evaluation: tuple[ReverseEvaluation, ...]
    mos_by_condition: tuple[MosOfCondition, ...]
    mos_by_cell: pd.DataFrame
    mos_anova: OneWayAnova | Unavailable
    notes: tuple[str, ...]


def analyse(spec: StudySpec, responses: pd.DataFrame) -> StudyReport:
    """Analyse what a study has collected.

    Parameters
    ----------
    spec : StudySpec
        The study.
    responses : pandas.DataFrame
        One row for each answered item with the columns `RESPONSE_COLUMNS`; it may be empty.

    Returns
    -------
    StudyReport
        Results, and in their place a reason in words for those that cannot be computed yet.

    Raises
    ------
    DataError
        If `responses` does not fit the study; see `evaluation.responses.check_responses`.

    References
    ----------
    Jia et al. (2013), section 5.2 with Table 8 (reverse evaluation) and section 5.4 with Table 10 (opinion scores).
    """
    table = check_responses(spec, responses)
    scores = score_trials(spec, table)
    for column in (*DIMENSIONS, "MOS"):
        if column not in scores:
            scores[column] = float("nan")
    pad_by_stimulus = _mean_pad(scores, ["stimulus"], spec)
    pad_by_cell = _mean_pad(scores, ["stimulus", "condition"], spec)
    mos_by_cell = _in_study_order(opinion_table(scores, score="MOS", by=["stimulus", "condition"]), spec)
    answered = table.groupby(["participant", "trial", "instrument"])["item"].size()
    return StudyReport(
        spec=spec,
        participants=int(table["participant"].nunique()),
        trials=len(scores),
        responses=len(answered),
        incomplete=_incomplete(spec, answered),
        scores=scores,
        pad_by_stimulus=pad_by_stimulus,
        pad_by_cell=pad_by_cell,
        reverse_evaluation=_reverse_evaluation(spec, pad_by_stimulus, pad_by_cell),
        mos_by_condition=tuple(_mos(spec, scores, condition.name) for condition in spec.conditions),
        mos_by_cell=mos_by_cell,
        mos_anova=_mos_anova(spec, mos_by_cell),
        notes=_notes(spec, table, pad_by_cell, mos_by_cell),
    )


def _mean_pad(scores: pd.DataFrame, by: list[str], spec: StudySpec) -> pd.DataFrame:
    rated = scores.dropna(subset=list(DIMENSIONS))
    groups = rated.groupby(by, sort=False)
    means = groups[[*INPUT_COLUMNS, *DIMENSIONS]].mean()
    means.insert(0, "n", groups.size())
    return _in_study_order(means.reset_index(), spec)


def _in_study_order(frame: pd.DataFrame, spec: StudySpec) -> pd.DataFrame:
    ranks = {
        "stimulus": {stimulus.id: place for place, stimulus in enumerate(spec.stimuli)},
        "condition": {condition.name: place for place, condition in enumerate(spec.conditions)},
    }
    by = [column for column in ranks if column in frame]
    return frame.sort_values(by, key=lambda column: column.map(ranks[str(column.name)]), ignore_index=True)


def _reverse_evaluation(
    spec: StudySpec, pad_by_stimulus: pd.DataFrame, pad_by_cell: pd.DataFrame
) -> tuple[ReverseEvaluation, ...]:
    parts: list[tuple[str | None, pd.DataFrame]] = [(None, pad_by_stimulus)]
    if len(spec.conditions) > 1:
        parts += [
            (condition.name, pad_by_cell[pad_by_cell["condition"] == condition.name]) for condition in spec.conditions
        ]
    return tuple(
        ReverseEvaluation(dimension=dimension, condition=condition, result=_correlate(spec, frame, dimension))
        for condition, frame in parts
        for dimension in DIMENSIONS
    )


def _correlate(spec: StudySpec, means: pd.DataFrame, dimension: str) -> Correlation | Unavailable:
    if "pad12" not in spec.instruments:
        return Unavailable("This study does not ask pad12, so there is no evaluated PAD.")
    if means.empty:
        return Unavailable("No face has been rated with pad12 yet.")
    known = means.dropna(subset=[f"input_{dimension}"])
    if known.empty:
        return Unavailable("The clips name no input PAD to compare with.")
    return _or_reason(lambda: pearson(known[f"input_{dimension}"].to_numpy(), known[dimension].to_numpy()))


def _mos(spec: StudySpec, scores: pd.DataFrame, condition: str) -> MosOfCondition:
    ratings = scores.loc[scores["condition"] == condition, "MOS"].dropna()
    result: OpinionScore | Unavailable
    if "mos5" not in spec.instruments:
        result = Unavailable("This study does not ask mos5, so there is no opinion score.")
    elif ratings.empty:
        result = Unavailable("No clip of this condition has been rated with mos5 yet.")
    else:
        result = opinion_score(ratings.to_numpy())
    return MosOfCondition(condition=condition, result=result)


def _mos_anova(spec: StudySpec, mos_by_cell: pd.DataFrame) -> OneWayAnova | Unavailable:
    if "mos5" not in spec.instruments:
        return Unavailable("This study does not ask mos5, so there is no opinion score.")
    if len(spec.conditions) < 2:
        return Unavailable("The study has one condition, so there is nothing to compare.")
    if mos_by_cell.empty:
        return Unavailable("No clip has been rated with mos5 yet.")
    means = mos_by_cell["mean"]
    groups = {
        condition.name: means[mos_by_cell["condition"] == condition.name].to_numpy() for condition in spec.conditions
    }
    return _or_reason(lambda: one_way(groups))


def _or_reason(compute: Callable[[], T]) -> T | Unavailable:
    try:
        return compute()
    except InsufficientDataError as error:
        return Unavailable(str(error))


def _incomplete(spec: StudySpec, answered: pd.Series) -> int:
    items = {name: len(instruments.get(name).items) for name in spec.instruments}
    names = answered.index.get_level_values("instrument")
    return int((answered.to_numpy() < names.map(items).to_numpy()).sum())


def _notes(
    spec: StudySpec, table: pd.DataFrame, pad_by_cell: pd.DataFrame, mos_by_cell: pd.DataFrame
) -> tuple[str, ...]:
    if table.empty:
        return ("There are no answers yet.",)
    notes = []
    if table["participant"].nunique() == 1:
        notes.append("All answers come from one participant; they say nothing about how people differ.")
    for name, frame in (("pad12", pad_by_cell), ("mos5", mos_by_cell)):
        open_cells = len(spec.cells()) - len(frame)
        if name in spec.instruments and open_cells:
            notes.append(f"{open_cells} of {len(spec.cells())} clips have not been rated with {name} yet.")
    return tuple(notes)
