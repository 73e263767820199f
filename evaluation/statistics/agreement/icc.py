"""Intraclass correlations: the six forms of Shrout and Fleiss."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.raters import listed, named_table
from evaluation.statistics.arrays import FloatArray, centred, check_confidence
from evaluation.statistics.matrices import centred_columns, finite_array
from evaluation.statistics.result import Result
from evaluation.statistics.wording import counted

# Residuals that hold at least this share of the mean square of the ratings lose no more than three digits to sums.
_WELL_SPREAD = 1e-3

# With fewer degrees of freedom than this, quantiles of F overflow.
_FEWEST_DEGREES = 0.02


@dataclass(frozen=True, kw_only=True)
class MeanSquares:
    """Mean squares of a two-way table with one rating a cell.

    Attributes
    ----------
    items, raters : int
        Size of the table.
    between_items, within_items : float
        Mean squares of a one-way analysis by item (BMS and WMS of Shrout and Fleiss).
    between_raters, residual : float
        What the raters' means and the rest share of those within (JMS and EMS).
    """

    items: int
    raters: int
    between_items: float
    within_items: float
    between_raters: float
    residual: float


@dataclass(frozen=True, kw_only=True)
class IntraclassCorrelation(Result):
    """One form of intraclass correlation.

    Attributes
    ----------
    form : str
        ``ICC1``, ``ICC2`` or ``ICC3`` for a single rater; ``ICC1k``, ``ICC2k`` or ``ICC3k`` for the mean of k.
    symbol : str
        As Shrout and Fleiss write it, for instance ``ICC(2,4)`` for the mean of four raters.
    model : str
        As McGraw and Wong name it, for instance ``ICC(A,k)``.
    value : float or None
        The correlation; it may be below 0. None where the items differ less than raters' errors alone would make them
        and the form has no value.
    F, df1, df2, p : float
        Test that items do not differ, and so that the correlation is 0.
    ci : tuple of float, or None
        Interval; None where there is no value.
    confidence : float
        Confidence of the interval.
    """

    form: str
    symbol: str
    model: str
    value: float | None
    F: float
    df1: int
    df2: int
    p: float
    ci: tuple[float, float] | None
    confidence: float

    def apa(self) -> str:
        """Return a sentence: ``ICC(2,1) = .29, 95% CI [.02, .76], F(5, 15) = 11.03, p < .001``."""
        parts = [f"{self.symbol} {'has no value' if self.value is None else f'= {wording.share(self.value)}'}"]
        if self.ci:
            parts.append(wording.interval(*self.ci, confidence=self.confidence, bounded=True))
        return ", ".join([*parts, f"F({self.df1}, {self.df2}) = {wording.number(self.F)}", wording.p_value(self.p)])

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no value."""
        low, high = self.ci or (math.nan, math.nan)
        return pd.DataFrame(
            {
                "form": [self.form],
                "symbol": [self.symbol],
                "model": [self.model],
                "value": [math.nan if self.value is None else self.value],
                "F": [self.F],
                "df1": [self.df1],
                "df2": [self.df2],
                "p": [self.p],
                "ci_low": [low],
                "ci_high": [high],
                "confidence": [self.confidence],
            }
        )


@dataclass(frozen=True, kw_only=True)
class IntraclassCorrelations(Result):
    """The six intraclass correlations of a table of ratings; ``found["ICC2k"]`` is one of them.

    Attributes
    ----------
    forms : tuple of IntraclassCorrelation
        ICC1, ICC2, ICC3, ICC1k, ICC2k, ICC3k.
    mean_squares : MeanSquares
        What all are made of.
    """

    forms: tuple[IntraclassCorrelation, ...]
    mean_squares: MeanSquares

    def __getitem__(self, form: str) -> IntraclassCorrelation:
        for found in self.forms:
            if found.form == form:
                return found
        raise DataError(f"There is no form {form!r}; there are {', '.join(found.form for found in self.forms)}.")

    def apa(self) -> str:
        """Return the sentences of all six forms, with semicolons between."""
        return "; ".join(found.apa() for found in self.forms)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each form."""
        return pd.concat([found.to_frame() for found in self.forms], ignore_index=True)


def intraclass_correlations(
    ratings: npt.ArrayLike | pd.DataFrame, *, confidence: float = 0.95
) -> IntraclassCorrelations:
    """Return the six intraclass correlations with their tests and intervals.

    Parameters
    ----------
    ratings : array_like or pandas.DataFrame, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    IntraclassCorrelations
        The forms. Raters who rated nothing, and then items that a rater did not rate, are left out; `flags` say how
        many.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, one is infinite or beyond 1e140, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than two raters or two complete items, or each rater gave one rating throughout.

    Notes
    -----
    Which form fits: ICC1 if each item has other raters; ICC2 if the same raters, a sample of many, rate all items and
    their levels matter (absolute agreement); ICC3 if only these raters count or levels do not matter (consistency).
    The forms with k are the reliability of the mean over the raters; a mean opinion score is such a mean.

    The intervals of ICC1 and ICC3 are exact for normal data. That of ICC2 has no exact form: it is Shrout and Fleiss'
    with Satterthwaite's degrees of freedom, as in R's psych and irr.

    References
    ----------
    Shrout and Fleiss (1979), Psychol. Bull. 86:420; McGraw and Wong (1996), Psychol. Methods 1:30, with the correction
    in 1:390.
    """
    check_confidence(confidence)
    table, squares, flags = _complete_items(ratings)
    ms = _mean_squares(table, squares)
    forms = _forms(ms, confidence)
    return IntraclassCorrelations(
        forms=forms, mean_squares=ms, flags=(*flags, *(flag for form in forms for flag in form.flags))
    )


def _complete_items(ratings: npt.ArrayLike | pd.DataFrame) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Return the complete items, the sum of the squares of their ratings, and what was left out."""
    names, table = named_table(ratings)
    flags = []
    missing = False
    with np.errstate(all="ignore"):
        squares = float(np.einsum("ij,ij->", table, table))
    if math.isnan(squares):
        given = ~np.isnan(table)
        silent = given.sum(axis=0) == 0
        if silent.any() and not silent.all():
            without = [name for name, is_silent in zip(names, silent, strict=True) if is_silent]
            flags.append(f"Raters without any rating were left out: {listed(without)}.")
            table, given = table[:, ~silent], given[:, ~silent]
        complete = given.all(axis=1)
        missing = not complete.all()
        if missing:
            left_out = int(np.count_nonzero(~complete))
            flags.append(f"{counted(left_out, 'item')} of {complete.size:,} with a missing rating left out.")
        table = table[complete]
    if not math.isfinite(squares):
        table = finite_array(table, axes=("items", "raters"), name="ratings")
        squares = float(np.einsum("ij,ij->", table, table))
    items, raters = table.shape
    if items < 2 or raters < 2:
        which = "without a missing rating " if missing else ""
        raise InsufficientDataError(
            f"Intraclass correlation needs at least 2 items {which}and 2 raters; there are {items} items and "
            f"{raters} raters."
        )
    return table, squares, tuple(flags)


def _mean_squares(table: FloatArray, squares: float) -> MeanSquares:
    n, k = table.shape
    # Sums of squares below this are no more than the rounding of the ratings.
    negligible = n * k * np.finfo(float).eps ** 2 * squares
    mean, of_items = centred(table.sum(axis=1) / k)
    _, of_raters = centred(table.sum(axis=0) / n)
    items, raters = k * float(of_items @ of_items), n * float(of_raters @ of_raters)
    rest = squares - mean**2 * n * k - items - raters
    if rest < _WELL_SPREAD * squares or squares < np.finfo(float).tiny / np.finfo(float).eps ** 2:
        items, raters, rest = _sums_of_differences(table)
    items, raters, rest = (0.0 if value <= negligible else value for value in (items, raters, rest))
    if items == 0 and rest == 0:
        raise InsufficientDataError(
            "Each rater gave all items the same rating, so nothing shows whether raters tell items apart."
        )
    return MeanSquares(
        items=n,
        raters=k,
        between_items=items / (n - 1),
        within_items=(raters + rest) / (n * (k - 1)),
        between_raters=raters / (k - 1),
        residual=rest / ((n - 1) * (k - 1)),
    )


def _sums_of_differences(table: FloatArray) -> tuple[float, float, float]:
    # Differences at each step, so that a large common part or near agreement costs no digits.
    n, k = table.shape
    means, differences = centred_columns(table - table[0, 0])
    _, of_raters = centred(means)
    of_items = differences.sum(axis=1) / k
    differences -= of_items[:, None]
    rest = float(np.einsum("ij,ij->", differences, differences))
    return k * float(of_items @ of_items), n * float(of_raters @ of_raters), rest


def _forms(ms: MeanSquares, confidence: float) -> tuple[IntraclassCorrelation, ...]:
    n, k = ms.items, ms.raters
    one_way, two_way = n * (k - 1), (n - 1) * (k - 1)
    singles = (
        _consistency(ms.between_items, ms.within_items, n=n, k=k, df2=one_way, confidence=confidence),
        _agreement(ms, confidence),
        _consistency(ms.between_items, ms.residual, n=n, k=k, df2=two_way, confidence=confidence),
    )
    errors = ((ms.within_items, one_way), (ms.residual, two_way), (ms.residual, two_way))
    found = []
    for mean in (False, True):
        for place, (value, ci) in enumerate(singles):
            error, df2 = errors[place]
            symbol = f"ICC({place + 1},{k if mean else 1})"
            F = ms.between_items / error if error > 0 else math.inf
            of_mean = _stepped_up(value, k) if mean else value
            found.append(
                IntraclassCorrelation(
                    form=f"ICC{place + 1}{'k' if mean else ''}",
                    symbol=symbol,
                    model=_model(place, mean=mean),
                    value=of_mean,
                    F=F,
                    df1=n - 1,
                    df2=df2,
                    p=float(special.fdtrc(n - 1, df2, F)),
                    ci=_interval(ci, k, mean=mean) if of_mean is not None else None,
                    confidence=confidence,
                    flags=_flags(symbol, of_mean, _interval(ci, k, mean=mean), error),
                )
            )
    return tuple(found)


def _model(place: int, *, mean: bool) -> str:
    number = "k" if mean else "1"
    return f"ICC({number})" if place == 0 else f"ICC({'AC'[place - 1]},{number})"


def _flags(symbol: str, value: float | None, ci: tuple[float, float] | None, error: float) -> tuple[str, ...]:
    if value is None:
        return (f"{symbol} has no value: the items differ less than the raters' errors alone would make them.",)
    if ci is None:
        return (f"{symbol} has no interval: too few items and raters for the errors they show.",)
    if math.isinf(ci[0]):
        return (f"{symbol}: its interval has no lower end.",)
    if error == 0:
        return (f"{symbol}: the raters leave no error at all, so F is infinite.",)
    return ()


def _consistency(
    between: float, error: float, *, n: int, k: int, df2: int, confidence: float
) -> tuple[float, tuple[float, float] | None]:
    tail = (1 - confidence) / 2
    # F over each quantile, brought to a fraction that also holds without error.
    upper, lower = special.fdtri(n - 1, df2, 1 - tail), special.fdtri(n - 1, df2, tail)
    value, low, high = (
        (between - share * error) / (between + (k - 1) * share * error) for share in (1.0, float(upper), float(lower))
    )
    return value, (low, high)


def _agreement(ms: MeanSquares, confidence: float) -> tuple[float | None, tuple[float, float] | None]:
    n, k, between, raters, error = ms.items, ms.raters, ms.between_items, ms.between_raters, ms.residual
    total = between + (k - 1) * error + k * (raters - error) / n
    if total <= 0:
        return None, None
    value = (between - error) / total
    of_raters, of_error = k * value * raters, (n * (1 + (k - 1) * value) - k * value) * error
    if of_raters == 0 and of_error == 0:
        return value, (1.0, 1.0) if value == 1 else None
    scale = max(abs(of_raters), abs(of_error))
    of_raters, of_error = of_raters / scale, of_error / scale
    df = (k - 1) * (n - 1) * (of_raters + of_error) ** 2 / ((n - 1) * of_raters**2 + of_error**2)
    if df < _FEWEST_DEGREES:
        return value, None
    tail = (1 - confidence) / 2
    upper, lower = float(special.fdtri(n - 1, df, 1 - tail)), float(special.fdtri(df, n - 1, 1 - tail))
    rest = k * raters + (k * n - k - n) * error
    return value, (
        n * (between - upper * error) / (upper * rest + n * between),
        n * (lower * between - error) / (rest + n * lower * between),
    )


def _stepped_up(value: float | None, k: int) -> float | None:
    # Spearman and Brown's formula; at -1 / (k - 1) and below, the mean of k raters has no variance left.
    if value is None or 1 + (k - 1) * value <= 4 * np.finfo(float).eps:
        return None
    return k * value / (1 + (k - 1) * value)


def _interval(ci: tuple[float, float] | None, k: int, *, mean: bool) -> tuple[float, float] | None:
    if ci is None or not mean:
        return ci
    low, high = (_stepped_up(end, k) for end in ci)
    return (-math.inf if low is None else low, -math.inf if high is None else high)
