"""Annotation by consensus: what too few raters agree about goes to a discussion round."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.annotation.rounds import IntArray
from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording


@dataclass(frozen=True, kw_only=True, eq=False)
class Consensus:
    """What raters agree about.

    Attributes
    ----------
    values : numpy.ndarray, shape (samples,) or (samples, items)
        The label on which raters agree; where there is none, NaN if labels are numbers, and otherwise None.
    agreed : numpy.ndarray of bool, shape (samples,) or (samples, items)
        Where there is one.
    votes : numpy.ndarray of int, shape (samples,) or (samples, items)
        How many raters gave the most frequent label.
    given : numpy.ndarray of int, shape (samples,) or (samples, items)
        How many raters gave any label.
    disputed : numpy.ndarray of int
        Samples with an item without consensus, in their order: those to discuss.
    share : float
        Share of the samples that are not disputed.
    agree : int
        How many raters had to agree.
    raters : int
        How many raters there are.
    items : tuple of str
        Names of the items.
    """

    values: npt.NDArray[Any]
    agreed: npt.NDArray[np.bool_]
    votes: IntArray
    given: IntArray
    disputed: IntArray
    share: float
    agree: int
    raters: int
    items: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.agreed)

    def summary(self) -> str:
        """Return how many samples have a consensus; where there are several items, their shares follow.

        For instance ``At least 2 of 3 raters agree on 88 of 94 samples (94%); 6 are disputed.``
        """
        settled = self.samples - self.disputed.size
        text = (
            f"At least {self.agree} of {self.raters} raters agree on {settled} of {self.samples} samples "
            f"({_percent(self.share)}); {self.disputed.size} are disputed."
        )
        if len(self.items) == 1:
            return text
        shares = (_percent(float(share)) for share in self.agreed.mean(axis=0))
        return (
            f"{text} By item: {', '.join(f'{name} {share}' for name, share in zip(self.items, shares, strict=True))}."
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each sample and item: sample (from 0), item, value, votes, given, agreed."""
        k = len(self.items)
        return pd.DataFrame(
            {
                "sample": np.repeat(np.arange(self.samples), k),
                "item": list(self.items) * self.samples,
                "value": self.values.reshape(-1),
                "votes": self.votes.reshape(-1),
                "given": self.given.reshape(-1),
                "agreed": self.agreed.reshape(-1),
            }
        )


def consensus(labels: npt.ArrayLike, *, agree: int = 2, items: Sequence[str] | None = None) -> Consensus:
    """Return the labels on which enough raters agree, and the samples on which they do not.

    The consensus on an item is its most frequent label, if at least `agree` raters gave it and no other label is as
    frequent: of four raters who are divided 2 : 2 nobody prevails, while 2 : 1 : 1 is enough for `agree` = 2.

    Parameters
    ----------
    labels : array_like, shape (samples, raters) or (samples, raters, items)
        Numbers or texts; None or NaN where one is missing, which agrees with nothing.
    agree : int
        How many raters must give the same label, at least 2.
    items : sequence of str, optional
        Names of the items; left out, "1", "2" and so on.

    Returns
    -------
    Consensus
        Its arrays have an axis of items only if the labels have one.

    Raises
    ------
    DataError
        If the labels have another number of axes, or the names do not fit.
    InsufficientDataError
        If there are no samples or items, or fewer raters than must agree.

    References
    ----------
    Jia et al. (2013), section 2.2: at least two of three annotators agree on the P and A values of 94 % of 94 prosodic
    words.
    """
    given = _array(labels)
    if given.ndim not in {2, 3}:
        raise DataError(f"The labels have the shape {given.shape}, but must have samples x raters (x items).")
    stack = given[:, :, None] if given.ndim == 2 else given
    samples, raters, number = stack.shape
    if agree < 2:
        raise DataError(f"agree is {agree}, but must be at least 2: one rater alone agrees with nobody.")
    if not samples or not number or raters < agree:
        raise InsufficientDataError(
            f"A consensus of {agree} needs that many raters and at least one sample and item; there are {samples} "
            f"samples, {raters} raters and {number} items."
        )
    names = tuple(items) if items is not None else tuple(str(place + 1) for place in range(number))
    if len(names) != number:
        raise DataError(f"There are {number} items, but {len(names)} names.")
    flat, kinds = pd.factorize(stack.reshape(-1), use_na_sentinel=True)
    winner, votes, rivals = _count(np.asarray(flat, dtype=np.intp).reshape(stack.shape))
    agreed = (votes >= agree) & (rivals == 1)
    # The last stands for no consensus: NaN as a number, and None as an object.
    endings = np.empty(len(kinds) + 1, dtype=stack.dtype)
    endings[:-1], endings[-1] = kinds, None
    values = endings[np.where(agreed, winner, -1)]
    disputed = ~agreed.all(axis=1)
    shape = (samples,) if given.ndim == 2 else (samples, number)
    return Consensus(
        values=values.reshape(shape),
        agreed=agreed.reshape(shape),
        votes=votes.reshape(shape),
        given=(flat.reshape(stack.shape) >= 0).sum(axis=1).reshape(shape),
        disputed=np.flatnonzero(disputed),
        share=float(1 - disputed.mean()),
        agree=agree,
        raters=raters,
        items=names,
    )


def _array(labels: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return labels as floats if all are numbers, and otherwise as objects."""
    found = np.asarray(labels, dtype=object)
    try:
        return found.astype(float) if not any(isinstance(label, str) for label in found.flat) else found
    except (TypeError, ValueError):
        return found


def _count(codes: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the first most frequent code over the raters, how often it is, and how many codes are as frequent.

    Parameters
    ----------
    codes : numpy.ndarray of int, shape (samples, raters, items)
        Kinds of label from 0; -1 where one is missing.
    """
    samples, raters, items = codes.shape
    # How often each rater's own label was given: as many comparisons as raters squared, and none with all kinds.
    support = np.zeros(codes.shape, dtype=np.intp)
    for rater in range(raters):
        support += codes == codes[:, rater : rater + 1]
    support[codes < 0] = 0
    place = support.argmax(axis=1)[:, None]
    votes = np.take_along_axis(support, place, axis=1)
    winner = np.take_along_axis(codes, place, axis=1)
    # As many raters stand behind the most frequent labels together as labels are that frequent, times their votes.
    behind = (support == votes).sum(axis=1, keepdims=True)
    rivals = np.where(votes > 0, behind // np.maximum(votes, 1), 0)
    return winner.reshape(samples, items), votes.reshape(samples, items), rivals.reshape(samples, items)


def _percent(share: float) -> str:
    """Return a share in percent, with more digits where it would otherwise round to all."""
    digits = next((digits for digits in range(4) if share == 1 or round(100 * share, digits) < 100), 4)
    return f"{wording.number(100 * share, digits)}%"
