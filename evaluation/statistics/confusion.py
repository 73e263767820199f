"""Confusion of intended and chosen categories: how well emotions are recognised."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.contingency import Contingency, contingency_of_counts
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result

IntArray = npt.NDArray[np.int64]

_LARGEST_COUNT = 1e9


@dataclass(frozen=True, kw_only=True, eq=False)
class Confusion(Result):
    """A table of intended and chosen categories, and how well the intended ones were recognised.

    Attributes
    ----------
    labels : tuple of str
        The categories.
    counts : numpy.ndarray of int, shape (k, k)
        Choices: intended in rows, chosen in columns.
    accuracy : float
        Share of the choices that are as intended.
    accuracy_ci : tuple of float
        Wilson's interval.
    chance : float
        Accuracy of guessing.
    p_chance : float
        Probability of so many hits or more by guessing (exact binomial).
    recall, precision, f1 : numpy.ndarray, shape (k,)
        Share of an intended category that is chosen so; share of a chosen category that was intended so; their harmonic
        mean. NaN where the category was not intended (recall), not chosen (precision), or neither (all three).
    recall_ci, precision_ci : numpy.ndarray, shape (k, 2)
        Wilson's intervals.
    recall_p : numpy.ndarray, shape (k,)
        As `p_chance`, for each intended category.
    hu : numpy.ndarray, shape (k,)
        Wagner's unbiased hit rate: recall times precision; 0 for an intended category that nobody chose.
    hu_chance : numpy.ndarray, shape (k,)
        What it would be if choices did not depend on intentions: share of the row times share of the column.
    kappa : float or None
        Cohen's kappa; None if all choices and intentions are the same one.
    kappa_ci : tuple of float, or None
        Its normal interval, within -1 and 1.
    confidence : float
        Confidence of the intervals.
    """

    labels: tuple[str, ...]
    counts: IntArray
    accuracy: float
    accuracy_ci: tuple[float, float]
    chance: float
    p_chance: float
    recall: FloatArray
    precision: FloatArray
    f1: FloatArray
    recall_ci: FloatArray
    precision_ci: FloatArray
    recall_p: FloatArray
    hu: FloatArray
    hu_chance: FloatArray
    kappa: float | None
    kappa_ci: tuple[float, float] | None
    confidence: float

    @property
    def n(self) -> int:
        """Number of choices."""
        return int(self.counts.sum())

    @property
    def macro_f1(self) -> float:
        """Mean F1 of the categories that were intended or chosen."""
        return float(np.nanmean(self.f1))

    def contingency(self) -> Contingency:
        """Return the table with its test of independence.

        Raises
        ------
        InsufficientDataError
            If fewer than two categories were intended, or chosen.
        """
        return contingency_of_counts(self.counts, row_names=self.labels, column_names=self.labels)

    def apa(self) -> str:
        """Return for instance ``accuracy .62, 95% CI [.55, .68], chance .14, p < .001, N = 213, κ = .55, ...``."""
        interval = wording.interval(*self.accuracy_ci, confidence=self.confidence, bounded=True)
        parts = [f"accuracy {wording.share(self.accuracy)}", interval]
        parts += [f"chance {wording.share(self.chance)}", wording.p_value(self.p_chance), f"N = {self.n}"]
        if self.kappa is not None:
            parts.append(f"κ = {wording.share(self.kappa)}")
        if self.kappa_ci is not None:
            parts.append(wording.interval(*self.kappa_ci, confidence=self.confidence, bounded=True))
        intended = ~np.isnan(self.hu)
        return ", ".join([*parts, f"mean Hu = {wording.share(float(self.hu[intended].mean()))}"])

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each category."""
        return pd.DataFrame(
            {
                "category": list(self.labels),
                "intended": self.counts.sum(axis=1),
                "chosen": self.counts.sum(axis=0),
                "hits": np.diag(self.counts),
                "recall": self.recall,
                "recall_ci_low": self.recall_ci[:, 0],
                "recall_ci_high": self.recall_ci[:, 1],
                "p_chance": self.recall_p,
                "precision": self.precision,
                "precision_ci_low": self.precision_ci[:, 0],
                "precision_ci_high": self.precision_ci[:, 1],
                "f1": self.f1,
                "hu": self.hu,
                "hu_chance": self.hu_chance,
            }
        )

    def matrix(self) -> pd.DataFrame:
        """Return the counts, intended categories in rows and chosen ones in columns."""
        return pd.DataFrame(self.counts, index=list(self.labels), columns=list(self.labels))


def confusion(
    intended: Sequence[Hashable],
    chosen: Sequence[Hashable],
    *,
    labels: Sequence[Hashable] | None = None,
    chance: float | None = None,
    confidence: float = 0.95,
) -> Confusion:
    """Count how often each category was chosen for what was intended, and return how well that went.

    Parameters
    ----------
    intended, chosen : sequence, length n
        What was intended and what was chosen, choice by choice.
    labels : sequence, optional
        The categories that could be chosen, in their order; left out, those of `intended` and then of `chosen`, in the
        order in which they first appear, or of a pandas categorical.
    chance, confidence
        As in `confusion_of_counts`.

    Returns
    -------
    Confusion
        As `confusion_of_counts`.

    Raises
    ------
    DataError
        If the two differ in length, a category is missing (None or NaN) or not among `labels`, or an option is out of
        range.
    InsufficientDataError
        If there are no choices, or fewer than two categories.

    References
    ----------
    As `confusion_of_counts`.
    """
    if len(intended) != len(chosen):
        raise DataError(f"There are {len(intended)} intended and {len(chosen)} chosen categories; each needs both.")
    sides = {name: _factorised(values) for name, values in (("intended", intended), ("chosen", chosen))}
    known = list(dict.fromkeys(kind for _, kinds in sides.values() for kind in kinds)) if labels is None else [*labels]
    index = pd.Index(known, dtype=object)
    if not index.is_unique:
        raise DataError("The labels must differ from each other.")
    places = []
    for name, (codes, kinds) in sides.items():
        # The last is for what is missing, whose code is -1.
        place = np.append(index.get_indexer(pd.Index(kinds, dtype=object)), -1)[codes]
        wrong = np.flatnonzero(place < 0)
        if wrong.size:
            first = int(wrong[0])
            what = repr(kinds[codes[first]]) if codes[first] >= 0 else "what is missing"
            raise DataError(f"{name}: {what} at place {first} is no category.")
        places.append(place)
    counts = np.zeros((len(known), len(known)), dtype=np.int64)
    np.add.at(counts, tuple(places), 1)
    return confusion_of_counts(counts, labels=[str(label) for label in known], chance=chance, confidence=confidence)


def confusion_of_counts(
    counts: npt.ArrayLike,
    *,
    labels: Sequence[str] | None = None,
    chance: float | None = None,
    confidence: float = 0.95,
) -> Confusion:
    """Return how well intended categories were recognised, from a table of counts.

    Parameters
    ----------
    counts : array_like, shape (k, k)
        How often the category of the row was intended and that of the column chosen.
    labels : sequence of str, optional
        Names of the categories; left out, "1", "2" and so on.
    chance : float, optional
        Accuracy of guessing, between 0 and 1; left out 1 / k, for k words to choose from.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    Confusion
        Accuracy, recall, precision, F1, unbiased hit rates, kappa and the test against chance.

    Raises
    ------
    DataError
        If the counts are no square table of whole numbers of 0 or more, the labels do not fit or are not unique, or an
        option is out of range.
    InsufficientDataError
        If there are no counts, or fewer than two categories.

    Notes
    -----
    Choices count as independent; those of one rater are not quite, and the intervals then too short.

    References
    ----------
    Wilson (1927), J. Amer. Statist. Assoc. 22:209. Wagner (1993), J. Nonverbal Behav. 17:3 (unbiased hit rate and its
    chance level). Cohen (1960), Educ. Psychol. Meas. 20:37 (kappa); Fleiss, Cohen and Everitt (1969), Psychol. Bull.
    72:323 (its standard error).
    """
    check_confidence(confidence)
    table = finite_array(counts, axes=("intended", "chosen"), name="counts")
    names = _checked(table, labels)
    k, n = len(names), float(table.sum())
    level = 1 / k if chance is None else chance
    if not 0 < level < 1:
        raise DataError(f"chance is {chance}, but must lie between 0 and 1.")
    hits, rows, columns = np.diag(table), table.sum(axis=1), table.sum(axis=0)
    recall, precision = _ratio(hits, rows), _ratio(hits, columns)
    accuracy = float(hits.sum()) / n
    kappa, kappa_ci = _kappa(table / n, n, confidence)
    ci = wilson_interval([hits.sum()], [n], confidence=confidence)[0]
    return Confusion(
        labels=names,
        counts=table.astype(np.int64),
        accuracy=accuracy,
        accuracy_ci=(float(ci[0]), float(ci[1])),
        chance=level,
        p_chance=float(_at_least(hits.sum(keepdims=True), np.array([n]), level)[0]),
        recall=recall,
        precision=precision,
        f1=_ratio(2 * hits, rows + columns),
        recall_ci=wilson_interval(hits, rows, confidence=confidence),
        precision_ci=wilson_interval(hits, columns, confidence=confidence),
        recall_p=_at_least(hits, rows, level),
        hu=np.where(rows > 0, recall * np.nan_to_num(precision), np.nan),
        hu_chance=np.where(rows > 0, rows * columns / n**2, np.nan),
        kappa=kappa,
        kappa_ci=kappa_ci,
        confidence=confidence,
        flags=_flags(names, rows, columns, kappa),
    )


def wilson_interval(hits: npt.ArrayLike, numbers: npt.ArrayLike, *, confidence: float = 0.95) -> FloatArray:
    """Return Wilson's intervals for proportions.

    Parameters
    ----------
    hits, numbers : array_like, shape (k,)
        Successes, and trials.
    confidence : float
        Confidence of the intervals, between 0 and 1.

    Returns
    -------
    numpy.ndarray, shape (k, 2)
        Lower and upper limits; NaN without any trial.

    Raises
    ------
    DataError
        If `confidence` is not between 0 and 1, or there are more successes than trials.

    References
    ----------
    Wilson (1927), J. Amer. Statist. Assoc. 22:209.
    """
    check_confidence(confidence)
    x, n = np.asarray(hits, dtype=float), np.asarray(numbers, dtype=float)
    if not ((x >= 0) & (x <= n)).all():
        raise DataError("There must be from 0 to as many successes as trials.")
    z2 = float(special.ndtri((1 + confidence) / 2)) ** 2
    total = n + z2
    middle = (x + z2 / 2) / total
    half = np.sqrt(z2) / total * np.sqrt(x * (n - x) / np.maximum(n, 1) + z2 / 4)
    # What rounding leaves of limits that are 0 and 1 exactly.
    low, high = np.where(x == 0, 0, middle - half), np.where(x == n, 1, middle + half)
    return np.where((n > 0)[:, None], np.column_stack([low, high]), np.nan)


def _checked(table: FloatArray, labels: Sequence[str] | None) -> tuple[str, ...]:
    if table.shape[0] != table.shape[1]:
        raise DataError(f"The counts have the shape {table.shape}, but as many rows as columns are needed.")
    if (table < 0).any() or (table > _LARGEST_COUNT).any() or (table != np.round(table)).any():
        raise DataError(f"The counts must be whole numbers from 0 to {_LARGEST_COUNT:g}.")
    names = tuple(str(label) for label in labels) if labels is not None else tuple(map(str, range(1, len(table) + 1)))
    if len(names) != len(table):
        raise DataError(f"There are {len(table)} categories, but {len(names)} labels.")
    if len(set(names)) != len(names):
        raise DataError("The labels must differ from each other.")
    if len(names) < 2:
        raise InsufficientDataError("There must be at least two categories to choose from.")
    if not table.any():
        raise InsufficientDataError("There are no choices.")
    return names


def _factorised(values: Sequence[Hashable]) -> tuple[npt.NDArray[np.intp], list[Hashable]]:
    """Return the number of each category, -1 if it is missing, and the categories."""
    categorical = values if isinstance(values, pd.Categorical) else getattr(values, "array", None)
    if isinstance(categorical, pd.Categorical):
        return np.asarray(categorical.codes, dtype=np.intp), categorical.categories.tolist()
    codes, kinds = pd.factorize(np.fromiter(values, dtype=object, count=len(values)), use_na_sentinel=True)
    return np.asarray(codes, dtype=np.intp), kinds.tolist()


def _ratio(part: FloatArray, whole: FloatArray) -> FloatArray:
    result: FloatArray = np.where(whole > 0, part / np.maximum(whole, 1), np.nan)
    return result


def _at_least(hits: FloatArray, numbers: FloatArray, chance: float) -> FloatArray:
    """Return the probability of so many hits or more; NaN without any trial."""
    some = np.maximum(hits, 1)
    tail = special.betainc(some, np.maximum(numbers - some, 0) + 1, chance)
    result: FloatArray = np.where(numbers > 0, np.where(hits > 0, tail, 1.0), np.nan)
    return result


def _kappa(shares: FloatArray, n: float, confidence: float) -> tuple[float | None, tuple[float, float] | None]:
    rows, columns, same = shares.sum(axis=1), shares.sum(axis=0), np.diag(shares)
    expected = float(rows @ columns)
    if 1 - expected <= 1e-12:
        return None, None
    kappa = (float(same.sum()) - expected) / (1 - expected)
    own = float(same @ (1 - (rows + columns) * (1 - kappa)) ** 2)
    others = shares * (columns[:, None] + rows) ** 2
    rest = (1 - kappa) ** 2 * float(others.sum() - np.diag(others).sum())
    variance = (own + rest - (kappa - expected * (1 - kappa)) ** 2) / ((1 - expected) ** 2 * n)
    half = float(special.ndtri((1 + confidence) / 2)) * math.sqrt(max(variance, 0.0))
    return kappa, (max(kappa - half, -1.0), min(kappa + half, 1.0))


def _flags(names: tuple[str, ...], rows: FloatArray, columns: FloatArray, kappa: float | None) -> tuple[str, ...]:
    flags = []
    for what, lost, sums in (("intended", "recall", rows), ("chosen", "precision", columns)):
        never = [name for name, total in zip(names, sums, strict=True) if not total]
        if never:
            flags.append(f"Never {what}, and so without {lost}: {', '.join(never)}.")
    if kappa is None:
        flags.append("One category was always intended and always chosen, so that there is no kappa.")
    return tuple(flags)
