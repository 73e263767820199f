"""The conditions compared: the paper's own choice of unit beside the right ones, and why they differ."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, results_section, stacked
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable, score_tables
from evaluation.report.section import NOTHING, Section
from evaluation.statistics import wording
from evaluation.statistics.anova import one_way
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.assumptions import levene, shapiro_residuals
from evaluation.statistics.comparisons import Comparisons
from evaluation.statistics.effect_size import cliffs_delta, cohens_d_paired, hedges_g
from evaluation.statistics.equivalence import tost_paired
from evaluation.statistics.mixed import crossed_mixed_model
from evaluation.statistics.mixed_result import CrossedMixedModel
from evaluation.statistics.ordinal_crossed import crossed_cumulative_logit
from evaluation.statistics.posthoc import games_howell, paired_comparisons, tukey_hsd
from evaluation.statistics.rank_tests import friedman, kruskal_wallis
from evaluation.statistics.repeated_measures import repeated_measures
from evaluation.statistics.result import Result
from evaluation.statistics.unit_means import unit_means
from evaluation.statistics.welch import welch

ORDINAL_RATINGS = 20_000
"""Ratings up to which the report fits the cumulative-logit mixed model."""

VARYING_LEVELS = 1_500
"""Raters and stimuli, times conditions, up to which effects of the conditions may vary over both."""

INDEPENDENT = "stimulus, conditions as independent groups"
BY_STIMULUS = "stimulus, conditions within"
BY_RATER = "rater, conditions within"
RATING = "rating, raters and stimuli random"
VARYING = "rating, raters and stimuli random, and with them the effects of conditions"

WHY_UNITS_DIFFER = (
    "Units: Jia et al. (2013), Table 10, take the mean of each stimulus in each condition as a value of independent "
    "groups, F(2, 57) for three conditions of 20 stimuli. The same stimuli stand in all conditions, so what makes some "
    "of them better in general is part of that test's error: it is too cautious where stimuli differ much. Repeated "
    "measures take it out: F(2, 38) by stimulus, which speaks for other stimuli and the same raters, or F(2, 28) by "
    "rater for 15 raters, which speaks for other raters and the same stimuli. The mixed model takes single ratings, "
    "with raters and stimuli as random, and speaks for others of both; if effects of conditions may vary over raters "
    "and stimuli it is the one to report, and without that it finds differences too easily where they do vary."
)

TOO_MANY = (
    "There are too many raters and stimuli to let effects of the conditions vary over both, which would take minutes. "
    "The mixed model without that finds differences too easily: read it with the tests by stimulus and by rater, and "
    "call a difference general only if all three find it."
)

Attempt = Result | Unavailable
Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The conditions compared on one score."""

    score: ScoreTable

    @property
    def conditions(self) -> tuple[str, ...]:
        """The conditions with ratings, in the order of the study file."""
        return self.score.conditions

    @property
    def table(self) -> pd.DataFrame:
        """One row for each rating: participant, stimulus, condition, value."""
        return self.score.table

    @cached_property
    def groups(self) -> Mapping[str, FloatArray]:
        """Means of the stimuli over raters, by condition."""
        means = self.table.groupby(["stimulus", "condition"], sort=False)["value"].mean().reset_index()
        return {name: means.loc[means["condition"] == name, "value"].to_numpy(dtype=float) for name in self.conditions}

    def matrix(self, unit: str) -> tuple[FloatArray, tuple[str, ...]]:
        """Return means of units (rows) in the conditions, and what was left out to have them complete."""
        found = unit_means(self.table["value"].to_numpy(), self.table["condition"].tolist(), self.table[unit].tolist())
        places = [found.conditions.index(name) for name in self.conditions]
        return found.matrix[:, places], found.flags

    @property
    def may_vary(self) -> bool:
        """Whether effects of the conditions may vary over raters and stimuli: with too many it takes minutes."""
        units = self.table["participant"].nunique() + self.table["stimulus"].nunique()
        return units * len(self.conditions) <= VARYING_LEVELS

    @cached_property
    def mixed(self) -> CrossedMixedModel | Unavailable:
        """The mixed model of the single ratings, in which effects of the conditions vary if there are few enough."""
        return attempt(lambda: self._mixed(slopes=self.may_vary))

    def _mixed(self, *, slopes: bool) -> CrossedMixedModel:
        return crossed_mixed_model(
            self.table["value"].to_numpy(),
            pd.Categorical(self.table["condition"], categories=list(self.conditions)),
            self.table["participant"].to_numpy(),
            pd.Categorical(self.table["stimulus"]),
            slopes=slopes,
        )

    def as_independent(self) -> list[tuple[str, str, Attempt]]:
        """Return the tests that take the conditions as independent groups of stimuli."""
        groups = self.groups
        return [
            ("One-way ANOVA (as Jia et al., 2013)", INDEPENDENT, attempt(lambda: one_way(groups))),
            ("Welch's ANOVA", INDEPENDENT, attempt(lambda: welch(groups))),
            ("Kruskal-Wallis test", INDEPENDENT, attempt(lambda: kruskal_wallis(groups))),
            ("Brown-Forsythe test of variances", INDEPENDENT, attempt(lambda: levene(groups))),
            ("Shapiro-Wilk test of residuals", INDEPENDENT, attempt(lambda: shapiro_residuals(groups))),
        ]

    def within(self) -> list[tuple[str, str, Attempt]]:
        """Return the tests within stimuli and within raters."""

        def measured(unit: str) -> Result:
            matrix, _ = self.matrix(unit)
            return repeated_measures(matrix, self.conditions)

        return [
            ("Repeated measures ANOVA", BY_STIMULUS, attempt(lambda: measured("stimulus"))),
            ("Friedman test", BY_STIMULUS, attempt(lambda: friedman(self.matrix("stimulus")[0], self.conditions))),
            ("Repeated measures ANOVA", BY_RATER, attempt(lambda: measured("participant"))),
        ]

    def of_ratings(self) -> list[tuple[str, str, Attempt]]:
        """Return the mixed models of single ratings."""
        name = "Linear mixed model (REML, Satterthwaite)"
        found: list[tuple[str, str, Attempt]] = [(name, VARYING if self.may_vary else RATING, self.mixed)]
        if self.may_vary:
            intercepts = attempt(lambda: self._mixed(slopes=False))
            found.append(("Linear mixed model, intercepts alone", RATING, intercepts))
        if self.score.ordinal:
            found.append(("Cumulative-logit mixed model (Laplace)", RATING, attempt(self._ordinal)))
        return found

    def _ordinal(self) -> Result:
        if len(self.table) > ORDINAL_RATINGS:
            raise InsufficientDataError(
                f"Not fitted: it takes long for the {len(self.table)} ratings, more than {ORDINAL_RATINGS}; "
                "evaluation.statistics.ordinal_crossed fits it."
            )
        return crossed_cumulative_logit(
            self.table["value"].to_numpy().astype(int),
            pd.Categorical(self.table["condition"], categories=list(self.conditions)).tolist(),
            self.table["participant"].tolist(),
            self.table["stimulus"].tolist(),
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
        name, opinion = one.score.score, one.score.score == "MOS"
        lines = [*one.as_independent(), *one.within(), *one.of_ratings()]
        # Of scores that are not opinions, the tests that answer the study's question.
        shown = lines if opinion else [line for line in lines if line[1] != INDEPENDENT and line[0] != "Friedman test"]
        notes = [WHY_UNITS_DIFFER] if not sections else []
        if not one.may_vary:
            notes.append(TOO_MANY)
        section = results_section(f"comparison_{one.score.slug}", f"{name}: conditions compared", shown, notes)
        sections.append(section)
        frames[section.name] = stacked(
            {f"{analysis}, by {unit}": result for analysis, unit, result in shown}, "analysis"
        )
        if opinion:
            for pairs, frame in _pairs(report, one):
                sections.append(pairs)
                frames[pairs.name] = frame
        if isinstance(one.mixed, CrossedMixedModel):
            sentences.append(f"{name} of the conditions, raters and stimuli random: {one.mixed.apa()}")
            frames[f"mixed_model_{one.score.slug}"] = one.mixed.to_frame()
    return Block(tuple(sections), frames, tuple(sentences))


def _pairs(report: StudyReport, found: Comparison) -> list[tuple[Section, pd.DataFrame]]:
    pairs = [(a, b) for place, a in enumerate(found.conditions) for b in found.conditions[place + 1 :]]
    return [_posthoc(found, pairs), _effects(found, pairs, report.study.analysis.equivalence)]


def _posthoc(found: Comparison, pairs: Sequence[Pair]) -> tuple[Section, pd.DataFrame]:
    tests: dict[str, Comparisons | Unavailable] = {
        "Tukey HSD": attempt(lambda: tukey_hsd(found.groups)),
        "Games-Howell": attempt(lambda: games_howell(found.groups)),
        "Paired by stimulus, Holm": attempt(
            lambda: paired_comparisons(found.matrix("stimulus")[0], conditions=found.conditions)
        ),
    }
    mixed = found.mixed
    contrasts = mixed.contrasts_frame() if isinstance(mixed, CrossedMixedModel) else pd.DataFrame()
    rows = [
        (
            f"{b} − {a}",
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
    ]
    section = Section("posthoc_mos", "MOS: pairs of conditions", header, 1, tuple(rows), tuple(dict.fromkeys(notes)))
    frame = stacked(dict(tests), "test")
    if len(contrasts):
        frame = pd.concat([frame, contrasts.assign(test="Linear mixed model")], ignore_index=True)
    return section, frame


def _difference(found: Comparison, a: str, b: str) -> str:
    return wording.number(float(found.groups[b].mean() - found.groups[a].mean()))


def _adjusted(test: Comparisons | Unavailable, a: str, b: str) -> str:
    return NOTHING if isinstance(test, Unavailable) else _p(test.pair(a, b).p_adjusted)


def _p(p: float) -> str:
    return NOTHING if np.isnan(p) else wording.p_value(p).removeprefix("p ").removeprefix("= ")


def _effects(found: Comparison, pairs: Sequence[Pair], equivalence: float | None) -> tuple[Section, pd.DataFrame]:
    matrix, left_out = found.matrix("stimulus")
    rows, frames, notes = [], [], list(left_out)
    for a, b in pairs:
        first, second = (matrix[:, found.conditions.index(name)] for name in (a, b))
        results: dict[str, Attempt] = {
            "Cohen's d_z (stimuli, paired)": attempt(partial(cohens_d_paired, second, first)),
            "Hedges' g (stimuli, independent)": attempt(partial(hedges_g, found.groups[b], found.groups[a])),
            "Cliff's δ (stimuli, independent)": attempt(partial(cliffs_delta, found.groups[b], found.groups[a])),
        }
        if equivalence is not None:
            results[f"Equivalence within ±{equivalence:g} (TOST, paired)"] = attempt(
                partial(tost_paired, second, first, bounds=equivalence)
            )
        rows += [
            (f"{b} − {a}", name, result.reason if isinstance(result, Unavailable) else result.apa())
            for name, result in results.items()
        ]
        notes += [flag for result in results.values() if isinstance(result, Result) for flag in result.flags]
        frames.append(stacked(results, "measure").assign(pair=f"{b} - {a}"))
    header = ("Pair", "Measure", "Result")
    section = Section("effects_mos", "MOS: effect sizes", header, 3, tuple(rows), tuple(dict.fromkeys(notes)))
    return section, pd.concat(frames, ignore_index=True)
