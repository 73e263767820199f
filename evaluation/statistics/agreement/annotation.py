"""Agreement of raters who all rated the same items."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.pairwise import standardised
from evaluation.statistics.agreement.raters import listed
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.correlation import pearson_p_values, without_rounding
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True, eq=False)
class DimensionAgreement(Result):
    """How well raters agree on one dimension.

    Attributes
    ----------
    dimension : str
        Its name.
    items, raters : int
        Numbers of items and raters.
    sd : float
        Mean over the items of the standard deviation over raters (n - 1), in units of the ratings.
    pairwise_r : float or None
        Mean of Pearson's correlation between the ratings of each two raters; None if fewer than two raters vary.
    largest_p : float or None
        The largest of the pairs' two-sided p values: below 0.05, every single pair correlates significantly.
    constant_raters : tuple of int
        Raters, numbered from 1, who gave every item the same rating: they correlate with nobody, and their pairs are
        left out of `pairwise_r`.
    correlations, p_values : numpy.ndarray, shape (raters, raters)
        Correlation and p value of each pair; NaN where a rater is constant, and p NaN on the diagonal.
    """

    dimension: str
    items: int
    raters: int
    sd: float
    pairwise_r: float | None
    largest_p: float | None
    constant_raters: tuple[int, ...]
    correlations: FloatArray
    p_values: FloatArray

    def apa(self) -> str:
        """Return a sentence, for instance ``P: SD = 0.20, mean pairwise r = .80 (each pair p < .001)``."""
        text = f"{self.dimension}: SD = {wording.number(self.sd)}"
        if self.pairwise_r is None or self.largest_p is None:
            return f"{text}, no pairwise r"
        which = "each pair" if self.largest_p < 0.001 else "largest"
        p = wording.p_value(self.largest_p)
        return f"{text}, mean pairwise r = {wording.share(self.pairwise_r)} ({which} {p})"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no correlation."""
        return pd.DataFrame(
            {
                "dimension": [self.dimension],
                "items": [self.items],
                "raters": [self.raters],
                "sd": [self.sd],
                "pairwise_r": [_or_nan(self.pairwise_r)],
                "largest_p": [_or_nan(self.largest_p)],
            }
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class AnnotationAgreement(Result):
    """Agreement of raters on each dimension, in the order of the dimensions."""

    dimensions: tuple[DimensionAgreement, ...]

    def __getitem__(self, dimension: str) -> DimensionAgreement:
        for found in self.dimensions:
            if found.dimension == dimension:
                return found
        names = ", ".join(found.dimension for found in self.dimensions)
        raise DataError(f"There is no dimension {dimension!r}; there are {names}.")

    def apa(self) -> str:
        """Return the sentences of all dimensions, with semicolons between."""
        return "; ".join(found.apa() for found in self.dimensions)

    def summary(self) -> str:
        """Return the sentence of each dimension, one on a line, each before its flags."""
        return "\n".join(found.summary() for found in self.dimensions)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each dimension; NaN where there is no correlation."""
        return pd.concat([found.to_frame() for found in self.dimensions], ignore_index=True)


def annotation_agreement(ratings: npt.ArrayLike, *, dimensions: Sequence[str] = ("P", "A", "D")) -> AnnotationAgreement:
    """Return how well raters agree: standard deviation over raters, and mean pairwise correlation.

    Parameters
    ----------
    ratings : array_like, shape (items, raters, dimensions)
        Complete ratings: every rater rated every item on every dimension.
    dimensions : sequence of str
        Names of the dimensions.

    Returns
    -------
    AnnotationAgreement
        Both measures for each dimension.

    Raises
    ------
    DataError
        If the ratings are no complete stack of finite numbers or the names do not fit.
    InsufficientDataError
        If there are fewer than three items or two raters.

    Notes
    -----
    The mean of the correlations is taken as it is, without Fisher's transformation, as the paper does. The p value of
    a pair is that of Pearson's r with items - 2 degrees of freedom.

    References
    ----------
    Jia et al. (2013), section 2.4: SD .20, .32, .30 and r .80, .44, .35 (p < .05) for P, A and D.
    """
    stack = finite_array(ratings, axes=("items", "raters", "dimensions"), name="ratings")
    items, raters, number = stack.shape
    if number != len(dimensions):
        raise DataError(f"The ratings have {number} dimensions, but {len(dimensions)} names.")
    if items < 3 or raters < 2:
        raise InsufficientDataError(
            f"Agreement needs at least 3 items and 2 raters; there are {items} items and {raters} raters."
        )
    spreads = deviation(stack).mean(axis=0)
    found = tuple(
        _agree(stack[:, :, place], dimension=name, sd=float(spreads[place])) for place, name in enumerate(dimensions)
    )
    return AnnotationAgreement(dimensions=found, flags=tuple(flag for one in found for flag in one.flags))


def deviation(ratings: npt.ArrayLike) -> FloatArray:
    """Return the standard deviation over raters of each item on each dimension.

    Parameters
    ----------
    ratings : array_like, shape (items, raters, dimensions)
        Complete ratings.

    Returns
    -------
    numpy.ndarray, shape (items, dimensions)
        Standard deviation with n - 1; exactly 0 where all raters agree.

    Raises
    ------
    DataError
        If the ratings are no complete stack of finite numbers.
    InsufficientDataError
        If there are fewer than two raters.
    """
    stack = finite_array(ratings, axes=("items", "raters", "dimensions"), name="ratings")
    if stack.shape[1] < 2:
        raise InsufficientDataError(f"A deviation over raters needs at least two raters; there are {stack.shape[1]}.")
    raters = stack.shape[1]
    # Differences from the first rater: equal ratings have no deviation at all, and since that rater is one of them, the
    # difference of sums of squares below cannot lose more than a factor of `raters`.
    differences = stack - stack[:, :1]
    squares = np.einsum("irk,irk->ik", differences, differences)
    result: FloatArray = np.sqrt(np.maximum(squares - differences.sum(axis=1) ** 2 / raters, 0) / (raters - 1))
    return result


def _agree(ratings: FloatArray, *, dimension: str, sd: float) -> DimensionAgreement:
    items, raters = ratings.shape
    columns, varies = standardised(ratings)
    varying = np.flatnonzero(varies)
    between = without_rounding(columns.T @ columns)
    np.fill_diagonal(between, 1)
    correlations, p_values = np.full((2, raters, raters), math.nan)
    correlations[np.ix_(varying, varying)] = between
    p_values[np.ix_(varying, varying)] = pearson_p_values(between, items)
    np.fill_diagonal(p_values, math.nan)
    pairs = np.triu_indices(raters, 1)
    known = ~np.isnan(correlations[pairs])
    constant = tuple(int(rater) + 1 for rater in np.flatnonzero(~varies))
    any_pair = bool(known.any())
    return DimensionAgreement(
        dimension=dimension,
        items=items,
        raters=raters,
        sd=sd,
        pairwise_r=float(correlations[pairs][known].mean()) if any_pair else None,
        largest_p=float(p_values[pairs][known].max()) if any_pair else None,
        constant_raters=constant,
        correlations=correlations,
        p_values=p_values,
        flags=_flags(dimension, constant, any_pair=any_pair),
    )


def _flags(dimension: str, constant: tuple[int, ...], *, any_pair: bool) -> tuple[str, ...]:
    flags = []
    if constant:
        names = listed([str(rater) for rater in constant])
        flags.append(f"{dimension}: raters who gave one rating throughout, left out of r: {names}.")
    if not any_pair:
        flags.append(f"{dimension}: no pairwise r since fewer than two raters vary.")
    return tuple(flags)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
