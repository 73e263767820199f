"""What single raters are like: bias and inconsistency, scores out of range, agreement with the others."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.alternating_projection import LEAST_VARIANCE, AlternatingProjection, BoolArray, IntArray
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array

LEAST_RATINGS = 3
"""Ratings that a rater must share with others, or the model of bias and inconsistency leaves the rater out."""

# Comparisons of sums count as equal what differs by rounding alone.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class RaterModel:
    """Qualities of items, and biases and inconsistencies of raters, that explain ratings best.

    Attributes
    ----------
    quality : numpy.ndarray, shape (items,)
        Quality of each item, free of biases; NaN where nobody who could be judged rated it.
    bias : numpy.ndarray, shape (raters,)
        By how much each rater rates higher than the others of the same group do on average (the biases of a group have
        the mean 0); NaN for raters with too few ratings.
    inconsistency : numpy.ndarray, shape (raters,)
        Standard deviation of what is left of each rater's ratings, with n; NaN as for the bias.
    group : numpy.ndarray of int, shape (raters,)
        Raters of one number are linked by items that they share, directly or through others; nothing tells the biases
        of different groups apart. -1 for raters with too few ratings.
    largest_weight : float
        Share of the weight that the most consistent rater of a group has, the largest of all groups. Near 1, the
        solution has collapsed: one rater's ratings are taken for the truth, which happens with few raters.
    iterations : int
        How many steps were taken.
    converged : bool
        Whether the last step changed the qualities by less than the tolerance.
    """

    quality: FloatArray
    bias: FloatArray
    inconsistency: FloatArray
    group: IntArray
    largest_weight: float
    iterations: int
    converged: bool


def rater_model(ratings: npt.ArrayLike, *, tolerance: float = 1e-8, steps: int = 1000) -> RaterModel:
    """Return the bias and the inconsistency of each rater, and the qualities of the items freed of them.

    The model is x[j, i] = quality[j] + bias[i] + inconsistency[i] * e, where e is normal with variance 1. Its maximum
    likelihood solution is found by alternating projection: qualities as means weighted by 1 / inconsistency squared,
    biases as mean differences from them, inconsistencies as standard deviations of the rest, until the qualities rest.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.
    tolerance : float
        Largest change of all qualities (root of the sum of squares) at which the solution is found.
    steps : int
        Largest number of steps.

    Returns
    -------
    RaterModel
        The solution.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    InsufficientDataError
        If no two raters share enough items.

    Notes
    -----
    An item that one rater alone has rated tells nothing of that rater, and whoever shares fewer than `LEAST_RATINGS`
    items with others would be fitted without a residual; both are left out of the fit. Such an item then has the rating
    less the rater's bias as its quality.

    References
    ----------
    Recommendation ITU-T P.910, bias-subtracted consistency-weighted mean opinion score by alternating projection.
    Li, Bampis, Krasula, Janowski and Katsavounidis (2020), A simple model for subject behavior in subjective
    experiments, Human Vision and Electronic Imaging (arXiv:2004.02067).
    """
    scores, given = _table(ratings)
    fitted = _linked(given)
    if not fitted.any():
        raise InsufficientDataError(
            f"Bias and inconsistency need two raters or more with at least {LEAST_RATINGS} items in common with others."
        )
    group = _groups(fitted)
    items, raters = fitted.any(axis=1), fitted.any(axis=0)
    fit = AlternatingProjection(scores[np.ix_(items, raters)], fitted[np.ix_(items, raters)])
    iterations, converged = fit.run(tolerance, steps)
    fit.centre(group[raters], _groups_of_items(fitted, group)[items])
    bias, inconsistency = np.full((2, scores.shape[1]), np.nan)
    bias[raters], inconsistency[raters] = fit.bias, fit.inconsistency()
    quality = np.full(len(scores), np.nan)
    quality[items] = fit.quality
    weight = np.zeros(raters.size)
    weight[raters] = 1 / (inconsistency[raters] ** 2 + LEAST_VARIANCE)
    _rest(quality, scores, given & raters, np.nan_to_num(bias), weight)
    shares = [weight[group == one].max() / weight[group == one].sum() for one in range(group.max() + 1)]
    return RaterModel(
        quality=quality,
        bias=bias,
        inconsistency=inconsistency,
        group=group,
        largest_weight=float(max(shares)),
        iterations=iterations,
        converged=converged,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class RangeCounts:
    """How many of each rater's scores are far above or below those of the others.

    Attributes
    ----------
    above, below : numpy.ndarray of int, shape (raters,)
        The standard's P and Q.
    presentations : numpy.ndarray of int, shape (raters,)
        How many presentations the rater has rated: the standard's J K R where nothing is missing.
    share : numpy.ndarray, shape (raters,)
        (P + Q) / presentations; NaN without any.
    asymmetry : numpy.ndarray, shape (raters,)
        abs(P - Q) / (P + Q); NaN where both are 0.
    """

    above: IntArray
    below: IntArray
    presentations: IntArray
    share: FloatArray
    asymmetry: FloatArray


def range_counts(ratings: npt.ArrayLike) -> RangeCounts:
    """Count each rater's scores that are out of the range of the presentation's scores (ITU-R BT.500).

    A score is out of range if it is 2 standard deviations (n - 1) or more from the presentation's mean, or the root of
    20 of them where the scores are not normal: where their kurtosis, the fourth moment over the square of the second,
    is not from 2 to 4. The standard rejects a rater if share > 0.05 and asymmetry < 0.3.

    Parameters
    ----------
    ratings : array_like, shape (presentations, raters)
        Scores; NaN where a rater did not rate a presentation.

    Returns
    -------
    RangeCounts
        Counts for each rater.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.

    Notes
    -----
    The rater's own score is part of mean and deviation, so that nothing is 2 deviations off among fewer than 6 raters,
    and nothing the root of 20 among fewer than 22. Where all agree, nothing is out of range.

    References
    ----------
    Recommendation ITU-R BT.500-14 (2019), Annex 1, A1-2.3.1.
    """
    scores, given = _table(ratings)
    number = given.sum(axis=1)
    differences = scores - (scores.sum(axis=1) / np.maximum(number, 1))[:, None]
    differences[~given] = 0
    largest = np.abs(differences).max(axis=1, initial=0)
    varied = largest > _ROUNDING * np.abs(scores).max(axis=1, initial=0)
    # In units of the largest difference, so that fourth powers of small numbers do not vanish.
    differences /= np.where(varied, largest, 1)[:, None]
    squares = differences**2
    sums = np.where(varied, squares.sum(axis=1), 1)
    spread = np.sqrt(sums / np.maximum(number - 1, 1))
    kurtosis = number * np.einsum("ji,ji->j", squares, squares) / sums**2
    normal = (kurtosis >= 2 * (1 - _ROUNDING)) & (kurtosis <= 4 * (1 + _ROUNDING))
    # No score is out of the range of a presentation that all rate alike.
    limit = np.where(varied, np.where(normal, 2.0, np.sqrt(20)) * spread * (1 - _ROUNDING), np.inf)[:, None]
    above = (differences >= limit).sum(axis=0)
    below = (differences <= -limit).sum(axis=0)
    presentations = given.sum(axis=0)
    out = above + below
    return RangeCounts(
        above=above,
        below=below,
        presentations=presentations,
        share=_ratio(out, presentations),
        asymmetry=_ratio(np.abs(above - below), out),
    )


def leave_one_out_correlation(ratings: npt.ArrayLike) -> FloatArray:
    """Return the correlation of each rater with the mean of the others.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.

    Returns
    -------
    numpy.ndarray, shape (raters,)
        Pearson's r over the items that the rater and another one rated; NaN with fewer than three of them, or where the
        rater or the mean of the others does not vary.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    """
    scores, given = _table(ratings)
    others = given.sum(axis=1, keepdims=True) - given
    shared = given & (others > 0)
    mean = (scores.sum(axis=1, keepdims=True) - scores) / np.maximum(others, 1)
    number = shared.sum(axis=0)
    own, own_constant = _centred_where(scores, shared, number)
    rest, rest_constant = _centred_where(mean, shared, number)
    product = np.einsum("ji,ji->i", own, rest)
    norm = np.sqrt(np.einsum("ji,ji->i", own, own) * np.einsum("ji,ji->i", rest, rest))
    known = (number >= 3) & ~own_constant & ~rest_constant
    result = np.full(number.size, np.nan)
    result[known] = np.clip(product[known] / norm[known], -1, 1)
    return result


def deviations(ratings: npt.ArrayLike) -> FloatArray:
    """Return each rater's mean difference from the items' means.

    Where everybody rated everything this is the rater's mean less the mean of all; with missing ratings it does not
    depend on which items a rater happened to get.

    Parameters
    ----------
    ratings : array_like, shape (items, raters)
        Ratings; NaN where a rater did not rate an item.

    Returns
    -------
    numpy.ndarray, shape (raters,)
        Mean over the items that the rater and another one rated; NaN without any.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite.
    """
    scores, given = _table(ratings)
    number = given.sum(axis=1, keepdims=True)
    shared = given & (number > 1)
    differences = np.where(shared, scores - scores.sum(axis=1, keepdims=True) / np.maximum(number, 1), 0)
    return _ratio(differences.sum(axis=0), shared.sum(axis=0))


def _table(ratings: npt.ArrayLike) -> tuple[FloatArray, BoolArray]:
    """Return the ratings with 0 for those that are missing, and which are there."""
    try:
        table = np.array(ratings, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("ratings: these values are not all numbers, or the rows differ in length.") from error
    given = ~np.isnan(table)
    table[~given] = 0
    return finite_array(table, axes=("items", "raters"), name="ratings"), given


def _ratio(part: npt.ArrayLike, whole: IntArray) -> FloatArray:
    result: FloatArray = np.where(whole > 0, np.asarray(part) / np.maximum(whole, 1), np.nan)
    return result


def _centred_where(values: FloatArray, where: BoolArray, number: IntArray) -> tuple[FloatArray, BoolArray]:
    """Return differences from the columns' means, scaled by the largest, and which columns do not vary."""
    means = np.where(where, values, 0).sum(axis=0) / np.maximum(number, 1)
    differences = np.where(where, values - means, 0)
    largest = np.abs(differences).max(axis=0, initial=0)
    constant: BoolArray = largest <= _ROUNDING * np.where(where, np.abs(values), 0).max(axis=0, initial=0)
    return differences / np.where(constant, 1, largest), constant


def _linked(given: BoolArray) -> BoolArray:
    """Return which ratings tell of their rater: those of items with two raters, by raters with enough of them."""
    linked = given.copy()
    while True:
        before = np.count_nonzero(linked)
        linked &= (linked.sum(axis=1) > 1)[:, None]
        linked &= linked.sum(axis=0) >= LEAST_RATINGS
        if np.count_nonzero(linked) == before:
            return linked


def _groups(linked: BoolArray) -> IntArray:
    """Return the number of each rater's group, those who share items directly or through others; -1 without any."""
    group = np.full(linked.shape[1], -1, dtype=np.intp)
    number = 0
    while (alone := (group < 0) & linked.any(axis=0)).any():
        members = np.arange(group.size) == np.argmax(alone)
        before = 0
        while before < int(members.sum()):
            before = int(members.sum())
            members = linked[linked[:, members].any(axis=1)].any(axis=0)
        group[members] = number
        number += 1
    return group


def _groups_of_items(linked: BoolArray, group: IntArray) -> IntArray:
    """Return the group of each item's raters; that of the first rater for an item without any."""
    numbers: IntArray = group[linked.argmax(axis=1)]
    return numbers


def _rest(quality: FloatArray, scores: FloatArray, given: BoolArray, bias: FloatArray, weight: FloatArray) -> None:
    """Fill in the qualities of items that the fit left out, from what fitted raters said of them."""
    left = np.isnan(quality) & given.any(axis=1)
    weights = given[left] * weight
    quality[left] = ((scores[left] - bias) * weights).sum(axis=1) / weights.sum(axis=1)
