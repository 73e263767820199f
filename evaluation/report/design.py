"""The design of a study as a table, and the paragraph on methods that can be pasted into a paper."""

import pandas as pd

from evaluation.instruments.pad12 import PAD12
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block
from evaluation.report.score_table import score_tables
from evaluation.report.section import Section, label
from evaluation.study import Part

_ASSIGNMENTS = {
    "full": "Every participant was to rate every stimulus in every condition",
    "latin_square": "Every participant was to rate every stimulus once, the conditions rotated over participants by a "
    "Latin square",
    "between": "Every participant was to rate every stimulus in one condition (between participants)",
}
_ORDERS = {
    "random": "in a random order of their own",
    "fixed": "in the same order",
    "blocks": "one condition after the other, in random order",
    "williams": "one condition after the other, in an order balanced by a Williams square",
}


def design(report: StudyReport) -> Block:
    """Return what the study showed to whom, and how many ratings each clip has."""
    spec = report.spec
    rows = [
        ("Study", spec.slug),
        ("Digest of the study file", report.digest),
        ("Seed of all random orders", str(report.study.seed)),
        ("Conditions", "; ".join(f"{one.name} ({label(one.label)})" for one in spec.conditions)),
        ("Stimuli", str(len(spec.stimuli))),
        ("Instruments", ", ".join(spec.instrument_names)),
    ]
    for part in spec.all_parts:
        about = "" if spec.parts is None else f" of {part.name}"
        rows.append((f"Assignment{about}", f"{part.presentation.assignment}, order {part.presentation.order}"))
        rows += [(f"{name}{about}", str(count)) for name, count in _checks(part) if count]
    rows += [(f"Ratings of each clip, {table.score}", _per_clip(table.table)) for table in score_tables(report)]
    if report.study.quota is not None:
        rows.append(("Participants wanted", str(report.study.quota)))
    section = Section("design", "Design", ("", "Value"), 2, tuple(rows))
    return Block((section,), {"design": pd.DataFrame(rows, columns=["name", "value"])})


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


def methods(report: StudyReport, names: tuple[str, ...]) -> str:
    """Return a paragraph on methods, from the study file and what was computed.

    Parameters
    ----------
    report : StudyReport
        The analysis.
    names : tuple of str
        Names of the blocks that the full report has.
    """
    spec = report.spec
    people, trials = report.participants, report.trials
    sentences = [
        f"{people} {'participant' if people == 1 else 'participants'} rated {len(spec.stimuli)} stimuli in "
        f"{len(report.conditions)} {'condition' if len(report.conditions) == 1 else 'conditions'} "
        f"({trials} trials) in a web browser with padlab (study {spec.slug}, digest {report.digest[:12]})."
    ]
    sentences += [_presented(part, alone=spec.parts is None) for part in spec.all_parts]
    if PAD12.name in spec.instrument_names:
        sentences.append(
            "Pleasure, arousal and dominance were rated with the 12-item abbreviated PAD scale and scored by Eq. 13 of "
            "Jia et al. (2013)."
        )
    if "mos5" in spec.instrument_names:
        sentences.append("Opinions were given on the five-point scale of absolute category rating (ITU-T P.800).")
    sentences += _screened(report)
    if "comparison" in names:
        sentences.append(
            "Conditions were compared by linear mixed models of the single ratings with condition as fixed and raters "
            "and stimuli, and their interactions with condition, as crossed random factors, fitted by restricted "
            "maximum likelihood, with Satterthwaite's degrees of freedom; beside these, analyses of variance by "
            "stimulus and by rater (Greenhouse-Geisser and Huynh-Feldt corrected) and, for comparison with Jia et al. "
            "(2013), one of independent groups are reported. Pairs of conditions were compared with Holm's correction."
        )
    if "rater_agreement" in names:
        sentences.append(
            "Agreement of raters is given as the mean pairwise Pearson correlation, Krippendorff's alpha with a "
            "bootstrap interval over clips, and the intraclass correlations of Shrout and Fleiss (1979)."
        )
    if "precision" in names:
        sentences.append(
            "Intervals of mean opinion scores are Student's, Clopper and Pearson's for the scaled mean, and bootstrap "
            "intervals (BCa)."
        )
    sentences.append(
        "All intervals have a confidence of 95 %, all tests are two-sided; random numbers of resampling come from the "
        f"seed {report.study.seed}, so that the report can be made again."
    )
    return " ".join(sentences)


def _presented(part: Part, *, alone: bool) -> str:
    shown = part.presentation
    about = "" if alone else f" in the part {part.name}"
    sentence = f"{_ASSIGNMENTS[shown.assignment]}{about}, {_ORDERS[shown.order]}"
    if shown.per_participant is not None:
        sentence += f", of which each participant got {shown.per_participant} trials"
    return f"{sentence}."


def _screened(report: StudyReport) -> list[str]:
    if report.screening is None:
        return []
    rules = list(dict.fromkeys(finding.rule for finding in report.screening.findings))
    out = len(report.screening.raters) - len(report.screening.used)
    return [
        f"Raters were screened by rules fixed in the study file ({', '.join(rules)}); {out} of "
        f"{len(report.screening.raters)} were left out of the analyses of used raters, and all results are given with "
        "and without them."
    ]
