"""The ratings behind one score, as a table and as a matrix of clips and raters."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from evaluation.instruments import ChoiceItem, Instrument, Item
from evaluation.instruments.mos import MOS5
from evaluation.report.analysis import StudyReport
from evaluation.responses import alike, asked_about_clips, numbers_of
from evaluation.statistics.arrays import FloatArray
from evaluation.study import Cell

ORDERED_ANSWERS = 11
"""Answers that a question has at most to be analysed as ordered categories."""


@dataclass(frozen=True, eq=False)
class ScoreTable:
    """The ratings of one score.

    Attributes
    ----------
    score : str
        Name of the score, for instance ``MOS`` or ``P``.
    table : pandas.DataFrame
        One row for each rating: participant, stimulus, condition, value.
    conditions : tuple of str
        The conditions with ratings, in the order of the study file.
    scale : tuple of float
        Ends of the scale.
    ordinal : bool
        Whether the score is the answer to one question with few ordered answers.
    opinion : bool
        Whether it is the mean opinion score of the five-point scale.
    slug : str
        The name as it stands in the names of tables and files, of its own among the scores of a report.
    """

    score: str
    table: pd.DataFrame
    conditions: tuple[str, ...]
    scale: tuple[float, float]
    ordinal: bool
    opinion: bool
    slug: str

    @cached_property
    def _coded(self) -> "_Coded":
        clips, cells = alike(self.table, ["stimulus", "condition"])
        raters, people = pd.factorize(self.table["participant"])
        width = len(people)
        place, values = clips * width + raters, self.table["value"].to_numpy(dtype=float)
        counts = np.bincount(place, minlength=len(cells) * width)
        sums = np.bincount(place, weights=values, minlength=len(cells) * width)
        matrix = np.full(len(counts), np.nan)
        np.divide(sums, counts, out=matrix, where=counts > 0)
        return _Coded(
            matrix.reshape(-1, width), [Cell(*cell) for cell in cells.itertuples(index=False, name=None)], list(people)
        )

    def of(self, condition: str) -> "ScoreTable":
        """Return the ratings of one condition."""
        own = self.table[self.table["condition"] == condition].reset_index(drop=True)
        found = replace(self, table=own, conditions=(condition,))
        rows = [place for place, cell in enumerate(self.clips) if cell.condition == condition]
        matrix = self.matrix[rows]
        rated = np.asarray(~np.isnan(matrix).all(axis=0))
        raters = [rater for rater, has in zip(self.raters, rated, strict=True) if has]
        # What is known of all conditions need not be found anew, which takes long for a million ratings.
        found.__dict__["_coded"] = _Coded(matrix[:, rated], [self.clips[row] for row in rows], raters)
        return found

    @property
    def matrix(self) -> FloatArray:
        """Ratings, shape (clips, raters); NaN where there is none, the mean where a rater rated a clip again."""
        return self._coded.matrix

    @property
    def clips(self) -> list[Cell]:
        """Stimulus and condition of each row of the matrix."""
        return self._coded.clips

    @property
    def raters(self) -> list[int | str]:
        """Participant of each column of the matrix."""
        return self._coded.raters


@dataclass(frozen=True, eq=False)
class _Coded:
    matrix: FloatArray
    clips: list[Cell]
    raters: list[int | str]


def score_tables(report: StudyReport) -> tuple[ScoreTable, ...]:
    """Return the scores of a study that have ratings, MOS first, then in the order of the instruments."""
    owners = {name: one for one in asked_about_clips(report.spec) for name in numbers_of(one)}
    found: list[ScoreTable] = []
    for name in sorted(owners, key=lambda name: name != "MOS"):
        if name not in report.scores:
            continue
        table = report.scores[["participant", "stimulus", "condition", name]].dropna(subset=[name])
        table = table.rename(columns={name: "value"}).reset_index(drop=True)
        if len(table):
            rated = set(table["condition"].unique())
            conditions = tuple(one for one in report.conditions if one in rated)
            scale, ordinal = _scale(owners[name], name)
            opinion = owners[name].name == MOS5.name
            slug = _slug(name, {one.slug for one in found})
            found.append(ScoreTable(name, table, conditions, scale, ordinal, opinion, slug))
    return tuple(found)


def _scale(instrument: Instrument, name: str) -> tuple[tuple[float, float], bool]:
    """Return the ends of a score's scale, and whether it is one question with few ordered answers."""
    items = {item.id: item for item in instrument.items}
    if not instrument.scores:
        item = items[name.removeprefix(f"{instrument.name}.")]
        return (min(item.values), max(item.values)), _few_ordered(item)
    score = next(one for one in instrument.scores if one.name == name)
    # A score is a weighted sum of its items, so its ends are where each item is at one of its own.
    ends = [sorted(weight * end(items[one].values) for end in (min, max)) for one, weight in score.weights.items()]
    low, high = (float((score.constant + sum(end[place] for end in ends)) / score.divisor) for place in (0, 1))
    return (low, high), len(score.weights) == 1 and _few_ordered(items[next(iter(score.weights))])


def _slug(name: str, taken: set[str]) -> str:
    plain = name.lower().replace(".", "_")
    slug, number = plain, 1
    while slug in taken:
        number += 1
        slug = f"{plain}_{number}"
    return slug


def _few_ordered(item: Item) -> bool:
    return len(item.values) <= ORDERED_ANSWERS and not isinstance(item, ChoiceItem)
