"""The tests that compare conditions on one score, each with its unit."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.report.block import attempt
from evaluation.report.ratings import Unavailable
from evaluation.report.score_table import ScoreTable
from evaluation.statistics.anova import one_way
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.assumptions import levene, shapiro_residuals
from evaluation.statistics.min_f import min_f
from evaluation.statistics.mixed.models import crossed_mixed_model
from evaluation.statistics.mixed.result import CrossedMixedModel
from evaluation.statistics.ordinal.crossed import CrossedCumulativeLogit, crossed_cumulative_logit
from evaluation.statistics.rank_tests import friedman, kruskal_wallis
from evaluation.statistics.repeated_measures import RepeatedMeasuresAnova, repeated_measures
from evaluation.statistics.result import Result
from evaluation.statistics.unit_means import unit_means
from evaluation.statistics.welch import welch

ORDINAL_RATINGS = 20_000
"""Ratings up to which the report fits the cumulative-logit mixed model."""

VARYING_LEVELS = 2_400
"""Raters and stimuli, times conditions, up to which effects of the conditions may vary over both."""

INDEPENDENT = "stimulus, conditions as independent groups"
BY_STIMULUS = "stimulus, conditions within"
BY_RATER = "rater, conditions within"
BY_BOTH = "rater and stimulus, conditions within both"
RATING = "rating, raters and stimuli random"
VARYING = "rating, raters and stimuli random, and with them the effects of conditions"

Attempt = Result | Unavailable
Line = tuple[str, str, Attempt]
"""Name of a test, its unit, and what came out."""


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
        if unit not in self._matrices:
            self._matrices[unit] = self._of_units(unit)
        return self._matrices[unit]

    @cached_property
    def _matrices(self) -> dict[str, tuple[FloatArray, tuple[str, ...]]]:
        """What `matrix` has found: several tests ask for the same."""
        return {}

    def _of_units(self, unit: str) -> tuple[FloatArray, tuple[str, ...]]:
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

    def as_independent(self) -> list[Line]:
        """Return the tests that take the conditions as independent groups of stimuli."""
        groups = self.groups
        return [
            ("One-way ANOVA (as Jia et al., 2013)", INDEPENDENT, attempt(lambda: one_way(groups))),
            ("Welch's ANOVA", INDEPENDENT, attempt(lambda: welch(groups))),
            ("Kruskal-Wallis test", INDEPENDENT, attempt(lambda: kruskal_wallis(groups))),
            ("Brown-Forsythe test of variances", INDEPENDENT, attempt(lambda: levene(groups))),
            ("Shapiro-Wilk test of residuals", INDEPENDENT, attempt(lambda: shapiro_residuals(groups))),
        ]

    def within(self) -> list[Line]:
        """Return the tests within stimuli and within raters."""
        by_stimulus = attempt(lambda: self._measured("stimulus"))
        by_rater = attempt(lambda: self._measured("participant"))
        if isinstance(by_rater, Unavailable):
            alone = attempt(lambda: one_way(self._raters()))
            last: Line = ("One-way ANOVA", "rater, conditions as independent groups", alone)
        else:
            last = ("Repeated measures ANOVA", BY_RATER, by_rater)
        found: list[Line] = [
            ("Repeated measures ANOVA", BY_STIMULUS, by_stimulus),
            ("Friedman test", BY_STIMULUS, attempt(self._ranked)),
            last,
        ]
        if not isinstance(by_rater, Unavailable) and not isinstance(by_stimulus, Unavailable):
            found.append(("min F′ (Clark, 1973)", BY_BOTH, attempt(lambda: min_f(by_rater, by_stimulus))))
        return found

    def _raters(self) -> dict[str, FloatArray]:
        """Return means of raters by condition, if each rated one condition alone."""
        means = self.table.groupby(["participant", "condition"], sort=False)["value"].mean().reset_index()
        if means["participant"].duplicated().any():
            raise InsufficientDataError(
                "Raters have ratings in several conditions, but none has them in all, so that there is no test by "
                "rater."
            )
        return {name: means.loc[means["condition"] == name, "value"].to_numpy(dtype=float) for name in self.conditions}

    def _measured(self, unit: str) -> RepeatedMeasuresAnova:
        matrix, left_out = self.matrix(unit)
        found = repeated_measures(matrix, self.conditions)
        return replace(found, flags=(*left_out, *found.flags))

    def _ranked(self) -> Result:
        matrix, left_out = self.matrix("stimulus")
        found = friedman(matrix, self.conditions)
        return replace(found, flags=(*left_out, *found.flags))

    def of_ratings(self) -> list[Line]:
        """Return the mixed models of single ratings."""
        name = "Linear mixed model (REML, Satterthwaite)"
        found: list[Line] = [(name, VARYING if self.may_vary else RATING, self.mixed)]
        if self.may_vary:
            intercepts = attempt(lambda: self._mixed(slopes=False))
            found.append(("Linear mixed model, intercepts alone", RATING, intercepts))
        if self.score.ordinal:
            found.append(("Cumulative-logit mixed model (Laplace), intercepts alone", RATING, self.ordinal))
        return found

    @cached_property
    def ordinal(self) -> CrossedCumulativeLogit | Unavailable:
        """The cumulative-logit mixed model of the single ratings."""
        return attempt(self._ordinal)

    def _ordinal(self) -> CrossedCumulativeLogit:
        if len(self.table) > ORDINAL_RATINGS:
            raise InsufficientDataError(
                f"Not fitted: it takes long for the {len(self.table)} ratings, more than {ORDINAL_RATINGS}; "
                "evaluation.statistics.ordinal.crossed fits it."
            )
        values = self.table["value"].to_numpy(dtype=float)
        if (values == np.rint(values)).all():
            values = values.astype(int)
        return crossed_cumulative_logit(
            pd.Categorical(values, ordered=True),
            # A categorical keeps the order of the study file.
            cast(Sequence[Hashable], pd.Categorical(self.table["condition"], categories=list(self.conditions))),
            self.table["participant"].tolist(),
            self.table["stimulus"].tolist(),
        )


def frame_of(found: Result) -> pd.DataFrame:
    """Return the numbers of a test's sentence."""
    if isinstance(found, CrossedMixedModel):
        return found.condition.to_frame()
    if isinstance(found, CrossedCumulativeLogit):
        test = pd.DataFrame({"chi2": [found.chi2], "df": [found.df], "p": [found.p]})
        return pd.concat([test, found.to_frame()], ignore_index=True)
    return found.to_frame()
