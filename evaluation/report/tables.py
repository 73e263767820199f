"""The tables of a report: as text for a terminal, as cells for a page, as frames for files."""

import unicodedata
from collections.abc import Sequence
from typing import NamedTuple

import pandas as pd

from evaluation.report.analysis import ANOVA_UNIT, MOS_UNIT, StudyReport, Unavailable
from evaluation.responses import DIMENSIONS
from evaluation.statistics import wording
from evaluation.statistics.anova import OneWayAnova
from evaluation.statistics.correlation import Correlation
from evaluation.statistics.opinion import OpinionScore

ALL_CONDITIONS = "all"
_NOTHING = "–"


class Section(NamedTuple):
    """One table of the report, its cells written out.

    Attributes
    ----------
    name : str
        Name for an anchor or a file.
    title : str
        Heading.
    header : tuple of str
        Heads of the columns; the first `text_columns` hold text, the others numbers.
    text_columns : int
        How many columns hold text.
    rows : tuple of tuple of str
        The cells.
    notes : tuple of str
        Sentences under the table.
    """

    name: str
    title: str
    header: tuple[str, ...]
    text_columns: int
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


def sections(report: StudyReport) -> tuple[Section, ...]:
    """Return the tables of a report in the order of reading.

    Parameters
    ----------
    report : StudyReport
        As `evaluation.report.analysis.analyse` returns it.

    Returns
    -------
    tuple of Section
        Overview, reverse evaluation, evaluated PAD, opinion scores, analysis of variance, opinion scores by stimulus.
    """
    return (
        _overview(report),
        _reverse_evaluation(report),
        _evaluated_pad(report),
        _mos_by_condition(report),
        _mos_anova(report),
        _mos_by_stimulus(report),
    )


def to_text(report: StudyReport) -> str:
    """Return the whole report as aligned plain text, ending with a line break."""
    title = label(report.spec.title)
    parts = [f"{title} ({report.spec.slug})"]
    for section in sections(report):
        lines = [section.title, "-" * _width(section.title)]
        if section.rows:
            lines += _aligned(section)
        lines += section.notes
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def frames(report: StudyReport) -> dict[str, pd.DataFrame]:
    """Return the tables of a report with full digits, by name, for CSV and other files."""
    reverse = [
        found.result.to_frame().assign(
            condition=found.condition or ALL_CONDITIONS, dimension=found.dimension, published_r=found.published
        )
        for found in report.reverse_evaluation
        if isinstance(found.result, Correlation)
    ]
    opinions = [
        found.result.to_frame().assign(condition=found.condition)
        for found in report.mos_by_condition
        if isinstance(found.result, OpinionScore)
    ]
    anova = report.mos_anova.to_frame() if isinstance(report.mos_anova, OneWayAnova) else pd.DataFrame()
    return {
        "reverse_evaluation": _stacked(reverse, ["condition", "dimension"]),
        "pad_by_stimulus": report.pad_by_stimulus,
        "pad_by_cell": report.pad_by_cell,
        "mos_by_condition": _stacked(opinions, ["condition"]),
        "mos_by_cell": report.mos_by_cell,
        "mos_anova": anova,
    }


def label(texts: object) -> str:
    """Return a text of the study in English, or else in its first language."""
    if not isinstance(texts, dict):
        return str(texts)
    return str(texts.get("en") or next(iter(texts.values())))


def _stacked(parts: Sequence[pd.DataFrame], first: list[str]) -> pd.DataFrame:
    if not parts:
        return pd.DataFrame(columns=first)
    table = pd.concat(parts, ignore_index=True)
    return table[[*first, *(column for column in table.columns if column not in first)]]


def _overview(report: StudyReport) -> Section:
    rows = (
        ("Participants with answers", str(report.participants)),
        ("Trials answered", str(report.trials)),
        ("Questionnaires answered", str(report.responses)),
        ("Questionnaires with an item missing", str(report.incomplete)),
    )
    return Section("overview", "What was collected", ("", "Number"), 1, rows, report.notes)


def _reverse_evaluation(report: StudyReport) -> Section:
    rows, reasons = [], []
    for found in report.reverse_evaluation:
        name = ALL_CONDITIONS if found.condition is None else label(report.spec.condition(found.condition).label)
        published = wording.share(found.published, 3)
        if isinstance(found.result, Unavailable):
            rows.append((name, found.dimension, *[_NOTHING] * 6, published))
            reasons.append(found.result.reason)
            continue
        result = found.result
        interval = _NOTHING if result.ci is None else f"{wording.share(result.ci[0])} to {wording.share(result.ci[1])}"
        rows.append(
            (
                name,
                found.dimension,
                str(result.n),
                wording.share(result.r, 3),
                interval,
                wording.p_value(result.p).removeprefix("p ").removeprefix("= "),
                wording.number(result.slope),
                wording.number(result.intercept),
                published,
            )
        )
    title = "Reverse evaluation: input against evaluated PAD"
    header = ("Condition", "Dimension", "n", "r", "95% CI", "p", "Slope", "Intercept", "r in MTAP 2013")
    if len(reasons) == len(rows):
        return Section("reverse_evaluation", title, header, 2, (), tuple(dict.fromkeys(reasons)))
    return Section(
        "reverse_evaluation",
        title,
        header,
        2,
        tuple(rows),
        (
            "Pearson correlation over the stimuli (n), each with its mean over raters, as in Jia et al. (2013), "
            "Table 8. The input is the PAD that the study file gives for the stimulus, before a condition changes the "
            "clip (its intensity, for instance): a slope below 1 means that people see less than that.",
            *dict.fromkeys(reasons),
        ),
    )


def _evaluated_pad(report: StudyReport) -> Section:
    rows = [
        (
            label(report.spec.stimulus(row["stimulus"]).label),
            str(row["n"]),
            *(_signed(row[f"input_{dimension}"]) for dimension in DIMENSIONS),
            *(_signed(row[dimension]) for dimension in DIMENSIONS),
        )
        for _, row in report.pad_by_stimulus.iterrows()
    ]
    header = ("Stimulus", "n", *(f"input {d}" for d in DIMENSIONS), *(f"evaluated {d}" for d in DIMENSIONS))
    notes = ("Means over all ratings (n) of all conditions.",) if rows else ("No face has been rated with pad12 yet.",)
    return Section("pad_by_stimulus", "Evaluated PAD of each stimulus", header, 1, tuple(rows), notes)


def _mos_by_condition(report: StudyReport) -> Section:
    rows, reasons = [], []
    for found in report.mos_by_condition:
        name = label(report.spec.condition(found.condition).label)
        result = found.result
        if isinstance(result, Unavailable):
            rows.append((name, "0", _NOTHING, _NOTHING, _NOTHING))
            reasons.append(result.reason)
            continue
        sd = _NOTHING if result.sd is None else wording.number(result.sd)
        ci = _NOTHING if result.ci is None else f"{wording.number(result.ci[0])} to {wording.number(result.ci[1])}"
        rows.append((name, str(result.n), wording.number(result.mean), sd, ci))
    title = "Mean opinion score of each condition"
    header = ("Condition", "Ratings", "MOS", "SD", "95% CI")
    because = tuple(dict.fromkeys(reasons))
    if len(reasons) == len(rows):
        return Section("mos_by_condition", title, header, 1, (), because)
    return Section("mos_by_condition", title, header, 1, tuple(rows), (MOS_UNIT, *because))


def _mos_anova(report: StudyReport) -> Section:
    title = "Analysis of variance of the opinion scores"
    header = ("Source", "Sum of squares", "df", "Mean square", "F", "p")
    found = report.mos_anova
    if isinstance(found, Unavailable):
        return Section("mos_anova", title, header, 1, (), (found.reason,))
    between, within = found.SSB / found.df_between, found.SSW / found.df_within
    p = wording.p_value(found.p).removeprefix("p ").removeprefix("= ")
    rows = (
        ("Between conditions", _three(found.SSB), str(found.df_between), _three(between), wording.number(found.F), p),
        ("Within conditions", _three(found.SSW), str(found.df_within), _three(within), "", ""),
        ("Total", _three(found.SSB + found.SSW), str(found.df_between + found.df_within), "", "", ""),
    )
    return Section("mos_anova", title, header, 1, rows, (found.summary(), ANOVA_UNIT))


def _mos_by_stimulus(report: StudyReport) -> Section:
    table = report.mos_by_cell
    names = [condition.name for condition in report.spec.conditions]
    found = {(row["stimulus"], row["condition"]): row for _, row in table.iterrows()}
    rows = []
    for stimulus in report.spec.stimuli:
        cells = [found.get((stimulus.id, name)) for name in names]
        if any(cell is not None for cell in cells):
            written = [_NOTHING if cell is None else f"{wording.number(cell['mean'])} ({cell['n']})" for cell in cells]
            rows.append((label(stimulus.label), *written))
    header = ("Stimulus", *(label(condition.label) for condition in report.spec.conditions))
    notes = ("In brackets the number of ratings.",) if rows else ("No clip has been rated with mos5 yet.",)
    return Section("mos_by_stimulus", "Mean opinion score of each stimulus", header, 1, tuple(rows), notes)


def _signed(value: float) -> str:
    return _NOTHING if pd.isna(value) else f"{round(value, 2) + 0.0:.2f}"


def _three(value: float) -> str:
    return wording.number(value, 3)


def _aligned(section: Section) -> list[str]:
    table = [section.header, *section.rows]
    widths = [max(_width(row[column]) for row in table) for column in range(len(section.header))]
    lines = []
    for row in table:
        cells = []
        for column, cell in enumerate(row):
            space = " " * (widths[column] - _width(cell))
            cells.append(cell + space if column < section.text_columns else space + cell)
        lines.append("  ".join(cells).rstrip())
    return lines


def _width(text: str) -> int:
    # A Chinese character takes two columns of a terminal.
    return sum(2 if unicodedata.east_asian_width(character) in "WF" else 1 for character in text)
