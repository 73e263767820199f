"""Votes for categories: how many raters chose each, and which was chosen most."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
import pandas as pd

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.result import Result


@dataclass(frozen=True, kw_only=True)
class Votes(Result):
    """How raters chose among categories.

    Attributes
    ----------
    labels : tuple of str
        The categories, in the order given, also those that nobody chose.
    counts : tuple of int
        Votes for each.
    n : int
        Votes in all.
    """

    labels: tuple[str, ...]
    counts: tuple[int, ...]
    n: int

    @property
    def shares(self) -> tuple[float, ...]:
        """Return the share of the votes that each category has; they sum to 1."""
        return tuple(count / self.n for count in self.counts)

    @property
    def leading(self) -> tuple[str, ...]:
        """Return the category with the most votes, or all those that tie for it."""
        most = max(self.counts)
        return tuple(label for label, count in zip(self.labels, self.counts, strict=True) if count == most)

    @property
    def majority(self) -> str | None:
        """Return the category with more votes than any other (a relative majority); None if several tie."""
        return self.leading[0] if len(self.leading) == 1 else None

    @property
    def absolute(self) -> bool:
        """Tell whether one category has more than half of the votes."""
        return 2 * max(self.counts) > self.n

    def apa(self) -> str:
        """Return the result in words, for instance ``majority Happy (6 of 9, share .67)``."""
        most = max(self.counts)
        figures = f"{most} of {self.n}, share {wording.share(most / self.n)}"
        if self.majority is not None:
            return f"majority {self.majority} ({figures})"
        return f"tie of {', '.join(self.leading)} ({figures}, each)"

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each category: label, votes, share and whether it leads, alone or in a tie."""
        return pd.DataFrame(
            {
                "label": list(self.labels),
                "votes": list(self.counts),
                "share": list(self.shares),
                "leading": [label in self.leading for label in self.labels],
            }
        )


def votes(labels: Mapping[int, str], values: Iterable[int]) -> Votes:
    """Count votes.

    Parameters
    ----------
    labels : mapping of int to str
        The name of each category by the value that stands for it in the answers; no name twice.
    values : iterable of int
        The value that each rater chose; a rater without an answer is left out.

    Returns
    -------
    Votes
        Counts, shares and the majority.

    Raises
    ------
    DataError
        If a value stands for no category, or two categories have the same name.
    InsufficientDataError
        If there are no votes.
    """
    if len(set(labels.values())) < len(labels):
        raise DataError("Two categories have the same name, but each must have its own.")
    counts = dict.fromkeys(labels, 0)
    for value in values:
        if value not in counts:
            known = ", ".join(str(one) for one in labels)
            raise DataError(f"There is a vote for {value!r}, which is no category; there are {known}.")
        counts[value] += 1
    return votes_of_counts(list(labels.values()), list(counts.values()))


def votes_of_counts(labels: Sequence[str], counts: Sequence[int]) -> Votes:
    """Return votes that were counted already.

    Parameters
    ----------
    labels : sequence of str, length k
        The name of each category; no name twice.
    counts : sequence of int, length k
        Votes for each, 0 or more.

    Returns
    -------
    Votes
        Counts, shares and the majority.

    Raises
    ------
    DataError
        If the two differ in length, a count is no whole number of 0 or more, or two categories have the same name.
    InsufficientDataError
        If there are no votes.
    """
    if len(labels) != len(counts):
        raise DataError(f"There are {len(labels)} categories, but {len(counts)} counts.")
    if len(set(labels)) < len(labels):
        raise DataError("Two categories have the same name, but each must have its own.")
    for label, count in zip(labels, counts, strict=True):
        is_number = isinstance(count, Real | np.bool_)
        if not (is_number and math.isfinite(count) and count >= 0 and count == int(count)):
            raise DataError(f"{label} has {count!r} votes, but must have a whole number of 0 or more.")
    total = sum(int(count) for count in counts)
    if not total:
        raise InsufficientDataError("There are no votes; at least one is needed.")
    return Votes(labels=tuple(labels), counts=tuple(int(count) for count in counts), n=total)
