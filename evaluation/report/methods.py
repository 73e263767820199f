"""The paragraph on methods that can be pasted into a paper."""

from collections.abc import Mapping

from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block
from evaluation.report.condition_tests import Comparison
from evaluation.report.design import stimuli_shown
from evaluation.report.score_table import score_tables
from evaluation.screening.report import MANUAL
from evaluation.statistics.wording import counted
from evaluation.study import Part

_ASSIGNMENTS = {
    "full": "Every participant was to rate every clip",
    "latin_square": "Every participant was to rate every stimulus once, the conditions rotated over participants by a "
    "Latin square",
    "between": "Every participant was to rate the stimuli in one condition (between participants)",
}
_ORDERS = {
    "random": "in a random order of their own",
    "fixed": "in the same order",
    "blocks": "one condition after the other, in random order",
    "williams": "one condition after the other, in an order balanced by a Williams square",
}
_TOGETHER = {"single": "", "pairs": ", two conditions of a stimulus on a page", "all": ", all conditions on a page"}

_OF_BLOCKS = {
    "precision": (
        "Intervals of mean opinion scores are Student's, Clopper and Pearson's for the scaled mean, and bootstrap "
        "intervals (BCa)."
    ),
    "rater_agreement": (
        "Agreement of raters is given as the mean pairwise Pearson correlation and Krippendorff's alpha with a "
        "bootstrap interval over clips."
    ),
    "rater_quality": (
        "Bias and inconsistency of raters follow the model of Recommendation ITU-T P.910; Recommendation ITU-R "
        "BT.500-14 was applied to see whom it would reject."
    ),
    "scale_quality": (
        "Reliability of the PAD scale is given as Cronbach's alpha and as McDonald's omega of a one-factor "
        "maximum-likelihood model."
    ),
    "intended_words": "Intended and chosen words were compared by hit rates and Wagner's (1993) unbiased hit rate.",
}
"""What the paragraph on methods says of each block."""


def methods(report: StudyReport, blocks: Mapping[str, Block]) -> str:
    """Return a paragraph on methods, from the study file and what was computed.

    Parameters
    ----------
    report : StudyReport
        The analysis.
    blocks : mapping of str to Block
        What the full report has, by name.
    """
    spec = report.spec
    shown = len(report.conditions)
    sentences = [
        f"{counted(report.participants, 'participant')} rated {counted(stimuli_shown(report), 'stimulus', 'stimuli')} "
        f"in {counted(shown, 'condition')} ({counted(report.trials, 'trial')}) in a web browser with padlab (study "
        f"{spec.slug}, digest {report.digest[:12]})."
    ]
    sentences += [_presented(part, alone=spec.parts is None) for part in spec.all_parts]
    sentences += _instruments(report)
    sentences += _screened(report)
    if "comparison" in blocks:
        sentences.append(_compared(report, blocks["comparison"]))
    sentences += [text for name, text in _OF_BLOCKS.items() if name in blocks]
    sentences.append(
        "Intervals have a confidence of 95 %, and tests of difference are two-sided; random numbers of resampling come "
        f"from the seed {report.study.seed}, so that the report can be made again."
    )
    return " ".join(sentences)


def _instruments(report: StudyReport) -> list[str]:
    known = {
        "pad12": "Pleasure, arousal and dominance were rated with the 12-item abbreviated PAD scale and scored by "
        "Eq. 13 of Jia et al. (2013).",
        "pad5": "Pleasure, arousal and dominance were rated directly on five points.",
        "sam": "Pleasure, arousal and dominance were rated with the Self-Assessment Manikin (Bradley and Lang, 1994).",
        "mos5": "Opinions were given on the five-point scale of absolute category rating (ITU-T P.800).",
    }
    asked = report.spec.instrument_names
    rest = [name for name in asked if name not in known]
    return [
        *(text for name, text in known.items() if name in asked),
        *([f"Participants also answered {', '.join(rest)}."] if rest else []),
    ]


def _compared(report: StudyReport, block: Block) -> str:
    """Return what was made of the conditions; what could not be fitted is not claimed."""

    def has(kind: str) -> bool:
        return any(name.startswith(kind) for name in block.frames)

    sentences = []
    if has("mixed_model_"):
        compared = [Comparison(one) for one in score_tables(report) if len(one.conditions) > 1]
        varying = all(one.may_vary for one in compared)
        random = "raters, stimuli and their interactions with condition" if varying else "raters and stimuli"
        sentences.append(
            "Conditions were compared by linear mixed models of the single ratings with condition as fixed and "
            f"{random} as crossed random effects, fitted by restricted maximum likelihood, with Satterthwaite's "
            "degrees of freedom."
        )
    if has("ordinal_model_"):
        sentences.append(
            "Answers to single questions were also analysed by a cumulative-logit mixed model with random intercepts "
            "of raters and stimuli (Laplace approximation)."
        )
    independent = " and, for comparison with Jia et al. (2013), of independent groups of stimuli"
    sentences.append(
        "Analyses of variance by stimulus and by rater (Greenhouse-Geisser corrected)"
        f"{independent if has('posthoc_') else ''} are reported, too."
    )
    if has("posthoc_"):
        sentences.append(
            "Pairs of conditions were compared with Holm's correction; Tukey's and Games and Howell's tests are "
            "reported, too."
        )
    equivalence = report.study.analysis.equivalence
    if equivalence is not None and has("effects_"):
        sentences.append(
            f"Equivalence within {equivalence:g} points was tested by two one-sided tests at the 5 % level, with "
            "intervals of 90 %."
        )
    return " ".join(sentences)


def _presented(part: Part, *, alone: bool) -> str:
    shown = part.presentation
    about = "" if alone else f" in the part {part.name}"
    sentence = f"{_ASSIGNMENTS[shown.assignment]}{about}{_TOGETHER[shown.together]}, {_ORDERS[shown.order]}"
    if shown.per_participant is not None:
        sentence += f", of which each participant got {shown.per_participant} trials"
    return f"{sentence}."


def _screened(report: StudyReport) -> list[str]:
    if report.screening is None:
        return []
    rules = [one for one in dict.fromkeys(finding.rule for finding in report.screening.findings) if one != MANUAL]
    every, used = len(report.screening.raters), len(report.screening.used)
    by = [f"by rules fixed in the study file ({', '.join(rules)})"] if rules else []
    if any(finding.rule == MANUAL for finding in report.screening.findings):
        by.append("by the experimenter's own decisions")
    sentence = f"Raters were screened {' and '.join(by)}; {every - used} of {every} were left out"
    if used == every:
        return [f"{sentence}."]
    return [f"{sentence} of the analyses of raters used, and the main results are given with and without them."]
