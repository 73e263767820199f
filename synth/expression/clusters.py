"""K-means of partial expression parameters: the groups into which expressions fall by themselves (ACII 2007, 4.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster import vq

from synth.errors import SpecError

Floats = NDArray[np.float64]

LARGEST = 1e6
"""Largest size of a value; PEPs lie in [-1, 1], measured ones a little beyond."""

_ITERATIONS = 20
_ROUNDS = 50
_DECIMALS = 12


@dataclass(frozen=True, eq=False)
class Clusters:
    """Groups of samples, the largest first; of equally large ones that with the smaller first coordinate.

    Attributes
    ----------
    centres : (k, K) float64
        Mean of each cluster's samples, in the samples' own units.
    labels : (N,) int64
        Cluster of each sample, 0 to k - 1; every cluster has at least one.
    sizes : (k,) int64
        Samples in each cluster.
    inertia : float
        Within-cluster sum of squared distances to the centres, in the units in which was clustered.
    standardised : bool
        Whether each parameter was divided by its standard deviation before.
    """

    centres: Floats
    labels: NDArray[np.int64]
    sizes: NDArray[np.int64]
    inertia: float
    standardised: bool


def k_means(
    samples: NDArray[np.floating] | Floats,
    k: int = 7,
    *,
    rng: np.random.Generator,
    restarts: int = 100,
    standardise: bool = False,
) -> Clusters:
    """Part samples into k clusters by k-means.

    Parameters
    ----------
    samples : (N, K) float
        PEPs, one row for each expression.
    k : int
        Number of clusters; the paper has seven, for seven emotions.
    rng : numpy.random.Generator
        Where the starts are drawn from.
    restarts : int
        Starts by k-means++, each followed to its end; the smallest within-cluster sum of squares is kept.
    standardise : bool
        Divide each parameter by its standard deviation first, so that those that move little count as much as those
        that move far; one that does not move stays as it is. The paper does not say; its PEPs had one range already,
        so the default leaves them.

    Returns
    -------
    Clusters
        The same, but for the order of the labels, in whatever order the samples come.

    Raises
    ------
    SpecError
        If the samples are not a table of finite numbers, fewer of them differ than there are to be clusters, or an
        option is out of range.

    Notes
    -----
    Lloyd's algorithm (`scipy.cluster.vq.kmeans2`) with the starts of Arthur and Vassilvitskii (2007), k-means++. It
    finds a local minimum; more restarts make the global one likelier.
    """
    table = _check(samples, k, restarts)
    # In an order of their own, the samples meet the same random numbers however they were given.
    order = np.lexsort(table.T[::-1])
    ordered = table[order]
    points = _scaled(ordered, standardise)
    distinct = len(np.unique(points, axis=0))
    if distinct < k:
        raise SpecError(f"Clusters: {distinct} different samples cannot make {k} clusters; give more or ask for fewer.")
    labels = _best(points, k, rng, restarts)
    centres = _means(ordered, labels, k)
    rank = np.lexsort([*centres.T[::-1], -np.bincount(labels, minlength=k)])
    labels = np.argsort(rank)[labels]
    in_units = ordered / _deviations(ordered) if standardise else ordered
    found = np.empty(len(table), dtype=np.int64)
    found[order] = labels
    return Clusters(
        centres=centres[rank],
        labels=found,
        sizes=np.bincount(labels, minlength=k).astype(np.int64),
        inertia=_inertia(in_units, labels, k),
        standardised=standardise,
    )


def _check(samples: NDArray[np.floating] | Floats, k: int, restarts: int) -> Floats:
    # Adding 0.0 turns -0.0 into 0.0, which would otherwise be sorted by chance.
    table = np.asarray(samples, dtype=np.float64) + 0.0
    if table.ndim != 2 or 0 in table.shape:
        raise SpecError(f"Clusters: the samples have shape {table.shape}, but must be (N, K) with at least one value.")
    if not (np.abs(table) <= LARGEST).all():
        row, column = np.argwhere(~(np.abs(table) <= LARGEST))[0]
        raise SpecError(
            f"Clusters: the value {table[row, column]} in row {row}, column {column} is not a number of at most "
            f"{LARGEST:g} in size."
        )
    for name, value in (("clusters", k), ("restarts", restarts)):
        if value < 1:
            raise SpecError(f"Clusters: {value} {name} are asked for, but at least 1 must be.")
    return table


def _deviations(table: Floats) -> Floats:
    """Return each column's standard deviation (K,), 1 for a column that is constant but for rounding."""
    sd = table.std(axis=0)
    return np.where(sd > 1e-9 * np.abs(table).max(axis=0), sd, 1.0)


def _scaled(table: Floats, standardise: bool) -> Floats:
    """Return the samples about their mean in units of the largest deviation, so that squares keep their digits."""
    points = table / _deviations(table) if standardise else table
    points = points - points.mean(axis=0)
    largest = np.abs(points).max()
    # Samples that differ by less than a rounding error count as one: no cluster is to be split by it.
    return np.asarray(np.round(points / largest if largest > 0.0 else points, _DECIMALS) + 0.0, dtype=np.float64)


def _best(points: Floats, k: int, rng: np.random.Generator, restarts: int) -> NDArray[np.int64]:
    best: NDArray[np.int64] | None = None
    least = np.inf
    for _ in range(restarts):
        labels = _settled(points, k, rng)
        if labels is not None and (inertia := _inertia(points, labels, k)) < least:
            best, least = labels, inertia
    if best is None:
        raise SpecError(
            f"Clusters: a cluster ran empty in each of {restarts} restarts with {k} clusters; ask for more restarts or "
            "for fewer clusters."
        )
    return best


def _settled(points: Floats, k: int, rng: np.random.Generator) -> NDArray[np.int64] | None:
    """Return the labels (N,) at which one start comes to rest; None if a cluster ran empty on the way."""
    try:
        centres, labels = vq.kmeans2(points, k, iter=_ITERATIONS, minit="++", missing="raise", rng=rng)
        for _ in range(_ROUNDS):
            before = labels
            centres, labels = vq.kmeans2(points, centres, iter=_ITERATIONS, minit="matrix", missing="raise")
            if np.array_equal(before, labels):
                break
    except vq.ClusterError:
        return None
    return np.asarray(labels, dtype=np.int64)


def _means(table: Floats, labels: NDArray[np.int64], k: int) -> Floats:
    return np.array([table[labels == cluster].mean(axis=0) for cluster in range(k)])


def _inertia(table: Floats, labels: NDArray[np.int64], k: int) -> float:
    return float(np.sum((table - _means(table, labels, k)[labels]) ** 2))
