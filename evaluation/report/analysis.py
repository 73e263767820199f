"""The analysis of a study: what its answers say, and what they cannot say yet."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import numpy as np
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.report.notes import notes_on, people
from evaluation.report.ratings import (
    RepeatedScore,
    Unavailable,
    VotesOfCell,
    opinions_by,
    preference_scores,
    repeated_scores,
    votes_by_cell,
)
from evaluation.responses import (
    DIMENSIONS,
    INPUT_COLUMNS,
    KEY,
    RESPONSE_COLUMNS,
    alike,
    asked_about_clips,
    check_responses,
    complete,
    numbers_of,
    pad_instruments,
    score_trials,
    statistical,
)
from evaluation.screening import ScreeningReport
from evaluation.statistics.anova import OneWayAnova, one_way
from evaluation.statistics.bradley_terry import BradleyTerry
from evaluation.statistics.correlation import Correlation, pearson
from evaluation.statistics.opinion import OpinionScore, opinion_score, opinion_table
from evaluation.study import MAIN, Cell, StudySpec

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
    """What a study's answers say, or those of one of its parts.

    Attributes
    ----------
    spec : StudySpec
        The study.
    study : StudySpec
        The whole study, if the report is on a part of it.
    conditions : tuple of str
        The conditions that are shown, in the order of the study file.
    participants, trials : int
        How many participants gave an answer, and in how many trials.
    responses : int
        How many questionnaires were answered (one instrument about one clip of one trial).
    incomplete : int
        How many of these lack an item, and so have no score.
    answers : pandas.DataFrame
        One row for each answered item, checked, as `evaluation.responses.complete`.
    scores : pandas.DataFrame
        One row for each clip of each trial, as `evaluation.responses.score_trials`.
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
    scores_by_condition, scores_by_cell : pandas.DataFrame
        For each score but MOS, and each number that is in no score, in each condition (and stimulus): score, condition,
        n, mean, sd, ci_low, ci_high.
    votes : tuple of VotesOfCell
        How raters chose in each single choice about one clip.
    preferences : BradleyTerry, Unavailable or None
        Scores of the conditions from comparisons of two clips; None if there are none in the study.
    repeated : pandas.DataFrame or None
        One row for each score of each trial that was repeated, as `analyse` takes it.
    repeats : tuple of RepeatedScore
        How well raters agree with themselves in hidden repeats; empty if there are none.
    screening : ScreeningReport or None
        What became of the raters; None if the study screens nobody.
    used : StudyReport or None
        The same analysis with the raters whom screening leaves; None if it excludes nobody.
    notes : tuple of str
        What a reader has to know before using the numbers.
    """

    spec: StudySpec
    study: StudySpec
    conditions: tuple[str, ...]
    participants: int
    trials: int
    responses: int
    incomplete: int
    answers: pd.DataFrame
    scores: pd.DataFrame
    pad_by_stimulus: pd.DataFrame
    pad_by_cell: pd.DataFrame
    reverse_evaluation: tuple[ReverseEvaluation, ...]
    mos_by_condition: tuple[MosOfCondition, ...]
    mos_by_cell: pd.DataFrame
    mos_anova: OneWayAnova | Unavailable
    scores_by_condition: pd.DataFrame
    scores_by_cell: pd.DataFrame
    votes: tuple[VotesOfCell, ...]
    preferences: BradleyTerry | Unavailable | None
    repeated: pd.DataFrame | None
    repeats: tuple[RepeatedScore, ...]
    screening: ScreeningReport | None
    used: "StudyReport | None"
    notes: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Digest of the whole study's content."""
        return self.study.digest

    @property
    def part(self) -> str | None:
        """Name of the part; None if the study has no parts, or the report is on several."""
        names = [part.name for part in self.spec.all_parts]
        return names[0] if self.spec.parts is not None and len(names) == 1 and names != [MAIN] else None


def analyse(
    spec: StudySpec,
    responses: pd.DataFrame,
    *,
    preferences: pd.DataFrame | None = None,
    repeats: pd.DataFrame | None = None,
    screening: ScreeningReport | None = None,
) -> StudyReport:
    """Analyse what a study has collected.

    A study with parts is analysed part by part, each with its own answers: ``analyse(spec.only("exp1"), ...)``.

    Parameters
    ----------
    spec : StudySpec
        The study.
    responses : pandas.DataFrame
        One row for each answered item with the columns `RESPONSE_COLUMNS`, and those of `OPTIONAL_COLUMNS` if need be;
        it may be empty.
    preferences : pandas.DataFrame, optional
        One row for each comparison of two clips: participant, trial, condition_a, condition_b, and preferred, the name
        of either.
    repeats : pandas.DataFrame, optional
        One row for each score of each trial that was repeated: participant, score, first, second.
    screening : ScreeningReport, optional
        Which raters are used. If some are not, the report has all results once more without them.

    Returns
    -------
    StudyReport
        Results, and in their place a reason in words for those that cannot be computed yet.

    Raises
    ------
    DataError
        If `responses` does not fit the study (see `evaluation.responses.check_responses`), or `preferences` names
        conditions that the study does not show.

    References
    ----------
    Jia et al. (2013), section 5.2 with Table 8 (reverse evaluation) and section 5.4 with Table 10 (opinion scores).
    """
    table = complete(check_responses(spec, responses))
    scores = score_trials(spec, table)
    for column in (*DIMENSIONS, "MOS"):
        if column not in scores:
            scores[column] = float("nan")
    pad_by_stimulus = _mean_pad(scores, ["stimulus"], spec)
    pad_by_cell = _mean_pad(scores, ["stimulus", "condition"], spec)
    mos_by_cell = _in_study_order(opinion_table(scores, score="MOS", by=["stimulus", "condition"]), spec)
    shown = _rated_cells(spec)
    conditions = tuple(c.name for c in spec.conditions if c.name in {cell.condition for cell in shown})
    numbers = [name for one in asked_about_clips(spec) for name in numbers_of(one) if name != "MOS"]
    screened = screening if screening is not None and screening.findings else None
    return StudyReport(
        spec=spec,
        study=spec,
        conditions=conditions,
        participants=people(table, preferences),
        trials=_number_of_trials(table, preferences),
        responses=len(table.drop_duplicates([*KEY, "instrument"])),
        incomplete=_incomplete(spec, table),
        answers=table,
        scores=scores,
        pad_by_stimulus=pad_by_stimulus,
        pad_by_cell=pad_by_cell,
        reverse_evaluation=_reverse_evaluation(spec, conditions, pad_by_stimulus, pad_by_cell),
        mos_by_condition=tuple(_mos(spec, scores, condition) for condition in conditions),
        mos_by_cell=mos_by_cell,
        mos_anova=_mos_anova(spec, conditions, mos_by_cell),
        scores_by_condition=_in_study_order(opinions_by(scores, numbers, ["condition"]), spec, first=numbers),
        scores_by_cell=_in_study_order(opinions_by(scores, numbers, ["stimulus", "condition"]), spec, first=numbers),
        votes=votes_by_cell(spec, table, shown),
        preferences=preference_scores(preferences, conditions) if _compares(spec) else None,
        repeated=repeats,
        repeats=repeated_scores(repeats),
        screening=screened,
        used=_with_used(spec, table, preferences, repeats, screened),
        notes=notes_on(spec, table, preferences, len(shown), {"PAD": pad_by_cell, "MOS": mos_by_cell}),
    )


def _rated_cells(spec: StudySpec) -> tuple[Cell, ...]:
    """Return what counting trials show; training and gold clips may be others."""
    rated = {cell for part in spec.all_parts for cell in spec.cells(part.name)}
    return tuple(cell for cell in spec.cells() if cell in rated)


def _number_of_trials(table: pd.DataFrame, preferences: pd.DataFrame | None) -> int:
    page = ["participant", "trial"]
    frames = [table[page]] if preferences is None else [table[page], preferences[page]]
    return len(pd.concat(frames).drop_duplicates())


def _compares(spec: StudySpec) -> bool:
    return "paired" in spec.instrument_names


def _with_used(
    spec: StudySpec,
    table: pd.DataFrame,
    preferences: pd.DataFrame | None,
    repeats: pd.DataFrame | None,
    screening: ScreeningReport | None,
) -> StudyReport | None:
    if screening is None or len(screening.used) == len(screening.raters):
        return None
    excluded = {rater.participant for rater in screening.raters if not rater.used}

    def left(frame: pd.DataFrame | None) -> pd.DataFrame | None:
        return None if frame is None else frame[~frame["participant"].isin(excluded)]

    rest = table[~table["participant"].isin(excluded)]
    return analyse(spec, rest, preferences=left(preferences), repeats=left(repeats))


def _mean_pad(scores: pd.DataFrame, by: list[str], spec: StudySpec) -> pd.DataFrame:
    rated = scores.dropna(subset=list(DIMENSIONS))
    groups = rated.groupby(by, sort=False)
    means = groups[[*INPUT_COLUMNS, *DIMENSIONS]].mean()
    means.insert(0, "n", groups.size())
    return _in_study_order(means.reset_index(), spec)


def _in_study_order(frame: pd.DataFrame, spec: StudySpec, *, first: Sequence[str] = ()) -> pd.DataFrame:
    ranks = {
        "score": {name: place for place, name in enumerate(first)},
        "stimulus": {stimulus.id: place for place, stimulus in enumerate(spec.stimuli)},
        "condition": {condition.name: place for place, condition in enumerate(spec.conditions)},
    }
    by = [column for column in ranks if column in frame]
    return frame.sort_values(by, key=lambda column: column.map(ranks[str(column.name)]), ignore_index=True)


def _reverse_evaluation(
    spec: StudySpec, conditions: Sequence[str], pad_by_stimulus: pd.DataFrame, pad_by_cell: pd.DataFrame
) -> tuple[ReverseEvaluation, ...]:
    parts: list[tuple[str | None, pd.DataFrame]] = [(None, pad_by_stimulus)]
    if len(conditions) > 1:
        parts += [(condition, pad_by_cell[pad_by_cell["condition"] == condition]) for condition in conditions]
    return tuple(
        ReverseEvaluation(dimension=dimension, condition=condition, result=_correlate(spec, frame, dimension))
        for condition, frame in parts
        for dimension in DIMENSIONS
    )


def _correlate(spec: StudySpec, means: pd.DataFrame, dimension: str) -> Correlation | Unavailable:
    names = pad_instruments(spec)
    if not names:
        return Unavailable("This study does not ask pad12, pad5 or sam, so there is no evaluated PAD.")
    if means.empty:
        return Unavailable(f"No face has been rated with {' or '.join(names)} yet.")
    known = means.dropna(subset=[f"input_{dimension}"])
    if known.empty:
        return Unavailable("The clips name no input PAD to compare with.")
    return _or_reason(lambda: pearson(known[f"input_{dimension}"].to_numpy(), known[dimension].to_numpy()))


def _mos(spec: StudySpec, scores: pd.DataFrame, condition: str) -> MosOfCondition:
    ratings = scores.loc[scores["condition"] == condition, "MOS"].dropna()
    result: OpinionScore | Unavailable
    if "mos5" not in spec.instrument_names:
        result = Unavailable("This study does not ask mos5, so there is no opinion score.")
    elif ratings.empty:
        result = Unavailable("No clip of this condition has been rated with mos5 yet.")
    else:
        result = opinion_score(ratings.to_numpy())
    return MosOfCondition(condition=condition, result=result)


def _mos_anova(spec: StudySpec, conditions: Sequence[str], mos_by_cell: pd.DataFrame) -> OneWayAnova | Unavailable:
    if "mos5" not in spec.instrument_names:
        return Unavailable("This study does not ask mos5, so there is no opinion score.")
    if len(conditions) < 2:
        return Unavailable("The study has one condition, so there is nothing to compare.")
    if mos_by_cell.empty:
        return Unavailable("No clip has been rated with mos5 yet.")
    means = mos_by_cell["mean"]
    groups = {name: means[mos_by_cell["condition"] == name].to_numpy() for name in conditions}
    return _or_reason(lambda: one_way(groups))


def _or_reason(compute: Callable[[], T]) -> T | Unavailable:
    try:
        return compute()
    except InsufficientDataError as error:
        return Unavailable(str(error))


def _incomplete(spec: StudySpec, table: pd.DataFrame) -> int:
    needed = {
        (one.name, item.id): sum(other.required for other in statistical(one))
        for one in asked_about_clips(spec)
        for item in statistical(one)
        if item.required
    }
    which, asked = alike(table, ["instrument", "item"])
    numbers = np.array([needed.get(key, np.nan) for key in asked.itertuples(index=False, name=None)], dtype=float)
    expected = pd.Series(numbers[which] if len(table) else numbers, index=table.index, dtype=float)
    answered = expected.dropna().groupby([table[column] for column in (*KEY, "instrument")]).agg(["size", "first"])
    return int((answered["size"] < answered["first"]).sum())
