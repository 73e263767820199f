"""The design of a study as a table."""

from importlib.metadata import version

import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block
from evaluation.report.score_table import score_tables
from evaluation.report.section import Section, label
from evaluation.study import Part


def design(report: StudyReport) -> Block:
    """Return what the study showed to whom, and how many ratings each clip has."""
    spec = report.spec
    rows = [
        ("Study", spec.slug),
        ("Digest of the study file", report.digest),
        ("Analysed with", f"padlab {version('padlab')}"),
        ("Seed of all random orders", str(report.study.seed)),
        ("Conditions", "; ".join(f"{name} ({label(spec.condition(name).label)})" for name in report.conditions)),
        ("Stimuli", str(stimuli_shown(report))),
        ("Instruments", ", ".join(spec.instrument_names)),
    ]
    for part in spec.all_parts:
        about = "" if spec.parts is None else f" of {part.name}"
        assignment = part.presentation.assignment.replace("_", " ")
        rows.append((f"Assignment{about}", f"{assignment}, order {part.presentation.order}"))
        rows += [(f"{name}{about}", str(count)) for name, count in _checks(part) if count]
    rows += [(f"Ratings of each clip, {table.score}", _per_clip(table.table)) for table in score_tables(report)]
    if report.study.quota is not None:
        rows.append(("Participants wanted", str(report.study.quota)))
    section = Section("design", "Design", ("", "Value"), 2, tuple(rows))
    return Block((section,), {"design": pd.DataFrame(rows, columns=["name", "value"])})


def stimuli_shown(report: StudyReport) -> int:
    """Return how many stimuli a study shows in trials that count."""
    return len({cell.stimulus for part in report.spec.all_parts for cell in report.spec.cells(part.name)})


def _checks(part: Part) -> list[tuple[str, int]]:
    return [
        ("Training trials", len(part.training)),
        ("Gold clips", len(part.gold)),
        ("Instructed questions", len(part.instructed)),
        ("Hidden repeats", part.repeats.count if part.repeats is not None else 0),
    ]


def _per_clip(table: pd.DataFrame) -> str:
    counts = table.groupby(["stimulus", "condition"]).size()
    return f"{counts.min()} to {counts.max()}, median {counts.median():g}, in all {counts.sum()}"
