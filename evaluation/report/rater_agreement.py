"""How well raters agree: with each other on each score, and with themselves in hidden repeats."""

from collections.abc import Hashable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, stacked
from evaluation.report.choices import choice_agreement
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable, score_tables
from evaluation.report.section import NOTHING, Section, label
from evaluation.seeding import generator
from evaluation.statistics import wording
from evaluation.statistics.agreement.icc import IntraclassCorrelations, intraclass_correlations
from evaluation.statistics.agreement.krippendorff import KrippendorffAlpha, Level, krippendorff_alpha
from evaluation.statistics.agreement.pairwise import MeanPairwiseCorrelation, mean_pairwise_pearson
from evaluation.statistics.consistency import RaterConsistency, rater_consistency
from evaluation.statistics.result import Result

_SOURCES = (
    "SD: mean over the clips of the standard deviation over raters (n − 1). Pairwise r: mean of Pearson's r over all "
    "pairs of raters, as Jia et al. (2013), section 2.4, report it (.80, .44 and .35 for P, A and D). Alpha: "
    "Krippendorff's, with a bootstrap interval over clips; it takes clips that were not rated by everybody as they "
    "are. Over all conditions together agreement is higher than within one, if the conditions differ."
)
_ICC = (
    "Intraclass correlations of Shrout and Fleiss (1979) over clips that all raters rated: of a single rating, and of "
    "the mean of all raters (k). ICC(2) takes raters as a sample of others and counts their differences of level, "
    "ICC(3) does not, ICC(1) does not know who rated."
)


def rater_agreement(report: StudyReport) -> Block | None:
    """Return the agreement of raters on each score and choice; None if there is none with two raters."""
    scores = [_Rated(one.score, "all", one) for one in score_tables(report) if len(one.raters) > 1]
    choices = choice_agreement(report)
    if not scores:
        return choices
    parts = [
        _Rated(one.score, condition, table)
        for one in scores
        for condition in (one.table.conditions if len(one.table.conditions) > 1 else ())
        if len((table := one.table.of(condition)).raters) > 1
    ]
    every = [*scores, *parts]
    seed = report.study.seed
    pairwise = {one.name: attempt(partial(mean_pairwise_pearson, one.table.matrix)) for one in every}
    alphas = {one.name: _alpha(one, "interval", seed) for one in every}
    ordinal = {f"{one.name}, ordinal": _alpha(one, "ordinal", seed) for one in scores if one.table.ordinal}
    coefficients = {one.score: attempt(partial(intraclass_correlations, one.table.matrix)) for one in scores}
    frame = pd.DataFrame(
        {
            "score": [one.score for one in every],
            "condition": [one.condition for one in every],
            "clips": [len(one.table.clips) for one in every],
            "raters": [len(one.table.raters) for one in every],
            "ratings": [int((~np.isnan(one.table.matrix)).sum()) for one in every],
            "sd": [_sd(one.table) for one in every],
            **_numbers([pairwise[one.name] for one in every], [alphas[one.name] for one in every]),
        }
    )
    rows = tuple(_row(report, line) for line in frame.to_dict("records"))
    header = ("Score", "Condition", "Clips", "Raters", "SD", "Pairwise r", "Krippendorff's α", "95% CI")
    own = [one.name for one in scores]
    # The table has alpha at the interval level.
    missing = {name: alphas[name] for name in own if isinstance(alphas[name], Unavailable)}
    remarks = (*_remarks({name: pairwise[name] for name in own}), *_remarks(missing), *_remarks(ordinal))
    within = {f"{one.score}, {label(report.spec.condition(one.condition).label)}": one.name for one in parts}
    remarks += tuple(
        _of_conditions([{shown: found[name] for shown, name in within.items()} for found in (pairwise, alphas)])
    )
    agreement = Section("agreement", "Agreement of raters", header, 2, rows, (_SOURCES, *remarks))
    icc = _icc(coefficients)
    frames = {
        "agreement": frame,
        "pairwise_r": stacked(pairwise, "score"),
        "krippendorff": stacked(alphas | ordinal, "score"),
        "icc": stacked(coefficients, "score"),
        **(choices.frames if choices is not None else {}),
    }
    sections = (agreement, *([icc] if icc is not None else []), *(choices.sections if choices is not None else ()))
    return Block(sections, frames)


class _Rated(NamedTuple):
    """The ratings of one score, in all conditions or in one."""

    score: str
    condition: str
    table: ScoreTable

    @property
    def name(self) -> str:
        return self.score if self.condition == "all" else f"{self.score}, {self.condition}"


def _numbers(
    pairwise: Sequence[MeanPairwiseCorrelation | Unavailable], alphas: Sequence[KrippendorffAlpha | Unavailable]
) -> dict[str, list[float]]:
    """Return the columns of the table whose numbers are those of other results; NaN where there is none."""
    nothing = float("nan")
    known = [None if isinstance(one, Unavailable) else one for one in alphas]
    ends = [(nothing, nothing) if one is None or one.ci is None else one.ci for one in known]
    return {
        "pairwise_r": [nothing if isinstance(one, Unavailable) else one.r for one in pairwise],
        "alpha": [nothing if one is None else one.alpha for one in known],
        "alpha_ci_low": [low for low, _ in ends],
        "alpha_ci_high": [high for _, high in ends],
    }


def _alpha(rated: _Rated, level: Level, seed: int) -> KrippendorffAlpha | Unavailable:
    rng = generator(seed, "report", "krippendorff", rated.name, level)
    return attempt(lambda: krippendorff_alpha(rated.table.matrix, level=level, rng=rng))


def _sd(table: ScoreTable) -> float:
    rated = table.matrix[(~np.isnan(table.matrix)).sum(axis=1) > 1]
    return float(np.nanstd(rated, axis=1, ddof=1).mean()) if len(rated) else float("nan")


def _row(report: StudyReport, line: Mapping[Hashable, Any]) -> tuple[str, ...]:
    condition = line["condition"]
    low, high = line["alpha_ci_low"], line["alpha_ci_high"]
    return (
        line["score"],
        condition if condition == "all" else label(report.spec.condition(condition).label),
        str(line["clips"]),
        str(line["raters"]),
        NOTHING if np.isnan(line["sd"]) else wording.number(line["sd"]),
        NOTHING if np.isnan(line["pairwise_r"]) else wording.share(line["pairwise_r"]),
        NOTHING if np.isnan(line["alpha"]) else wording.share(line["alpha"]),
        NOTHING if np.isnan(low) else f"{wording.share(low)} to {wording.share(high)}",
    )


def _remarks(found: Mapping[str, Result | Unavailable]) -> list[str]:
    """Return what each result says, under the name of its score."""
    said = [f"{name}: {one.reason if isinstance(one, Unavailable) else one.apa()}" for name, one in found.items()]
    flags = [f"{name}: {flag}" for name, one in found.items() if isinstance(one, Result) for flag in one.flags]
    return [*said, *flags]


def _of_conditions(tables: Sequence[Mapping[str, Result | Unavailable]]) -> list[str]:
    """Return what has to be known of the results of single conditions, each sentence once with all it holds for."""
    said: dict[str, list[str]] = {}
    for table in tables:
        for name, one in table.items():
            for sentence in (one.reason,) if isinstance(one, Unavailable) else one.flags:
                said.setdefault(sentence, []).append(name)
    return [f"{'; '.join(names)}: {sentence}" for sentence, names in said.items()]


def _icc(found: dict[str, IntraclassCorrelations | Unavailable]) -> Section | None:
    known = {score: one for score, one in found.items() if isinstance(one, IntraclassCorrelations)}
    reasons = tuple(f"{score}: {one.reason}" for score, one in found.items() if isinstance(one, Unavailable))
    header = ("Score", "Form", "ICC", "95% CI", "Test", "p")
    if not known:
        return Section("icc", "Intraclass correlations", header, 2, (), reasons) if reasons else None
    rows = tuple(
        (
            score,
            one.symbol,
            NOTHING if one.value is None else wording.share(one.value),
            _between(one.ci),
            f"F({one.df1}, {one.df2}) {'infinite' if np.isinf(one.F) else f'= {wording.number(one.F)}'}",
            wording.p_column(one.p),
        )
        for score, result in known.items()
        for one in result.forms
    )
    flags = tuple(f"{score}, {flag}" for score, one in known.items() for flag in dict.fromkeys(one.flags))
    return Section("icc", "Intraclass correlations", header, 2, rows, (_ICC, *flags, *reasons))


def _between(ci: tuple[float, float] | None) -> str:
    if ci is None or np.isinf(ci[1]):
        return NOTHING
    # The mean of many raters can have an interval without a lower end.
    return f"{wording.share(ci[0])} to {wording.share(ci[1])}" if np.isfinite(ci[0]) else f"≤ {wording.share(ci[1])}"


def rater_consistencies(report: StudyReport) -> Block | None:
    """Return how well raters agree with themselves in hidden repeats; None if there are none."""
    if report.repeated is None or report.repeated.empty:
        return None
    found: dict[str, RaterConsistency | Unavailable] = {}
    for score, rows in report.repeated.dropna(subset=["first", "second"]).groupby("score", sort=False):
        values = [*rows["first"].astype(float), *rows["second"].astype(float)]
        people = rows["participant"].tolist()
        items = rows.get("of", pd.Series(range(len(rows)), index=rows.index)).astype(str)
        clips = items + "/" + rows["clip"].astype(str) if "clip" in rows else items
        found[str(score)] = attempt(partial(rater_consistency, values, raters=people * 2, items=[*clips, *clips]))
    lines = [(score, one.reason if isinstance(one, Unavailable) else one.apa()) for score, one in found.items()]
    flags = [flag for one in found.values() if isinstance(one, Result) for flag in one.flags]
    section = Section(
        "consistency", "Raters against themselves", ("Score", "Result"), 2, tuple(lines), tuple(dict.fromkeys(flags))
    )
    return Block((section,), {"consistency": stacked(found, "score")})
