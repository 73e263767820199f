"""How well raters agree: with each other on each score, and with themselves in hidden repeats."""

from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, stacked
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable, score_tables
from evaluation.report.section import NOTHING, Section
from evaluation.seeding import generator
from evaluation.statistics import wording
from evaluation.statistics.consistency import RaterConsistency, rater_consistency
from evaluation.statistics.icc import IntraclassCorrelations, intraclass_correlations
from evaluation.statistics.krippendorff import KrippendorffAlpha, Level, krippendorff_alpha
from evaluation.statistics.pairwise import MeanPairwiseCorrelation, mean_pairwise_pearson
from evaluation.statistics.result import Result

_SOURCES = (
    "SD: mean over the clips of the standard deviation over raters (n − 1). Pairwise r: mean of Pearson's r over all "
    "pairs of raters, as Jia et al. (2013), section 2.4, report it (.80, .44 and .35 for P, A and D). Alpha: "
    "Krippendorff's, with a bootstrap interval over clips; it takes clips that were not rated by everybody as they are."
)
_ICC = (
    "Intraclass correlations of Shrout and Fleiss (1979) over clips that all raters rated: of a single rating, and of "
    "the mean of all raters (k). ICC(2) takes raters as a sample of others and counts their differences of level, "
    "ICC(3) does not, ICC(1) does not know who rated."
)


def rater_agreement(report: StudyReport) -> Block | None:
    """Return the agreement of raters on each score; None if there is none with two raters."""
    tables = [one for one in score_tables(report) if len(one.raters) > 1]
    if not tables:
        return None
    seed = report.study.seed
    pairwise = {one.score: attempt(partial(mean_pairwise_pearson, one.matrix)) for one in tables}
    alphas = {f"{one.score}, {level}": _alpha(one, level, seed) for one in tables for level in _levels(one)}
    coefficients = {one.score: attempt(partial(intraclass_correlations, one.matrix)) for one in tables}
    spread = pd.DataFrame(
        {
            "score": [one.score for one in tables],
            "clips": [len(one.clips) for one in tables],
            "raters": [len(one.raters) for one in tables],
            "ratings": [int((~np.isnan(one.matrix)).sum()) for one in tables],
            "sd": [_sd(one) for one in tables],
        }
    )
    rows = tuple(_row(one, spread["sd"][place], pairwise[one.score], alphas) for place, one in enumerate(tables))
    header = ("Score", "Clips", "Raters", "SD", "Pairwise r", "Krippendorff's α", "95% CI")
    # The table has alpha at the interval level.
    others = {name: one for name, one in alphas.items() if not (isinstance(one, Result) and name.endswith("interval"))}
    remarks = (*_remarks(pairwise), *_remarks(others))
    agreement = Section("agreement", "Agreement of raters", header, 1, rows, (_SOURCES, *remarks))
    icc = _icc(coefficients)
    sections = [agreement, *([icc] if icc is not None else [])]
    frames = {
        "agreement": spread,
        "pairwise_r": stacked(pairwise, "score"),
        "krippendorff": stacked(alphas, "score"),
        "icc": stacked(coefficients, "score"),
    }
    return Block(tuple(sections), frames)


def _levels(table: ScoreTable) -> tuple[Level, ...]:
    return ("interval", "ordinal") if table.ordinal else ("interval",)


def _alpha(table: ScoreTable, level: Level, seed: int) -> KrippendorffAlpha | Unavailable:
    rng = generator(seed, "report", "krippendorff", table.score, level)
    return attempt(lambda: krippendorff_alpha(table.matrix, level=level, rng=rng))


def _sd(table: ScoreTable) -> float:
    rated = table.matrix[(~np.isnan(table.matrix)).sum(axis=1) > 1]
    return float(np.nanstd(rated, axis=1, ddof=1).mean()) if len(rated) else float("nan")


def _row(
    table: ScoreTable,
    sd: float,
    pairwise: MeanPairwiseCorrelation | Unavailable,
    alphas: dict[str, KrippendorffAlpha | Unavailable],
) -> tuple[str, ...]:
    alpha = alphas[f"{table.score}, interval"]
    ci = None if isinstance(alpha, Unavailable) else alpha.ci
    return (
        table.score,
        str(len(table.clips)),
        str(len(table.raters)),
        NOTHING if np.isnan(sd) else wording.number(sd),
        NOTHING if isinstance(pairwise, Unavailable) else wording.share(pairwise.r),
        NOTHING if isinstance(alpha, Unavailable) else wording.share(alpha.alpha),
        NOTHING if ci is None else f"{wording.share(ci[0])} to {wording.share(ci[1])}",
    )


def _remarks(found: Mapping[str, Result | Unavailable]) -> list[str]:
    """Return what each result says, under the name of its score."""
    said = [f"{name}: {one.reason if isinstance(one, Unavailable) else one.apa()}" for name, one in found.items()]
    flags = [f"{name}: {flag}" for name, one in found.items() if isinstance(one, Result) for flag in one.flags]
    return [*said, *flags]


def _icc(found: dict[str, IntraclassCorrelations | Unavailable]) -> Section | None:
    known = {score: one for score, one in found.items() if isinstance(one, IntraclassCorrelations)}
    reasons = tuple(f"{score}: {one.reason}" for score, one in found.items() if isinstance(one, Unavailable))
    if not known:
        return None
    rows = tuple(
        (
            score,
            one.symbol,
            NOTHING if one.value is None else wording.share(one.value),
            NOTHING if one.ci is None else f"{wording.share(one.ci[0])} to {wording.share(one.ci[1])}",
            f"F({one.df1}, {one.df2}) = {wording.number(one.F)}",
            wording.p_value(one.p).removeprefix("p ").removeprefix("= "),
        )
        for score, result in known.items()
        for one in result.forms
    )
    flags = tuple(dict.fromkeys(flag for one in known.values() for flag in one.flags))
    header = ("Score", "Form", "ICC", "95% CI", "Test", "p")
    return Section("icc", "Intraclass correlations", header, 2, rows, (_ICC, *flags, *reasons))


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
