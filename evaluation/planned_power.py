"""The power of what a study file plans, by simulation and in closed form beside each other."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from evaluation.errors import DataError
from evaluation.planning import SEEING, Plan
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.power.closed_form import chance, correlation_power, required_n
from evaluation.statistics.power.crossed import CrossedPower, crossed_power, power_table, required
from evaluation.statistics.power.crossed_design import TEST_LABELS, TESTS, VarianceComponents
from evaluation.statistics.power.presets import CorrelationEffect, MeanEffect
from evaluation.statistics.power.simulation import Share, SimulatedPower, simulate_correlation_power, simulate_power
from evaluation.statistics.result import Result

SCALE = (1, 5)
"""Lowest and highest point of the opinion scale."""

CURVE = (5, 10, 15, 20, 30, 40, 60)
"""Numbers of raters and items in tables of power, besides those planned."""

_MOST = 5000
_RATINGS = 20_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparisonPower(Result):
    """The power with which a planned part finds that its conditions differ.

    Attributes
    ----------
    plan : Plan
        Who rates what.
    effect : MeanEffect or float
        An effect of the papers, or the difference between the lowest and the highest condition, in points.
    means : tuple of float
        True means of the conditions that were supposed.
    components : VarianceComponents
        What else makes ratings differ, as supposed.
    target, alpha : float
        Power wanted, and level of the tests.
    closed : tuple of CrossedPower
        Each test in closed form.
    simulated : SimulatedPower
        Each test by simulation.
    raters_needed, items_needed : int or None
        The fewest people, or stimuli, with which the test that takes raters and items as samples has the power wanted,
        the other number as planned; None if 5000 are not enough.
    at_raters_needed : Share or None
        The power of as many raters by simulation.
    table : pandas.DataFrame
        Power in closed form of the same test by people (rows) and stimuli (columns).
    """

    plan: Plan
    effect: MeanEffect | float
    means: tuple[float, ...]
    components: VarianceComponents
    target: float
    alpha: float
    closed: tuple[CrossedPower, ...]
    simulated: SimulatedPower
    raters_needed: int | None
    items_needed: int | None
    at_raters_needed: Share | None
    table: pd.DataFrame

    def apa(self) -> str:
        """Return a sentence on the test that takes raters and items as samples."""
        return self.simulated.apa()

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each test: closed form, false positives, simulation with its interval."""
        closed = pd.concat([one.to_frame() for one in self.closed], ignore_index=True)
        simulated = self.simulated.to_frame().rename(columns={"power": "simulated"})
        return closed.merge(simulated, on="test")

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain JSON values."""
        design, main = self.plan.design, self.simulated.tests["quasi_f"]
        closed = {one.test: one for one in self.closed}
        return {
            "study": self.plan.study,
            "part": self.plan.part,
            "raters": self.plan.raters,
            "items": design.items,
            "conditions": list(self.plan.conditions),
            "assignment": design.assignment,
            "raters_of_design": design.raters,
            "ratings": design.ratings,
            "raters_per_clip": design.raters_per_clip,
            "effect": self._effect(),
            "components": self.components.to_dict(),
            "alpha": self.alpha,
            "target": self.target,
            "test": "quasi_f",
            "unit": "rating; raters and items random",
            "power": main.value,
            "power_ci": [main.low, main.high],
            "power_closed_form": closed["quasi_f"].power,
            "tests": {
                test: {
                    "label": TEST_LABELS[test],
                    "df": list(closed[test].df),
                    "power_closed_form": closed[test].power,
                    "false_positive_rate": closed[test].false_positive_rate,
                    "power": self.simulated.tests[test].value,
                    "power_ci": [self.simulated.tests[test].low, self.simulated.tests[test].high],
                }
                for test in TESTS
            },
            "raters_needed": self.raters_needed,
            "power_at_raters_needed": None if self.at_raters_needed is None else self.at_raters_needed.value,
            "items_needed": self.items_needed,
            "table": {
                "raters": [int(count) for count in self.table.index],
                "items": [int(count) for count in self.table.columns],
                "power": self.table.to_numpy().tolist(),
            },
            "replications": self.simulated.replications,
            "seed": self.simulated.seed,
            "flags": list(self.flags),
        }

    def _effect(self) -> dict[str, Any]:
        described: dict[str, Any] = {
            "name": None,
            "means": list(self.means),
            "difference": max(self.means) - min(self.means),
        }
        if isinstance(self.effect, MeanEffect):
            described |= {
                "name": self.effect.name,
                "title": self.effect.title,
                "source": self.effect.source,
                "printed_means": list(self.effect.means),
                "F": self.effect.F,
                "pooled_sd": self.effect.pooled_sd,
                "eta_squared": self.effect.eta_squared,
                "f": self.effect.f,
                "power_as_printed": self.effect.power_as_printed(alpha=self.alpha).power,
                "power_within": self.effect.power_within(alpha=self.alpha).power,
            }
        return described


@dataclass(frozen=True, kw_only=True)
class CorrelationPlan(Result):
    """The power with which a part finds a correlation of input and evaluated PAD.

    Attributes
    ----------
    study, part : str
        Slug of the study and name of the part.
    effect : CorrelationEffect
        The correlation; raters do not enter, since the printed one is of means over them.
    items : int
        Number of stimuli.
    target, alpha, power : float
        Power wanted, level of the test, and power in closed form.
    simulated : Share
        The power by simulation.
    items_needed : int or None
        The fewest stimuli with the power wanted.
    replications, seed : int
        Of the simulation.
    """

    study: str
    part: str
    effect: CorrelationEffect
    items: int
    target: float
    alpha: float
    power: float
    simulated: Share
    items_needed: int | None
    replications: int
    seed: int

    def apa(self) -> str:
        """Return a sentence."""
        return correlation_power(self.effect.r, self.items, alpha=self.alpha).apa()

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        return correlation_power(self.effect.r, self.items, alpha=self.alpha).to_frame()

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain JSON values."""
        return {
            "study": self.study,
            "part": self.part,
            "items": self.items,
            "effect": dataclasses.asdict(self.effect),
            "alpha": self.alpha,
            "target": self.target,
            "test": "correlation",
            "unit": "stimulus; mean over raters",
            "power": self.simulated.value,
            "power_ci": [self.simulated.low, self.simulated.high],
            "power_closed_form": self.power,
            "items_needed": self.items_needed,
            "replications": self.replications,
            "seed": self.seed,
            "flags": list(self.flags),
        }


def effect_means(effect: MeanEffect | float, conditions: int) -> FloatArray:
    """Return the true means that an effect supposes.

    Parameters
    ----------
    effect : MeanEffect or float
        An effect of the papers, or the difference between the lowest and the highest condition, in points.
    conditions : int
        Number of conditions, at least 2.

    Returns
    -------
    numpy.ndarray, shape (conditions,)
        The printed means if there are as many; else from the lowest to the highest in equal steps, around the middle of
        the scale if the effect is a difference.

    Raises
    ------
    DataError
        If a difference is not a positive number or wider than the scale.
    """
    if isinstance(effect, MeanEffect):
        return effect.spread_over(conditions)
    low, high = SCALE
    if not 0 < effect <= high - low:
        raise DataError(
            f"The difference is {effect}, but must be a positive number of points, {high - low} at most, the width of "
            "the scale."
        )
    return (low + high) / 2 + effect * np.linspace(-0.5, 0.5, conditions)


def comparison_power(
    plan: Plan,
    effect: MeanEffect | float,
    components: VarianceComponents,
    *,
    seed: int,
    target: float = 0.8,
    alpha: float = 0.05,
    replications: int = 1000,
) -> ComparisonPower:
    """Return the power with which a planned part finds that its conditions differ, and how much more it would take.

    Parameters
    ----------
    plan : Plan
        Of `evaluation.planning.plan_comparison`.
    effect : MeanEffect or float
        As for `effect_means`.
    components : VarianceComponents
        What else makes ratings differ.
    seed, replications : int
        Of the simulation.
    target, alpha : float
        Power wanted, and level of the tests.

    Returns
    -------
    ComparisonPower
        All tests of `evaluation.statistics.power.crossed_design.TESTS`; ratings are simulated on the five-point scale.

    Raises
    ------
    DataError
        If an argument is out of range.
    """
    design = plan.design
    means = effect_means(effect, design.conditions)
    closed = tuple(crossed_power(design, means, components, test=test, alpha=alpha) for test in TESTS)
    simulated = simulate_power(design, means, components, seed=seed, replications=replications, alpha=alpha)
    raters = required("raters", design, means, components, target=target, alpha=alpha, most=_MOST)
    items = required("items", design, means, components, target=target, alpha=alpha, most=_MOST)
    at_needed = None
    if raters is not None:
        enough = dataclasses.replace(design, raters=raters)
        # Of very large studies fewer are simulated; their power lies near what was wanted anyway.
        few = min(replications, max(100, _RATINGS // enough.ratings))
        again = simulate_power(enough, means, components, seed=seed, replications=few, alpha=alpha)
        at_needed = again.tests["quasi_f"]
    return ComparisonPower(
        plan=plan,
        effect=effect,
        means=tuple(float(mean) for mean in means),
        components=components,
        target=target,
        alpha=alpha,
        closed=closed,
        simulated=simulated,
        raters_needed=None if raters is None else plan.people(raters),
        items_needed=items,
        at_raters_needed=at_needed,
        table=_table(plan, means, components, alpha),
        flags=(*plan.notes, *_effect_flags(effect, design.conditions), *simulated.flags, *_test_flags(closed)),
    )


def correlation_plan(
    study: str,
    part: str,
    effect: CorrelationEffect,
    items: int,
    *,
    seed: int,
    target: float = 0.8,
    alpha: float = 0.05,
    replications: int = 1000,
) -> CorrelationPlan:
    """Return the power with which so many stimuli show a correlation; raises DataError as `correlation_power`."""
    return CorrelationPlan(
        study=study,
        part=part,
        effect=effect,
        items=items,
        target=target,
        alpha=alpha,
        power=correlation_power(effect.r, items, alpha=alpha).power,
        simulated=simulate_correlation_power(effect.r, items, seed=seed, replications=replications, alpha=alpha),
        items_needed=required_n(
            lambda n: correlation_power(effect.r, n, alpha=alpha).power, target=target, least=3, most=_MOST
        ),
        replications=replications,
        seed=seed,
        flags=(
            "Raters do not enter: the printed correlation is of means over raters; with fewer of them it is lower.",
        ),
    )


def told_design(plan: Plan) -> str:
    """Return what a plan means, as a sentence."""
    design = plan.design
    # With fewer trials for each, several people make up a rater who sees everything.
    counted = f"as much as {design.raters} raters of whom " if design.raters != plan.raters else ""
    return (
        f"{plan.raters} raters x {design.items} stimuli x {design.conditions} conditions "
        f"({', '.join(plan.conditions)}): {counted}{SEEING[design.assignment]}, {design.ratings} ratings, "
        f"{design.raters_per_clip} of each clip."
    )


def _table(plan: Plan, means: FloatArray, components: VarianceComponents, alpha: float) -> pd.DataFrame:
    design = plan.design
    raters, items = _steps(design.raters, design.rater_step), _steps(design.items, design.item_step)
    table = power_table(design, means, components, raters=raters, items=items, alpha=alpha)
    table.index = pd.Index([plan.people(count) for count in raters], name="raters")
    return table


def _steps(planned: int, step: int) -> Sequence[int]:
    """Return numbers of raters or items for a table, in multiples of a step."""
    rounded = {max(2 * step, step * round(count / step)) for count in CURVE}
    return sorted(rounded | {planned})


def _effect_flags(effect: MeanEffect | float, conditions: int) -> tuple[str, ...]:
    if not isinstance(effect, MeanEffect) or conditions == len(effect.means):
        return ()
    return (
        f"The effect {effect.name} has {len(effect.means)} means, but there are {conditions} conditions; these are "
        "spread evenly from its lowest to its highest mean.",
    )


def _test_flags(closed: Sequence[CrossedPower]) -> tuple[str, ...]:
    """Return one sentence on all tests that find too much where there is nothing."""
    wrong = [one for one in closed if one.flags and one.test != "quasi_f"]
    rough = tuple(flag for one in closed if one.test == "quasi_f" for flag in one.flags)
    if not wrong:
        return rough
    told = "; ".join(f"{TEST_LABELS[one.test]}: {chance(one.false_positive_rate)}" for one in wrong)
    return (
        *rough,
        f"Of conditions that do not differ, these tests find a difference more often than in "
        f"{wording.share(wrong[0].alpha)} of all studies, since they leave out a source of variance: {told}.",
    )
