"""How precise opinion scores are: intervals that respect the scale, votes still needed, spread against mean."""

from functools import partial

import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, stacked
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable, score_tables
from evaluation.report.section import NOTHING, Section, label
from evaluation.seeding import generator
from evaluation.statistics import wording
from evaluation.statistics.bounded_interval import BoundedTable, Method, bounded_table
from evaluation.statistics.opinion import opinion_table
from evaluation.statistics.result import Result
from evaluation.statistics.sos import sos_from_summary
from evaluation.statistics.votes_needed import votes_needed_from_summary

BOOTSTRAP_RATINGS = 50_000
"""Ratings of a condition up to which its mean is resampled; with more, the intervals hardly differ."""

_INTERVALS = (
    "Intervals of 95 % for the same mean. Student's does not know the ends of the scale; the binomial one takes the "
    "mean as a share of the scale, which cannot leave it, and is cautious unless ratings go to both ends (Hoßfeld et "
    "al., 2018); the bootstrap resamples ratings (BCa) if there are not too many. They take ratings as independent, "
    "although each participant gives several; those of the mixed model do not."
)

VOTES = (
    "Ratings of each clip until the 95 % interval of its mean reaches {:g} to either side at most (analysis.half_width "
    "in the study file)."
)
SOS = (
    "The parameter a of the SOS hypothesis (Hoßfeld et al., 2011), by which the variance of the ratings of a clip "
    "follows its mean."
)


def precision(report: StudyReport) -> Block | None:
    """Return intervals, votes still needed and the SOS parameter of the opinion scores; None if there are none."""
    found = [one for one in score_tables(report) if one.opinion]
    if not found:
        return None
    table = found[0]
    half_width = report.study.analysis.half_width
    intervals, interval_frame = _intervals(report, table)
    cells = opinion_table(table.table, score="value", by=["stimulus", "condition"])
    names = [
        f"{stimulus}, {condition}" for stimulus, condition in zip(cells["stimulus"], cells["condition"], strict=True)
    ]
    spread = cells["sd"].to_numpy()
    needed = attempt(
        lambda: votes_needed_from_summary(
            cells["n"].to_numpy(), spread, half_width=half_width, names=names, scale=table.scale
        )
    )
    several = cells[cells["n"] > 1]
    rng = generator(report.study.seed, "report", "sos")
    spread_found = attempt(
        lambda: sos_from_summary(
            several["mean"].to_numpy(), several["sd"].to_numpy() ** 2, low=table.scale[0], high=table.scale[1], rng=rng
        )
    )
    return Block(
        (
            intervals,
            _one("votes_needed", "Votes still needed", needed, VOTES.format(half_width)),
            _one("precision", "Spread of the ratings against their mean", spread_found, SOS, source="sos"),
        ),
        {
            "mos_intervals": interval_frame,
            "votes_needed": stacked({"MOS": needed}, "score"),
            "sos": stacked({"MOS": spread_found}, "score"),
        },
    )


def _one(name: str, title: str, found: Result | Unavailable, note: str, *, source: str = "") -> Section:
    flags = found.flags if isinstance(found, Result) else ()
    said = found.reason if isinstance(found, Unavailable) else found.apa()
    return Section(name, title, ("Result",), 1, ((said,),), (note, *flags), source)


def _intervals(report: StudyReport, table: ScoreTable) -> tuple[Section, pd.DataFrame]:
    low, high = table.scale
    frame = opinion_table(table.table, score="value", by=["condition"])
    frame = frame.rename(columns={"ci_low": "t_low", "ci_high": "t_high"})
    largest = int(table.table["condition"].value_counts().max())
    notes = [_INTERVALS]
    methods: tuple[Method, ...] = ("binomial", "bootstrap") if largest <= BOOTSTRAP_RATINGS else ("binomial",)
    for method in methods:
        rng = generator(report.study.seed, "report", "mos intervals") if method == "bootstrap" else None
        found = attempt(
            partial(
                bounded_table, table.table, score="value", by=["condition"], low=low, high=high, method=method, rng=rng
            )
        )
        if isinstance(found, BoundedTable):
            notes += found.flags
            own = found.to_frame().set_index("condition")
            for end in ("low", "high"):
                frame[f"{method}_{end}"] = frame["condition"].map(own[f"ci_{end}"])
    frame = frame.sort_values(
        "condition", key=lambda column: column.map(list(table.conditions).index), ignore_index=True
    )
    rows = tuple(
        (
            label(report.spec.condition(line["condition"]).label),
            str(line["n"]),
            wording.number(line["mean"]),
            *(_interval(line.get(f"{kind}_low"), line.get(f"{kind}_high")) for kind in ("t", "binomial", "bootstrap")),
        )
        for line in frame.to_dict("records")
    )
    header = ("Condition", "Ratings", "MOS", "Student", "Binomial", "Bootstrap")
    return Section("mos_intervals", "Intervals of the opinion scores", header, 1, rows, tuple(notes)), frame


def _interval(low: float | None, high: float | None) -> str:
    if low is None or high is None or pd.isna(low) or pd.isna(high):
        return NOTHING
    return f"{wording.number(low)} to {wording.number(high)}"
