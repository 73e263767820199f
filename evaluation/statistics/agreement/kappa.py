"""Cohen's kappa of two raters, unweighted and weighted, and Light's mean of it over pairs of raters."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.label_codes import IntArray, LabelCodes, label_codes
from evaluation.statistics.result import Result

Weights = Literal["unweighted", "linear", "quadratic"]

_WEIGHTS = ("unweighted", "linear", "quadratic")


@dataclass(frozen=True, kw_only=True)
class CohenKappa(Result):
    """Cohen's kappa.

    Attributes
    ----------
    kappa : float
        Agreement beyond chance: 1 if perfect, 0 if as by chance.
    weights : str
        ``unweighted``, ``linear`` or ``quadratic``.
    agreement, expected : float
        Observed agreement p_o, and p_e that chance would give; weighted if `weights` says so.
    items : int
        Number of items that both raters labelled.
    categories : tuple
        The categories in their order.
    se : float
        Large-sample standard error.
    ci : tuple of float
        kappa plus and minus the normal quantile times `se`; it may reach beyond 1.
    confidence : float
        Confidence of the interval.
    se_null, z, p : float or None
        Standard error if there were no agreement beyond chance, kappa over it, and the two-sided p value; None if that
        standard error is 0.
    """

    kappa: float
    weights: Weights
    agreement: float
    expected: float
    items: int
    categories: tuple[Hashable, ...]
    se: float
    ci: tuple[float, float]
    confidence: float
    se_null: float | None
    z: float | None
    p: float | None

    def apa(self) -> str:
        """Return a sentence, for instance ``Cohen's kappa (linear weights, 30 items) = .47, 95% CI [.31, .62].``."""
        kind = "" if self.weights == "unweighted" else f"{self.weights} weights, "
        text = f"Cohen's kappa ({kind}{self.items} items) = {wording.share(self.kappa)}"
        text = f"{text}, {wording.interval(*self.ci, confidence=self.confidence, bounded=True)}"
        if self.z is not None and self.p is not None:
            text = f"{text}, z = {wording.number(self.z)}, {wording.p_value(self.p)}"
        return f"{text}."

    def to_frame(self) -> pd.DataFrame:
        """Return the numbers as a frame of one row; NaN where there is no value."""
        return pd.DataFrame(
            {
                "weights": [self.weights],
                "kappa": [self.kappa],
                "se": [self.se],
                "ci_low": [self.ci[0]],
                "ci_high": [self.ci[1]],
                "confidence": [self.confidence],
                "se_null": [_or_nan(self.se_null)],
                "z": [_or_nan(self.z)],
                "p": [_or_nan(self.p)],
                "agreement": [self.agreement],
                "expected": [self.expected],
                "items": [self.items],
            }
        )


def cohen_kappa(
    first: npt.ArrayLike,
    second: npt.ArrayLike,
    *,
    weights: Weights = "unweighted",
    categories: Sequence[Hashable] | None = None,
    confidence: float = 0.95,
) -> CohenKappa:
    """Return Cohen's kappa of two raters with its standard error and interval.

    Parameters
    ----------
    first, second : array_like, shape (items,)
        Each rater's label of each item; items where one is missing (None, NaN) are left out.
    weights : {"unweighted", "linear", "quadratic"}
        What a disagreement of d steps between k categories counts as agreement: nothing, 1 - d / (k - 1), or
        1 - d^2 / (k - 1)^2.
    categories : sequence, optional
        All categories; for weights in their order. Without it, those that occur, numbers from small to large. Weights
        go by the places of the categories: give all points of a scale, also those that nobody chose.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    CohenKappa
        Kappa with its standard error, interval and test.

    Raises
    ------
    DataError
        If the two differ in length, a label is not among the categories, or weights are asked for labels without order.
    InsufficientDataError
        If fewer than two items have both labels, or all labels are the same.

    References
    ----------
    Cohen (1960), Educational and Psychological Measurement 20:37, and (1968), Psychological Bulletin 70:213. Standard
    errors: Fleiss, Cohen and Everitt (1969), Psychological Bulletin 72:323.
    """
    check_confidence(confidence)
    _check_weights(weights)
    labels = label_codes(_pairs(first, second), categories=_known_categories(first, second, categories), name="labels")
    _check_order(labels, weights)
    return _cohen(labels.codes[0], labels.codes[1], labels.categories, weights, confidence)


def _pairs(first: npt.ArrayLike, second: npt.ArrayLike) -> npt.NDArray[np.object_]:
    sides = []
    for name, side in (("first", first), ("second", second)):
        try:
            flat = np.ndim(side) == 1
        except ValueError:
            flat = False
        if not flat:
            raise DataError(f"{name} must be a flat list of labels.")
        sides.append(pd.Series(side, dtype=object).to_numpy())
    if len(sides[0]) != len(sides[1]):
        raise DataError(
            f"The first rater has {len(sides[0])} labels and the second {len(sides[1])}, but kappa needs pairs."
        )
    return np.stack(sides)


def _known_categories(
    first: npt.ArrayLike, second: npt.ArrayLike, categories: Sequence[Hashable] | None
) -> Sequence[Hashable] | None:
    """Return the categories given, or else those of two pandas categoricals that have the same."""
    if categories is not None:
        return categories
    dtypes = [getattr(side, "dtype", None) for side in (first, second)]
    if isinstance(dtypes[0], pd.CategoricalDtype) and dtypes[0] == dtypes[1]:
        found: list[Hashable] = dtypes[0].categories.tolist()
        return found
    return None


def _check_weights(weights: str) -> None:
    if weights not in _WEIGHTS:
        raise DataError(f"weights is {weights!r}, but must be one of {', '.join(_WEIGHTS)}.")


def _check_order(labels: LabelCodes, weights: Weights) -> None:
    if weights != "unweighted" and not labels.ordered:
        raise DataError(
            f"{weights} weights need the order of the labels: give categories from the lowest to the highest."
        )


def _cohen(
    one: IntArray, two: IntArray, categories: tuple[Hashable, ...], weights: Weights, confidence: float
) -> CohenKappa:
    both = (one >= 0) & (two >= 0)
    n, k = int(both.sum()), len(categories)
    if n < 2:
        raise InsufficientDataError(f"Kappa needs at least 2 items that both raters labelled; there {_are(n)}.")
    shares = np.bincount(one[both] * k + two[both], minlength=k * k).reshape(k, k) / n
    rows, columns = shares.sum(axis=1), shares.sum(axis=0)
    if max(rows) * max(columns) == 1 and rows.argmax() == columns.argmax():
        raise InsufficientDataError(f"Both raters gave all {n} items the same label, so that kappa is not defined.")
    worth = _worth(k, weights)
    agreement, expected = float((worth * shares).sum()), float(rows @ worth @ columns)
    # 1 - expected as a sum of disagreements, which loses no digits when agreement is near perfect.
    room = float(rows @ (1 - worth) @ columns)
    kappa = 1 - float(((1 - worth) * shares).sum()) / room
    margins = (worth @ columns)[:, None] + worth.T @ rows
    spread = float((shares * (worth * room - margins * (1 - agreement)) ** 2).sum())
    variance = max(spread - (agreement * expected - 2 * expected + agreement) ** 2, 0) / (n * room**4)
    null = float((np.outer(rows, columns) * (worth - margins) ** 2).sum()) - expected**2
    se_null = math.sqrt(null / n) / room if null > 1e-14 else None
    z = None if se_null is None else kappa / se_null
    se = math.sqrt(variance) if variance > 1e-15 else 0.0
    half = float(stats.norm.ppf((1 + confidence) / 2)) * se
    return CohenKappa(
        kappa=kappa,
        weights=weights,
        agreement=agreement,
        expected=expected,
        items=n,
        categories=categories,
        se=se,
        ci=(kappa - half, kappa + half),
        confidence=confidence,
        se_null=se_null,
        z=z,
        p=None if z is None else float(2 * stats.norm.sf(abs(z))),
        flags=_flags(both, shares, categories, weights, kappa + half),
    )


def _worth(k: int, weights: Weights) -> FloatArray:
    """Return how much agreement each pair of categories counts as."""
    if weights == "unweighted":
        return np.eye(k)
    steps = np.abs(np.subtract.outer(np.arange(k), np.arange(k))) / (k - 1)
    worth: FloatArray = 1 - (steps if weights == "linear" else steps**2)
    return worth


def _flags(
    both: npt.NDArray[np.bool_], shares: FloatArray, categories: tuple[Hashable, ...], weights: Weights, high: float
) -> tuple[str, ...]:
    flags = []
    if not both.all():
        flags.append(f"Left out, lacking a label: {both.size - both.sum()} of {both.size} items.")
    margins = shares.sum(axis=1), shares.sum(axis=0)
    if any((margin > 0).sum() == 1 for margin in margins):
        flags.append("A rater gave every item the same label, which makes kappa 0 whatever the other rater does.")
    elif shares.trace() > 1 - 1e-12:
        flags.append("The raters agree on every item, so that the standard error is 0 and the interval has no width.")
    elif high > 1:
        flags.append("The large-sample interval reaches beyond 1, which kappa cannot exceed.")
    if weights != "unweighted" and _uneven(categories):
        flags.append("The categories are no whole numbers in a row; weights count them as equally far apart.")
    return tuple(flags)


def _uneven(categories: tuple[Hashable, ...]) -> bool:
    numbers = [float(category) for category in categories if isinstance(category, int | float | np.number)]
    return len(numbers) == len(categories) and bool((np.diff(numbers) != 1).any())


def _are(n: int) -> str:
    return "is 1" if n == 1 else f"are {n}"


@dataclass(frozen=True, kw_only=True, eq=False)
class LightKappa(Result):
    """Light's kappa: the mean of Cohen's kappa over all pairs of raters.

    Attributes
    ----------
    kappa : float
        The mean.
    weights : str
        Weights of Cohen's kappa.
    items, raters : int
        Size of the table.
    pairs : int
        How many pairs of raters have a kappa.
    lowest, highest : float
        Range of the pairs' kappas.
    matrix : numpy.ndarray, shape (raters, raters)
        Kappa of each pair, 1 on the diagonal; NaN where there is none, which the flags then say.
    """

    kappa: float
    weights: Weights
    items: int
    raters: int
    pairs: int
    lowest: float
    highest: float
    matrix: FloatArray

    def apa(self) -> str:
        """Return a sentence, for instance ``Light's kappa (4 raters, 30 items) = .47, pairs from .31 to .62.``."""
        kind = "" if self.weights == "unweighted" else f"{self.weights} weights, "
        return (
            f"Light's kappa ({kind}{self.raters} raters, {self.items} items) = {wording.share(self.kappa)}, "
            f"pairs from {wording.share(self.lowest)} to {wording.share(self.highest)}."
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each pair of raters, numbered from 1."""
        one, two = np.triu_indices(self.raters, 1)
        return pd.DataFrame({"rater": one + 1, "other": two + 1, "kappa": self.matrix[one, two]})


def light_kappa(
    labels: npt.ArrayLike, *, weights: Weights = "unweighted", categories: Sequence[Hashable] | None = None
) -> LightKappa:
    """Return the mean of Cohen's kappa over all pairs of raters.

    Parameters
    ----------
    labels : array_like, shape (items, raters)
        Labels; None or NaN where a rater gave an item none. Each pair is compared on the items that both labelled.
    weights, categories
        As `cohen_kappa`.

    Returns
    -------
    LightKappa
        Mean, range and matrix of the pairs' kappas.

    Raises
    ------
    DataError
        As `cohen_kappa`, or if the labels are no table.
    InsufficientDataError
        If no pair of raters has a kappa.

    References
    ----------
    Light (1971), Psychological Bulletin 76:365.
    """
    _check_weights(weights)
    coded = label_codes(labels, categories=categories, name="labels")
    _check_order(coded, weights)
    if coded.codes.ndim != 2:
        raise DataError(f"labels has the shape {coded.codes.shape}, but must have items x raters.")
    items, raters = coded.codes.shape
    matrix = np.where(np.eye(raters, dtype=bool), 1.0, math.nan)
    for one, two in combinations(range(raters), 2):
        try:
            found = _cohen(coded.codes[:, one], coded.codes[:, two], coded.categories, weights, 0.95)
        except InsufficientDataError:
            continue
        matrix[one, two] = matrix[two, one] = found.kappa
    kappas = matrix[np.triu_indices(raters, 1)]
    known = kappas[~np.isnan(kappas)]
    if not known.size:
        raise InsufficientDataError("No two raters have a kappa: they share too few items, or all labels are the same.")
    lost = kappas.size - known.size
    matrix.flags.writeable = False
    return LightKappa(
        kappa=float(known.mean()),
        weights=weights,
        items=items,
        raters=raters,
        pairs=known.size,
        lowest=float(known.min()),
        highest=float(known.max()),
        matrix=matrix,
        flags=(f"Left out, having no kappa: {lost} of {kappas.size} pairs of raters.",) if lost else (),
    )


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
