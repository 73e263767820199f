"""Ratings by a sample of raters of a sample of items in several conditions: expected mean squares and their tests."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Literal, NamedTuple, get_args

from evaluation.errors import DataError
from evaluation.statistics.noncentral import check_count

Assignment = Literal["full", "latin_square", "between"]
Test = Literal["quasi_f", "by_item", "by_rater", "both", "mixed_model", "independent"]

ASSIGNMENTS: tuple[Assignment, ...] = get_args(Assignment)
TESTS: tuple[Test, ...] = get_args(Test)

TEST_LABELS: Mapping[Test, str] = MappingProxyType(
    {
        "quasi_f": "raters and items random (quasi-F)",
        "by_item": "by item (raters averaged)",
        "by_rater": "by rater (items averaged)",
        "both": "by item and by rater both",
        "mixed_model": "mixed model, random intercepts alone",
        "independent": "items' means as independent groups",
    }
)
"""What the tests are called in tables."""


class Stratum(NamedTuple):
    """A line of the analysis of variance: degrees of freedom, and the mean square expected without an effect."""

    df: int
    expected: float


@dataclass(frozen=True, kw_only=True)
class VarianceComponents:
    """Standard deviations of what makes ratings differ, in points of the scale, each 0 or more.

    Attributes
    ----------
    rater_sd, item_sd : float
        Of raters (who are stricter or milder) and of items (which are better or worse), alike in all conditions.
    rater_condition_sd, item_condition_sd : float
        Of what a rater, or an item, adds in one condition alone. These limit what many items, or raters, can show.
    rater_item_sd : float
        Of what a rater sees in one item, in all conditions.
    residual_sd : float
        Of a single rating around all this, with rounding to the scale's points.

    Raises
    ------
    DataError
        If one is negative or not finite, or all are 0.
    """

    rater_sd: float
    item_sd: float
    residual_sd: float
    rater_condition_sd: float = 0.0
    item_condition_sd: float = 0.0
    rater_item_sd: float = 0.0

    def __post_init__(self) -> None:
        for name, sd in self.to_dict().items():
            # Far beyond any rating scale; squares of what is smaller neither overflow nor vanish.
            if not (math.isfinite(sd) and 0 <= sd <= 1e6):
                raise DataError(f"{name} is {sd}, but must be a number from 0 to 1000000.")
        if self.residual_sd < 1e-6:
            raise DataError("residual_sd is 0, but ratings always differ by chance; give a positive number.")

    def to_dict(self) -> dict[str, float]:
        """Return the standard deviations by name."""
        return {field.name: float(getattr(self, field.name)) for field in fields(self)}


@dataclass(frozen=True, kw_only=True)
class CrossedDesign:
    """A complete and balanced design.

    Attributes
    ----------
    raters, items, conditions : int
        How many there are, each at least 2.
    assignment : str
        "full": each rater rates each item in each condition. "latin_square": each item once, a third (of three
        conditions) of the items in each condition, counterbalanced over raters; raters and items must be multiples of
        the conditions, at least twice as many. "between": each rater rates all items in one condition; raters must
        be such a multiple.

    Raises
    ------
    DataError
        If a number is too small or no such multiple.
    """

    raters: int
    items: int
    conditions: int
    assignment: Assignment = "full"

    def __post_init__(self) -> None:
        if self.assignment not in ASSIGNMENTS:
            raise DataError(f"The assignment is {self.assignment!r}, but must be one of {', '.join(ASSIGNMENTS)}.")
        check_count(self.conditions, 2, "The number of conditions")
        for name, count, step in (("raters", self.raters, self.rater_step), ("items", self.items, self.item_step)):
            least = 2 * step
            check_count(count, least, f"The number of {name}")
            if count % step:
                raise DataError(
                    f"{count} {name} cannot be divided evenly among {step} conditions; take a multiple of {step}."
                )

    @property
    def rater_step(self) -> int:
        """Return what the number of raters must be a multiple of."""
        return 1 if self.assignment == "full" else self.conditions

    @property
    def item_step(self) -> int:
        """Return what the number of items must be a multiple of."""
        return self.conditions if self.assignment == "latin_square" else 1

    @property
    def ratings_per_condition(self) -> int:
        """Return how many ratings each condition gets."""
        everything = self.raters * self.items
        return everything if self.assignment == "full" else everything // self.conditions

    @property
    def ratings(self) -> int:
        """Return how many ratings there are."""
        return self.conditions * self.ratings_per_condition

    @property
    def raters_per_clip(self) -> int:
        """Return how many raters see one item in one condition."""
        return self.ratings_per_condition // self.items

    def strata(self, components: VarianceComponents) -> dict[str, Stratum]:
        """Return the lines of the analysis of variance with their expected mean squares if the conditions are alike.

        Parameters
        ----------
        components : VarianceComponents
            The standard deviations.

        Returns
        -------
        dict
            "condition"; "rater" and "item", which have the interactions with the condition that are not mixed up with
            anything else; "error"; and the rest: "items" and, by design, "rater_items", "sets", "groups", "square".

        References
        ----------
        Cornfield and Tukey (1956), Annals of Mathematical Statistics 27:907, for the expectations; Westfall, Kenny and
        Judd (2014), Journal of Experimental Psychology: General 143:2020, for the three designs, which they call fully
        crossed, counterbalanced, and participants within condition. Their slope variances belong to codes of -1 and 1:
        for two conditions the variances here are twice as large.
        """
        build = {"full": self._full, "latin_square": self._latin_square, "between": self._between}
        return build[self.assignment](components)

    def denominator(self, test: Test) -> tuple[str, ...]:
        """Return which lines a test pools for the denominator of its F ratio.

        Raises
        ------
        DataError
            If the test has no such denominator: "quasi_f" and "both".
        """
        items_as_groups = {
            "full": ("items", "item"),
            "latin_square": ("items", "sets", "item", "groups", "square"),
            "between": ("items", "item"),
        }
        all_but_effects = {
            "full": ("rater", "item", "rater_items", "error"),
            "latin_square": ("rater", "item", "error", "square"),
            # Raters differ between conditions here, so their intercepts alone make the denominator.
            "between": ("rater",),
        }
        found: dict[str, tuple[str, ...]] = {
            "by_item": ("item",),
            "by_rater": ("rater",),
            "mixed_model": all_but_effects[self.assignment],
            "independent": items_as_groups[self.assignment],
        }
        if test not in found:
            raise DataError(f"The test is {test!r}, but must be one of {', '.join(found)}.")
        return found[test]

    def _full(self, components: VarianceComponents) -> dict[str, Stratum]:
        R, S, c = self.raters, self.items, self.conditions
        error = components.residual_sd**2
        rater, item = S * components.rater_condition_sd**2, R * components.item_condition_sd**2
        both = c * components.rater_item_sd**2
        return {
            "condition": Stratum(c - 1, rater + item + error),
            "rater": Stratum((R - 1) * (c - 1), rater + error),
            "item": Stratum((S - 1) * (c - 1), item + error),
            "error": Stratum((R - 1) * (S - 1) * (c - 1), error),
            "items": Stratum(S - 1, R * c * components.item_sd**2 + item + both + error),
            "rater_items": Stratum((R - 1) * (S - 1), both + error),
        }

    def _latin_square(self, components: VarianceComponents) -> dict[str, Stratum]:
        R, S, c = self.raters, self.items, self.conditions
        # Each rater sees each item once, so what the pair has of its own cannot be told from chance.
        error = components.residual_sd**2 + components.rater_item_sd**2
        rater, item = S // c * components.rater_condition_sd**2, R // c * components.item_condition_sd**2
        items, raters = R * components.item_sd**2, S * components.rater_sd**2
        return {
            "condition": Stratum(c - 1, rater + item + error),
            "rater": Stratum((R - c) * (c - 1), rater + error),
            "item": Stratum((S - c) * (c - 1), item + error),
            "error": Stratum((R - c) * (S - c), error),
            "items": Stratum(S - c, items + item + error),
            "sets": Stratum(c - 1, items + rater + item + error),
            "groups": Stratum(c - 1, raters + rater + item + error),
            "square": Stratum((c - 1) * (c - 2), rater + item + error),
        }

    def _between(self, components: VarianceComponents) -> dict[str, Stratum]:
        R, S, c = self.raters, self.items, self.conditions
        error = components.residual_sd**2 + components.rater_item_sd**2
        rater = S * (components.rater_sd**2 + components.rater_condition_sd**2)
        item = R // c * components.item_condition_sd**2
        return {
            "condition": Stratum(c - 1, rater + item + error),
            "rater": Stratum(R - c, rater + error),
            "item": Stratum((S - 1) * (c - 1), item + error),
            "error": Stratum((R - c) * (S - 1), error),
            "items": Stratum(S - 1, R * components.item_sd**2 + item + error),
        }
