"""Power of comparisons of conditions when raters and items are both samples, in closed form."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.noncentral import check_level, f_power
from evaluation.statistics.power.closed_form import chance, required_n
from evaluation.statistics.power.crossed_design import (
    TEST_LABELS,
    TESTS,
    CrossedDesign,
    Stratum,
    Test,
    VarianceComponents,
)
from evaluation.statistics.result import Result

_MOST = 10_000
_NODES = 96
# With fewer degrees of freedom the estimated ones scatter too widely around the expected ones.
_ROUGH = 8
# Where the noncentral chi-squared is the central one, and where it hardly varies.
_NOTHING, _SURE = 1e-12, 1e5


@dataclass(frozen=True, kw_only=True)
class CrossedPower(Result):
    """The power of a comparison of conditions.

    Attributes
    ----------
    test : str
        One of `evaluation.statistics.power.crossed_design.TESTS`.
    design : CrossedDesign
        Raters, items and conditions.
    alpha, power : float
        Level of the test, and probability that it finds the difference.
    false_positive_rate : float
        Probability that the test finds a difference where there is none. Above `alpha` if the denominator leaves out
        a source of variance; the power is then not to be had honestly.
    noncentrality : float
        That of the F ratio.
    df : tuple of two float
        Degrees of freedom of the test; for "both" those of the weaker of its two tests.
    """

    test: Test
    design: CrossedDesign
    alpha: float
    power: float
    false_positive_rate: float
    noncentrality: float
    df: tuple[float, float]

    def apa(self) -> str:
        """Return a sentence."""
        design = self.design
        sample = f"{design.raters} raters and {design.items} items in {design.conditions} conditions"
        df = ", ".join(f"{value:.1f}".removesuffix(".0") for value in self.df)
        level = f"α = {wording.share(self.alpha)}"
        test = TEST_LABELS[self.test]
        return f"With {sample} the test F({df}), {test}, has a power of {chance(self.power)} at {level}."

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        return pd.DataFrame(
            {
                "test": [self.test],
                **{name: [value] for name, value in dataclasses.asdict(self.design).items()},
                "alpha": [self.alpha],
                "power": [self.power],
                "false_positive_rate": [self.false_positive_rate],
                "noncentrality": [self.noncentrality],
                "df_1": [self.df[0]],
                "df_2": [self.df[1]],
            }
        )


def crossed_power(
    design: CrossedDesign,
    means: npt.ArrayLike,
    components: VarianceComponents,
    *,
    test: Test = "quasi_f",
    alpha: float = 0.05,
) -> CrossedPower:
    """Return the power with which conditions rated by a sample of raters on a sample of items are found to differ.

    Parameters
    ----------
    design : CrossedDesign
        Who rates what.
    means : array_like, shape (conditions,)
        True means of the conditions, in points of the scale.
    components : VarianceComponents
        What else makes ratings differ.
    test : str
        "quasi_f": raters and items random, with their interactions with the condition; holds for other raters and other
        items, and is what `evaluation.statistics.mixed.crossed_mixed_model` with slopes tests. "by_item": repeated
        measures of the items' means over raters (of two conditions the paired t test); holds for these raters alone
        unless raters differ alike in all conditions. "by_rater": the other way round. "both": both significant, as
        min-F' was meant to ensure. "mixed_model": raters and items as random intercepts, as the same without slopes.
        "independent": one-way analysis of the items' means, as in Jia et al. (2013), Table 10.
    alpha : float
        Level of the test.

    Returns
    -------
    CrossedPower
        From the noncentral F with Satterthwaite's degrees of freedom; exact for "by_item" and "by_rater" where their
        assumption holds. Flagged if the test finds too much where there is nothing.

    Raises
    ------
    DataError
        If there are not as many finite means as conditions, or another argument is out of range.

    References
    ----------
    Westfall, Kenny and Judd (2014), Statistical power and optimal design in experiments in which samples of
    participants respond to samples of stimuli, Journal of Experimental Psychology: General 143:2020; with more than two
    conditions by the F instead of the t. Clark (1973), Journal of Verbal Learning and Verbal Behavior 12:335, for F1,
    F2 and quasi-F; Pollatsek and Well (1995), Journal of Experimental Psychology: LMC 21:785, for the tests by item and
    by rater in counterbalanced designs, which take out lists and groups.
    """
    check_level(alpha)
    if test not in TESTS:
        raise DataError(f"The test is {test!r}, but must be one of {', '.join(TESTS)}.")
    strata = design.strata(components)
    effect = strata["condition"]
    noncentrality = design.ratings_per_condition * _squared_effect(design, means) / effect.expected
    df, (power, rate) = _probabilities(design, strata, test, (noncentrality, 0.0), alpha)
    return CrossedPower(
        test=test,
        design=design,
        alpha=alpha,
        power=power,
        false_positive_rate=rate,
        noncentrality=noncentrality,
        df=(effect.df, df),
        flags=_flags(test, rate, alpha, df),
    )


def required(
    what: Literal["raters", "items"],
    design: CrossedDesign,
    means: npt.ArrayLike,
    components: VarianceComponents,
    *,
    target: float = 0.8,
    test: Test = "quasi_f",
    alpha: float = 0.05,
    most: int = _MOST,
) -> int | None:
    """Return the smallest number of raters (or items) that gives a power, the other number staying as it is.

    Parameters
    ----------
    what : str
        "raters" or "items".
    design, means, components, test, alpha
        As for `crossed_power`; the number in `design` that is looked for does not matter.
    target : float
        The power wanted, between 0 and 1.
    most : int
        The largest number that is tried.

    Returns
    -------
    int or None
        The number, a multiple of the conditions if the design asks for it; None if even `most` are not enough: with few
        items no number of raters may be, and the other way round.

    Raises
    ------
    DataError
        As `crossed_power`.
    """
    step = design.rater_step if what == "raters" else design.item_step

    def power_of(count: int) -> float:
        changed = (
            dataclasses.replace(design, raters=count) if what == "raters" else dataclasses.replace(design, items=count)
        )
        return crossed_power(changed, means, components, test=test, alpha=alpha).power

    return required_n(power_of, target=target, least=2 * step, most=most, step=step)


def power_table(
    design: CrossedDesign,
    means: npt.ArrayLike,
    components: VarianceComponents,
    *,
    raters: Iterable[int],
    items: Iterable[int],
    test: Test = "quasi_f",
    alpha: float = 0.05,
) -> pd.DataFrame:
    """Return the power for each number of raters (rows) and items (columns); raises as `crossed_power`."""
    columns = list(items)
    rows = {
        rater: [
            crossed_power(
                dataclasses.replace(design, raters=rater, items=item), means, components, test=test, alpha=alpha
            ).power
            for item in columns
        ]
        for rater in raters
    }
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=pd.Index(columns, name="items"))
    return frame.rename_axis(index="raters")


def condition_means(design: CrossedDesign, means: npt.ArrayLike) -> FloatArray:
    """Return the means as a vector; DataError unless there is a finite one for each condition."""
    vector = finite_vector(means, name="means")
    if vector.size != design.conditions:
        raise DataError(f"There are {vector.size} means but {design.conditions} conditions; give one mean for each.")
    return vector


def _squared_effect(design: CrossedDesign, means: npt.ArrayLike) -> float:
    vector = condition_means(design, means)
    return float(((vector - vector.mean()) ** 2).sum())


def _probabilities(
    design: CrossedDesign, strata: Mapping[str, Stratum], test: Test, noncentralities: Sequence[float], alpha: float
) -> tuple[float, list[float]]:
    """Return a test's degrees of freedom, and how often it is significant with each noncentrality."""
    effect = strata["condition"]
    if test == "both":
        df = float(min(strata["rater"].df, strata["item"].df))
        return df, [_both(strata, noncentrality, alpha) for noncentrality in noncentralities]
    if test == "quasi_f":
        df = _satterthwaite(strata, {"rater": 1.0, "item": 1.0, "error": -1.0})
        return df, [f_power(effect.df, df, noncentrality, alpha=alpha) for noncentrality in noncentralities]
    pooled = design.denominator(test)
    df = float(sum(strata[name].df for name in pooled))
    shares = {name: strata[name].df / df for name in pooled}
    inflation = effect.expected / sum(share * strata[name].expected for name, share in shares.items())
    own = _satterthwaite(strata, shares)
    return df, [
        f_power(effect.df, own, noncentrality, alpha=alpha, df_test=df, inflation=inflation)
        for noncentrality in noncentralities
    ]


def _satterthwaite(strata: Mapping[str, Stratum], weights: Mapping[str, float]) -> float:
    """Return the degrees of freedom of a weighted sum of mean squares (Satterthwaite, 1946, Biometrics 2:110)."""
    parts = [(weight * strata[name].expected, strata[name].df) for name, weight in weights.items() if strata[name].df]
    return float(sum(part for part, _ in parts) ** 2 / math.fsum(part**2 / df for part, df in parts))


def _both(strata: Mapping[str, Stratum], noncentrality: float, alpha: float) -> float:
    """Return the probability that one mean square exceeds those of raters and of items, each by its critical F."""
    effect = strata["condition"]
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    # The mean square of the conditions at evenly spread probabilities; most of the integrand lies in its body.
    squares = effect.expected * _quantiles((nodes + 1) / 2, effect.df, noncentrality) / effect.df
    found = np.ones_like(squares)
    for name in ("rater", "item"):
        df, expected = strata[name]
        critical = float(stats.f.isf(alpha, effect.df, df))
        found *= stats.chi2.cdf(squares / critical * df / expected, df)
    return float(weights @ found / 2)


def _quantiles(probabilities: FloatArray, df: int, noncentrality: float) -> FloatArray:
    if noncentrality < _NOTHING:
        return np.asarray(stats.chi2.ppf(probabilities, df))
    if noncentrality > _SURE:
        return np.full_like(probabilities, noncentrality + df)
    return np.asarray(stats.ncx2.ppf(probabilities, df, noncentrality))


def _flags(test: Test, rate: float, alpha: float, df: float) -> tuple[str, ...]:
    if test == "quasi_f" and df < _ROUGH:
        return (f"With {df:.1f} degrees of freedom the closed form is rough; trust the simulation.",)
    if rate <= 1.2 * alpha:
        return ()
    return (
        f"The test {TEST_LABELS[test]} finds a difference where there is none with a probability of "
        f"{wording.share(rate)} instead of {wording.share(alpha)}, because its denominator leaves out a source of "
        "variance.",
    )
