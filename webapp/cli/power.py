"""``padlab power``: what a planned study can show, and how many raters and stimuli that takes."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import click

from evaluation.errors import DataError
from evaluation.planned_power import (
    ComparisonPower,
    CorrelationPlan,
    comparison_power,
    correlation_plan,
    told_design,
)
from evaluation.planning import comparable_parts, correlated_parts, plan_comparison, planned_pairs
from evaluation.statistics import wording
from evaluation.statistics.power.closed_form import chance
from evaluation.statistics.power.crossed_design import TEST_LABELS, VarianceComponents
from evaluation.statistics.power.presets import (
    PRESETS,
    CorrelationEffect,
    Effect,
    MeanEffect,
    preset,
    usual_components,
)
from evaluation.study import StudySpec
from webapp.cli.context import echo_json
from webapp.cli.study import FILE, read_study_file

LIST = "list"

CHANCE = click.FloatRange(min=0, max=1, min_open=True, max_open=True)
SD = click.FloatRange(min=0, max=100)

Told = ComparisonPower | CorrelationPlan


class EffectType(click.ParamType[Effect | float | str]):
    """The name of an effect of the papers, or a difference in points."""

    name = "effect"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Effect | float | str:
        """Read the effect."""
        text = str(value)
        if text == LIST:
            return text
        try:
            number = float(text)
        except ValueError:
            try:
                return preset(text)
            except DataError as error:
                self.fail(str(error), param, ctx)
        if not (math.isfinite(number) and 0 < number <= 4):
            self.fail(f"{text} is no difference on a scale from 1 to 5; it takes more than 0 and at most 4", param, ctx)
        return number


@click.command()
@click.argument("file", type=FILE, required=False)
@click.option(
    "--effect",
    type=EffectType(),
    default="0.5",
    show_default=True,
    metavar="NAME|NUMBER",
    help=f"What is to be found: a difference between the lowest and the highest condition, in points, or an effect of "
    f"the papers: {', '.join(PRESETS)}. `list` describes them.",
)
@click.option("--part", help="Only this part of the study; left out, all parts that fit the effect.")
@click.option("--raters", type=click.IntRange(min=2, max=100_000), help="People who take part  [default: the quota].")
@click.option("--items", type=click.IntRange(min=2, max=100_000), help="Stimuli  [default: those of the file].")
@click.option("--power", "target", type=CHANCE, default=0.8, show_default=True, help="The power wanted.")
@click.option("--alpha", type=CHANCE, default=0.05, show_default=True, help="Level of the tests.")
@click.option("--rater-sd", type=SD, help="SD of raters over all conditions, in points.")
@click.option("--rater-condition-sd", type=SD, help="SD of what a rater adds in one condition alone.")
@click.option("--item-sd", type=SD, help="SD of stimuli over all conditions.")
@click.option("--item-condition-sd", type=SD, help="SD of what a stimulus adds in one condition alone.")
@click.option("--residual-sd", type=SD, help="SD of a single rating around all this.")
@click.option(
    "--replications",
    type=click.IntRange(min=100, max=100_000),
    default=1000,
    show_default=True,
    help="Studies that are simulated.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the simulation  [default: the study's].")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def power(
    file: Path | None,
    *,
    effect: Effect | float | str,
    part: str | None,
    raters: int | None,
    items: int | None,
    target: float,
    alpha: float,
    replications: int,
    seed: int | None,
    as_json: bool,
    **sds: float | None,
) -> None:
    """Tell the power of the study that a FILE (or a bundled study's name) plans, before anybody is asked.

    Ratings of raters and stimuli in conditions are simulated and tested in several ways; beside it stands the power in
    closed form, and how many raters or stimuli would do. The SDs are what ratings differ by; left out, they are those
    of the effect, or usual ones.
    """
    if isinstance(effect, str):
        _list_effects(as_json=as_json)
        return
    if file is None:
        raise click.UsageError("Missing argument 'FILE' (--effect list needs none)")
    spec, _ = read_study_file(file)
    seed = spec.seed if seed is None else seed
    told: dict[str, Told] = {}
    if isinstance(effect, CorrelationEffect):
        for name in _parts(spec, part, correlated_parts(spec), "asks for the PAD of stimuli made from one"):
            number = planned_pairs(spec, name) if items is None else items
            told[name] = correlation_plan(
                spec.slug, name, effect, number, seed=seed, target=target, alpha=alpha, replications=replications
            )
    else:
        components = _components(effect, sds)
        for name in _parts(spec, part, comparable_parts(spec), "shows stimuli in several conditions"):
            plan = plan_comparison(spec, name, raters=raters, items=items)
            told[name] = comparison_power(
                plan, effect, components, seed=seed, target=target, alpha=alpha, replications=replications
            )
    if as_json:
        documents = {name: one.to_dict() for name, one in told.items()}
        echo_json({**next(iter(documents.values())), "parts": documents})
        return
    for place, one in enumerate(told.values()):
        if place:
            click.echo()
        lines = _comparison(one) if isinstance(one, ComparisonPower) else _correlation(one)
        click.echo("\n".join([*lines, *(f"Note: {flag}" for flag in one.flags)]))


def _parts(spec: StudySpec, part: str | None, fitting: Sequence[str], what: str) -> Sequence[str]:
    if part is not None:
        return [spec.part(part).name]
    if not fitting:
        raise DataError(
            f"No part of the study '{spec.slug}' {what}, so this effect cannot be planned with it; "
            "`padlab power --effect list` shows others."
        )
    return fitting


def _components(effect: MeanEffect | float, sds: dict[str, float | None]) -> VarianceComponents:
    found = effect.components if isinstance(effect, MeanEffect) else usual_components()
    return dataclasses.replace(found, **{name: sd for name, sd in sds.items() if sd is not None})


def _list_effects(*, as_json: bool) -> None:
    if as_json:
        echo_json({name: effect.summary() for name, effect in PRESETS.items()})
        return
    for name, effect in PRESETS.items():
        click.echo(f"{name:<7} {effect.summary()}")


def _comparison(found: ComparisonPower) -> list[str]:
    plan, design = found.plan, found.plan.design
    means = ", ".join(wording.number(mean) for mean in found.means)
    sds = ", ".join(f"{name.removesuffix('_sd').replace('_', ' x ')} {sd:.2f}" for name, sd in _shown_sds(found))
    assumed = "printed F and usual raters" if isinstance(found.effect, MeanEffect) else "usual for opinion scores"
    lines = [
        f"{plan.study}, part {plan.part}: {told_design(plan)}",
        f"Effect: {_effect(found.effect)}; true means {means}.",
        f"Supposed SDs, in points ({assumed}): {sds}.",
        "",
        *_tests(found),
        "",
        f"Power {wording.share(found.target)} with raters and items random takes, in closed form:",
        f"  {_needed(found.raters_needed, 'raters')} with {design.items} stimuli{_checked(found)}",
        f"  {_needed(found.items_needed, 'stimuli')} with {plan.raters} raters",
        "",
        *_table(found),
    ]
    if isinstance(found.effect, MeanEffect):
        lines += ["", _as_printed(found.effect, found.alpha)]
    return lines


def _shown_sds(found: ComparisonPower) -> list[tuple[str, float]]:
    return [(name, sd) for name, sd in found.components.to_dict().items() if name != "rater_item_sd" or sd]


def _effect(effect: MeanEffect | float) -> str:
    if isinstance(effect, MeanEffect):
        return effect.summary()
    return f"{effect:g} points between the lowest and the highest condition"


def _tests(found: ComparisonPower) -> list[str]:
    rows = [["test", "df", "closed form", "simulated", "95% CI", "false positives"]]
    for one in found.closed:
        share = found.simulated.tests[one.test]
        df = ", ".join(f"{value:.1f}".removesuffix(".0") for value in one.df)
        interval = f"[{wording.share(share.low)}, {wording.share(share.high)}]"
        numbers = [chance(one.power), chance(share.value), interval, chance(one.false_positive_rate)]
        rows.append([TEST_LABELS[one.test], f"({df})", *numbers])
    how = f"Power at α = {wording.share(found.alpha)} (simulated: {found.simulated.replications} studies on the scale"
    return [f"{how} 1 to 5, seed {found.simulated.seed}):", *_aligned(rows)]


def _needed(count: int | None, what: str) -> str:
    return f"no number of {what} up to 5000" if count is None else f"{count} {what}"


def _checked(found: ComparisonPower) -> str:
    share = found.at_raters_needed
    if share is None:
        return ""
    return f" (simulated: {chance(share.value)}, [{wording.share(share.low)}, {wording.share(share.high)}])"


def _table(found: ComparisonPower) -> list[str]:
    table = found.table
    rows = [["raters \\ stimuli", *(str(count) for count in table.columns)]]
    rows += [
        [str(people), *(chance(value) for value in values)]
        for people, values in zip(table.index, table.to_numpy().tolist(), strict=True)
    ]
    return ["Power by raters and stimuli (closed form, both random):", *_aligned(rows)]


def _as_printed(effect: MeanEffect, alpha: float) -> str:
    printed, within = effect.power_as_printed(alpha=alpha), effect.power_within(alpha=alpha)
    return (
        f"As printed, F[{printed.df[0]:g}, {printed.df[1]:g}] takes the {len(effect.means)} conditions of the same "
        f"{effect.items} sentences for independent groups (power {chance(printed.power)}); within sentences it is "
        f"F({within.df[0]:g}, {within.df[1]:g}) (power {chance(within.power)})."
    )


def _correlation(found: CorrelationPlan) -> list[str]:
    share = found.simulated
    needed = _needed(found.items_needed, "stimuli")
    return [
        f"{found.study}, part {found.part}: {found.items} stimuli with input and evaluated PAD (means over raters).",
        f"Effect: {found.effect.summary()}.",
        f"Power at α = {wording.share(found.alpha)}: closed form {chance(found.power)}, simulated "
        f"{chance(share.value)} [{wording.share(share.low)}, {wording.share(share.high)}] ({share.of} studies, "
        f"seed {found.seed}).",
        f"Power {wording.share(found.target)} takes {needed}.",
    ]


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join(["", row[0].ljust(widths[0]), *cells]).rstrip())
    return lines
