"""A table of comparisons, each of two conditions."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.result import Result

# More pairs than these are not named in a sentence.
_NAMED = 8


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A comparison of two conditions.

    Attributes
    ----------
    first, second : str
        Names of the conditions.
    difference : float
        Mean (for Dunn's test, mean rank) of the first less that of the second.
    statistic : float
        t, or z for Dunn's test: the difference in units of its standard error. NaN if nothing varies.
    df : float or None
        Degrees of freedom of t; None for z.
    p : float
        Two-sided probability of this test by itself. NaN if nothing varies.
    p_adjusted : float
        The same, allowing for the number of pairs.
    ci : tuple of float, or None
        Interval for the difference; None for Dunn's test, where ranks depend on all other conditions.
    """

    first: str
    second: str
    difference: float
    statistic: float
    df: float | None
    p: float
    p_adjusted: float
    ci: tuple[float, float] | None

    @property
    def name(self) -> str:
        """The pair as R's ``TukeyHSD`` writes it, for instance ``trt2-trt1``."""
        return f"{self.first}-{self.second}"

    def turned(self) -> "Comparison":
        """Return the same comparison with the second condition first."""
        return replace(
            self,
            first=self.second,
            second=self.first,
            difference=-self.difference,
            statistic=-self.statistic,
            ci=None if self.ci is None else (-self.ci[1], -self.ci[0]),
        )


@dataclass(frozen=True, kw_only=True)
class Comparisons(Result):
    """Comparisons of all pairs of conditions.

    Attributes
    ----------
    test : str
        Name of the procedure.
    adjustment : str
        How p values allow for the number of pairs.
    symbol : str
        ``t`` or ``z``: what the statistic of each comparison is.
    confidence : float
        Confidence of the intervals; differences with an adjusted p of at most 1 less this are called significant.
    simultaneous : bool
        Whether the confidence is that all intervals hold at once, and not each by itself.
    pairs : tuple of Comparison
        Later conditions less earlier ones, in the order of R's ``TukeyHSD``.
    """

    test: str
    adjustment: str
    symbol: str
    confidence: float
    simultaneous: bool
    pairs: tuple[Comparison, ...]

    @property
    def significant(self) -> tuple[Comparison, ...]:
        """The pairs whose adjusted p is at most 1 - confidence."""
        level = self._level
        return tuple(pair for pair in self.pairs if pair.p_adjusted <= level)

    def pair(self, first: object, second: object) -> Comparison:
        """Return the comparison of two conditions, the first less the second.

        Raises
        ------
        DataError
            If the two were not compared.
        """
        wanted = (str(first), str(second))
        for pair in self.pairs:
            if (pair.first, pair.second) == wanted:
                return pair
            if (pair.second, pair.first) == wanted:
                return pair.turned()
        raise DataError(f"{wanted[0]} and {wanted[1]} were not compared.")

    def apa(self) -> str:
        """Return a sentence that names the pairs that differ significantly, smallest p first."""
        known = sorted((pair for pair in self.pairs if not math.isnan(pair.p_adjusted)), key=lambda one: one.p_adjusted)
        level = wording.share(self._level, max(2, -math.floor(math.log10(self._level))))
        start = f"{self.test}, {self.adjustment}"
        found = known[: len(self.significant)]
        if not found:
            smallest = f", smallest {wording.p_value(known[0].p_adjusted)}" if known else ""
            return f"{start}: no pair differs significantly at the {level} level{smallest}"
        named = "; ".join(self._written(pair) for pair in found[:_NAMED])
        more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        share = f"{len(found)} of {len(self.pairs)} pair{'' if len(self.pairs) == 1 else 's'}"
        verb = "differs" if len(found) == 1 else "differ"
        return f"{start}: {share} {verb} significantly at the {level} level: {named}{more}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each pair; degrees of freedom and interval are NaN where the test has none."""
        ends = [pair.ci or (math.nan, math.nan) for pair in self.pairs]
        return pd.DataFrame(
            {
                "first": [pair.first for pair in self.pairs],
                "second": [pair.second for pair in self.pairs],
                "difference": [pair.difference for pair in self.pairs],
                self.symbol: [pair.statistic for pair in self.pairs],
                "df": [math.nan if pair.df is None else pair.df for pair in self.pairs],
                "p": [pair.p for pair in self.pairs],
                "p_adjusted": [pair.p_adjusted for pair in self.pairs],
                "ci_low": [low for low, _ in ends],
                "ci_high": [high for _, high in ends],
            }
        )

    @property
    def _level(self) -> float:
        # 1 - .95 is not .05 in binary.
        return round(1 - self.confidence, 12)

    def _written(self, pair: Comparison) -> str:
        sign = ">" if pair.difference > 0 else "<"
        freedom = "" if pair.df is None else f"({pair.df:g})" if pair.df % 1 == 0 else f"({wording.number(pair.df)})"
        parts = [f"difference = {wording.number(pair.difference)}"]
        if pair.ci is not None:
            parts.append(wording.interval(*pair.ci, confidence=self.confidence))
        parts += [f"{self.symbol}{freedom} = {wording.number(pair.statistic)}", wording.p_value(pair.p_adjusted)]
        return f"{pair.first} {sign} {pair.second} ({', '.join(parts)})"


def pairs_of(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of the later and the earlier condition of all pairs, in the order of R's ``TukeyHSD``."""
    earlier, later = np.triu_indices(number, 1)
    return later, earlier


def without_variance(pairs: Iterable[Comparison]) -> tuple[str, ...]:
    """Return the flag that names the pairs that have no statistic, if there are any."""
    names = [pair.name for pair in pairs if math.isnan(pair.p)]
    if not names:
        return ()
    shown = ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
    return (f"Not tested, and not counted, because nothing varies but the difference itself: {shown}.",)
