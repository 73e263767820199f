"""One-way analysis of variance."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import finite_vector
from evaluation.statistics.groups import Moments, check_sizes, group_vectors, matrix_moments, moments, variance_ratio
from evaluation.statistics.result import Result


class Group(NamedTuple):
    """One group of an analysis of variance; `sd` is None for a group of one value."""

    name: str
    n: int
    mean: float
    sd: float | None


@dataclass(frozen=True, kw_only=True)
class OneWayAnova(Result):
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

    def apa(self) -> str:
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
    return _analyse(moments(group_vectors(groups)))


def one_way_of_matrix(matrix: npt.ArrayLike, names: Sequence[str] | None = None) -> OneWayAnova:
    """Compare the means of the columns of a matrix: `one_way` for groups of one size, and much quicker for many.

    Parameters
    ----------
    matrix : array_like, shape (n, k)
        Finite numbers; each of the k columns is a group of n values. Groups with missing values differ in size and
        are for `one_way`.
    names : sequence of str, optional
        Names of the groups; 1, 2, 3, … if not given.

    Returns
    -------
    OneWayAnova
        As `one_way`.

    Raises
    ------
    DataError
        If it is no matrix of finite numbers, or there is not one name, and another one, for each column.
    InsufficientDataError
        As `one_way`.

    References
    ----------
    As `one_way`.
    """
    return _analyse(matrix_moments(matrix, names))


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
    sizes = dict(ns) if isinstance(ns, Mapping) else dict.fromkeys(means, ns)
    if not set(means) == set(sds) == set(sizes):
        raise DataError("Means, standard deviations and sizes must be given for the same groups.")
    centres = finite_vector([means[name] for name in means], name="means")
    spreads = finite_vector([sds[name] for name in means], name="standard deviations")
    counts = finite_vector([sizes[name] for name in means], name="sizes")
    if (spreads < 0).any():
        raise DataError("A standard deviation is negative, but must be 0 or more.")
    if (counts < 1).any() or (counts % 1).any():
        raise DataError("A group's size is not positive, but must be a whole number of 1 or more.")
    check_sizes(counts.astype(np.int64))
    found = Moments(
        names=tuple(map(str, means)),
        sizes=counts.astype(np.int64),
        origin=float(centres[0]),
        offsets=centres - centres[0],
        squares=(counts - 1) * spreads**2,
        largest=float(np.abs(centres).max()),
    )
    return _analyse(found)


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


def described(found: Moments) -> tuple[Group, ...]:
    """Return size, mean and standard deviation of each group."""
    single = found.sizes == 1
    sds = np.sqrt(found.squares / np.where(single, 1, found.sizes - 1))
    means = (found.origin + found.offsets).tolist()
    groups = map(Group, found.names, found.sizes.tolist(), means, sds.tolist())
    if not single.any():
        return tuple(groups)
    return tuple(group if group.n > 1 else group._replace(sd=None) for group in groups)


def _analyse(found: Moments) -> OneWayAnova:
    ratio = variance_ratio(found)
    within = ratio.SSW / ratio.df_within
    total = ratio.SSB + ratio.SSW
    flags = [] if within > 0 else ["No group varies within itself, so F is infinite."]
    single = int((found.sizes == 1).sum())
    if single:
        flags.append(f"Groups of only one value, which tell nothing of the variance within groups: {single}.")
    return OneWayAnova(
        **ratio._asdict(),
        eta_squared=ratio.SSB / total,
        omega_squared=(ratio.SSB - ratio.df_between * within) / (total + within),
        groups=described(found),
        flags=tuple(flags),
    )
