"""Comparisons by ranks, which suppose neither normal values nor an interval scale."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, finite_vector
from evaluation.statistics.assumptions import joined
from evaluation.statistics.groups import EPSILON, column_names, group_vectors, segment_sums
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result

# From this size on, and whenever values are tied, p comes from the normal distribution, as in R.
EXACT_BELOW = 50
# Subjects up to which chi squared is too rough for Friedman's statistic, by number of conditions: tables of its exact
# distribution reach so far (Siegel and Castellan, 1988, Nonparametric Statistics, table M).
_FEW_SUBJECTS = {2: 20, 3: 13, 4: 8}


@dataclass(frozen=True, kw_only=True)
class KruskalWallis(Result):
    """A Kruskal-Wallis test.

    Attributes
    ----------
    H : float
        The statistic, corrected for ties; distributed as chi squared if all groups have one distribution.
    df : int
        Degrees of freedom.
    p : float
        Probability of an H at least as large, by chi squared.
    epsilon_squared : float
        Share of the variance of the ranks that the groups explain, 0 to 1: H / (n - 1).
    n : int
        Number of values.
    names : tuple of str
        Names of the groups.
    mean_ranks : tuple of float
        Mean rank of each group.
    """

    H: float
    df: int
    p: float
    epsilon_squared: float
    n: int
    names: tuple[str, ...]
    mean_ranks: tuple[float, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``H(2) = 7.99, p = .018, ε² = .28``."""
        size = f"ε² = {wording.share(self.epsilon_squared)}"
        return f"H({self.df}) = {wording.number(self.H)}, {wording.p_value(self.p)}, {size}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        names = ("H", "df", "p", "epsilon_squared", "n")
        return pd.DataFrame({name: [getattr(self, name)] for name in names})


@dataclass(frozen=True, kw_only=True)
class Friedman(Result):
    """A Friedman test.

    Attributes
    ----------
    chi_squared : float
        The statistic, corrected for ties.
    df : int
        Degrees of freedom.
    p : float
        Probability of a statistic at least as large, by chi squared.
    W : float
        Kendall's coefficient of concordance: 1 if all subjects rank the conditions alike.
    n : int
        Number of subjects.
    names : tuple of str
        Names of the conditions.
    mean_ranks : tuple of float
        Mean rank of each condition.
    """

    chi_squared: float
    df: int
    p: float
    W: float
    n: int
    names: tuple[str, ...]
    mean_ranks: tuple[float, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``χ²(2, N = 22) = 11.14, p = .004, W = .25``."""
        statistic = f"χ²({self.df}, N = {self.n}) = {wording.number(self.chi_squared)}"
        return f"{statistic}, {wording.p_value(self.p)}, W = {wording.share(self.W)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        names = ("chi_squared", "df", "p", "W", "n")
        return pd.DataFrame({name: [getattr(self, name)] for name in names})


@dataclass(frozen=True, kw_only=True)
class TwoSampleRanks(Result):
    """A comparison of two sets of values by ranks.

    Attributes
    ----------
    test : str
        ``Mann-Whitney`` or ``Wilcoxon signed rank``.
    symbol : str
        What the statistic is called: U, or V as R calls it.
    statistic : float
        U: number of pairs in which the value of x is the larger, ties counting half. V: sum of the ranks of the
        differences x - y that are positive.
    p : float
        Two-sided probability.
    method : str
        ``exact``, or ``normal`` for the normal distribution with a correction for ties and for continuity.
    rank_biserial : float
        Share of the pairs, or of the sum of ranks, that favours x less the share that favours y, -1 to 1.
    n : tuple of int
        Numbers of values; of pairs that differ.
    """

    test: str
    symbol: str
    statistic: float
    p: float
    method: str
    rank_biserial: float
    n: tuple[int, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``Mann-Whitney U = 10.00, p = .021, r = -.60``."""
        effect = f"rank-biserial r = {wording.share(self.rank_biserial)}"
        return f"{self.test} {self.symbol} = {wording.number(self.statistic)}, {wording.p_value(self.p)}, {effect}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        names = ("test", "statistic", "p", "method", "rank_biserial")
        return pd.DataFrame({name: [getattr(self, name)] for name in names} | {"n": [sum(self.n)]})


def kruskal_wallis(groups: Mapping[str, npt.ArrayLike]) -> KruskalWallis:
    """Test whether groups come from one distribution, by the ranks of their values.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.

    Returns
    -------
    KruskalWallis
        H with its probability; a flag if a group has fewer than five values.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups, a group is empty, or all values are the same.

    References
    ----------
    Kruskal and Wallis (1952), Journal of the American Statistical Association 47:583; epsilon squared by Tomczak and
    Tomczak (2014), Trends in Sport Sciences 21:19.
    """
    vectors = group_vectors(groups)
    ranks = stats.rankdata(np.concatenate(list(vectors.values())))
    n = ranks.size
    sizes = np.array([vector.size for vector in vectors.values()])
    means = segment_sums(ranks, sizes) / sizes
    middle = (n + 1) / 2
    spread = float(((ranks - middle) ** 2).sum())
    if spread == 0:
        raise InsufficientDataError("All values are the same, so they have no ranks.")
    share = float((sizes * (means - middle) ** 2).sum()) / spread
    H, df = share * (n - 1), sizes.size - 1
    small = [name for name, vector in vectors.items() if vector.size < 5]
    flags = (f"Groups of fewer than five values, for which p is rough: {', '.join(small)}.",) if small else ()
    return KruskalWallis(
        H=H,
        df=df,
        p=float(special.chdtrc(df, H)),
        epsilon_squared=share,
        n=n,
        names=tuple(vectors),
        mean_ranks=tuple(means.tolist()),
        flags=flags,
    )


def friedman(matrix: npt.ArrayLike, names: Sequence[str] | None = None) -> Friedman:
    """Test whether conditions that every subject has seen differ, by the ranks that each subject gives them.

    Parameters
    ----------
    matrix : array_like, shape (subjects, conditions)
        Finite values; the subjects are raters or items.
    names : sequence of str, optional
        Names of the conditions; 1, 2, 3, … if not given.

    Returns
    -------
    Friedman
        Chi squared with its probability and Kendall's W; a flag if there are so few subjects that p is rough.

    Raises
    ------
    DataError
        If it is no matrix of finite numbers, or the number of names is wrong or two are the same.
    InsufficientDataError
        If there are fewer than two subjects or conditions, or every subject ranks all conditions the same.

    References
    ----------
    Friedman (1937), Journal of the American Statistical Association 32:675; Kendall and Babington Smith (1939), Annals
    of Mathematical Statistics 10:275; the correction for ties as in Hollander and Wolfe (1973), section 7.1.
    """
    table = finite_array(matrix, axes=("subjects", "conditions"), name="matrix")
    n, k = table.shape
    titles = column_names(names, k)
    if n < 2 or k < 2:
        raise InsufficientDataError(f"Two subjects and two conditions are needed; there are {n} and {k}.")
    ranks = stats.rankdata(table, axis=1) - (k + 1) / 2
    spread = float((ranks**2).sum())
    if spread == 0:
        raise InsufficientDataError("Each subject's values are all the same, so there is no ranking of the conditions.")
    means = ranks.mean(axis=0)
    W = n * float(means @ means) / spread
    df = k - 1
    statistic = W * n * df
    flags = (f"There are only {n} subjects, so p is rough.",) if n <= _FEW_SUBJECTS.get(k, 5) else ()
    return Friedman(
        chi_squared=statistic,
        df=df,
        p=float(special.chdtrc(df, statistic)),
        W=W,
        n=n,
        names=titles,
        mean_ranks=tuple((means + (k + 1) / 2).tolist()),
        flags=flags,
    )


def mann_whitney(x: npt.ArrayLike, y: npt.ArrayLike) -> TwoSampleRanks:
    """Test whether the values of x tend to be larger or smaller than those of y.

    Parameters
    ----------
    x, y : array_like, shapes (n,) and (m,)
        Finite numbers.

    Returns
    -------
    TwoSampleRanks
        U of x with its two-sided probability: exact for fewer than 50 values each without ties, else by the normal
        distribution, as R's `wilcox.test`.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If a side is empty or all values are the same.

    References
    ----------
    Mann and Whitney (1947), Annals of Mathematical Statistics 18:50; the rank-biserial correlation by Kerby (2014),
    Comprehensive Psychology 3:11.IT.3.1.
    """
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if not (xs.size and ys.size):
        raise InsufficientDataError(f"Values are needed on both sides; x has {xs.size} and y has {ys.size}.")
    values = np.concatenate([xs, ys])
    if np.ptp(values) == 0:
        raise InsufficientDataError("All values are the same, so they have no ranks.")
    tied = np.unique(values).size < values.size
    exact = not tied and max(xs.size, ys.size) < EXACT_BELOW
    found = stats.mannwhitneyu(xs, ys, method="exact" if exact else "asymptotic")
    U = float(found.statistic)
    return TwoSampleRanks(
        test="Mann-Whitney",
        symbol="U",
        statistic=U,
        p=min(1.0, float(found.pvalue)),
        method="exact" if exact else "normal",
        rank_biserial=2 * U / (xs.size * ys.size) - 1,
        n=(xs.size, ys.size),
    )


def wilcoxon(x: npt.ArrayLike, y: npt.ArrayLike) -> TwoSampleRanks:
    """Test whether the differences x - y lie around zero, by their signed ranks.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pairs of finite numbers. Pairs without a difference do not count.

    Returns
    -------
    TwoSampleRanks
        V with its two-sided probability: exact for fewer than 50 pairs without ties that all differ, else by the
        normal distribution, as R's `wilcox.test`. Differences are ranked as the computer subtracts them; a flag says
        so if some differ by rounding only.

    Raises
    ------
    DataError
        If a value is not a finite number or the two differ in length.
    InsufficientDataError
        If no pair differs.

    References
    ----------
    Wilcoxon (1945), Biometrics Bulletin 1:80; the rank-biserial correlation by Kerby (2014), Comprehensive Psychology
    3:11.IT.3.1.
    """
    xs, ys = finite_vector(x, name="x"), finite_vector(y, name="y")
    if xs.size != ys.size:
        raise DataError(f"The test needs pairs, but x has {xs.size} values and y has {ys.size}.")
    differences = xs - ys
    given = differences[differences != 0]
    rounding = 4 * EPSILON * max(float(np.abs(xs).max(initial=0)), float(np.abs(ys).max(initial=0)))
    if not (np.abs(given) > rounding).any():
        raise InsufficientDataError("No pair differs, so there is nothing to rank.")
    n, sizes = given.size, np.abs(given)
    ranks = stats.rankdata(sizes)
    V = float(ranks[given > 0].sum())
    different = np.unique(sizes).size
    exact = different == differences.size and n < EXACT_BELOW
    nearly = joined(sizes, within=2 * rounding)
    flags: tuple[str, ...] = ()
    if np.unique(nearly).size < different or (sizes <= rounding).any():
        flags = (
            "Some differences differ by rounding only, and are ranked as different, as R ranks them; give whole "
            "numbers, for instance tenths, to have them tied.",
        )
    return TwoSampleRanks(
        test="Wilcoxon signed rank",
        symbol="V",
        statistic=V,
        p=_signed_rank_p(given, exact=exact),
        method="exact" if exact else "normal",
        rank_biserial=4 * V / (n * (n + 1)) - 1,
        n=(n,),
        flags=flags,
    )


def _signed_rank_p(differences: FloatArray, *, exact: bool) -> float:
    if exact:
        return min(1.0, float(stats.wilcoxon(differences, method="exact").pvalue))
    # R's normal approximation; scipy's differs from it in whether V at its very mean is corrected for continuity.
    n = differences.size
    ranks = stats.rankdata(np.abs(differences))
    deviation = float(ranks[differences > 0].sum()) - n * (n + 1) / 4
    counts = np.unique(ranks, return_counts=True)[1].astype(float)
    variance = n * (n + 1) * (2 * n + 1) / 24 - float((counts**3 - counts).sum()) / 48
    z = (abs(deviation) - 0.5 * (deviation != 0)) / math.sqrt(variance)
    return min(1.0, 2 * float(special.ndtr(-z)))
