"""Pairs of conditions compared on the mean opinion score: four post hoc tests, and effect sizes."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from evaluation.report.analysis import StudyReport
from evaluation.report.block import attempt, stacked
from evaluation.report.condition_tests import Attempt, Comparison
from evaluation.report.ratings import Unavailable
from evaluation.report.section import NOTHING, Section, label
from evaluation.statistics import wording
from evaluation.statistics.comparisons import Comparisons
from evaluation.statistics.effect_size import cliffs_delta, cohens_d_paired, hedges_g
from evaluation.statistics.equivalence import tost_paired
from evaluation.statistics.mixed.result import CrossedMixedModel
from evaluation.statistics.posthoc import games_howell, paired_comparisons, tukey_hsd
from evaluation.statistics.result import Result

Pair = tuple[str, str]

OF_MEANS = (
    "Effect sizes of the stimuli's means over raters: averaging takes out most of the noise of single ratings, so that "
    "they are larger than those of ratings, and not to be compared with them."
)


def pairs_of_conditions(report: StudyReport, found: Comparison) -> list[tuple[Section, pd.DataFrame]]:
    """Return the table of post hoc tests and that of effect sizes, each with its frame."""
    pairs = [(a, b) for place, a in enumerate(found.conditions) for b in found.conditions[place + 1 :]]
    names = {name: label(report.spec.condition(name).label) for name in found.conditions}
    return [_posthoc(found, pairs, names), _effects(found, pairs, names, report.study.analysis.equivalence)]


def _posthoc(found: Comparison, pairs: Sequence[Pair], names: dict[str, str]) -> tuple[Section, pd.DataFrame]:
    tests: dict[str, Comparisons | Unavailable] = {
        "Tukey HSD": attempt(lambda: tukey_hsd(found.groups)),
        "Games-Howell": attempt(lambda: games_howell(found.groups)),
        "Paired by stimulus, Holm": attempt(lambda: _paired(found)),
    }
    mixed = found.mixed
    rows = [
        (
            f"{names[b]} − {names[a]}",
            _difference(found, a, b),
            *(_adjusted(test, a, b) for test in tests.values()),
            NOTHING if isinstance(mixed, Unavailable) else _p(mixed.contrasts[place].p_holm),
        )
        for place, (a, b) in enumerate(pairs)
    ]
    header = ("Pair", "Difference", *(f"p, {name}" for name in tests), "p, mixed model, Holm")
    notes = [
        "Difference of the means over stimuli. Tukey's and Games and Howell's tests take the conditions as independent "
        "groups of stimuli, the others do not; all p values are adjusted for the number of pairs.",
        *(test.reason for test in tests.values() if isinstance(test, Unavailable)),
        *(f"{name}: {flag}" for name, test in tests.items() if isinstance(test, Comparisons) for flag in test.flags),
    ]
    section = Section("posthoc_mos", "MOS: pairs of conditions", header, 1, tuple(rows), tuple(dict.fromkeys(notes)))
    parts = [
        stacked(dict(tests), "test"),
        *([_contrasts(mixed, pairs)] if isinstance(mixed, CrossedMixedModel) else []),
    ]
    frame = pd.concat([one for one in parts if len(one)] or parts[:1], ignore_index=True)
    shown = pd.DataFrame(
        {
            "test": "means",
            "first": [b for _, b in pairs],
            "second": [a for a, _ in pairs],
            "difference": [float(found.groups[b].mean() - found.groups[a].mean()) for a, b in pairs],
        }
    )
    return section, pd.concat([shown, frame], ignore_index=True)


def _paired(found: Comparison) -> Comparisons:
    matrix, left_out = found.matrix("stimulus")
    result = paired_comparisons(matrix, conditions=found.conditions)
    return replace(result, flags=(*left_out, *result.flags))


def _contrasts(mixed: CrossedMixedModel, pairs: Sequence[Pair]) -> pd.DataFrame:
    """Return the model's contrasts turned as the other tests', the later condition less the earlier."""
    return pd.DataFrame(
        [
            {
                "test": "Linear mixed model, Holm",
                "first": b,
                "second": a,
                "difference": -one.estimate,
                "t": -one.t,
                "df": one.df,
                "p": one.p,
                "p_adjusted": one.p_holm,
                "ci_low": -one.ci[1],
                "ci_high": -one.ci[0],
            }
            for (a, b), one in zip(pairs, mixed.contrasts, strict=True)
        ]
    )


def _difference(found: Comparison, a: str, b: str) -> str:
    return wording.number(float(found.groups[b].mean() - found.groups[a].mean()))


def _adjusted(test: Comparisons | Unavailable, a: str, b: str) -> str:
    return NOTHING if isinstance(test, Unavailable) else _p(test.pair(a, b).p_adjusted)


def _p(p: float) -> str:
    return NOTHING if math.isnan(p) else wording.p_column(p)


def _effects(
    found: Comparison, pairs: Sequence[Pair], names: dict[str, str], equivalence: float | None
) -> tuple[Section, pd.DataFrame]:
    rows, frames, notes = [], [], [OF_MEANS]
    for a, b in pairs:
        pair = f"{names[b]} − {names[a]}"
        results = _effects_of_pair(found, a, b, equivalence)
        rows += [
            (pair, name, result.reason if isinstance(result, Unavailable) else result.apa())
            for name, result in results.items()
        ]
        notes += [f"{pair}: {flag}" for one in results.values() if isinstance(one, Result) for flag in one.flags]
        frames.append(stacked(results, "measure").assign(pair=f"{b} - {a}"))
    header = ("Pair", "Measure", "Result")
    section = Section("effects_mos", "MOS: effect sizes", header, 3, tuple(rows), tuple(dict.fromkeys(notes)))
    return section, pd.concat(frames, ignore_index=True)


def _effects_of_pair(found: Comparison, a: str, b: str, equivalence: float | None) -> dict[str, Attempt]:
    def columns() -> tuple[np.ndarray, np.ndarray]:
        matrix, _ = found.matrix("stimulus")
        return matrix[:, found.conditions.index(b)], matrix[:, found.conditions.index(a)]

    results: dict[str, Attempt] = {
        "Cohen's d_z (stimuli, paired)": attempt(lambda: cohens_d_paired(*columns())),
        "Hedges' g (stimuli, independent)": attempt(partial(hedges_g, found.groups[b], found.groups[a])),
        "Cliff's δ (stimuli, independent)": attempt(partial(cliffs_delta, found.groups[b], found.groups[a])),
    }
    if equivalence is not None:
        results[f"Equivalence within ±{equivalence:g} (TOST, paired)"] = attempt(
            lambda: tost_paired(*columns(), bounds=equivalence)
        )
    return results
