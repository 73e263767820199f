"""Adjustment of p values for how many tests were made."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.result import Result

Method = Literal["holm", "bonferroni", "BH", "BY", "none"]

METHOD_NAMES: dict[str, str] = {
    "holm": "Holm",
    "bonferroni": "Bonferroni",
    "BH": "Benjamini-Hochberg",
    "BY": "Benjamini-Yekutieli",
    "none": "no",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class AdjustedPValues(Result):
    """P values adjusted for their number.

    Attributes
    ----------
    names : tuple of str
        What was tested.
    p, p_adjusted : numpy.ndarray, shape (n,)
        Probabilities before and after; NaN where a test has none, which the flags then say.
    method : str
        ``holm``, ``bonferroni``, ``BH``, ``BY`` or ``none``.
    alpha : float
        Level: the rate of any false rejection (Holm, Bonferroni) or the expected share of false ones among all
        rejections (Benjamini-Hochberg, Benjamini-Yekutieli).
    """

    names: tuple[str, ...]
    p: FloatArray
    p_adjusted: FloatArray
    method: Method
    alpha: float

    @property
    def rejected(self) -> tuple[str, ...]:
        """Names of the tests whose adjusted p is at most alpha."""
        return tuple(name for name, p in zip(self.names, self.p_adjusted, strict=True) if p <= self.alpha)

    def apa(self) -> str:
        """Return the result as a sentence that names what was rejected, smallest p first."""
        tests = int(np.isfinite(self.p).sum())
        number = f"{tests} {'test' if tests == 1 else 'tests'}"
        start = f"With {METHOD_NAMES[self.method]} adjustment for {number}"
        level = wording.share(self.alpha, _digits(self.alpha))
        if not self.rejected:
            return f"{start}, none is significant at the {level} level, smallest {self._written(self._order()[0])}"
        named = [f"{self.names[place]} ({self._written(place)})" for place in self._order()[: len(self.rejected)]]
        shown = ", ".join(named[:10]) + (f" and {len(named) - 10} more" if len(named) > 10 else "")
        return f"{start}, {len(named)} {'is' if len(named) == 1 else 'are'} significant at the {level} level: {shown}"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each test, in the order given."""
        return pd.DataFrame(
            {
                "test": list(self.names),
                "p": self.p,
                "p_adjusted": self.p_adjusted,
                "rejected": self.p_adjusted <= self.alpha,
            }
        )

    def _order(self) -> list[int]:
        return [int(place) for place in np.argsort(self.p_adjusted, kind="stable")]

    def _written(self, place: int) -> str:
        return wording.p_value(float(self.p_adjusted[place]))


def adjust(
    p: npt.ArrayLike, *, method: Method = "holm", names: Sequence[object] | None = None, alpha: float = 0.05
) -> AdjustedPValues:
    """Adjust p values for their number, as R's ``p.adjust`` does.

    Parameters
    ----------
    p : array_like, shape (n,)
        Probabilities, 0 to 1; NaN where a test has none: it stays NaN and does not count.
    method : {"holm", "bonferroni", "BH", "BY", "none"}
        Holm and Bonferroni hold for any dependence of the tests; Benjamini-Hochberg holds for independent or positively
        dependent tests, Benjamini-Yekutieli for all.
    names : sequence, optional
        What was tested; left out, "1", "2" and so on.
    alpha : float
        Level, between 0 and 1.

    Returns
    -------
    AdjustedPValues
        The adjusted values, at most 1.

    Raises
    ------
    DataError
        If a value is not between 0 and 1, the names do not fit, or `method` or `alpha` is unknown or out of range.
    InsufficientDataError
        If there is no p value.

    References
    ----------
    Holm (1979), Scandinavian Journal of Statistics 6:65; Dunn (1961), JASA 56:52 (Bonferroni's inequality); Benjamini
    and Hochberg (1995), J. R. Stat. Soc. B 57:289; Benjamini and Yekutieli (2001), Annals of Statistics 29:1165; as
    adjusted p values by Wright (1992), Biometrics 48:1005.
    """
    if not 0 < alpha < 1:
        raise DataError(f"alpha is {alpha}, but must lie between 0 and 1.")
    values = _probabilities(p)
    titles = tuple(map(str, range(1, values.size + 1) if names is None else names))
    if len(titles) != values.size:
        raise DataError(f"There are {values.size} p values, but {len(titles)} names.")
    adjusted = adjusted_p(values, method=method)
    missing = [title for title, value in zip(titles, values, strict=True) if math.isnan(value)]
    if len(missing) == values.size:
        raise InsufficientDataError("There is no p value to adjust.")
    flags = (f"Without a p value, and not counted: {', '.join(missing)}.",) if missing else ()
    for array in (values, adjusted):
        array.flags.writeable = False
    return AdjustedPValues(names=titles, p=values, p_adjusted=adjusted, method=method, alpha=alpha, flags=flags)


def adjusted_p(p: npt.ArrayLike, *, method: Method = "holm") -> FloatArray:
    """Return only the adjusted p values; see `adjust`.

    Parameters
    ----------
    p : array_like, shape (n,)
        Probabilities, 0 to 1, or NaN.
    method : {"holm", "bonferroni", "BH", "BY", "none"}
        As in `adjust`.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Adjusted values; NaN where there was NaN.

    Raises
    ------
    DataError
        If a value is not between 0 and 1 or the method is unknown.
    """
    values = _probabilities(p)
    check_method(method)
    given = np.flatnonzero(~np.isnan(values))
    result = values.copy()
    count = given.size
    if not count or method == "none":
        return result
    order = given[np.argsort(values[given], kind="stable")]
    ordered, ranks = values[order], np.arange(1, count + 1)
    if method == "bonferroni":
        adjusted = count * ordered
    elif method == "holm":
        adjusted = np.maximum.accumulate((count - ranks + 1) * ordered)
    else:
        dependence = math.fsum((1 / ranks).tolist()) if method == "BY" else 1.0
        adjusted = np.minimum.accumulate((dependence * count / ranks * ordered)[::-1])[::-1]
    result[order] = np.minimum(adjusted, 1.0)
    return result


def check_method(method: str) -> None:
    """Raise DataError unless a method of adjustment is known."""
    if method not in get_args(Method):
        raise DataError(f"The method is {method!r}, but must be one of {', '.join(get_args(Method))}.")


def _probabilities(p: npt.ArrayLike) -> FloatArray:
    try:
        values = np.array(p, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("p: these values are not all numbers.") from error
    if values.ndim != 1:
        raise DataError(f"p has {values.ndim} dimensions, but must be a flat list.")
    wrong = np.flatnonzero((values < 0) | (values > 1))
    if wrong.size:
        raise DataError(f"p: the value at place {wrong[0]} is {values[wrong[0]]}, but must lie between 0 and 1.")
    return values


def _digits(alpha: float) -> int:
    return max(2, -math.floor(math.log10(alpha)))
