"""Effects of the two papers, recomputed from what they print, for planning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from evaluation.errors import DataError
from evaluation.statistics import printed_tables
from evaluation.statistics.anova import one_way_from_summary, pooled_sd_from_f
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.correlation import pearson
from evaluation.statistics.power.closed_form import Power, effect_f, one_way_power, repeated_measures_power
from evaluation.statistics.power.crossed_design import VarianceComponents

MTAP = "Jia et al. (2013), Multimedia Tools and Applications"
ACII = "Zhang et al. (2007), ACII"

RATER_SD = 0.4
RATER_CONDITION_SD = 0.2
RESIDUAL_SD = 0.66
"""What makes opinion scores of one clip differ, in points, which neither paper prints; together the usual 0.8."""

ITEM_CONDITION_SHARE = 0.5
"""Share of the variance of true means of items inside a condition that an item does not have in all conditions alike;
neither paper prints that, and half is the choice that leans to neither side."""


@dataclass(frozen=True, kw_only=True)
class MeanEffect:
    """Printed means of opinion scores in several conditions.

    Attributes
    ----------
    name, title : str
        Name for commands, and what was compared.
    conditions : tuple of str
        The conditions.
    means : tuple of float
        Mean opinion score of each condition, 1 to 5.
    F : float
        Printed variance ratio, of the items' means as independent groups.
    raters, items : int
        Number of raters, and of items in each condition.
    source : str
        Where it is printed.
    """

    name: str
    title: str
    conditions: tuple[str, ...]
    means: tuple[float, ...]
    F: float
    raters: int
    items: int
    source: str

    @property
    def pooled_sd(self) -> float:
        """Return the standard deviation of the items' means in a condition that the printed F implies."""
        return pooled_sd_from_f(self.means, self.items, self.F)

    @property
    def eta_squared(self) -> float:
        """Return the share of the variance of the items' means that the conditions explain."""
        sds = dict.fromkeys(self.conditions, self.pooled_sd)
        return one_way_from_summary(dict(zip(self.conditions, self.means, strict=True)), sds, self.items).eta_squared

    @property
    def f(self) -> float:
        """Return Cohen's f of the items' means."""
        return effect_f(self.means, self.pooled_sd)

    @property
    def components(self) -> VarianceComponents:
        """Return what makes ratings differ: printed where it can be, assumed where not.

        The variance of items' means that the printed F implies, less what chance leaves in a mean over the printed
        number of raters, is that of items, `ITEM_CONDITION_SHARE` of it in one condition alone. Raters and chance are
        `RATER_SD`, `RATER_CONDITION_SD` and `RESIDUAL_SD`.
        """
        true = max(0.0, self.pooled_sd**2 - RESIDUAL_SD**2 / self.raters)
        return _components(true)

    @property
    def correlation(self) -> float:
        """Return the correlation of items' means in two conditions that `components` imply."""
        return self.components.item_sd**2 / self.pooled_sd**2

    def power_as_printed(self, *, alpha: float = 0.05) -> Power:
        """Return the power with which the paper's own test, for which the conditions are independent, finds this."""
        return one_way_power(self.f, self.items, len(self.means), alpha=alpha)

    def power_within(self, *, alpha: float = 0.05) -> Power:
        """Return the power of the repeated measures that the design in fact is: the same items in all conditions."""
        return repeated_measures_power(self.f, self.items, len(self.means), correlation=self.correlation, alpha=alpha)

    def spread_over(self, conditions: int) -> FloatArray:
        """Return a mean for each of another number of conditions: from the lowest to the highest in equal steps.

        Raises
        ------
        DataError
            If there are fewer than two conditions.
        """
        if conditions < 2:
            raise DataError(f"There is {conditions} condition, but a difference needs two or more.")
        if conditions == len(self.means):
            return np.array(self.means)
        return np.linspace(min(self.means), max(self.means), conditions)

    def summary(self) -> str:
        """Return the effect as a sentence."""
        means = ", ".join(f"{mean:.2f}" for mean in self.means)
        return (
            f"{self.title}: means {means}, SD of items' means {self.pooled_sd:.2f}, f = {self.f:.2f}, "
            f"η² = {self.eta_squared:.2f} ({self.source})"
        )


@dataclass(frozen=True, kw_only=True)
class CorrelationEffect:
    """A correlation over faces of the PAD that went in and the PAD that people saw.

    Attributes
    ----------
    name, title : str
        Name for commands, and what was correlated.
    r : float
        The correlation, recomputed from the printed table.
    n : int
        Number of faces.
    source : str
        Where the table is.
    """

    name: str
    title: str
    r: float
    n: int
    source: str

    def summary(self) -> str:
        """Return the effect as a sentence."""
        return f"{self.title}: r = {self.r:.3f} over {self.n} faces ({self.source})"


Effect = MeanEffect | CorrelationEffect

# The conditions of Jia et al. (2013), Table 9, for each line of Table 10, and names for commands.
_EXPERIMENTS: Mapping[str, tuple[str, str, str]] = {
    "head": ("static", "random", "prosodic"),
    "face": ("neutral", "linear", "network"),
    "avatar": ("head alone", "face alone", "both"),
}


def _components(true_variance: float) -> VarianceComponents:
    return VarianceComponents(
        rater_sd=RATER_SD,
        item_sd=math.sqrt((1 - ITEM_CONDITION_SHARE) * true_variance),
        residual_sd=RESIDUAL_SD,
        rater_condition_sd=RATER_CONDITION_SD,
        item_condition_sd=math.sqrt(ITEM_CONDITION_SHARE * true_variance),
    )


def _experiments() -> list[MeanEffect]:
    printed, lines = printed_tables.figures(printed_tables.MTAP), printed_tables.table(printed_tables.MTAP, 10).frame
    means = lines[["group_1", "group_2", "group_3"]].to_numpy(dtype=float).tolist()
    return [
        MeanEffect(
            name=name,
            title=title,
            conditions=conditions,
            means=tuple(found),
            F=F,
            raters=int(printed["raters"]),
            items=int(printed["sentences"]),
            source=f"{MTAP}, Table 10",
        )
        for (name, conditions), title, found, F in zip(
            _EXPERIMENTS.items(), lines["experiment"].tolist(), means, lines["F"].tolist(), strict=True
        )
    ]


def _correlations(name: str, source: str, paper: str) -> list[CorrelationEffect]:
    words = {"P": "pleasure", "A": "arousal", "D": "dominance"}
    faces = printed_tables.table(paper, 8).frame
    return [
        CorrelationEffect(
            name=f"{name}-{letter.lower()}",
            title=f"Input and evaluated {word}",
            r=pearson(faces[f"input_{letter}"].to_numpy(), faces[f"evaluated_{letter}"].to_numpy()).r,
            n=len(faces),
            source=f"{source}, Table 8",
        )
        for letter, word in words.items()
    ]


def _all() -> dict[str, Effect]:
    effects: list[Effect] = [
        *_experiments(),
        *_correlations("pad", MTAP, printed_tables.MTAP),
        *_correlations("acii", ACII, printed_tables.ACII),
    ]
    return {effect.name: effect for effect in effects}


PRESETS: Mapping[str, Effect] = MappingProxyType(_all())
"""All effects by name: ``head``, ``face`` and ``avatar`` of opinion scores; ``pad-p`` … and ``acii-p`` … of PAD."""


def preset(name: str) -> Effect:
    """Return an effect by its name; DataError, which lists the names, if there is none."""
    if name not in PRESETS:
        raise DataError(f"There is no effect {name!r}; there are {', '.join(PRESETS)}, or a difference in points.")
    return PRESETS[name]


def usual_components() -> VarianceComponents:
    """Return what makes opinion scores differ in an experiment of which nothing is known yet.

    The variance of items is the mean of what the three experiments of Jia et al. (2013), Table 10, imply; see
    `MeanEffect.components`.
    """
    found = [effect.components for effect in PRESETS.values() if isinstance(effect, MeanEffect)]
    return _components(float(np.mean([one.item_sd**2 + one.item_condition_sd**2 for one in found])))
