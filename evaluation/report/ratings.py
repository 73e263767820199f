"""Results beside PAD and opinion scores: any score of each condition, votes, preferences and hidden repeats."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments import ChoiceItem
from evaluation.report.section import label
from evaluation.responses import asked_about_clips, statistical
from evaluation.statistics.bradley_terry import BradleyTerry, bradley_terry
from evaluation.statistics.correlation import Correlation, pearson
from evaluation.statistics.opinion import opinion_table
from evaluation.statistics.votes import Votes, votes
from evaluation.study import Cell, StudySpec

_PRIOR = 0.5


@dataclass(frozen=True)
class Unavailable:
    """A result that cannot be computed from what there is, and why."""

    reason: str

    def summary(self) -> str:
        """Return the reason."""
        return self.reason


@dataclass(frozen=True, kw_only=True)
class VotesOfCell:
    """How raters chose for one stimulus in one condition; `question` is ``instrument.item``."""

    question: str
    stimulus: str
    condition: str
    votes: Votes


@dataclass(frozen=True, kw_only=True)
class RepeatedScore:
    """How well raters agree with themselves.

    Attributes
    ----------
    score : str
        Name of the score.
    n : int
        Number of trials that came a second time.
    mean_difference : float
        Mean of the differences without sign, in the units of the score.
    result : Correlation or Unavailable
        Pearson's r of first and second time.
    """

    score: str
    n: int
    mean_difference: float
    result: Correlation | Unavailable


def opinions_by(scores: pd.DataFrame, names: Sequence[str], by: Sequence[str]) -> pd.DataFrame:
    """Return number, mean, standard deviation and Student's interval of scores, in each group of rows.

    Parameters
    ----------
    scores : pandas.DataFrame
        As `evaluation.responses.score_trials`.
    names : sequence of str
        The scores.
    by : sequence of str
        Columns that make the groups.

    Returns
    -------
    pandas.DataFrame
        The columns score, those of `by`, n, mean, sd, ci_low and ci_high; a row for each group with a score.
    """
    tables = [opinion_table(scores, score=name, by=by) for name in names]
    for name, table in zip(names, tables, strict=True):
        table.insert(0, "score", name)
    filled = [table for table in tables if len(table)]
    if filled:
        return pd.concat(filled, ignore_index=True)
    return pd.DataFrame(columns=["score", *by, "n", "mean", "sd", "ci_low", "ci_high"])


def votes_by_cell(spec: StudySpec, responses: pd.DataFrame, cells: Sequence[Cell]) -> tuple[VotesOfCell, ...]:
    """Return the votes in each single choice about one clip.

    Parameters
    ----------
    spec : StudySpec
        The study.
    responses : pandas.DataFrame
        As `evaluation.responses.complete` returns them.
    cells : sequence of Cell
        The cells in the order of the result.

    Returns
    -------
    tuple of VotesOfCell
        One for each item and cell with a vote.
    """
    found = []
    for instrument in asked_about_clips(spec):
        for item in statistical(instrument):
            if not isinstance(item, ChoiceItem):
                continue
            own = responses[(responses["instrument"] == instrument.name) & (responses["item"] == item.id)]
            by_cell: dict[Cell, list[int]] = {}
            for stimulus, condition, value in own[["stimulus", "condition", "keyed"]].itertuples(index=False):
                by_cell.setdefault(Cell(stimulus, condition), []).append(int(value))
            found += [
                VotesOfCell(
                    question=f"{instrument.name}.{item.id}",
                    stimulus=cell.stimulus,
                    condition=cell.condition,
                    votes=votes(_labels(item), by_cell[cell]),
                )
                for cell in cells
                if cell in by_cell
            ]
    return tuple(found)


def preference_scores(preferences: pd.DataFrame | None, conditions: Sequence[str]) -> BradleyTerry | Unavailable:
    """Return Bradley-Terry scores of the conditions, or why there are none.

    If a condition always wins, or always loses, half a preference is added in each direction of each pair, which the
    result says: otherwise it would have no score.

    Parameters
    ----------
    preferences : pandas.DataFrame or None
        One row for each comparison: condition_a, condition_b, and preferred, which is either.
    conditions : sequence of str
        The conditions, in their order.

    Raises
    ------
    DataError
        If a row prefers neither of its conditions, or names others than `conditions`.
    """
    if preferences is None or preferences.empty:
        return Unavailable("No clips have been compared yet.")
    first, second = preferences["condition_a"], preferences["condition_b"]
    preferred = preferences["preferred"]
    if not ((preferred == first) | (preferred == second)).all():
        raise DataError("A preference must be for one of the two conditions that were compared.")
    other = first.where(preferred == second, second)
    for prior in (0.0, _PRIOR) if _all_linked(first.tolist(), second.tolist(), conditions) else (0.0,):
        try:
            return bradley_terry(preferred.tolist(), other.tolist(), names=list(conditions), prior=prior)
        except InsufficientDataError as error:
            reason = str(error)
    return Unavailable(reason)


def _all_linked(first: Sequence[str], second: Sequence[str], conditions: Sequence[str]) -> bool:
    """Tell whether comparisons lead from each condition to all others, so that there is one scale."""
    linked = {first[0]}
    for _ in conditions:
        linked |= {name for pair in zip(first, second, strict=True) if linked & set(pair) for name in pair}
    return linked >= set(conditions)


def repeated_scores(repeats: pd.DataFrame | None) -> tuple[RepeatedScore, ...]:
    """Return how well raters agree with themselves, for each score of trials that came twice.

    Parameters
    ----------
    repeats : pandas.DataFrame or None
        One row for each score of each such trial: score, first, second.
    """
    if repeats is None:
        return ()
    known = repeats.dropna(subset=["first", "second"])
    found = []
    for score, rows in known.groupby("score", sort=False):
        first, second = rows["first"].to_numpy(dtype=float), rows["second"].to_numpy(dtype=float)
        result: Correlation | Unavailable
        try:
            result = pearson(first, second)
        except InsufficientDataError as error:
            result = Unavailable(str(error))
        difference = float(np.abs(first - second).mean())
        found.append(RepeatedScore(score=str(score), n=len(rows), mean_difference=difference, result=result))
    return tuple(found)


def _labels(item: ChoiceItem) -> dict[int, str]:
    names = {option.value: label(option.label) for option in item.options}
    if len(set(names.values())) == len(names):
        return names
    return {value: f"{name} ({value})" for value, name in names.items()}
