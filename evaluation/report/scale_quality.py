"""How good the 12-item questionnaire for pleasure, arousal and dominance is as a scale, in a study's answers."""

import math

import numpy as np
import pandas as pd

from evaluation.instruments.pad12 import PAD12
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt
from evaluation.report.ratings import Unavailable
from evaluation.report.section import NOTHING, Section
from evaluation.responses import KEY, alike
from evaluation.seeding import generator
from evaluation.statistics import wording
from evaluation.statistics.scale_reliability.pad import DimensionQuality, pad_scale_quality

REPLICATES, FEWER_REPLICATES = 1_000, 200
MANY_ROWS = 5_000
"""Rows above which intervals of omega come from fewer bootstrap samples: they are narrow then, and samples are slow."""

_SOURCES = (
    "Alpha: Cronbach's, with Feldt's interval. Omega: McDonald's total of a one-factor model by maximum likelihood, "
    "with a bootstrap interval. Item-total r: smallest and largest correlation of an item with the sum of the others. "
    "One factor: fit of that model, and the first eigenvalue over the second."
)


def scale_quality(report: StudyReport) -> Block | None:
    """Return the quality of the questionnaire for each dimension; None if the study does not ask it."""
    if PAD12.name not in report.spec.instrument_names:
        return None
    answers = report.answers[report.answers["instrument"] == PAD12.name]
    table = _one_row_for_each_clip(answers)
    found = attempt(
        lambda: pad_scale_quality(
            table,
            rater="participant",
            stimulus="stimulus",
            rng=generator(report.study.seed, "report", "scale quality"),
            replicates=REPLICATES if len(table) <= MANY_ROWS else FEWER_REPLICATES,
        )
    )
    title = "Quality of the PAD questionnaire"
    header = ("Dimension", "Items", "α", "95% CI", "ω", "95% CI ", "Item-total r", "One factor")
    if isinstance(found, Unavailable):
        return Block(
            (Section("scale_quality", title, header, 1, (), (found.reason,)),), {"scale_quality": pd.DataFrame()}
        )
    rows = tuple(_row(one) for one in found.dimensions)
    own = [flag for one in found.dimensions for flag in one.flags]
    notes = tuple(dict.fromkeys([_SOURCES, *found.flags, *own]))
    section = Section("scale_quality", title, header, 1, rows, notes)
    rest = [_rest(one) for one in found.dimensions]
    frame = found.to_frame().assign(
        rest_r_min=[min(one, default=math.nan) for one in rest], rest_r_max=[max(one, default=math.nan) for one in rest]
    )
    return Block((section,), {"scale_quality": frame, "scale_items": found.item_frame()})


def _one_row_for_each_clip(answers: pd.DataFrame) -> pd.DataFrame:
    """Return keyed answers with a column for each item, and participant and stimulus."""
    clips, first = alike(answers, KEY, keep=["stimulus"])
    items, names = pd.factorize(answers["item"])
    wide = np.full((len(first), len(names)), np.nan)
    wide[clips, items] = answers["keyed"].to_numpy(dtype=float)
    return pd.concat([first[["participant", "stimulus"]], pd.DataFrame(wide, columns=list(names))], axis=1)


def _rest(found: DimensionQuality) -> list[float]:
    return [] if found.alpha is None else [item.rest_r for item in found.alpha.items if item.rest_r is not None]


def _row(found: DimensionQuality) -> tuple[str, ...]:
    alpha, omega, factor = found.alpha, found.omega, found.factor
    rest = _rest(found)
    fit = None if factor is None else factor.fit
    ratio = None if factor is None else factor.eigenvalue_ratio
    one = [
        *([] if fit is None else [f"RMSEA {wording.share(fit.rmsea)}"]),
        *([] if fit is None or fit.cfi is None else [f"CFI {wording.share(fit.cfi)}"]),
        *([] if ratio is None else [f"eigenvalue ratio {wording.number(ratio, 1)}"]),
    ]
    return (
        found.dimension,
        str(len(found.items)),
        NOTHING if alpha is None else wording.share(alpha.alpha),
        NOTHING if alpha is None else _interval(alpha.ci),
        NOTHING if omega is None else wording.share(omega.omega),
        NOTHING if omega is None else _interval(omega.ci),
        f"{wording.share(min(rest))} to {wording.share(max(rest))}" if rest else NOTHING,
        ", ".join(one) or NOTHING,
    )


def _interval(ci: tuple[float, float] | None) -> str:
    return NOTHING if ci is None else f"{wording.share(ci[0])} to {wording.share(ci[1])}"
