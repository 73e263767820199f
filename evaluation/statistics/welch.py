"""Welch's analysis of variance: groups whose variances differ."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.anova import Group, described
from evaluation.statistics.groups import EPSILON, group_vectors, moments, upper_tail
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class WelchAnova(Result):
    """Welch's analysis of variance.

    Attributes
    ----------
    F : float
        Welch's variance ratio.
    df_between : int
        Degrees of freedom between groups.
    df_within : float
        Degrees of freedom within groups, as Welch estimates them; no whole number as a rule.
    p : float
        Probability of an F at least as large if all groups had one mean.
    omega_squared : float
        Share of the variance that the groups explain, estimated for the population from F; may be slightly below 0.
    groups : tuple of Group
        Means and standard deviations, in the order given.
    """

    F: float
    df_between: int
    df_within: float
    p: float
    omega_squared: float
    groups: tuple[Group, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``Welch's F(2, 17.13) = 5.18, p = .017, ω² = .22``."""
        ratio = f"Welch's F({self.df_between}, {wording.number(self.df_within)}) = {wording.number(self.F)}"
        return f"{ratio}, {wording.p_value(self.p)}, ω² = {wording.share(self.omega_squared)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row."""
        names = ("F", "df_between", "df_within", "p", "omega_squared")
        return pd.DataFrame({name: [getattr(self, name)] for name in names})


def welch(groups: Mapping[str, npt.ArrayLike]) -> WelchAnova:
    """Compare the means of groups without supposing that their variances are equal.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group; groups may differ in size.

    Returns
    -------
    WelchAnova
        The variance ratio with its degrees of freedom and probability.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups, or a group has fewer than two different values: its mean would have
        infinite weight.

    References
    ----------
    Welch (1951), On the comparison of several mean values, Biometrika 38:330. Omega squared by Carroll and Nordholm
    (1975), Educational and Psychological Measurement 35:541, from Welch's F.
    """
    found = moments(group_vectors(groups))
    n = found.sizes.astype(float)
    rounding = n * (4 * EPSILON * found.largest) ** 2
    for name, constant in zip(found.names, found.squares <= rounding, strict=True):
        if constant:
            raise InsufficientDataError(
                f"The values of the group {name} do not vary, so Welch's test, which weighs groups by their variance, "
                "cannot use it."
            )
    # In units of the largest variance, so that no weight can overflow.
    scale = math.sqrt(float((found.squares / (n - 1)).max()))
    weights = n / (found.squares / scale / scale / (n - 1))
    offsets = found.offsets / scale
    total = float(weights.sum())
    centre = float(weights @ offsets) / total
    k = n.size
    doubt = float(((1 - weights / total) ** 2 / (n - 1)).sum())
    between = float(weights @ (offsets - centre) ** 2) / (k - 1)
    F = between / (1 + 2 * (k - 2) * doubt / (k**2 - 1))
    df_within = (k**2 - 1) / (3 * doubt)
    gain = (k - 1) * (F - 1)
    return WelchAnova(
        F=F,
        df_between=k - 1,
        df_within=df_within,
        p=upper_tail(F, k - 1, df_within),
        omega_squared=gain / (gain + float(np.sum(n))),
        groups=described(found),
    )
