"""Fleiss' kappa: agreement of many raters on categories."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, check_confidence
from evaluation.statistics.label_codes import label_codes
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result

_BATCH = 2_000_000


@dataclass(frozen=True, kw_only=True)
class CategoryKappa:
    """Agreement on one category against all others.

    Attributes
    ----------
    category : hashable
        Its name.
    share : float
        Share of the labels that name it, 0 to 1.
    kappa : float or None
        Kappa of the category; None if it has no labels or all of them.
    se, z, p : float or None
        Standard error if there were no agreement, kappa over it, and the two-sided p value; None as for kappa, and if
        items differ in their number of labels.
    """

    category: Hashable
    share: float
    kappa: float | None
    se: float | None
    z: float | None
    p: float | None


@dataclass(frozen=True, kw_only=True)
class FleissKappa(Result):
    """Fleiss' kappa.

    Attributes
    ----------
    kappa : float
        Agreement beyond chance: 1 if perfect, 0 if as by chance.
    p_bar, p_e : float
        Mean agreement of pairs of labels on an item, and what chance would give.
    items : int
        Number of items with two labels or more.
    labels_per_item : tuple of int
        Smallest and largest number of labels of an item.
    se, z, p : float or None
        Standard error if there were no agreement beyond chance, kappa over it, and the two-sided p value; None if items
        differ in their number of labels. This standard error is for the test and gives no interval.
    ci : tuple of float, or None
        Bootstrap interval; None if none was asked for.
    confidence : float
        Confidence of the interval.
    replicates : int
        Bootstrap samples that the interval comes from.
    categories : tuple of CategoryKappa
        Agreement on each category.
    """

    kappa: float
    p_bar: float
    p_e: float
    items: int
    labels_per_item: tuple[int, int]
    se: float | None
    z: float | None
    p: float | None
    ci: tuple[float, float] | None
    confidence: float
    replicates: int
    categories: tuple[CategoryKappa, ...]

    def apa(self) -> str:
        """Return a sentence, for instance ``Fleiss' kappa (10 items, 14 labels each) = .21, z = 17.65, p < .001.``."""
        low, high = self.labels_per_item
        labels = f"{low} labels each" if low == high else f"{low} to {high} labels each"
        text = f"Fleiss' kappa ({self.items} items, {labels}) = {wording.share(self.kappa)}"
        if self.ci is not None:
            text = f"{text}, {wording.interval(*self.ci, confidence=self.confidence, bounded=True)}"
        if self.z is not None and self.p is not None:
            text = f"{text}, z = {wording.number(self.z)}, {wording.p_value(self.p)}"
        return f"{text}."

    def to_frame(self) -> pd.DataFrame:
        """Return a row for all categories together, named ``all``, and one for each; NaN where there is no value."""
        low, high = self.ci or (math.nan, math.nan)
        rows: list[tuple[Hashable, ...]] = [("all", 1.0, self.kappa, self.se, low, high, self.z, self.p)]
        rows += [
            (one.category, one.share, one.kappa, one.se, math.nan, math.nan, one.z, one.p) for one in self.categories
        ]
        frame = pd.DataFrame(rows, columns=["category", "share", "kappa", "se", "ci_low", "ci_high", "z", "p"])
        numbers = frame.columns[1:]
        return frame.astype(dict.fromkeys(numbers, float))


def fleiss_kappa(
    counts: npt.ArrayLike,
    *,
    categories: Sequence[Hashable] | None = None,
    rng: np.random.Generator | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
) -> FleissKappa:
    """Return Fleiss' kappa from the number of labels that each item got of each category.

    Parameters
    ----------
    counts : array_like, shape (items, categories)
        Whole numbers from 0.
    categories : sequence, optional
        Names of the categories; 1, 2 ... without it.
    rng : numpy.random.Generator, optional
        Source of bootstrap samples of the items; without it there is no interval.
    replicates : int
        Number of bootstrap samples, at least 100.
    confidence : float
        Confidence of the interval, between 0 and 1.

    Returns
    -------
    FleissKappa
        Kappa, its test, and the kappa of each category.

    Raises
    ------
    DataError
        If the counts are no table of whole numbers from 0, or an option is wrong.
    InsufficientDataError
        If fewer than two items have two labels, or all labels are the same.

    Notes
    -----
    Items may differ in their number of labels. Those with fewer than two are left out; each of the others counts once
    for the mean agreement and, with its shares of labels, once for the chance agreement, whatever its number of labels
    (Gwet, 2014). The published standard errors hold for equal numbers only, so that there are none otherwise.

    References
    ----------
    Fleiss (1971), Psychological Bulletin 76:378. Standard errors: Fleiss, Nee and Landis (1979), Psychological Bulletin
    86:974. Gwet (2014), Handbook of Inter-Rater Reliability, 4th edition.
    """
    check_confidence(confidence)
    if rng is not None and replicates < 100:
        raise DataError(f"replicates is {replicates}, but an interval needs at least 100.")
    table = finite_array(counts, axes=("items", "categories"), name="counts")
    if (table < 0).any() or (table != np.floor(table)).any():
        raise DataError("counts: a number of labels is no whole number from 0.")
    names = tuple(range(1, table.shape[1] + 1)) if categories is None else tuple(categories)
    if len(names) != table.shape[1]:
        raise DataError(f"The counts have {table.shape[1]} categories, but {len(names)} names.")
    kept = table[table.sum(axis=1) >= 2]
    if len(kept) < 2:
        raise InsufficientDataError(
            f"Fleiss' kappa needs at least 2 items with two labels or more; there {'is 1' if len(kept) else 'are 0'}."
        )
    return _fleiss(kept, names, len(table) - len(kept), (rng, replicates, confidence))


def fleiss_kappa_of_labels(
    labels: npt.ArrayLike,
    *,
    categories: Sequence[Hashable] | None = None,
    rng: np.random.Generator | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
) -> FleissKappa:
    """Return Fleiss' kappa from each rater's label of each item.

    Parameters
    ----------
    labels : array_like, shape (items, raters)
        Labels of any kind; None or NaN where a rater gave an item none.
    categories : sequence, optional
        All categories; those that occur without it.
    rng, replicates, confidence
        As `fleiss_kappa`.

    Returns
    -------
    FleissKappa
        As `fleiss_kappa` of the counts.

    Raises
    ------
    DataError
        If the labels are no table, or one is not among the categories.
    InsufficientDataError
        As `fleiss_kappa`.

    References
    ----------
    As `fleiss_kappa`.
    """
    coded = label_codes(labels, categories=categories, name="labels")
    if coded.codes.ndim != 2:
        raise DataError(f"labels has the shape {coded.codes.shape}, but must have items x raters.")
    counts = np.stack([(coded.codes == place).sum(axis=1) for place in range(len(coded.categories))] or [[]], axis=-1)
    return fleiss_kappa(
        counts, categories=coded.categories or None, rng=rng, replicates=replicates, confidence=confidence
    )


def _fleiss(
    counts: FloatArray,
    names: tuple[Hashable, ...],
    left_out: int,
    bootstrap: tuple[np.random.Generator | None, int, float],
) -> FleissKappa:
    each = counts.sum(axis=1)
    shares = counts / each[:, None]
    agreement = (counts * (counts - 1)).sum(axis=1) / (each * (each - 1))
    p_bar, margins = float(agreement.mean()), shares.mean(axis=0)
    if (counts.any(axis=0)).sum() < 2:
        raise InsufficientDataError("All labels are the same, so that Fleiss' kappa is not defined.")
    p_e = float(margins @ margins)
    kappa = (p_bar - p_e) / (1 - p_e)
    equal = bool((each == each[0]).all())
    se = _standard_error(margins, len(counts), float(each[0])) if equal else None
    rng, replicates, confidence = bootstrap
    flags = (
        [f"Left out, having fewer than two labels: {left_out} of {left_out + len(counts)} items."] if left_out else []
    )
    if not equal:
        flags.append(
            "Items differ in their number of labels; each counts once, and no standard error is known for that case."
        )
    ci, drawn = _bootstrap(agreement, shares, rng, replicates, confidence) if rng is not None else (None, 0)
    if rng is not None and drawn < replicates:
        flags.append(f"In {replicates - drawn} of {replicates} bootstrap samples all labels were the same.")
    return FleissKappa(
        kappa=kappa,
        p_bar=p_bar,
        p_e=p_e,
        items=len(counts),
        labels_per_item=(int(each.min()), int(each.max())),
        se=se,
        z=None if se is None else kappa / se,
        p=None if se is None else float(2 * stats.norm.sf(abs(kappa / se))),
        ci=ci,
        confidence=confidence,
        replicates=drawn,
        categories=tuple(_category(names[j], counts[:, j], each, equal=equal) for j in range(len(names))),
        flags=tuple(flags),
    )


def _standard_error(margins: FloatArray, items: int, raters: float) -> float | None:
    """Return the standard error of Fleiss, Nee and Landis (1979) if there is no agreement beyond chance."""
    products = margins * (1 - margins)
    inner = products.sum() ** 2 - (products * (1 - 2 * margins)).sum()
    if inner <= 0:
        return None
    return math.sqrt(2 * inner / (items * raters * (raters - 1))) / float(products.sum())


def _category(name: Hashable, counts: FloatArray, each: FloatArray, *, equal: bool) -> CategoryKappa:
    share = float((counts / each).mean())
    if not counts.any() or (counts == each).all():
        return CategoryKappa(category=name, share=share, kappa=None, se=None, z=None, p=None)
    apart = float((counts * (each - counts) / (each * (each - 1))).mean())
    kappa = 1 - apart / (share * (1 - share))
    if not equal:
        return CategoryKappa(category=name, share=share, kappa=kappa, se=None, z=None, p=None)
    se = math.sqrt(2 / (counts.size * float(each[0]) * (float(each[0]) - 1)))
    p = float(2 * stats.norm.sf(abs(kappa / se)))
    return CategoryKappa(category=name, share=share, kappa=kappa, se=se, z=kappa / se, p=p)


def _bootstrap(
    agreement: FloatArray, shares: FloatArray, rng: np.random.Generator, replicates: int, confidence: float
) -> tuple[tuple[float, float] | None, int]:
    """Return the percentile interval over samples of the items, and how many samples had a kappa."""
    items = agreement.size
    size = max(1, _BATCH // items)
    found = []
    for start in range(0, replicates, size):
        samples = min(size, replicates - start)
        drawn = rng.integers(items, size=(samples, items)) + items * np.arange(samples)[:, None]
        weights = np.bincount(drawn.ravel(), minlength=samples * items).reshape(samples, items) / items
        p_bar, p_e = weights @ agreement, ((weights @ shares) ** 2).sum(axis=1)
        sound = p_e < 1 - 1e-12
        found.append((p_bar[sound] - p_e[sound]) / (1 - p_e[sound]))
    kappas = np.concatenate(found)
    if kappas.size < 100:
        return None, kappas.size
    low, high = np.quantile(kappas, [(1 - confidence) / 2, (1 + confidence) / 2])
    return (float(low), float(high)), kappas.size
