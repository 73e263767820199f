"""One-way analysis of variance."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, finite_vector


@dataclass(frozen=True, kw_only=True)
class Group:
    """One group of an analysis of variance; `sd` is None for a group of one value."""

    name: str
    n: int
    mean: float
    sd: float | None


@dataclass(frozen=True, kw_only=True)
class OneWayAnova:
    """A one-way analysis of variance.

    Attributes
    ----------
    F : float
        Variance ratio; infinite if the groups differ and the values within them do not.
    df_between, df_within : int
        Degrees of freedom.
    p : float
        Probability of an F at least as large if all groups had one mean.
    SSB, SSW : float
        Sums of squares between and within groups.
    eta_squared, omega_squared : float
        Share of the variance that the groups explain, in the data and as estimated for the population; omega squared
        may be slightly below 0.
    groups : tuple of Group
        Means and standard deviations, in the order given.
    """

    F: float
    df_between: int
    df_within: int
    p: float
    SSB: float
    SSW: float
    eta_squared: float
    omega_squared: float
    groups: tuple[Group, ...]

    def summary(self) -> str:
        """Return the result as a sentence in APA style, for instance ``F(2, 57) = 38.70, p < .001, η² = .58``."""
        ratio = f"F({self.df_between}, {self.df_within}) = {wording.number(self.F)}"
        sizes = f"η² = {wording.share(self.eta_squared)}, ω² = {wording.share(self.omega_squared)}"
        return f"{ratio}, {wording.p_value(self.p)}, {sizes}"

    def to_frame(self) -> pd.DataFrame:
        """Return the usual table: one row each for between, within and total."""
        between, within = self.SSB / self.df_between, self.SSW / self.df_within
        return pd.DataFrame(
            {
                "source": ["between", "within", "total"],
                "sum_of_squares": [self.SSB, self.SSW, self.SSB + self.SSW],
                "df": [self.df_between, self.df_within, self.df_between + self.df_within],
                "mean_square": [between, within, math.nan],
                "F": [self.F, math.nan, math.nan],
                "p": [self.p, math.nan, math.nan],
                "eta_squared": [self.eta_squared, math.nan, math.nan],
                "omega_squared": [self.omega_squared, math.nan, math.nan],
            }
        )


def one_way(groups: Mapping[str, npt.ArrayLike]) -> OneWayAnova:
    """Compare the means of groups.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group; groups may differ in size.

    Returns
    -------
    OneWayAnova
        The variance ratio, its probability and the effect sizes.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups, a group is empty, no group has two values, or all values are the same.

    Notes
    -----
    Jia et al. (2013), Table 10, compare three groups of 20 sentences, whose values are means over raters: F[2, 57].
    Sums of squares are formed from differences to a nearby value, in two passes, so that a large common part costs no
    digits (NIST StRD, SmLs07 to SmLs09).

    References
    ----------
    Fisher (1925), Statistical Methods for Research Workers, chapter 7; omega squared by Hays (1963), Statistics for
    Psychologists.
    """
    vectors = {str(name): finite_vector(values, name=f"group {name}") for name, values in groups.items()}
    for name, vector in vectors.items():
        if vector.size == 0:
            raise InsufficientDataError(f"The group {name} has no values, so the groups cannot be compared.")
    _check_sizes([vector.size for vector in vectors.values()])
    origin = float(next(iter(vectors.values()))[0])
    offsets, inner, members = [], [], []
    for name, vector in vectors.items():
        offset, differences = centred(vector - origin)
        squares = float(differences @ differences)
        offsets.append(offset)
        inner.append(squares)
        sd = math.sqrt(squares / (vector.size - 1)) if vector.size > 1 else None
        members.append(Group(name=name, n=vector.size, mean=origin + offset, sd=sd))
    largest = max(float(np.abs(vector).max()) for vector in vectors.values())
    return _analyse(tuple(members), np.array(offsets), SSW=math.fsum(inner), largest=largest)


def one_way_from_summary(
    means: Mapping[str, float], sds: Mapping[str, float], ns: Mapping[str, int] | int
) -> OneWayAnova:
    """Compare the means of groups of which only mean, standard deviation and size are printed.

    Parameters
    ----------
    means, sds : mapping of str to float
        Mean and standard deviation (with n - 1) of each group.
    ns : mapping of str to int, or int
        Size of each group, or the one size of all.

    Returns
    -------
    OneWayAnova
        As `one_way` would return for the values themselves.

    Raises
    ------
    DataError
        If the groups of the three differ, a number is not finite, a standard deviation is negative or a size is not a
        positive whole number.
    InsufficientDataError
        As `one_way`.

    References
    ----------
    Larson (1992), Analysis of variance with just summary statistics as input, The American Statistician 46:151.
    """
    sizes = dict.fromkeys(means, ns) if isinstance(ns, int) else dict(ns)
    if not set(means) == set(sds) == set(sizes):
        raise DataError("Means, standard deviations and sizes must be given for the same groups.")
    centres = finite_vector([means[name] for name in means], name="means")
    spreads = finite_vector([sds[name] for name in means], name="standard deviations")
    counts = [sizes[name] for name in means]
    if (spreads < 0).any():
        raise DataError("A standard deviation is negative, but must be 0 or more.")
    if any(count < 1 for count in counts):
        raise DataError("A group's size is not positive, but must be a whole number of 1 or more.")
    _check_sizes(counts)
    members = tuple(
        Group(name=name, n=count, mean=float(mean), sd=float(sd) if count > 1 else None)
        for name, count, mean, sd in zip(means, counts, centres, spreads, strict=True)
    )
    inner = [(group.n - 1) * group.sd**2 for group in members if group.sd is not None]
    largest = float(np.abs(centres).max())
    return _analyse(members, centres - centres[0], SSW=math.fsum(inner), largest=largest)


def pooled_sd_from_f(means: npt.ArrayLike, n: int, F: float) -> float:
    """Return the standard deviation within groups that a printed F implies.

    Papers often print means and F but no standard deviation, as Jia et al. (2013) do in Table 10; power planning and
    effect sizes need it.

    Parameters
    ----------
    means : array_like, shape (k,)
        Means of the groups.
    n : int
        Size of each group.
    F : float
        The printed variance ratio, positive.

    Returns
    -------
    float
        Pooled standard deviation, in the units of the means: sqrt(n var(means) / F).

    Raises
    ------
    DataError
        If a number is not finite, `F` is not positive, or `n` is less than 2.
    InsufficientDataError
        If there are fewer than two means or they are all the same.

    References
    ----------
    Cohen (1988), Statistical Power Analysis for the Behavioral Sciences, 2nd ed., section 8.2.
    """
    centres = finite_vector(means, name="means")
    if not (math.isfinite(F) and F > 0) or n < 2:
        raise DataError(f"F is {F} and n is {n}, but F must be positive and n 2 or more.")
    if centres.size < 2 or np.ptp(centres) == 0:
        raise InsufficientDataError("At least two different means are needed.")
    return math.sqrt(n * float(np.var(centres, ddof=1)) / F)


def _check_sizes(counts: list[int]) -> None:
    if len(counts) < 2:
        raise InsufficientDataError(
            f"At least two groups are needed to compare means; there is {len(counts) or 'none'}."
        )
    if sum(counts) <= len(counts):
        raise InsufficientDataError("Each group has only one value; at least one group needs two or more.")


def _analyse(groups: tuple[Group, ...], offsets: FloatArray, *, SSW: float, largest: float) -> OneWayAnova:
    sizes = np.array([group.n for group in groups])
    df_between, df_within = len(groups) - 1, int(sizes.sum()) - len(groups)
    grand = float(sizes @ offsets) / float(sizes.sum())
    SSB = math.fsum(sizes * (offsets - grand) ** 2)
    # Squares of differences that are no more than the rounding of the values mean that nothing varies.
    negligible = float(sizes.sum()) * (4 * np.finfo(float).eps * largest) ** 2
    SSB, SSW = (0.0 if squares <= negligible else squares for squares in (SSB, SSW))
    total = SSB + SSW
    if total == 0:
        raise InsufficientDataError("All values are the same, so there is no variance to analyse.")
    within = SSW / df_within
    F = (SSB / df_between) / within if within > 0 else math.inf
    return OneWayAnova(
        F=F,
        df_between=df_between,
        df_within=df_within,
        p=float(stats.f.sf(F, df_between, df_within)),
        SSB=SSB,
        SSW=SSW,
        eta_squared=SSB / total,
        omega_squared=(SSB - df_between * within) / (total + within),
        groups=groups,
    )
