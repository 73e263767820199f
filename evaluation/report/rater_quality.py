"""What single raters are like: bias and inconsistency, scores out of range, agreement with the others."""

from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable, score_tables
from evaluation.report.section import NOTHING, Section
from evaluation.statistics import wording
from evaluation.statistics.bt500 import Bt500Rejection, bt500_rejection
from evaluation.statistics.leave_one_out import leave_one_out
from evaluation.statistics.rater_model import RaterModel, rater_model

MOST_RATERS = 60
"""Raters up to whom the table for reading has a line for each; the file always has."""
_COLUMNS = MappingProxyType(
    {
        "rater": "Rater",
        "ratings": "Ratings",
        "bias": "Bias",
        "inconsistency": "Inconsistency",
        "r_others": "r, others",
        "bt500_rejected": "BT.500",
    }
)
"""Columns of the frame that the page shows, with their heads."""

_SOURCES = (
    "Bias and inconsistency: the model of Recommendation ITU-T P.910 (Li et al., 2020), in the units of the score. "
    "Their intervals take the qualities of the clips as known, and are too short with few raters or clips. "
    "r, others: Pearson's r of a rater with the mean of all others. BT.500: whether Recommendation ITU-R BT.500-14 "
    "would reject the rater. These figures describe; nobody is left out because of them unless the study file says so."
)


def rater_quality(report: StudyReport) -> Block | None:
    """Return what raters are like on each score; None if there is no score with two raters."""
    tables = [one for one in score_tables(report) if len(one.raters) > 1]
    if not tables:
        return None
    sections, frames = [], {}
    for table in tables:
        frame, remarks = _described(table)
        name = f"raters_{table.slug}"
        frames[name] = frame
        shown = [column for column in _COLUMNS if column in frame]
        rows = tuple(
            tuple(_written(column, line[column]) for column in shown)
            for line in frame.head(MOST_RATERS).to_dict("records")
        )
        if len(frame) > MOST_RATERS:
            remarks = (f"The first {MOST_RATERS} of {len(frame)} raters; all are in the file.", *remarks)
        header = tuple(_COLUMNS[column] for column in shown)
        sections.append(Section(name, f"{table.score}: raters", header, 1, rows, (_SOURCES, *remarks)))
    return Block(tuple(sections), frames)


def _described(table: ScoreTable) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return a line for each rater, and what has to be said of the numbers."""
    model = attempt(lambda: rater_model(table.matrix))
    others = attempt(lambda: leave_one_out(table.matrix))
    rejection = attempt(lambda: bt500_rejection(table.matrix))
    known = ~np.isnan(table.matrix)
    columns: dict[str, object] = {"rater": table.raters, "ratings": known.sum(axis=0)}
    # Where one rater is taken for the truth, the others' numbers mean nothing; the flag says so.
    if not isinstance(model, Unavailable) and not model.collapsed:
        columns |= {
            "bias": model.bias,
            "bias_ci_low": model.bias_ci[:, 0],
            "bias_ci_high": model.bias_ci[:, 1],
            "inconsistency": model.inconsistency,
            "inconsistency_ci_low": model.inconsistency_ci[:, 0],
            "inconsistency_ci_high": model.inconsistency_ci[:, 1],
        }
    if not isinstance(others, Unavailable):
        columns |= {"r_others": others.r, "r_others_ci_low": others.ci_low, "r_others_ci_high": others.ci_high}
    if not isinstance(rejection, Unavailable):
        columns |= {"bt500_share": rejection.counts.share, "bt500_rejected": rejection.rejected}
    remarks: list[str] = []
    for found in (model, others, rejection):
        if isinstance(found, Unavailable):
            remarks.append(found.reason)
            continue
        collapsed = isinstance(found, RaterModel) and found.collapsed
        # BT.500 knows raters by their place, readers by their number.
        remarks += [*([] if collapsed or isinstance(found, Bt500Rejection) else [found.apa()]), *found.flags]
    return pd.DataFrame(columns), tuple(dict.fromkeys(remarks))


def _written(column: str, value: Any) -> str:
    if column in {"rater", "ratings"}:
        return str(value)
    if column == "bt500_rejected":
        return "rejects" if value else "keeps"
    if pd.isna(value):
        return NOTHING
    return wording.share(value) if column == "r_others" else wording.number(value)
