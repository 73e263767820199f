"""What single raters are like: the model of bias and inconsistency."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.alternating_projection import LEAST_VARIANCE, AlternatingProjection, BoolArray, IntArray
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.bt500 import RangeCounts, range_counts
from evaluation.statistics.leave_one_out import deviations, leave_one_out_correlation
from evaluation.statistics.matrices import ratings_table
from evaluation.statistics.result import Result
from evaluation.statistics.threads import one_thread

__all__ = [
    "LEAST_RATINGS",
    "RangeCounts",
    "RaterModel",
    "deviations",
    "leave_one_out_correlation",
    "range_counts",
    "rater_model",
]

LEAST_RATINGS = 3
"""Ratings that a rater must share with others, or the model of bias and inconsistency leaves the rater out."""

# A rater with more than this share of all weight is the solution alone.
_COLLAPSED = 0.99
# Ratings that sum to less, as do their squares, are not looked at more closely.
_LARGEST = 1e140


@dataclass(frozen=True, kw_only=True, eq=False)
class RaterModel(Result):
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
    quality_se, bias_se : numpy.ndarray, shapes (items,) and (raters,)
        Standard errors; NaN as for the estimates.
    ratings : numpy.ndarray of int, shape (raters,)
        Ratings of each rater that the model was fitted to.
    confidence : float
        Confidence of the intervals.
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
    quality_se: FloatArray
    bias_se: FloatArray
    ratings: IntArray
    confidence: float
    group: IntArray
    largest_weight: float
    iterations: int
    converged: bool

    @property
    def inconsistency_se(self) -> FloatArray:
        """Standard errors of the inconsistencies, from the information: inconsistency / sqrt(2 n); shape (raters,)."""
        errors: FloatArray = self.inconsistency / np.sqrt(2 * np.maximum(self.ratings, 1))
        return errors

    @property
    def quality_ci(self) -> FloatArray:
        """Normal intervals of the qualities, shape (items, 2)."""
        return self._normal(self.quality, self.quality_se)

    @property
    def bias_ci(self) -> FloatArray:
        """Normal intervals of the biases, shape (raters, 2)."""
        return self._normal(self.bias, self.bias_se)

    @property
    def inconsistency_ci(self) -> FloatArray:
        """Intervals of the inconsistencies by the chi-square with n degrees of freedom, shape (raters, 2)."""
        number = np.maximum(self.ratings, 1)
        tails = np.array([(1 - self.confidence) / 2, (1 + self.confidence) / 2])
        factors = np.sqrt(number[:, None] / special.chdtri(number[:, None], tails))
        limits: FloatArray = self.inconsistency[:, None] * factors
        return limits

    @property
    def collapsed(self) -> bool:
        """Whether one rater's ratings are taken for the truth, so that the others' numbers mean nothing."""
        return self.largest_weight > _COLLAPSED

    def apa(self) -> str:
        """Return the size of the panel and how far biases and inconsistencies reach."""
        known = self.group >= 0
        bias, spread = self.bias[known], self.inconsistency[known]
        items = int(np.count_nonzero(~np.isnan(self.quality)))
        return (
            f"Bias and inconsistency (ITU-T P.910) of {bias.size} raters of {items} items: bias "
            f"{wording.number(float(bias.min()))} to {wording.number(float(bias.max()))}, "
            f"SD = {wording.number(float(bias.std()))}, inconsistency {wording.number(float(spread.min()))} to "
            f"{wording.number(float(spread.max()))}, M = {wording.number(float(spread.mean()))}, "
            f"mean SE of a quality {wording.number(float(np.nanmean(self.quality_se)), 3)}"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each parameter: what it is, its number from 0, estimate, standard error and interval."""
        parts = (
            ("quality", self.quality, self.quality_se, self.quality_ci),
            ("bias", self.bias, self.bias_se, self.bias_ci),
            ("inconsistency", self.inconsistency, self.inconsistency_se, self.inconsistency_ci),
        )
        return pd.concat(
            [
                pd.DataFrame(
                    {
                        "parameter": name,
                        "number": np.arange(estimate.size),
                        "estimate": estimate,
                        "se": se,
                        "ci_low": ci[:, 0],
                        "ci_high": ci[:, 1],
                    }
                )
                for name, estimate, se, ci in parts
            ],
            ignore_index=True,
        )

    def _normal(self, estimate: FloatArray, se: FloatArray) -> FloatArray:
        half = float(special.ndtri((1 + self.confidence) / 2)) * se
        return np.column_stack([estimate - half, estimate + half])


@one_thread()
def rater_model(
    ratings: npt.ArrayLike, *, tolerance: float = 1e-8, steps: int = 1000, confidence: float = 0.95
) -> RaterModel:
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
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    RaterModel
        The solution, with standard errors and intervals.

    Raises
    ------
    DataError
        If the ratings are no table of numbers, or infinite, or `confidence` is not between 0 and 1.
    InsufficientDataError
        If no two raters share enough items.

    Notes
    -----
    An item that one rater alone has rated tells nothing of that rater, and whoever shares fewer than `LEAST_RATINGS`
    items with others would be fitted without a residual; both are left out of the fit. Such an item then has the rating
    less the rater's bias as its quality.

    Standard errors are those of Li et al., from the second derivatives of the log likelihood by one parameter each:
    1 / sqrt(sum of 1 / inconsistency squared) over the raters of an item for its quality, inconsistency / sqrt(n) for
    the bias of a rater of n items.

    References
    ----------
    Recommendation ITU-T P.910, bias-subtracted consistency-weighted mean opinion score by alternating projection.
    Li, Bampis, Krasula, Janowski and Katsavounidis (2020), A simple model for subject behavior in subjective
    experiments, Human Vision and Electronic Imaging (arXiv:2004.02067).
    """
    check_confidence(confidence)
    begun = _of_complete(ratings)
    if begun is not None:
        return _fit(begun.rest, None, begun, tolerance=tolerance, steps=steps, confidence=confidence)
    scores, given = _table(ratings)
    fitted = _linked(given)
    if not fitted.any():
        raise InsufficientDataError(
            f"Bias and inconsistency need two raters or more with at least {LEAST_RATINGS} items in common with others."
        )
    return _fit(scores, (given, fitted), None, tolerance=tolerance, steps=steps, confidence=confidence)


def _plain(ratings: npt.ArrayLike) -> FloatArray | None:
    """Return a table of numbers as it is, None if the ratings are anything else."""
    if not isinstance(ratings, np.ndarray) or ratings.dtype.kind not in "iuf" or ratings.ndim != 2:
        return None
    return np.ascontiguousarray(ratings, dtype=float)


def _of_complete(ratings: npt.ArrayLike) -> AlternatingProjection | None:
    """Return the fit's beginning if nothing is missing; the sums that it needs tell that sooner than a look first."""
    scores = _plain(ratings)
    if scores is None or len(scores) < LEAST_RATINGS or scores.shape[1] < 2:
        return None
    with np.errstate(all="ignore"):
        begun = AlternatingProjection(scores, None)
    # A sum is NaN if one of its terms is.
    return begun if begun.largest < _LARGEST else None


def _table(ratings: npt.ArrayLike) -> tuple[FloatArray, BoolArray]:
    """Return as `ratings_table`, but sooner."""
    scores = _plain(ratings)
    if scores is None:
        return ratings_table(ratings)
    given = ~np.isnan(scores)
    scores = np.where(given, scores, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        sums = np.einsum("ji,ji->j", scores, scores)
    return (scores, given) if sums.max(initial=0) < _LARGEST else ratings_table(ratings)


def _fit(
    scores: FloatArray,
    known: tuple[BoolArray, BoolArray] | None,
    begun: AlternatingProjection | None,
    *,
    tolerance: float,
    steps: int,
    confidence: float,
) -> RaterModel:
    shape = scores.shape
    items: BoolArray
    raters: BoolArray
    given: BoolArray | None = None
    if known is None or begun is not None:
        group, of_items = np.zeros(shape[1], dtype=np.intp), np.zeros(shape[0], dtype=np.intp)
        items, raters = np.ones(shape[0], dtype=np.bool_), np.ones(shape[1], dtype=np.bool_)
        fit = begun if begun is not None else AlternatingProjection(scores, None)
    else:
        given, fitted = known
        group = _groups(fitted)
        of_items = group[fitted.argmax(axis=1)]
        items, raters = np.asarray(fitted.any(axis=1)), np.asarray(fitted.any(axis=0))
        everything = bool(items.all() and raters.all())
        places = np.ix_(items, raters)
        part, linked = (scores, fitted) if everything else (scores[places], fitted[places])
        fit = AlternatingProjection(part, None if linked.all() else linked)
    iterations, converged = fit.run(tolerance, steps)
    fit.centre(group[raters], of_items[items])
    bias, inconsistency, bias_se = np.full((3, shape[1]), np.nan)
    bias[raters], inconsistency[raters] = fit.bias, fit.inconsistency
    bias_se[raters] = fit.inconsistency / np.sqrt(fit.per_rater)
    number = np.zeros(shape[1], dtype=np.intp)
    number[raters] = fit.per_rater
    weight = np.zeros(shape[1])
    weight[raters] = 1 / (fit.inconsistency**2 + LEAST_VARIANCE)
    quality = np.full(shape[0], np.nan)
    quality[items] = fit.quality
    if given is not None:
        _rest(quality, scores, given & raters, np.nan_to_num(bias), weight)
    largest = max(float(weight[group == one].max() / weight[group == one].sum()) for one in range(group.max() + 1))
    precision = np.full(shape[0], weight.sum()) if given is None else given @ weight
    return RaterModel(
        quality=quality,
        bias=bias,
        inconsistency=inconsistency,
        quality_se=np.where(precision > 0, 1 / np.sqrt(np.where(precision > 0, precision, 1)), np.nan),
        bias_se=bias_se,
        ratings=number,
        confidence=confidence,
        group=group,
        largest_weight=largest,
        iterations=iterations,
        converged=converged,
        flags=_flags(quality, group, largest, converged=converged),
    )


def _flags(quality: FloatArray, group: IntArray, largest: float, *, converged: bool) -> tuple[str, ...]:
    flags = []
    if not converged:
        flags.append("The qualities had not come to rest after the last step; more steps are needed.")
    if largest > _COLLAPSED:
        flags.append(
            "The solution has collapsed: one rater's ratings are taken for the truth, which happens with few raters; "
            "neither inconsistencies nor standard errors can be trusted."
        )
    if group.max() > 0:
        flags.append(
            f"The raters fall into {group.max() + 1} groups without a common item; biases and qualities of different "
            "groups cannot be compared."
        )
    out = int(np.count_nonzero(group < 0))
    if out:
        flags.append(f"{out} of {group.size} raters share fewer than {LEAST_RATINGS} items with others: left out.")
    unknown = int(np.count_nonzero(np.isnan(quality)))
    if unknown:
        flags.append(f"{unknown} of {quality.size} items have no rating by a rater of the model, and so no quality.")
    return tuple(flags)


def _linked(given: BoolArray) -> BoolArray:
    """Return which ratings tell of their rater: those of items with two raters, by raters with enough of them."""
    linked = given.copy()
    while True:
        before = np.count_nonzero(linked)
        linked &= (np.count_nonzero(linked, axis=1) > 1)[:, None]
        linked &= np.count_nonzero(linked, axis=0) >= LEAST_RATINGS
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


def _rest(quality: FloatArray, scores: FloatArray, given: BoolArray, bias: FloatArray, weight: FloatArray) -> None:
    """Fill in the qualities of items that the fit left out, from what fitted raters said of them."""
    left = np.isnan(quality) & given.any(axis=1)
    if not left.any():
        return
    weights = given[left] * weight
    quality[left] = ((scores[left] - bias) * weights).sum(axis=1) / weights.sum(axis=1)
