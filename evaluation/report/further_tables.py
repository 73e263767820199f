"""Tables of a report beside those of the papers: screening, other scores, votes, preferences and repeats."""

import pandas as pd

from evaluation.report.analysis import MOS_UNIT, StudyReport, Unavailable
from evaluation.report.section import NOTHING, Section, label
from evaluation.screening.report import MANUAL
from evaluation.statistics import wording
from evaluation.statistics.bradley_terry import BradleyTerry
from evaluation.statistics.correlation import Correlation


def screened(report: StudyReport) -> tuple[Section, ...]:
    """Return the table of raters who are not used, with the findings of each rule; none if nobody is screened."""
    if report.screening is None:
        return ()
    verdicts = report.screening.raters
    rows = tuple(
        (str(rater.participant), "yes" if rater.accepted else "no", "; ".join(rater.reasons))
        for rater in verdicts
        if not rater.used
    )
    # The lines on single raters are the rows.
    rules = dict.fromkeys(finding.rule for finding in report.screening.findings)
    notes = report.screening.summary().splitlines()[: 1 + len(rules)]
    if MANUAL in rules or rows:
        notes.append("Tables marked as of the raters used leave these out; no rating is deleted.")
    header = ("Rater not used", "Accepted", "Reasons")
    return (Section("screening", "Screening of raters", header, len(header), rows, tuple(notes)),)


def further_sections(report: StudyReport) -> tuple[Section, ...]:
    """Return the tables of other scores, votes, preferences and repeats; those without anything are left out."""
    found = []
    if len(report.scores_by_condition):
        found.append(_scores(report))
    if report.votes:
        found.append(_votes(report))
    if report.preferences is not None:
        found.append(_preferences(report, report.preferences))
    if report.repeats:
        found.append(_repeats(report))
    return tuple(found)


def further_frames(report: StudyReport) -> dict[str, pd.DataFrame]:
    """Return the same with full digits, by name; without what the study does not ask."""
    found = {"scores_by_condition": report.scores_by_condition, "scores_by_cell": report.scores_by_cell}
    if report.votes:
        parts = [
            one.votes.to_frame().assign(question=one.question, stimulus=one.stimulus, condition=one.condition)
            for one in report.votes
        ]
        columns = ["question", "stimulus", "condition", "label", "votes", "share", "leading"]
        found["votes"] = pd.concat(parts, ignore_index=True)[columns]
    if isinstance(report.preferences, BradleyTerry):
        found["preferences"] = report.preferences.to_frame().rename(columns={"name": "condition"})
    elif report.preferences is not None:
        found["preferences"] = pd.DataFrame(columns=["condition"])
    if report.repeats:
        found["repeats"] = pd.DataFrame(
            {
                "score": [one.score for one in report.repeats],
                "n": [one.n for one in report.repeats],
                "mean_difference": [one.mean_difference for one in report.repeats],
                "r": [one.result.r if isinstance(one.result, Correlation) else None for one in report.repeats],
            }
        ).astype({"r": float})
    if report.screening is not None:
        found["screening"] = report.screening.to_frame()
    return found


def _scores(report: StudyReport) -> Section:
    rows = tuple(
        (
            str(row["score"]),
            label(report.spec.condition(row["condition"]).label),
            str(row["n"]),
            wording.number(row["mean"]),
            *_spread(row),
        )
        for _, row in report.scores_by_condition.iterrows()
    )
    header = ("Score", "Condition", "Ratings", "Mean", "SD", "95% CI")
    return Section("scores_by_condition", "Scores of each condition", header, 2, rows, (MOS_UNIT,))


def _spread(row: pd.Series) -> tuple[str, str]:
    if pd.isna(row["sd"]):
        return NOTHING, NOTHING
    return wording.number(row["sd"]), f"{wording.number(row['ci_low'])} to {wording.number(row['ci_high'])}"


def _votes(report: StudyReport) -> Section:
    rows = []
    for one in report.votes:
        pairs = zip(one.votes.labels, one.votes.counts, strict=True)
        others = [(name, count) for name, count in pairs if count and name not in one.votes.leading]
        others.sort(key=lambda pair: -pair[1])
        rows.append(
            (
                label(report.spec.stimulus(one.stimulus).label),
                label(report.spec.condition(one.condition).label),
                one.question,
                one.votes.majority or f"tie of {', '.join(one.votes.leading)}",
                ", ".join(f"{name} {count}" for name, count in others) or NOTHING,
                str(one.votes.n),
                wording.share(max(one.votes.shares)),
            )
        )
    header = ("Stimulus", "Condition", "Question", "Most votes", "Other votes", "n", "Share")
    note = "The answer with more votes than any other, and its share of all; in a tie, the share of each."
    return Section("votes", "Votes", header, 5, tuple(rows), (note,))


def _preferences(report: StudyReport, found: BradleyTerry | Unavailable) -> Section:
    title = "Preferences between the conditions"
    header = ("Condition", "Preferred", "Not preferred", "Score", "SE", "95% CI")
    if isinstance(found, Unavailable):
        return Section("preferences", title, header, 1, (), (found.reason,))
    rows = tuple(
        (
            label(report.spec.condition(row["name"]).label),
            f"{row['wins']:g}",
            f"{row['losses']:g}",
            wording.number(row["score"]),
            wording.number(row["se"]),
            f"{wording.number(row['ci_low'])} to {wording.number(row['ci_high'])}",
        )
        for _, row in found.to_frame().iterrows()
    )
    notes = (
        found.summary(),
        "Scores of Bradley and Terry (1952), natural logarithms that sum to 0. Standard errors take the comparisons as "
        "independent, although each participant gives several.",
    )
    return Section("preferences", title, header, 1, rows, notes)


def _repeats(report: StudyReport) -> Section:
    rows, reasons = [], []
    for one in report.repeats:
        if isinstance(one.result, Unavailable):
            reasons.append(one.result.reason)
            r = NOTHING
        else:
            r = wording.share(one.result.r)
        rows.append((one.score, str(one.n), wording.number(one.mean_difference), r))
    header = ("Score", "Trials shown twice", "Mean difference", "r")
    notes = ("Each trial against its hidden repeat by the same rater.", *dict.fromkeys(reasons))
    return Section("repeats", "Agreement of raters with themselves", header, 1, tuple(rows), notes)
