"""Power of tests, and how many observations a power takes, in closed form."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import finite_vector
from evaluation.statistics.noncentral import (
    Alternative,
    check_count,
    check_level,
    check_positive,
    correlation_exceeds,
    f_power,
    t_power,
)
from evaluation.statistics.result import Result

_MOST = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Power(Result):
    """The power of a test.

    Attributes
    ----------
    test : str
        The test, for instance "one-way analysis of variance".
    sample : str
        What it is made of, for instance "3 groups of 20".
    effect, effect_name
        Size of the effect, and what it is: f, d, d_z or r.
    n : int
        Values in each group, or pairs, or items.
    alpha : float
        Level of the test.
    power : float
        Probability that the test finds the effect.
    noncentrality : float or None
        That of the F or t distribution; None for a correlation, whose power is a mixture.
    df : tuple of float
        Degrees of freedom of the test.
    """

    test: str
    sample: str
    effect: float
    effect_name: str
    n: int
    alpha: float
    power: float
    noncentrality: float | None
    df: tuple[float, ...]

    def apa(self) -> str:
        """Return a sentence, for instance ``A paired t test of 34 pairs has a power of .81 to find d_z = 0.50 …``."""
        write = wording.share if self.effect_name == "r" else wording.number
        found = f"{self.effect_name} = {write(self.effect)} at α = {wording.share(self.alpha)}"
        return f"A {self.test} of {self.sample} has a power of {chance(self.power)} to find {found}."

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; a t test has the one number of degrees of freedom `df_2`."""
        return pd.DataFrame(
            {
                "test": [self.test],
                "sample": [self.sample],
                "effect_name": [self.effect_name],
                "effect": [self.effect],
                "n": [self.n],
                "alpha": [self.alpha],
                "power": [self.power],
                "noncentrality": [math.nan if self.noncentrality is None else self.noncentrality],
                "df_1": [self.df[0] if len(self.df) > 1 else math.nan],
                "df_2": [self.df[-1]],
            }
        )


def chance(probability: float) -> str:
    """Return a power as it is written: two digits, or ``over .999``."""
    return "over .999" if probability > 0.999 else wording.share(probability)


def effect_f(means: npt.ArrayLike, sd: float) -> float:
    """Return Cohen's f of groups of equal size: the standard deviation (with n) of their means over that within them.

    Raises
    ------
    DataError
        If a mean is not finite, `sd` is not positive, or (InsufficientDataError) there are fewer than two means.

    References
    ----------
    Cohen (1988), Statistical Power Analysis for the Behavioral Sciences, 2nd ed., Eq. 8.2.1 and 8.2.2.
    """
    centres = finite_vector(means, name="means")
    if centres.size < 2:
        raise InsufficientDataError("At least two means are needed.")
    check_positive(sd, "The standard deviation")
    return float(np.std(centres)) / sd


def one_way_power(f: float, n: int, groups: int, *, alpha: float = 0.05) -> Power:
    """Return the power of a one-way analysis of variance of independent groups.

    Parameters
    ----------
    f : float
        Cohen's f, 0 or more; `effect_f` gives it.
    n : int
        Values in each group, at least 2.
    groups : int
        Number of groups, at least 2.
    alpha : float
        Level of the test.

    Returns
    -------
    Power
        From the noncentral F with groups - 1 and groups (n - 1) degrees of freedom and noncentrality groups n f².

    Raises
    ------
    DataError
        If a number is out of its range.

    Notes
    -----
    Jia et al. (2013), Table 10, test means of the same sentences in three conditions in this way, F[2, 57], as if they
    were independent; `repeated_measures_power` is for the design as it was.

    References
    ----------
    Cohen (1988), section 8.5.
    """
    _check_effect(f)
    check_count(n, 2, "n")
    check_count(groups, 2, "The number of groups")
    df = (groups - 1, groups * (n - 1))
    noncentrality = groups * n * f**2
    return Power(
        test="one-way analysis of variance",
        sample=f"{groups} groups of {n}",
        effect=float(f),
        effect_name="f",
        n=int(n),
        alpha=alpha,
        power=f_power(*df, noncentrality, alpha=alpha),
        noncentrality=noncentrality,
        df=df,
    )


def repeated_measures_power(
    f: float, n: int, conditions: int, *, correlation: float = 0.0, epsilon: float = 1.0, alpha: float = 0.05
) -> Power:
    """Return the power of a repeated-measures analysis of variance, for instance of items rated in all conditions.

    Parameters
    ----------
    f : float
        Cohen's f, as for independent groups: with the standard deviation within conditions.
    n : int
        Items (or raters) that are measured in all conditions, at least 2.
    conditions : int
        Number of conditions, at least 2.
    correlation : float
        Correlation of the measurements in two conditions, -1 / (conditions - 1) to 1, both excluded; 0 if nobody knows.
    epsilon : float
        Departure from sphericity by which degrees of freedom shrink, 1 / (conditions - 1) to 1.
    alpha : float
        Level of the test.

    Returns
    -------
    Power
        From the noncentral F with epsilon (conditions - 1) and epsilon (n - 1)(conditions - 1) degrees of freedom and
        noncentrality epsilon n conditions f² / (1 - correlation).

    Raises
    ------
    DataError
        If a number is out of its range.

    References
    ----------
    Faul, Erdfelder, Lang and Buchner (2007), G*Power 3, Behavior Research Methods 39:175, table 3; Muller and Barton
    (1989), JASA 84:549, for epsilon.
    """
    _check_effect(f)
    check_count(n, 2, "n")
    check_count(conditions, 2, "The number of conditions")
    least = 1 / (conditions - 1)
    if not -least < correlation < 1:
        raise DataError(f"The correlation is {correlation}, but must lie between {-least:.3g} and 1.")
    if not least - 1e-12 <= epsilon <= 1:
        raise DataError(f"epsilon is {epsilon}, but must lie from {least:.3g} to 1.")
    df = (epsilon * (conditions - 1), epsilon * (conditions - 1) * (n - 1))
    noncentrality = epsilon * n * conditions * f**2 / (1 - correlation)
    return Power(
        test="repeated-measures analysis of variance",
        sample=f"{n} units in {conditions} conditions",
        effect=float(f),
        effect_name="f",
        n=int(n),
        alpha=alpha,
        power=f_power(*df, noncentrality, alpha=alpha),
        noncentrality=noncentrality,
        df=df,
    )


def independent_t_power(
    d: float, n: int, n_other: int | None = None, *, alternative: Alternative = "two-sided", alpha: float = 0.05
) -> Power:
    """Return the power of Student's t test of two independent groups.

    Parameters
    ----------
    d : float
        Cohen's d: the difference of means over the standard deviation within groups.
    n, n_other : int
        Values in the two groups; left out, the second is as large as the first. At least 3 together.
    alternative : str
        "two-sided", or "greater" if only a positive difference counts.
    alpha : float
        Level of the test.

    Returns
    -------
    Power
        From the noncentral t with N - 2 degrees of freedom and noncentrality d sqrt(n n_other / N), N = n + n_other.

    Raises
    ------
    DataError
        If a number is out of its range.

    References
    ----------
    Cohen (1988), section 2.5.
    """
    other = n if n_other is None else n_other
    check_count(n, 1, "n")
    check_count(other, 1, "n_other")
    check_count(n + other, 3, "The number of values")
    _check_effect(abs(d))
    noncentrality = d * math.sqrt(n * other / (n + other))
    return Power(
        test="t test",
        sample=f"two groups of {n} and {other}",
        effect=float(d),
        effect_name="d",
        n=int(n),
        alpha=alpha,
        power=t_power(n + other - 2, noncentrality, alternative, alpha),
        noncentrality=noncentrality,
        df=(n + other - 2,),
    )


def paired_t_power(d_z: float, n: int, *, alternative: Alternative = "two-sided", alpha: float = 0.05) -> Power:
    """Return the power of a paired t test; raises as `independent_t_power`.

    Parameters
    ----------
    d_z : float
        The mean of the differences over their standard deviation.
    n : int
        Number of pairs, at least 2.
    alternative, alpha
        As for `independent_t_power`.

    Returns
    -------
    Power
        From the noncentral t with n - 1 degrees of freedom and noncentrality d_z sqrt(n).

    References
    ----------
    Cohen (1988), section 2.3.5.
    """
    _check_effect(abs(d_z))
    check_count(n, 2, "n")
    noncentrality = d_z * math.sqrt(n)
    return Power(
        test="paired t test",
        sample=f"{n} pairs",
        effect=float(d_z),
        effect_name="d_z",
        n=int(n),
        alpha=alpha,
        power=t_power(n - 1, noncentrality, alternative, alpha),
        noncentrality=noncentrality,
        df=(n - 1,),
    )


def correlation_power(r: float, n: int, *, alpha: float = 0.05) -> Power:
    """Return the power of the two-sided t test of a Pearson correlation between two normal variables.

    Parameters
    ----------
    r : float
        The correlation to be found, between -1 and 1.
    n : int
        Number of pairs, at least 3.
    alpha : float
        Level of the test.

    Returns
    -------
    Power
        Exact: given x, the test has a noncentral F with a noncentrality that follows a scaled chi-squared over samples,
        so that r² is a beta variable mixed by a negative binomial one.

    Raises
    ------
    DataError
        If a number is out of its range.

    References
    ----------
    Gurland (1968), A relatively simple form of the distribution of the multiple correlation coefficient, J. R. Stat.
    Soc. B 30:276, for one predictor; the model is G*Power's "bivariate normal" (Faul et al., 2009, Behavior Research
    Methods 41:1149).
    """
    check_level(alpha)
    if not -1 < r < 1:
        raise DataError(f"The correlation is {r}, but must lie between -1 and 1.")
    check_count(n, 3, "n")
    # Smallest r² that the test rejects: r² = F / (F + n - 2) is beta distributed if there is no correlation.
    critical = float(special.betaincinv(0.5, (n - 2) / 2, 1 - alpha))
    return Power(
        test="test of a correlation",
        sample=f"{n} pairs",
        effect=float(r),
        effect_name="r",
        n=int(n),
        alpha=alpha,
        power=correlation_exceeds(critical, r * r, n),
        noncentrality=None,
        df=(n - 2,),
    )


def required_n(
    power_of: Callable[[int], float], *, target: float = 0.8, least: int = 2, most: int = _MOST, step: int = 1
) -> int | None:
    """Return the smallest number of observations with which a test has a power.

    Parameters
    ----------
    power_of : callable
        From a number of observations to the power, which must not fall; for instance
        ``lambda n: one_way_power(0.25, n, 3).power``.
    target : float
        The power wanted, between 0 and 1.
    least, most, step : int
        The numbers to choose from: `least`, `least` + `step`, and so on, up to `most`.

    Returns
    -------
    int or None
        The number; None if even `most` are not enough.

    Raises
    ------
    DataError
        If `target` is not between 0 and 1.
    """
    if not 0 < target < 1:
        raise DataError(f"The power wanted is {target}, but must lie between 0 and 1.")
    if power_of(least) >= target:
        return least
    last = (most - least) // step
    low, high = 0, 1
    while high < last and power_of(least + high * step) < target:
        low, high = high, 2 * high
    high = min(high, last)
    if low >= high or power_of(least + high * step) < target:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if power_of(least + middle * step) >= target else (middle, high)
    return least + high * step


def _check_effect(effect: float) -> None:
    if not 0 <= effect <= 1000:
        raise DataError(f"The effect size is {effect}, but must be a number from 0 to 1000 in size (f not negative).")
