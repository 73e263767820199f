"""The one-factor model of correlations, by maximum likelihood or minimum residuals."""

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.arrays import FloatArray

Extraction = Literal["ml", "minres"]

LEAST_UNIQUENESS = 0.005
"""Uniquenesses are held at or above this share of an item's variance; one that ends there is a Heywood case."""

_SINGULAR = 1e-10
_STEPS = 200
_HALVINGS = 30
_FLAT = 1e-8


class OneFactor(NamedTuple):
    """One factor of standardised items.

    Attributes
    ----------
    loadings : numpy.ndarray, shape (items,)
        Correlation of each item with the factor; their sum is not negative.
    uniquenesses : numpy.ndarray, shape (items,)
        Share of each item's variance that the factor does not explain, 0.005 to 1.
    discrepancy : float
        What was made smallest: log|S| - log|R| + tr(R S^-1) - k (ml), or half the sum of squared residuals (minres).
    converged : bool
        Whether the gradient vanishes, but for uniquenesses held at a bound.
    """

    loadings: FloatArray
    uniquenesses: FloatArray
    discrepancy: float
    converged: bool

    @property
    def heywood(self) -> npt.NDArray[np.intp]:
        """Places of the items whose uniqueness is at its lower bound."""
        return np.flatnonzero(self.uniquenesses < 1.001 * LEAST_UNIQUENESS)


def fit_one_factor(correlations: FloatArray, *, extraction: Extraction) -> OneFactor:
    """Return the one-factor model that fits correlations best.

    Parameters
    ----------
    correlations : numpy.ndarray, shape (items, items)
        Correlations of three items or more.
    extraction : {"ml", "minres"}
        Maximum likelihood (Joreskog, 1967) or minimum residuals (Harman and Jones, 1966).

    Returns
    -------
    OneFactor
        Loadings and uniquenesses.

    Raises
    ------
    DataError
        If the extraction is not known.
    InsufficientDataError
        If there are fewer than three items, or (ml) some item is a sum of others.

    References
    ----------
    Joreskog (1967), Psychometrika 32:443, with loadings eliminated; Lawley and Maxwell (1971), Factor Analysis as a
    Statistical Method, chapter 4. Harman and Jones (1966), Psychometrika 31:351.
    """
    if extraction not in {"ml", "minres"}:
        raise DataError(f"extraction is {extraction!r}, but must be ml or minres.")
    items = len(correlations)
    if items < 3:
        raise InsufficientDataError(
            f"One factor cannot be found from {items} items; give Cronbach's alpha or the Spearman-Brown "
            "formula instead."
        )
    if extraction == "ml" and np.linalg.eigvalsh(correlations)[0] < _SINGULAR:
        raise InsufficientDataError("Some item is a sum of others, so that maximum likelihood has no solution.")
    # The discrepancy can have more than one minimum: two beginnings, of which the better end counts.
    others = np.abs(correlations - np.eye(items)).max(axis=0)
    starts = np.stack([1 - others**2, np.full(items, 0.5)])
    logs, discrepancy, converged = _minimise(np.stack([correlations] * 2), np.clip(starts, 0.01, 0.99), extraction)
    best = int(np.argmin(discrepancy))
    uniquenesses = np.exp(logs[best])
    loadings = _loadings(correlations[None], uniquenesses[None], extraction)[0]
    return OneFactor(loadings, uniquenesses, float(discrepancy[best]), bool(converged[best]))


def fit_many(
    correlations: FloatArray, *, extraction: Extraction, start: FloatArray
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """Return the one-factor models of many tables of correlations that resemble each other, as bootstrap samples do.

    Parameters
    ----------
    correlations : numpy.ndarray, shape (samples, items, items)
        Correlations of three items or more; positive definite (ml).
    extraction : {"ml", "minres"}
        As `fit_one_factor`.
    start : numpy.ndarray, shape (items,)
        Uniquenesses to begin with.

    Returns
    -------
    tuple of numpy.ndarray, shapes (samples, items), (samples, items) and (samples,)
        Loadings, uniquenesses, and whether each fit converged.
    """
    logs, _, converged = _minimise(
        correlations, np.tile(np.clip(start, 0.01, 0.99), (len(correlations), 1)), extraction
    )
    uniquenesses = np.exp(logs)
    return _loadings(correlations, uniquenesses, extraction), uniquenesses, converged


def _minimise(
    correlations: FloatArray, starts: FloatArray, extraction: Extraction
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """Return the logarithms of the best uniquenesses, the discrepancy there, and whether the gradient vanishes.

    Newton's method within bounds, on all samples at once: directions of negative curvature are turned round, and steps
    are halved until the discrepancy falls.
    """
    derivatives = _likelihood if extraction == "ml" else _residuals
    low, high = float(np.log(LEAST_UNIQUENESS)), 0.0
    logs, converged = np.log(starts), np.zeros(len(starts), dtype=bool)
    value, gradient, hessian = derivatives(logs, correlations)
    for _ in range(_STEPS):
        held = ((logs <= low) & (gradient > 0)) | ((logs >= high) & (gradient < 0))
        converged = np.abs(np.where(held, 0, gradient)).max(axis=1) < _FLAT
        if converged.all():
            break
        at = np.flatnonzero(~converged)
        step = _direction(gradient[at], hessian[at], held[at])
        size = np.ones(at.size)
        for _ in range(_HALVINGS):
            trial = np.clip(logs[at] + size[:, None] * step, low, high)
            fall = np.einsum("si,si->s", gradient[at], trial - logs[at])
            found = derivatives(trial, correlations[at])
            # What rounding alone may add is no rise.
            worse = found[0] > value[at] + 1e-4 * np.minimum(fall, 0) + 1e-13
            if not worse.any():
                break
            size[worse] /= 2
        logs[at] = trial
        value[at], gradient[at], hessian[at] = found
    return logs, value, converged


def _direction(gradient: FloatArray, hessian: FloatArray, held: npt.NDArray[np.bool_]) -> FloatArray:
    free = ~held
    block = hessian * (free[:, :, None] & free[:, None, :])
    roots, vectors = np.linalg.eigh(block)
    sizes = np.maximum(np.abs(roots), 1e-6 * np.maximum(np.abs(roots).max(axis=1, keepdims=True), 1e-12))
    along = np.einsum("sij,si->sj", vectors, gradient * free) / sizes
    step = -np.einsum("sij,sj->si", vectors, along) * free
    # No uniqueness changes more than e-fold in one step.
    shortened: FloatArray = step / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1)
    return shortened


def _likelihood(logs: FloatArray, correlations: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the discrepancy, and its first and second derivatives by the logarithms of the uniquenesses.

    They come from the derivatives of the roots and vectors of the correlations scaled by the uniquenesses.
    """
    scale = np.exp(-logs / 2)
    roots, vectors = np.linalg.eigh(correlations * scale[:, :, None] * scale[:, None, :])
    rest, largest = np.maximum(roots[:, :-1], 1e-300), roots[:, -1:]
    others, first = vectors[:, :, :-1], vectors[:, :, -1]
    slope = (1 - rest) * (largest + rest) / np.maximum(largest - rest, 1e-8)
    hessian = _outer(others, rest) * _outer(others, np.ones_like(rest))
    hessian += first[:, :, None] * first[:, None, :] * _outer(others, slope)
    gradient = np.einsum("sim,sm->si", others**2, 1 - rest)
    return (rest - np.log(rest) - 1).sum(axis=1), gradient, hessian


def _residuals(logs: FloatArray, correlations: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return half the sum of squared residuals, and its derivatives as `_likelihood`."""
    uniquenesses = np.exp(logs)
    diagonal = np.eye(logs.shape[1]) * uniquenesses[:, None, :]
    roots, vectors = np.linalg.eigh(correlations - diagonal)
    rest, largest = roots[:, :-1], roots[:, -1:]
    others, first = vectors[:, :, :-1], vectors[:, :, -1]
    slope = -2 * rest / np.maximum(largest - rest, 1e-8)
    hessian = _outer(others, np.ones_like(rest)) ** 2
    hessian += first[:, :, None] * first[:, None, :] * _outer(others, slope)
    gradient = -uniquenesses * np.einsum("sim,sm->si", others**2, rest)
    hessian = hessian * uniquenesses[:, :, None] * uniquenesses[:, None, :] + np.eye(logs.shape[1]) * gradient[:, None]
    return (rest**2).sum(axis=1) / 2, gradient, hessian


def _outer(vectors: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the sum of the vectors' outer products, each times its weight."""
    products: FloatArray = np.matmul(vectors * weights[:, None, :], vectors.transpose(0, 2, 1))
    return products


def _loadings(correlations: FloatArray, uniquenesses: FloatArray, extraction: Extraction) -> FloatArray:
    """Return the loadings of each sample, turned so that their sum is not negative."""
    if extraction == "minres":
        diagonal = np.eye(uniquenesses.shape[1]) * uniquenesses[:, None, :]
        roots, vectors = np.linalg.eigh(correlations - diagonal)
        loadings = vectors[:, :, -1] * np.sqrt(np.maximum(roots[:, -1:], 0))
    else:
        scale = np.sqrt(uniquenesses)
        roots, vectors = np.linalg.eigh(correlations / (scale[:, :, None] * scale[:, None, :]))
        loadings = scale * vectors[:, :, -1] * np.sqrt(np.maximum(roots[:, -1:] - 1, 0))
    turned: FloatArray = loadings * np.where(loadings.sum(axis=1, keepdims=True) < 0, -1, 1)
    return turned
