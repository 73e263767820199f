"""How well the raters of one round agree, also when ratings are missing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.annotation.missing import array_with_gaps, known_deviation
from evaluation.errors import DataError
from evaluation.statistics import wording
from evaluation.statistics.agreement.annotation import annotation_agreement
from evaluation.statistics.arrays import FloatArray

_FEWEST_SAMPLES = 3
"""A correlation of two samples is always 1 or -1, and has no p value."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RoundDimension:
    """How well the raters of a round agree on one dimension.

    Attributes
    ----------
    dimension : str
        Its name.
    sd : float or None
        Mean of the samples' standard deviations over raters (n - 1), in units of the ratings, over the samples with at
        least two ratings; None if there are none.
    sd_samples : int
        Number of those samples.
    pairwise_r : float or None
        Mean of Pearson's correlation of each two raters over the samples that both rated; None if no pair has one.
    largest_p : float or None
        The largest of the pairs' two-sided p values.
    pairs, possible_pairs : int
        How many pairs of raters have a correlation, and how many pairs there are of those who rated anything.
    constant_raters : tuple of int
        Raters, numbered from 1, who gave one rating throughout, and are left out of `pairwise_r`.
    correlations, p_values : numpy.ndarray, shape (raters, raters)
        Of each pair of all raters; NaN where there is none, and p NaN on the diagonal.
    """

    dimension: str
    sd: float | None
    sd_samples: int
    pairwise_r: float | None
    largest_p: float | None
    pairs: int
    possible_pairs: int
    constant_raters: tuple[int, ...]
    correlations: FloatArray
    p_values: FloatArray

    @property
    def flags(self) -> tuple[str, ...]:
        """What could not be computed, and why, in words; empty if everything could."""
        found = []
        if self.sd is None:
            found.append("no sample has two ratings, so there is no SD")
        if self.possible_pairs == 0:
            found.append("fewer than two raters, so there is no correlation")
        elif self.pairs < self.possible_pairs:
            found.append(
                f"{self.possible_pairs - self.pairs} of {self.possible_pairs} pairs of raters have no correlation, "
                f"since one does not vary or they share fewer than {_FEWEST_SAMPLES} samples"
            )
        if self.constant_raters:
            names = ", ".join(str(rater) for rater in self.constant_raters)
            found.append(f"raters who gave one rating throughout: {names}")
        return tuple(found)

    def summary(self) -> str:
        """Return a sentence, for instance ``P: SD = 0.20, mean pairwise r = .80 (largest p = .034)``."""
        parts = []
        if self.sd is not None:
            parts.append(f"SD = {wording.number(self.sd)}")
        if self.pairwise_r is not None and self.largest_p is not None:
            p = wording.p_value(self.largest_p)
            which = "each pair" if self.largest_p < 0.001 else "largest"
            parts.append(f"mean pairwise r = {wording.share(self.pairwise_r)} ({which} {p})")
        return "; ".join([f"{self.dimension}: {', '.join(parts) or 'nothing can be computed'}", *self.flags])


@dataclass(frozen=True, kw_only=True, eq=False)
class RoundAgreement:
    """How well the raters of a round agree.

    Attributes
    ----------
    samples, raters : int
        How many samples have, and how many raters gave, a rating.
    missing : int
        How many ratings these raters did not give of these samples, over all dimensions.
    dimensions : tuple of RoundDimension
        Each dimension, in their order.
    """

    samples: int
    raters: int
    missing: int
    dimensions: tuple[RoundDimension, ...]

    def __getitem__(self, dimension: str) -> RoundDimension:
        for found in self.dimensions:
            if found.dimension == dimension:
                return found
        names = ", ".join(found.dimension for found in self.dimensions)
        raise DataError(f"There is no dimension {dimension!r}; there are {names}.")

    def summary(self) -> str:
        """Return a line about the round, then one for each dimension."""
        first = f"{self.samples} samples, {self.raters} raters, {self.missing} ratings missing"
        return "\n".join([first, *(found.summary() for found in self.dimensions)])

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each dimension; NaN where there is no value."""
        return pd.DataFrame(
            {
                "dimension": [found.dimension for found in self.dimensions],
                "samples": self.samples,
                "raters": self.raters,
                "sd": [_or_nan(found.sd) for found in self.dimensions],
                "pairwise_r": [_or_nan(found.pairwise_r) for found in self.dimensions],
                "largest_p": [_or_nan(found.largest_p) for found in self.dimensions],
                "pairs": [found.pairs for found in self.dimensions],
                "flags": ["; ".join(found.flags) for found in self.dimensions],
            }
        )


def round_agreement(ratings: npt.ArrayLike, *, dimensions: Sequence[str] = ("P", "A", "D")) -> RoundAgreement:
    """Return how well raters agree: standard deviation over raters, and mean pairwise correlation.

    Unlike `evaluation.statistics.agreement.annotation_agreement`, which it equals for complete ratings, it takes what
    is there and flags what it cannot compute, so that a round in progress, a single rater or a rater who gave one
    rating throughout are no errors.

    Parameters
    ----------
    ratings : array_like, shape (samples, raters, dimensions)
        Ratings of one round, or those combined over the rounds of a fixed panel; NaN where one is missing. Fresh raters
        of several rounds must not share a column: nobody in it would have given all of its ratings.
    dimensions : sequence of str
        Names of the dimensions.

    Returns
    -------
    RoundAgreement
        Both measures for each dimension.

    Raises
    ------
    DataError
        If the ratings are no stack of numbers, one is infinite, or the names do not fit.

    References
    ----------
    Jia et al. (2013), section 2.4.
    """
    stack = array_with_gaps(ratings)
    if stack.shape[2] != len(dimensions):
        raise DataError(f"The ratings have {stack.shape[2]} dimensions, but {len(dimensions)} names.")
    known = ~np.isnan(stack)
    samples, raters = int(known.any(axis=(1, 2)).sum()), int(known.any(axis=(0, 2)).sum())
    spreads = known_deviation(stack)
    return RoundAgreement(
        samples=samples,
        raters=raters,
        missing=samples * raters * len(dimensions) - int(known.sum()),
        dimensions=tuple(
            _agree(stack[:, :, place], spreads[:, place], dimension=name) for place, name in enumerate(dimensions)
        ),
    )


def _agree(ratings: FloatArray, spreads: FloatArray, *, dimension: str) -> RoundDimension:
    known = ~np.isnan(ratings)
    there = np.flatnonzero(known.any(axis=0))
    rows = known.any(axis=1)
    raters = ratings.shape[1]
    correlations, p_values = np.full((2, raters, raters), math.nan)
    inner = np.ix_(there, there)
    rated = ratings[rows][:, there]
    if there.size >= 2 and len(rated) >= _FEWEST_SAMPLES:
        correlations[inner], p_values[inner] = _correlate(rated)
    pairs = np.triu_indices(raters, 1)
    found = ~np.isnan(correlations[pairs])
    deviations = spreads[~np.isnan(spreads)]
    return RoundDimension(
        dimension=dimension,
        sd=float(deviations.mean()) if deviations.size else None,
        sd_samples=deviations.size,
        pairwise_r=float(correlations[pairs][found].mean()) if found.any() else None,
        largest_p=float(p_values[pairs][found].max()) if found.any() else None,
        pairs=int(found.sum()),
        possible_pairs=math.comb(there.size, 2),
        constant_raters=tuple(int(rater) + 1 for rater in there[_constant(rated)]),
        correlations=correlations,
        p_values=p_values,
    )


def _correlate(ratings: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return correlations and p values of the pairs of raters, each over the samples that both rated."""
    known = ~np.isnan(ratings)
    if known.all():
        complete = annotation_agreement(ratings[:, :, None], dimensions=["all"])["all"]
        return complete.correlations, complete.p_values
    varying = np.where(_constant(ratings), math.nan, ratings)
    correlations = np.clip(pd.DataFrame(varying).corr(min_periods=_FEWEST_SAMPLES).to_numpy(), -1, 1)
    shared = known.T.astype(float) @ known
    half = np.maximum(shared, _FEWEST_SAMPLES) / 2 - 1
    p_values = 2 * special.betainc(half, half, (1 - np.abs(correlations)) / 2)
    np.fill_diagonal(p_values, math.nan)
    return correlations, p_values


def _constant(ratings: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which raters differ in their ratings by no more than rounding; each gave at least one."""
    known = ~np.isnan(ratings)
    largest = np.where(known, ratings, -math.inf).max(axis=0, initial=-math.inf)
    smallest = np.where(known, ratings, math.inf).min(axis=0, initial=math.inf)
    size = np.maximum(np.abs(largest), np.abs(smallest))
    constant: npt.NDArray[np.bool_] = largest - smallest <= 4 * np.finfo(float).eps * size
    return constant


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
