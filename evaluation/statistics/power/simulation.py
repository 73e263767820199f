"""Power of comparisons of conditions by simulated ratings, which may be rounded to the points of a scale."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.noncentral import check_count, check_level
from evaluation.statistics.power import mean_squares
from evaluation.statistics.power.closed_form import chance
from evaluation.statistics.power.crossed import condition_means
from evaluation.statistics.power.crossed_design import TESTS, CrossedDesign, Test, VarianceComponents
from evaluation.statistics.result import Result

BoolArray = npt.NDArray[np.bool_]

# Ratings that are simulated at a time, so that memory does not grow with the number of replications.
_AT_ONCE = 1_000_000
_LARGEST_STUDY = 4_000_000
_MOST_RATINGS = 1_000_000_000
_ROUNDING = 1 / 12
_MOST_REPLICATIONS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Share:
    """How many replications found a difference.

    Attributes
    ----------
    found, of : int
        Number of replications, with a difference and in all.
    low, high : float
        Wilson's interval of the share.
    """

    found: int
    of: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Return the share."""
        return self.found / self.of


@dataclass(frozen=True, kw_only=True)
class SimulatedPower(Result):
    """The power of comparisons of conditions, estimated by simulation.

    Attributes
    ----------
    design : CrossedDesign
        Raters, items and conditions.
    tests : mapping of str to Share
        For each of `evaluation.statistics.power.crossed_design.TESTS` how often it found a difference.
    alpha, confidence : float
        Level of the tests, and confidence of the intervals.
    replications : int
        How many studies were simulated.
    seed : int
        From which the same studies come again.
    scale : tuple of int, or None
        Lowest and highest point of the scale; None if ratings were not rounded.
    """

    design: CrossedDesign
    tests: Mapping[Test, Share]
    alpha: float
    confidence: float
    replications: int
    seed: int
    scale: tuple[int, int] | None

    def apa(self) -> str:
        """Return a sentence on the test that takes raters and items as samples."""
        share = self.tests["quasi_f"]
        design = self.design
        sample = f"{design.raters} raters and {design.items} items in {design.conditions} conditions"
        interval = wording.interval(share.low, share.high, confidence=self.confidence, bounded=True)
        return (
            f"In {share.found} of {share.of} simulated studies with {sample} the conditions were found to differ at "
            f"α = {wording.share(self.alpha)} (power {chance(share.value)}, {interval})."
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each test."""
        rows = [
            {"test": test, "power": share.value, "ci_low": share.low, "ci_high": share.high, "replications": share.of}
            for test, share in self.tests.items()
        ]
        return pd.DataFrame(rows)


def simulate_power(
    design: CrossedDesign,
    means: npt.ArrayLike,
    components: VarianceComponents,
    *,
    seed: int,
    replications: int = 1000,
    scale: tuple[int, int] | None = (1, 5),
    alpha: float = 0.05,
    confidence: float = 0.95,
) -> SimulatedPower:
    """Return how often simulated studies find that conditions differ.

    Parameters
    ----------
    design : CrossedDesign
        Who rates what.
    means : array_like, shape (conditions,)
        True means of the conditions, in points of the scale, before rounding. Equal means give the rate of false
        positives.
    components : VarianceComponents
        What else makes ratings differ; all of it normally distributed.
    seed : int
        Of the random numbers, 0 or more.
    replications : int
        How many studies are simulated, 1 to 1000000.
    scale : tuple of int, or None
        Lowest and highest whole number that a rating can be; None leaves ratings as they are.
    alpha, confidence : float
        Level of the tests, and confidence of the intervals.

    Returns
    -------
    SimulatedPower
        Share of studies in which each test was significant, with Wilson's interval. Flagged if the scale cuts off what
        was to be simulated.

    Raises
    ------
    DataError
        If there are not as many finite means as conditions, or another argument is out of range.

    Notes
    -----
    A rating is the condition's mean plus the effects of rater, item, their interactions with the condition and with
    each other, and chance. `components.residual_sd` is that of rounded ratings: where they are rounded, chance has the
    variance that is left after 1/12 for rounding (Sheppard's correction), so that closed form and simulation agree as
    long as the ends of the scale are far.

    All tests come from the mean squares of the complete, balanced design, in which a mixed model without slopes has the
    F ratio of "mixed_model" and one with slopes nearly that of "quasi_f". The denominator of the quasi-F is the error's
    mean square plus what those of raters and items exceed it by, if they do, with Satterthwaite's degrees of freedom
    of the mean squares that are left.

    References
    ----------
    As `evaluation.statistics.crossed_power.crossed_power`; Wilson (1927), JASA 22:209.
    """
    centres = condition_means(design, means)
    _check(design, seed, replications, scale)
    check_level(alpha)
    check_confidence(confidence)
    rng = np.random.default_rng(seed)
    latent = components if scale is None else _without_rounding(components)
    batch = max(1, _AT_ONCE // design.ratings)
    found = dict.fromkeys(TESTS, 0)
    for start in range(0, replications, batch):
        ratings = _ratings(design, centres, latent, min(batch, replications - start), rng)
        if scale is not None:
            np.clip(np.rint(ratings, out=ratings), *scale, out=ratings)
        for test, significant in _significant(design, mean_squares.of(design, ratings), alpha).items():
            found[test] += int(significant.sum())
    return SimulatedPower(
        design=design,
        tests={test: wilson(count, replications, confidence) for test, count in found.items()},
        alpha=alpha,
        confidence=confidence,
        replications=replications,
        seed=seed,
        scale=scale,
        flags=_flags(centres, components, scale),
    )


def simulate_correlation_power(
    r: float, n: int, *, seed: int, replications: int = 1000, alpha: float = 0.05, confidence: float = 0.95
) -> Share:
    """Return how often the test of a correlation is significant in simulated pairs of normal variables.

    Parameters
    ----------
    r : float
        True correlation, between -1 and 1.
    n : int
        Number of pairs, at least 3.
    seed, replications, alpha, confidence
        As for `simulate_power`.

    Returns
    -------
    Share
        Share of significant replications.

    Raises
    ------
    DataError
        If an argument is out of range.
    """
    check_level(alpha)
    check_confidence(confidence)
    check_count(n, 3, "n")
    _check_numbers(seed, replications)
    if not -1 < r < 1:
        raise DataError(f"The correlation is {r}, but must lie between -1 and 1.")
    rng = np.random.default_rng(seed)
    critical = float(stats.f.isf(alpha, 1, n - 2))
    found = 0
    batch = max(1, _AT_ONCE // n)
    for start in range(0, replications, batch):
        x, noise = rng.standard_normal((2, min(batch, replications - start), n))
        y = r * x + math.sqrt(1 - r * r) * noise
        x -= x.mean(axis=1, keepdims=True)
        y -= y.mean(axis=1, keepdims=True)
        explained = (x * y).sum(axis=1) ** 2 / (x * x).sum(axis=1)
        left = (y * y).sum(axis=1) - explained
        found += int((explained * (n - 2) > critical * left).sum())
    return wilson(found, replications, confidence)


def wilson(found: int, of: int, confidence: float = 0.95) -> Share:
    """Return a share with Wilson's interval; raises DataError unless 0 <= `found` <= `of` and `of` is positive."""
    check_count(of, 1, "The number of replications")
    check_count(found, 0, "The number found")
    check_confidence(confidence)
    if found > of:
        raise DataError(f"{found} of {of} were found, but there cannot be more than all.")
    low, high = stats.binomtest(found, of).proportion_ci(confidence, method="wilson")
    return Share(found=found, of=of, low=float(low), high=float(high))


def _ratings(
    design: CrossedDesign, means: FloatArray, sd: VarianceComponents, studies: int, rng: np.random.Generator
) -> FloatArray:
    """Return simulated ratings in the shape that `mean_squares.of` takes."""
    R, S, c = design.raters, design.items, design.conditions

    def normal(scale: float, *shape: int) -> FloatArray:
        return scale * rng.standard_normal((studies, *shape))

    if design.assignment == "full":
        ratings = normal(sd.residual_sd, R, S, c) + normal(sd.rater_item_sd, R, S, 1)
        ratings += normal(sd.rater_sd, R, 1, 1) + normal(sd.rater_condition_sd, R, 1, c)
        ratings += normal(sd.item_sd, 1, S, 1) + normal(sd.item_condition_sd, 1, S, c) + means
        return ratings
    own = math.hypot(sd.residual_sd, sd.rater_item_sd)
    if design.assignment == "between":
        ratings = normal(own, c, R // c, S) + normal(math.hypot(sd.rater_sd, sd.rater_condition_sd), c, R // c, 1)
        ratings += normal(sd.item_sd, 1, 1, S) + normal(sd.item_condition_sd, c, 1, S) + means[:, None, None]
        return ratings
    shown = mean_squares.latin_square(c)
    ratings = normal(own, c, R // c, c, S // c)
    ratings += normal(sd.rater_sd, c, R // c, 1, 1) + normal(sd.item_sd, 1, 1, c, S // c)
    # A rater's own part in each condition, and an item's, put where the square shows that condition.
    group, items_of = np.arange(c)[:, None], np.arange(c)[None, :]
    of_raters = normal(sd.rater_condition_sd, c, R // c, c)
    ratings += np.moveaxis(of_raters[:, group, :, shown], (0, 1), (1, 3))[..., None]
    of_items = normal(sd.item_condition_sd, c, S // c, c)
    ratings += np.moveaxis(of_items[:, items_of, :, shown], 2, 0)[:, :, None]
    ratings += means[shown][:, None, :, None]
    return ratings


def _significant(design: CrossedDesign, squares: Mapping[str, FloatArray], alpha: float) -> dict[Test, BoolArray]:
    """Return which studies each test finds significant, from the sums of squares of each."""
    df = mean_squares.degrees_of_freedom(design)
    effect = squares["condition"] / df["condition"]
    found: dict[Test, BoolArray] = {}
    for test in ("by_item", "by_rater", "mixed_model", "independent"):
        pooled = design.denominator(test)
        total = sum(df[name] for name in pooled)
        denominator = sum((squares[name] for name in pooled), np.zeros_like(effect)) / total
        found[test] = effect > float(stats.f.isf(alpha, df["condition"], total)) * denominator
    found["both"] = found["by_item"] & found["by_rater"]
    denominator, own = _quasi_f({name: squares[name] / df[name] for name in ("rater", "item", "error")}, df)
    # Of studies in which nothing varies at all, no test finds anything.
    found["quasi_f"] = effect > stats.f.isf(alpha, df["condition"], own) * denominator
    return {test: found[test] for test in TESTS}


def _quasi_f(squares: Mapping[str, FloatArray], df: Mapping[str, int]) -> tuple[FloatArray, FloatArray]:
    """Return the denominator of the quasi-F and its degrees of freedom, for each study."""
    rater, item, error = squares["rater"], squares["item"], squares["error"]
    more_rater, more_item = rater > error, item > error
    denominator = np.where(more_rater, rater, 0) + np.where(more_item, item, 0)
    denominator = denominator + np.where(more_rater & more_item, -error, np.where(more_rater | more_item, 0, error))
    spread = np.where(more_rater, rater**2 / df["rater"], 0) + np.where(more_item, item**2 / df["item"], 0)
    spread = spread + np.where(more_rater == more_item, error**2 / df["error"], 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = np.where(spread > 0, denominator**2 / spread, df["error"])
    return denominator, np.maximum(own, 1.0)


def _without_rounding(components: VarianceComponents) -> VarianceComponents:
    left = max(components.residual_sd**2 - _ROUNDING, 1e-12)
    return dataclasses.replace(components, residual_sd=math.sqrt(left))


def _check(design: CrossedDesign, seed: int, replications: int, scale: tuple[int, int] | None) -> None:
    _check_numbers(seed, replications)
    if scale is not None and not scale[0] < scale[1]:
        raise DataError(
            f"The scale goes from {scale[0]} to {scale[1]}, but its lowest point must be below its highest."
        )
    if design.ratings > _LARGEST_STUDY:
        raise DataError(
            f"One study of this design has {design.ratings} ratings, more than the {_LARGEST_STUDY} that can be "
            "simulated; the closed form has no such limit."
        )
    if design.ratings * replications > _MOST_RATINGS:
        raise DataError(
            f"{replications} replications of {design.ratings} ratings are more than {_MOST_RATINGS} ratings; take "
            f"{_MOST_RATINGS // design.ratings} replications at most."
        )


def _check_numbers(seed: int, replications: int) -> None:
    check_count(seed, 0, "The seed")
    check_count(replications, 1, "The number of replications")
    if replications > _MOST_REPLICATIONS:
        raise DataError(f"{replications} replications are more than {_MOST_REPLICATIONS}.")


def _flags(means: FloatArray, components: VarianceComponents, scale: tuple[int, int] | None) -> tuple[str, ...]:
    if scale is None:
        return ()
    low, high = scale
    flags = []
    if means.min() < low or means.max() > high:
        flags.append(
            f"A condition's true mean lies outside of the scale from {low} to {high}; its ratings are cut off there."
        )
    spread = math.hypot(*components.to_dict().values())
    cut = stats.norm.sf((np.minimum(means - low, high - means) + 0.5) / spread).max()
    if not flags and cut > 0.1:
        flags.append(
            f"In one condition {100 * cut:.0f}% of the ratings would lie beyond the scale from {low} to {high} and are "
            "cut off, so that the simulated differences are smaller than the true means say."
        )
    if components.residual_sd**2 < _ROUNDING:
        flags.append(
            "The residual standard deviation is smaller than rounding alone makes it (0.29), so simulated ratings vary "
            "more than was asked for."
        )
    return tuple(flags)
