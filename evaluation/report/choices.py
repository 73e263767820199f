"""How well raters agree in questions with one choice."""

from functools import partial

import numpy as np
import pandas as pd

from evaluation.instruments import ChoiceItem
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, stacked
from evaluation.report.ratings import Unavailable
from evaluation.report.section import Section
from evaluation.responses import alike, asked_about_clips, several, statistical
from evaluation.seeding import generator
from evaluation.statistics.agreement.fleiss import fleiss_kappa
from evaluation.statistics.agreement.krippendorff import krippendorff_alpha
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.result import Result

_SOURCES = (
    "Fleiss' kappa of the clips that the same number of raters answered, and Krippendorff's alpha for names, which "
    "takes all clips with two answers."
)


def choice_agreement(report: StudyReport) -> Block | None:
    """Return the agreement of raters in each question with one choice; None if there is none with two raters."""
    lines: list[tuple[str, str, str]] = []
    results: dict[str, Result | Unavailable] = {}
    flags: list[str] = []
    for instrument in asked_about_clips(report.spec):
        for item in statistical(instrument):
            if not isinstance(item, ChoiceItem) or several(item):
                continue
            question = f"{instrument.name}.{item.id}"
            matrix = _chosen(report, instrument.name, item.id)
            if matrix.shape[1] < 2:
                continue
            counts = np.stack([(matrix == value).sum(axis=1) for value in item.values], axis=1)
            answered = counts[counts.sum(axis=1) > 1]
            rng = generator(report.study.seed, "report", "choices", question)
            names = [str(option.value) for option in item.options]
            found = {
                "Fleiss' kappa": attempt(partial(fleiss_kappa, answered, categories=names)),
                "Krippendorff's alpha": attempt(partial(krippendorff_alpha, matrix, level="nominal", rng=rng)),
            }
            for name, one in found.items():
                lines.append((question, name, one.reason if isinstance(one, Unavailable) else one.apa()))
                results[f"{question}, {name}"] = one
                flags += [f"{question}, {name}: {flag}" for flag in (one.flags if isinstance(one, Result) else ())]
    if not lines:
        return None
    header = ("Question", "Measure", "Result")
    section = Section("choices", "Agreement in choices", header, 3, tuple(lines), (_SOURCES, *flags))
    return Block((section,), {"choices": stacked(results, "measure")})


def _chosen(report: StudyReport, instrument: str, item: str) -> FloatArray:
    """Return the values chosen, shape (clips, raters); NaN where there is none, the last where there are several."""
    own = report.answers[(report.answers["instrument"] == instrument) & (report.answers["item"] == item)]
    clips, cells = alike(own, ["stimulus", "condition"])
    raters, people = pd.factorize(own["participant"])
    matrix = np.full((len(cells), len(people)), np.nan)
    matrix[clips, raters] = own["keyed"].to_numpy(dtype=float)
    return matrix
