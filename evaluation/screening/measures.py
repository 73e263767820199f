"""What each rule measures of each rater."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.screening.data import Participant, ScreeningData, ordered
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.rater_model import (
    RaterModel,
    deviations,
    leave_one_out_correlation,
    range_counts,
    rater_model,
)
from evaluation.statistics.wording import number, share

LEAST = 3
"""Fewer trials, common clips or raters than these are too few for a spread, a line or a correlation."""

BT500_RATERS = 6
"""Among fewer raters no score can be 2 standard deviations from the mean."""

BT500_ASYMMETRY = 0.3
"""Raters whose outlying scores lie mostly on one side, by this or more, are not rejected (ITU-R BT.500)."""

_ROUNDING = 1e-9
_FEW = "fewer than 3 raters who share at least 3 clips"


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """One measure of one rater.

    Attributes
    ----------
    participant : str or int
        The rater.
    value : float or None
        What the rule compares with its limit; None if it cannot be told.
    text : str
        The same in words, or why it cannot be told.
    score : str or None
        The score that it is about.
    spared : bool
        Whether the rule does not apply although its limit is passed; `text` says why.
    """

    participant: Participant
    value: float | None
    text: str
    score: str | None = None
    spared: bool = False


class _Ratings(NamedTuple):
    """One score: a row for each cell (stimulus in a condition), a column for each rater."""

    score: str
    raters: Sequence[Participant]
    table: FloatArray


class Measures:
    """The measures of all rules: each method is named as its rule and yields what it measures, score by score."""

    def __init__(self, data: ScreeningData) -> None:
        self._data = data

    def gold(self) -> Iterator[Measure]:
        """Yield the shares of gold clips that were answered as known."""
        return self._checks("gold", "gold clips answered as known")

    def instructed(self) -> Iterator[Measure]:
        """Yield the shares of instructed answers that were right."""
        return self._checks("instructed", "instructed answers right")

    def watched(self) -> Iterator[Measure]:
        """Yield the mean over trials of the share of a clip that was played, each trial counting alike."""
        known = self._data.timing.dropna(subset=["share"])
        for participant, (count, mean) in _by_rater(known, "share", ["count", "mean"]):
            text = f"{100 * mean:.0f} % of a clip played on average, {_of(count, 'trial')}"
            yield Measure(participant=participant, value=mean, text=text)

    def seconds(self) -> Iterator[Measure]:
        """Yield the medians of the seconds that a trial took."""
        known = self._data.timing.dropna(subset=["seconds"])
        for participant, (count, median) in _by_rater(known, "seconds", ["count", "median"]):
            text = f"median of {number(median)} s for a trial, {_of(count, 'trial')}"
            yield Measure(participant=participant, value=median, text=text)

    def straight_lining(self) -> Iterator[Measure]:
        """Yield the shares of trials in which one instrument or another got the same answer throughout.

        An instrument is looked at if at least three of its items share one range, and three of those were answered; if
        it has several such sets of items, each of them must be a straight line.
        """
        ranges = self._data.ranges.drop_duplicates(["instrument", "item"])
        alike = ranges.groupby(["instrument", "low", "high"])["item"].transform("size")
        answers = self._data.answers.dropna(subset=["value"]).merge(ranges[alike >= LEAST], on=["instrument", "item"])
        trial = ["participant", "trial"]
        sets = answers.groupby([*trial, "instrument", "low", "high"])["value"].agg(["count", "nunique"]).reset_index()
        sets = sets[sets["count"] >= LEAST].assign(straight=lambda table: table["nunique"] == 1)
        lines = sets.groupby([*trial, "instrument"])["straight"].all().groupby(trial).any().rename("straight")
        for participant, (count, lined) in _by_rater(lines.reset_index(), "straight", ["count", "sum"]):
            if count < LEAST:
                yield _unknown(participant, f"{_of(count, 'trial')} with three items or more of one range")
            else:
                text = f"{int(lined)} of {int(count)} trials answered with the same answer throughout"
                yield Measure(participant=participant, value=lined / count, text=text)

    def variance(self) -> Iterator[Measure]:
        """Yield the variances (n - 1) of each rater's scores over the trials."""
        known = self._data.scores.dropna(subset=["value"])
        for score, rows in known.groupby("score", sort=True):
            for participant, (count, variance) in _by_rater(rows, "value", ["count", "var"]):
                if count < LEAST:
                    yield _unknown(participant, _of(count, "rating"), str(score))
                else:
                    text = f"variance {number(variance)} of {_of(count, 'rating')}"
                    yield Measure(participant=participant, value=variance, text=text, score=str(score))

    def z_score(self) -> Iterator[Measure]:
        """Yield how many standard deviations (n) a rater's mean is from that of all raters.

        The mean is that of the differences from the clips' means, so that it does not depend on which clips a rater
        got; where all rated the same clips that is no difference. Naderi and Cutler's program for ITU-T P.808 (2020)
        applies the same limit to single votes, also with n, and drops those. Among n raters no |z| exceeds
        the root of n - 1: with 11 raters or fewer nobody can reach 3.29.
        """
        for score, raters, table in self._ratings:
            means = deviations(table)
            known = ~np.isnan(means)
            enough = int(known.sum()) >= LEAST
            spread = float(means[known].std()) if enough else 0.0
            exact = spread <= _ROUNDING * float(np.nanmax(np.abs(table), initial=0))
            for rater, mean in zip(raters, means, strict=True):
                if not enough or np.isnan(mean):
                    yield _unknown(rater, "fewer than 3 raters with clips in common", score)
                else:
                    z = 0.0 if exact else float((mean - means[known].mean()) / spread)
                    yield Measure(participant=rater, value=z, text=f"mean at z = {number(z)} among raters", score=score)

    def kurtosis(self) -> Iterator[Measure]:
        """Yield the shares of scores out of the range of the clip's scores (ITU-R BT.500-14, A1-2.3.1).

        Raters are spared if |P - Q| / (P + Q) is 0.3 or more: most of what is out of range lies on one side.
        """
        for score, raters, table in self._ratings:
            counts = range_counts(table)
            given = ~np.isnan(table)
            panels = np.where(given, given.sum(axis=1, keepdims=True), 0).max(axis=0, initial=0)
            for place, rater in enumerate(raters):
                if panels[place] < BT500_RATERS:
                    yield _unknown(rater, f"fewer than {BT500_RATERS} raters of each clip", score)
                    continue
                out, total = int(counts.above[place] + counts.below[place]), int(counts.presentations[place])
                spared = out > 0 and bool(counts.asymmetry[place] >= BT500_ASYMMETRY * (1 - _ROUNDING))
                text = (
                    f"{out} of {total} scores out of range ({counts.above[place]} above, {counts.below[place]} below)"
                )
                if spared:
                    text = f"{text}, most on one side"
                value = float(counts.share[place])
                yield Measure(participant=rater, value=value, text=text, score=score, spared=spared)

    def bias(self) -> Iterator[Measure]:
        """Yield the biases of `evaluation.statistics.rater_model`."""
        for score, rater, bias, _, _ in self._modelled():
            if bias is None:
                yield _unknown(rater, _FEW, score)
            else:
                text = f"bias {bias:+.2f} against the other raters"
                yield Measure(participant=rater, value=bias, text=text, score=score)

    def inconsistency(self) -> Iterator[Measure]:
        """Yield the inconsistencies of `evaluation.statistics.rater_model`."""
        for score, rater, _, inconsistency, collapsed in self._modelled():
            if inconsistency is None:
                yield _unknown(rater, _FEW, score)
            elif collapsed:
                yield _unknown(rater, "so few raters that the model takes one of them for the truth", score)
            else:
                text = f"inconsistency {number(inconsistency)}"
                yield Measure(participant=rater, value=inconsistency, text=text, score=score)

    def correlation(self) -> Iterator[Measure]:
        """Yield each rater's correlation with the mean of the others."""
        for score, raters, table in self._ratings:
            for rater, r in zip(raters, leave_one_out_correlation(table), strict=True):
                if np.isnan(r):
                    yield _unknown(
                        rater, "fewer than 3 clips in common with others, or ratings that do not vary", score
                    )
                else:
                    text = f"r = {share(float(r))} with the mean of the others"
                    yield Measure(participant=rater, value=float(r), text=text, score=score)

    def repeats(self) -> Iterator[Measure]:
        """Yield the mean differences, without sign, between trials and their hidden repeats."""
        known = self._data.repeats.dropna(subset=["first", "second"])
        known = known.assign(difference=(known["first"] - known["second"]).abs())
        for score, rows in known.groupby("score", sort=True):
            for participant, (count, mean) in _by_rater(rows, "difference", ["count", "mean"]):
                text = f"mean difference {number(mean)} from hidden repeats, {_of(count, 'trial')}"
                yield Measure(participant=participant, value=mean, text=text, score=str(score))

    @cached_property
    def _ratings(self) -> tuple[_Ratings, ...]:
        """The scores as tables; where a rater rated a clip more than once, the mean."""
        known = self._data.scores.dropna(subset=["value"])
        return tuple(_table(str(score), rows) for score, rows in known.groupby("score", sort=True))

    @cached_property
    def _models(self) -> tuple[RaterModel | None, ...]:
        return tuple(_model(ratings.table) for ratings in self._ratings)

    def _modelled(self) -> Iterator[tuple[str, Participant, float | None, float | None, bool]]:
        """Yield score, rater, bias and inconsistency (None if nothing tells them), and whether the model collapsed."""
        for (score, raters, _), model in zip(self._ratings, self._models, strict=True):
            sizes = np.bincount(model.group + 1) if model is not None else None
            for place, rater in enumerate(raters):
                if model is None or sizes is None or model.group[place] < 0 or sizes[model.group[place] + 1] < LEAST:
                    yield score, rater, None, None, False
                else:
                    collapsed = model.collapsed
                    yield score, rater, float(model.bias[place]), float(model.inconsistency[place]), collapsed

    def _checks(self, kind: str, what: str) -> Iterator[Measure]:
        checks = self._data.checks
        rows = checks[checks["kind"] == kind].assign(passed=lambda table: table["passed"].astype(bool))
        for participant, (count, passed) in _by_rater(rows, "passed", ["count", "sum"]):
            text = f"{int(passed)} of {int(count)} {what}"
            yield Measure(participant=participant, value=passed / count, text=text)


def _by_rater(rows: pd.DataFrame, column: str, how: Sequence[str]) -> Iterator[tuple[Participant, list[float]]]:
    found = rows.groupby("participant", sort=False)[column].agg([*how])
    yield from zip(found.index.tolist(), found.to_numpy(dtype=float).tolist(), strict=True)


def _table(score: str, rows: pd.DataFrame) -> _Ratings:
    raters = ordered(set(rows["participant"].unique().tolist()))
    columns = pd.Index(raters, dtype=object).get_indexer(pd.Index(rows["participant"], dtype=object))
    cells = rows.groupby(["stimulus", "condition"], sort=True).ngroup().to_numpy()
    shape = (int(cells.max()) + 1, len(raters))
    places = cells * shape[1] + columns
    counts = np.bincount(places, minlength=shape[0] * shape[1])
    sums = np.bincount(places, weights=rows["value"].to_numpy(), minlength=shape[0] * shape[1])
    means = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return _Ratings(score, raters, means.reshape(shape))


def _model(table: FloatArray) -> RaterModel | None:
    try:
        return rater_model(table)
    except InsufficientDataError:
        return None


def _unknown(participant: Participant, why: str, score: str | None = None) -> Measure:
    return Measure(participant=participant, value=None, text=f"cannot be told from {why}", score=score)


def _of(count: float, noun: str) -> str:
    return f"{int(count)} {noun}{'' if count == 1 else 's'}"
