"""Scores from paired preferences: the model of Bradley and Terry."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import sparse, special, stats
from scipy.sparse import csgraph

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result

_MOST_STEPS = 500
_LARGEST_COUNT = 1e9
_SMALLEST_PRIOR = 0.01
_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True, eq=False)
class BradleyTerry(Result):
    """Scores of things that were compared two by two.

    Attributes
    ----------
    names : tuple of str
        What was compared, for instance conditions.
    counts : numpy.ndarray, shape (k, k)
        How often the row was preferred to the column, without `prior`.
    scores : numpy.ndarray, shape (k,)
        Natural logarithms of the worths; they sum to 0. The odds that i is preferred to j are exp(score i - score j).
    covariance : numpy.ndarray, shape (k, k)
        Their asymptotic covariance: the pseudo-inverse of Fisher's information, whose rows sum to 0.
    confidence : float
        Confidence of the intervals.
    prior : float
        How many preferences were added in each direction of each pair; 0: the scores are those of maximum likelihood.
    chi2, df, p : float, int, float
        Likelihood-ratio test of all scores being equal, without `prior`; with it, the three are NaN, 0 and NaN.
    """

    names: tuple[str, ...]
    counts: FloatArray
    scores: FloatArray
    covariance: FloatArray
    confidence: float
    prior: float
    chi2: float
    df: int
    p: float

    @property
    def comparisons(self) -> float:
        """Number of comparisons."""
        return float(self.counts.sum())

    @property
    def se(self) -> FloatArray:
        """Standard errors of the scores, shape (k,): from the mean of all; those of differences are in `difference`."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def ci(self) -> FloatArray:
        """Normal intervals of the scores, shape (k, 2)."""
        half = float(stats.norm.ppf((1 + self.confidence) / 2)) * self.se
        return np.column_stack([self.scores - half, self.scores + half])

    def difference(self, first: str, second: str) -> tuple[float, float]:
        """Return how much higher the first scores than the second, and the standard error of that."""
        i, j = self._place(first), self._place(second)
        variance = self.covariance[i, i] + self.covariance[j, j] - 2 * self.covariance[i, j]
        return float(self.scores[i] - self.scores[j]), math.sqrt(max(float(variance), 0.0))

    def probability(self, first: str, second: str) -> float:
        """Return the probability that the first is preferred to the second; 0.5 of a thing and itself."""
        return float(special.expit(self.difference(first, second)[0]))

    def apa(self) -> str:
        """Return the scores, the highest first, and the test.

        For instance ``B = 0.51 (SE 0.20), A = -0.51 (SE 0.20); 40 comparisons, all equal: χ²(1) = 7.05, p = .008``.
        """
        order = np.argsort(-self.scores, kind="stable")
        scores = ", ".join(
            f"{self.names[k]} = {wording.number(float(self.scores[k]))} (SE {wording.number(float(self.se[k]))})"
            for k in order
        )
        text = f"{scores}; {self.comparisons:g} comparisons"
        if self.prior:
            return f"{text}; {self.prior:g} preferences were added in each direction of each pair: no likelihood test"
        return f"{text}, all equal: χ²({self.df}) = {wording.number(self.chi2)}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each thing, in the order of the names: wins, losses, score, standard error, interval."""
        return pd.DataFrame(
            {
                "name": list(self.names),
                "wins": self.counts.sum(axis=1),
                "losses": self.counts.sum(axis=0),
                "score": self.scores,
                "se": self.se,
                "ci_low": self.ci[:, 0],
                "ci_high": self.ci[:, 1],
                "prior": self.prior,
            }
        )

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise DataError(f"Nothing is called {name!r}; there are {', '.join(self.names)}.")
        return self.names.index(name)


def bradley_terry(
    winners: Sequence[Hashable],
    losers: Sequence[Hashable],
    *,
    names: Sequence[Hashable] | None = None,
    confidence: float = 0.95,
    prior: float = 0.0,
) -> BradleyTerry:
    """Return scores from single preferences.

    Parameters
    ----------
    winners, losers : sequence, length n
        What was preferred in each comparison, and what it was preferred to.
    names : sequence, optional
        All things and their order; left out, those that occur, in the order in which they first do.
    confidence, prior
        As in `bradley_terry_of_counts`.

    Returns
    -------
    BradleyTerry
        Scores and standard errors.

    Raises
    ------
    DataError
        If the two differ in length, something is missing, is compared with itself or is not among the names, or as
        `bradley_terry_of_counts`.
    InsufficientDataError
        As `bradley_terry_of_counts`.
    """
    if len(winners) != len(losers):
        raise DataError(f"There are {len(winners)} winners and {len(losers)} losers; each comparison needs both.")
    both = np.fromiter([*winners, *losers], dtype=object, count=2 * len(winners))
    if pd.isna(both).any():
        place_of_gap = int(np.flatnonzero(pd.isna(both))[0]) % len(winners)
        raise DataError(f"The comparison at place {place_of_gap} lacks its winner or loser; leave it out first.")
    pairs = list(zip(winners, losers, strict=True))
    things = list(dict.fromkeys(thing for pair in pairs for thing in pair) if names is None else names)
    place = {thing: k for k, thing in enumerate(things)}
    for thing in both:
        if thing not in place:
            raise DataError(f"{thing!r} was compared, but is not among the names.")
    counts = np.zeros((len(things), len(things)))
    for winner, loser in pairs:
        counts[place[winner], place[loser]] += 1
    return bradley_terry_of_counts(counts, names=[str(thing) for thing in things], confidence=confidence, prior=prior)


def bradley_terry_of_counts(
    counts: npt.ArrayLike,
    *,
    names: Sequence[str] | None = None,
    confidence: float = 0.95,
    prior: float = 0.0,
) -> BradleyTerry:
    """Return scores from a table of preferences, by maximum likelihood.

    Parameters
    ----------
    counts : array_like, shape (k, k)
        How often the row was preferred to the column, whole numbers up to 1e9; 0 on the diagonal. A comparison without
        a preference may count as one half for each of both: the scores are then useful, their standard errors rough.
    names : sequence of str, optional
        Names of the things; left out, "1", "2" and so on.
    confidence : float
        Confidence of the intervals, between 0 and 1.
    prior : float
        Preferences to add in each direction of each pair, 0 or at least 0.01. With 0, scores must be identifiable; 0.5,
        say, gives scores to any table, drawn towards each other, which the result and its sentence say.

    Returns
    -------
    BradleyTerry
        Scores and standard errors.

    Raises
    ------
    DataError
        If the counts are no square table of such numbers, the names do not fit or are not unique, or `confidence` or
        `prior` is out of range.
    InsufficientDataError
        If there are fewer than two things; or if `prior` is 0 and the things fall into two groups of which the one was
        never preferred to the other, so that the likelihood has no maximum.

    Notes
    -----
    Comparisons count as independent. Several by the same rater are not quite, and the standard errors are then too
    small. The maximum is found by Newton's method with halved steps; the likelihood is concave, and the maximum unique
    exactly if the directed graph "was preferred to" is strongly connected.

    References
    ----------
    Bradley and Terry (1952), Biometrika 39:324. Ford (1957), Amer. Math. Monthly 64(8):28 (when there is a maximum).
    Hunter (2004), Ann. Statist. 32:384. Agresti (2002), Categorical Data Analysis, 2nd ed., section 10.6.
    """
    if not 0 < confidence < 1:
        raise DataError(f"confidence is {confidence}, but must lie between 0 and 1.")
    if prior != 0 and not _SMALLEST_PRIOR <= prior <= _LARGEST_COUNT:
        raise DataError(f"prior is {prior}, but must be 0 or from {_SMALLEST_PRIOR:g} to {_LARGEST_COUNT:g}.")
    table = finite_array(counts, axes=("preferred", "not preferred"), name="counts")
    known_as = _names(names, table)
    added = table + prior * (1 - np.eye(len(table)))
    _check_identifiable(added, known_as)
    scores = _maximum(added)
    # All scores equal is the likelihood at 0. Rounding may leave the difference a little below 0 when they are.
    chi2 = math.nan if prior else max(2 * (_log_likelihood(table, scores) - _log_likelihood(table, 0 * scores)), 0.0)
    df = 0 if prior else len(table) - 1
    return BradleyTerry(
        names=known_as,
        counts=table,
        scores=scores,
        covariance=_invert(_information(added, scores)),
        confidence=confidence,
        prior=float(prior),
        chi2=chi2,
        df=df,
        p=math.nan if prior else float(stats.chi2.sf(chi2, df)),
    )


def _names(names: Sequence[str] | None, table: FloatArray) -> tuple[str, ...]:
    k = len(table)
    if table.shape != (k, k):
        raise DataError(f"The counts have the shape {table.shape}, but as many rows as columns are needed.")
    if (table < 0).any() or (table > _LARGEST_COUNT).any() or (2 * table != np.round(2 * table)).any():
        raise DataError(f"The counts must be whole numbers, or halves, from 0 to {_LARGEST_COUNT:g}.")
    if np.diag(table).any():
        place = int(np.flatnonzero(np.diag(table))[0])
        raise DataError(f"Thing {place + 1} is compared with itself; the diagonal of the counts must be 0.")
    found = tuple(names) if names is not None else tuple(str(place + 1) for place in range(k))
    if len(found) != k:
        raise DataError(f"There are {k} things, but {len(found)} names.")
    if len(set(found)) != k:
        raise DataError("The names must differ from each other.")
    return found


def _check_identifiable(counts: FloatArray, names: tuple[str, ...]) -> None:
    if len(names) < 2:
        raise InsufficientDataError(f"Scores need at least two things that are compared; there are {len(names)}.")
    graph = sparse.csr_array(counts > 0)
    groups, member = csgraph.connected_components(graph, directed=True, connection="strong")
    if groups == 1:
        return
    parts, part = csgraph.connected_components(graph, directed=False)
    if parts > 1:
        one = ", ".join(name for name, of in zip(names, part, strict=True) if of == part[0])
        raise InsufficientDataError(
            f"{one}: never compared with any of the others, so that scores have no common scale."
        )
    # Some group has lost to nobody outside it, or there would be a circle and one group.
    for group in range(groups):
        inside = member == group
        if not counts[np.ix_(~inside, inside)].any():
            one = ", ".join(name for name, here in zip(names, inside, strict=True) if here)
            raise InsufficientDataError(
                f"{one}: none of the others was ever preferred to it, so that its score has no upper limit; "
                "a prior above 0 gives scores."
            )


def _maximum(counts: FloatArray) -> FloatArray:
    scores = np.zeros(len(counts))
    total = counts + counts.T
    for _ in range(_MOST_STEPS):
        value = _log_likelihood(counts, scores)
        gradient = (counts - total * special.expit(scores[:, None] - scores)).sum(axis=1)
        step = _invert(_information(counts, scores)) @ gradient
        # The square of Newton's decrement: twice what the step would gain if the likelihood were a parabola.
        gain = float(gradient @ step)
        rounding = _ROUNDING * (1 + abs(value))
        if gain <= rounding:
            # Newton's method doubles the digits with each step: one more, and nothing is left to gain.
            return _centred(scores + step)
        size = 1.0
        while _log_likelihood(counts, scores + size * step) < value + 1e-4 * size * gain - rounding:
            size /= 2
        scores = _centred(scores + size * step)
    raise InsufficientDataError("The preferences are too one-sided for scores; a prior above 0 gives some.")


def _centred(scores: FloatArray) -> FloatArray:
    result: FloatArray = scores - scores.mean()
    return result


def _log_likelihood(counts: FloatArray, scores: FloatArray) -> float:
    return float((counts * special.log_expit(scores[:, None] - scores)).sum())


def _information(counts: FloatArray, scores: FloatArray) -> FloatArray:
    differences = scores[:, None] - scores
    weights = (counts + counts.T) * special.expit(differences) * special.expit(-differences)
    result: FloatArray = np.diag(weights.sum(axis=1)) - weights
    return result


def _invert(information: FloatArray) -> FloatArray:
    """Return the pseudo-inverse of the information, whose rows sum to 0."""
    k = len(information)
    # A constant is added to make it regular, as large as the information is, so that no digits are lost.
    constant = float(np.trace(information)) / k
    return np.asarray(np.linalg.inv(information + constant / k), dtype=float) - 1 / (constant * k)
