"""The conditions compared: the paper's own choice of unit beside the right ones, and why they differ."""

import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, results_section, stacked
from evaluation.report.condition_tests import INDEPENDENT, Comparison, Line, frame_of
from evaluation.report.pairs import pairs_of_conditions
from evaluation.report.score_table import score_tables
from evaluation.report.section import Section, label
from evaluation.statistics import wording
from evaluation.statistics.mixed.result import CrossedMixedModel
from evaluation.statistics.ordinal.crossed import CrossedCumulativeLogit

WHY_UNITS_DIFFER = (
    "Units: Jia et al. (2013), Table 10, take the mean of each stimulus in each condition as a value of independent "
    "groups, F(2, 57) for three conditions of 20 stimuli. Where the same stimuli stand in all conditions, what makes "
    "some of them better in general is part of that test's error, which makes it too cautious; that raters differ in "
    "what they think of the conditions is not part of it, which makes it too bold. Repeated measures by stimulus, F(2, "
    "38), take the stimuli out and speak for other stimuli and the same raters; by rater, F(2, 28) for 15 raters, for "
    "other raters and the same stimuli; min F′ for others of both, cautiously. The mixed model takes single ratings, "
    "with raters and stimuli as random; if effects of conditions may vary over both, it is the one to report. Models "
    "of intercepts alone, linear or cumulative-logit, find differences too easily where those effects do vary."
)
LATIN_SQUARE = (
    "Each rater saw each stimulus in one condition, so that a rater's means of conditions are of different stimuli: "
    "the test by rater has differences of stimuli in its error, too."
)
BETWEEN = "Each rater saw one condition, so that raters are independent groups; no test within raters is possible."
TOO_MANY = (
    "There are too many raters and stimuli to let effects of the conditions vary over both in reasonable time. The "
    "mixed model without that finds differences too easily; min F′ allows for it: report that."
)


def comparison(report: StudyReport) -> Block | None:
    """Return the tests of the conditions on each score, post hoc comparisons and effect sizes.

    Parameters
    ----------
    report : StudyReport
        The analysis of a study.

    Returns
    -------
    Block or None
        None for a study of one condition, or without scores.

    References
    ----------
    Jia et al. (2013), section 5.4 and Table 10; Baayen, Davidson and Bates (2008), Journal of Memory and Language
    59:390, on raters and stimuli as crossed random effects.
    """
    compared = [Comparison(one) for one in score_tables(report) if len(one.conditions) > 1]
    if not compared:
        return None
    sections: list[Section] = []
    frames: dict[str, pd.DataFrame] = {}
    sentences = []
    for one in compared:
        opinion, slug = one.score.opinion, one.score.slug
        # Of scores that are not opinions, the tests that answer the study's question.
        shown = [line for line in _lines(one) if opinion or not (line[1] == INDEPENDENT or line[0] == "Friedman test")]
        notes = [*([] if sections else [WHY_UNITS_DIFFER, *_on_design(report)]), *([] if one.may_vary else [TOO_MANY])]
        section = results_section(f"comparison_{slug}", f"{one.score.score}: conditions compared", shown, notes)
        sections.append(section)
        tests = {f"{name}, by {unit}": found for name, unit, found in shown}
        frames[section.name] = stacked(tests, "analysis", frame_of)
        model = _model(report, one)
        if model is not None and opinion:
            sections.append(model[0])
            sentences.append(_sentence(report, one))
        frames |= {} if model is None else model[1]
        if one.score.ordinal and isinstance(one.ordinal, CrossedCumulativeLogit):
            frames[f"ordinal_model_{slug}"] = one.ordinal.to_frame()
        for pairs, frame in pairs_of_conditions(report, one) if opinion else ():
            sections.append(pairs)
            frames[pairs.name] = frame
    return Block(tuple(sections), frames, tuple(sentences))


def _lines(one: Comparison) -> list[Line]:
    return [*one.as_independent(), *one.within(), *one.of_ratings()]


def _on_design(report: StudyReport) -> list[str]:
    assigned = {part.presentation.assignment for part in report.spec.all_parts}
    return [*([LATIN_SQUARE] if "latin_square" in assigned else []), *([BETWEEN] if "between" in assigned else [])]


def _sentence(report: StudyReport, one: Comparison) -> str:
    found = one.mixed
    means = [
        f"{label(report.spec.condition(name).label)} {wording.number(float(values.mean()))}"
        for name, values in one.groups.items()
    ]
    test = found.reason if not isinstance(found, CrossedMixedModel) else found.apa()
    return f"{one.score.score}: {', '.join(means)}; raters and stimuli random: {test}"


def _model(report: StudyReport, one: Comparison) -> tuple[Section, dict[str, pd.DataFrame]] | None:
    """Return what the mixed model estimates: means of the conditions, and how much raters and stimuli vary."""
    found, slug = one.mixed, one.score.slug
    if not isinstance(found, CrossedMixedModel):
        return None
    rows = [
        (
            label(report.spec.condition(name).label),
            wording.number(mean.estimate),
            wording.number(mean.se),
            f"{wording.number(mean.ci[0])} to {wording.number(mean.ci[1])}",
        )
        for name, mean in zip(one.conditions, found.means, strict=True)
    ]
    rows += [(f"SD of {effect.term}", wording.number(effect.sd), "", "") for effect in found.random]
    rows.append(("SD of the rest", wording.number(found.sigma), "", ""))
    random = found.random_frame()
    frames = {
        f"mixed_model_{slug}": pd.concat([found.means_frame(), random], ignore_index=True),
        f"mixed_fixed_{slug}": found.to_frame(),
        f"mixed_random_{slug}": random,
    }
    note = (
        "Means of the conditions by the linear mixed model, with intervals that hold for other raters and other "
        "stimuli, and the standard deviations of its random effects."
    )
    header = ("Condition or effect", "Estimate", "SE", "95% CI")
    return Section(f"mixed_model_{slug}", f"{one.score.score}: mixed model", header, 1, tuple(rows), (note,)), frames
