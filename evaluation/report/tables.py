"""The tables of a report: as text for a terminal, as cells for a page, as frames for files."""

from collections.abc import Sequence

import pandas as pd

from evaluation.report.analysis import ANOVA_UNIT, MOS_UNIT, StudyReport, Unavailable
from evaluation.report.further_tables import further_frames, further_sections, screened
from evaluation.report.section import NOTHING, Section, label, lines
from evaluation.responses import DIMENSIONS, pad_instruments
from evaluation.statistics import wording
from evaluation.statistics.anova import OneWayAnova
from evaluation.statistics.correlation import Correlation
from evaluation.statistics.opinion import OpinionScore
from evaluation.statistics.wording import counted

__all__ = ["ALL_CONDITIONS", "Section", "frames", "headline", "label", "sections", "to_text"]

ALL_CONDITIONS = "all"

_NOT_TWICE = frozenset({"pad_by_stimulus", "mos_by_stimulus", "screening"})
"""Sections that are not repeated with the raters used alone; their numbers are in `frames`."""


def sections(report: StudyReport) -> tuple[Section, ...]:
    """Return the tables of a report in the order of reading.

    Parameters
    ----------
    report : StudyReport
        As `evaluation.report.analysis.analyse` returns it.

    Returns
    -------
    tuple of Section
        Overview and screening, reverse evaluation and evaluated PAD, opinion scores and their analysis of variance,
        other scores, votes, preferences, and repeats, each if the study asks for it. If screening excludes raters, the
        main tables stand there for all raters and then, under ``NAME_used``, for those whose ratings are used.
    """
    own = _sections(report)
    if report.used is None:
        return own
    used = {section.name: section for section in _sections(report.used)}
    everybody, left = report.participants, report.used.participants
    both = []
    for section in own:
        if section.name in _NOT_TWICE or section.name not in used:
            both.append(section)
            continue
        other = used[section.name]
        both.append(section._replace(title=f"{section.title} – all {counted(everybody, 'rater')}"))
        both.append(
            other._replace(name=f"{other.name}_used", title=f"{other.title} – the {counted(left, 'rater')} used")
        )
    return tuple(both)


def _sections(report: StudyReport) -> tuple[Section, ...]:
    found = [_overview(report), *screened(report)]
    if pad_instruments(report.spec):
        found += [_reverse_evaluation(report), _evaluated_pad(report)]
    if "mos5" in report.spec.instrument_names:
        found += [_mos_by_condition(report), _mos_anova(report), _mos_by_stimulus(report)]
    return (*found, *further_sections(report))


def title(report: StudyReport) -> str:
    """Return the title of the study, with that of the part if it has parts."""
    study = label(report.spec.title)
    if report.part is None:
        return study
    part = report.spec.part(report.part)
    return f"{study}: {label(part.title) if part.title else part.name}"


def to_text(report: StudyReport) -> str:
    """Return the whole report as aligned plain text, ending with a line break."""
    place = report.spec.slug if report.part is None else f"{report.spec.slug}, part {report.part}"
    parts = [f"{title(report)} ({place})", *("\n".join(lines(section)) for section in sections(report))]
    return "\n\n".join(parts) + "\n"


def headline(report: StudyReport) -> list[str]:
    """Return the main results as sentences."""
    sentences = _headline(report)
    if report.used is None:
        return sentences
    with_used = [
        f"With the {counted(report.used.participants, 'rater')} used: {sentence}" for sentence in _headline(report.used)
    ]
    return [*sentences, *with_used]


def _headline(report: StudyReport) -> list[str]:
    names = {"P": "pleasure", "A": "arousal", "D": "dominance"}
    sentences = []
    if pad_instruments(report.spec):
        sentences += [
            f"Input and evaluated {names[found.dimension]}: {found.result.summary()}"
            for found in report.reverse_evaluation
            if found.condition is None
        ]
    if "mos5" in report.spec.instrument_names:
        sentences.append(
            f"Opinion scores of the conditions, stimuli as independent groups: {report.mos_anova.summary()}"
        )
    if report.preferences is not None:
        sentences.append(f"Preferences: {report.preferences.summary()}")
    return sentences


def frames(report: StudyReport) -> dict[str, pd.DataFrame]:
    """Return the tables of a report with full digits, by name, for CSV and other files.

    If screening excludes raters, each table is there once more, as ``NAME_used``, with the others alone.
    """
    own = _frames(report)
    if report.used is not None:
        own |= {f"{name}_used": frame for name, frame in _frames(report.used).items() if name != "screening"}
    return own


def _frames(report: StudyReport) -> dict[str, pd.DataFrame]:
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
        "overview": pd.DataFrame(
            {
                "name": ["participants", "trials", "questionnaires", "incomplete"],
                "number": [report.participants, report.trials, report.responses, report.incomplete],
            }
        ),
        "reverse_evaluation": _stacked(reverse, ["condition", "dimension"]),
        "pad_by_stimulus": report.pad_by_stimulus,
        "pad_by_cell": report.pad_by_cell,
        "mos_by_condition": _stacked(opinions, ["condition"]),
        "mos_by_cell": report.mos_by_cell,
        "mos_anova": anova,
        **further_frames(report),
    }


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
            rows.append((name, found.dimension, *[NOTHING] * 6, published))
            reasons.append(found.result.reason)
            continue
        result = found.result
        interval = NOTHING if result.ci is None else f"{wording.share(result.ci[0])} to {wording.share(result.ci[1])}"
        rows.append(
            (
                name,
                found.dimension,
                str(result.n),
                wording.share(result.r, 3),
                interval,
                wording.p_column(result.p),
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
    asked = " or ".join(pad_instruments(report.spec))
    header = ("Stimulus", "n", *(f"input {d}" for d in DIMENSIONS), *(f"evaluated {d}" for d in DIMENSIONS))
    notes = (
        ("Means over all ratings (n) of all conditions.",) if rows else (f"No face has been rated with {asked} yet.",)
    )
    return Section("pad_by_stimulus", "Evaluated PAD of each stimulus", header, 1, tuple(rows), notes)


def _mos_by_condition(report: StudyReport) -> Section:
    rows, reasons = [], []
    for found in report.mos_by_condition:
        name = label(report.spec.condition(found.condition).label)
        result = found.result
        if isinstance(result, Unavailable):
            rows.append((name, "0", NOTHING, NOTHING, NOTHING))
            reasons.append(result.reason)
            continue
        sd = NOTHING if result.sd is None else wording.number(result.sd)
        ci = NOTHING if result.ci is None else f"{wording.number(result.ci[0])} to {wording.number(result.ci[1])}"
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
    p = wording.p_column(found.p)
    rows = (
        ("Between conditions", _three(found.SSB), str(found.df_between), _three(between), wording.number(found.F), p),
        ("Within conditions", _three(found.SSW), str(found.df_within), _three(within), "", ""),
        ("Total", _three(found.SSB + found.SSW), str(found.df_between + found.df_within), "", "", ""),
    )
    return Section("mos_anova", title, header, 1, rows, (found.summary(), ANOVA_UNIT))


def _mos_by_stimulus(report: StudyReport) -> Section:
    table = report.mos_by_cell
    names = list(report.conditions)
    found = {(row["stimulus"], row["condition"]): row for _, row in table.iterrows()}
    rows = []
    for stimulus in report.spec.stimuli:
        cells = [found.get((stimulus.id, name)) for name in names]
        if any(cell is not None for cell in cells):
            written = [NOTHING if cell is None else f"{wording.number(cell['mean'])} ({cell['n']})" for cell in cells]
            rows.append((label(stimulus.label), *written))
    header = ("Stimulus", *(label(report.spec.condition(name).label) for name in names))
    notes = ("In brackets the number of ratings.",) if rows else ("No clip has been rated with mos5 yet.",)
    return Section(
        "mos_by_stimulus", "Mean opinion score of each stimulus", header, 1, tuple(rows), notes, "mos_by_cell"
    )


def _signed(value: float) -> str:
    return NOTHING if pd.isna(value) else f"{round(value, 2) + 0.0:.2f}"


def _three(value: float) -> str:
    return wording.number(value, 3)
