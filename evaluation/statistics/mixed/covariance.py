"""Covariances of random effects, relative to the residual variance, as functions of few parameters."""

from dataclasses import dataclass

import numpy as np

from evaluation.statistics.arrays import FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class CovarianceStructure:
    """A family of covariance matrices T(theta) of the q effects of one level.

    T is the sum of tau[i] * basis[i], and each tau[i] is the quadratic form theta' curvature[i] theta / 2, so that T is
    positive semidefinite for every theta, and the deviance is smooth in theta without bounds: a variance of zero is an
    ordinary stationary point.

    Attributes
    ----------
    basis : numpy.ndarray, shape (parameters, q, q)
        Symmetric matrices.
    curvature : numpy.ndarray, shape (parameters, parameters, parameters)
        Second derivatives of tau by theta.
    compound : bool
        Whether T is compound symmetric; otherwise any covariance matrix.
    """

    basis: FloatArray
    curvature: FloatArray
    compound: bool

    @property
    def parameters(self) -> int:
        """How many numbers theta has."""
        return len(self.basis)

    @property
    def width(self) -> int:
        """How many effects a level has: q."""
        return int(self.basis.shape[1])

    def tau(self, theta: FloatArray) -> FloatArray:
        """Return the coefficients of the basis, shape (parameters,)."""
        return np.asarray(self.curvature @ theta @ theta / 2, dtype=float)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Return the derivatives of tau (rows) by theta (columns)."""
        return np.asarray(self.curvature @ theta, dtype=float)

    def covariance(self, theta: FloatArray) -> FloatArray:
        """Return T, shape (q, q)."""
        return np.asarray(np.tensordot(self.tau(theta), self.basis, axes=1), dtype=float)

    def factor(self, theta: FloatArray) -> FloatArray:
        """Return a matrix whose product with its transpose is T, shape (q, q)."""
        q = self.width
        if self.compound:
            own, common = abs(theta[1]), theta[0] ** 2
            return np.asarray(own * np.eye(q) + (np.sqrt(own**2 + q * common) - own) / q, dtype=float)
        factor = np.zeros((q, q))
        factor[np.tril_indices(q)] = theta
        return factor

    def theta(self, tau: FloatArray, *, floor: float) -> FloatArray:
        """Return the theta whose tau is the one given, or the nearest without variances (eigenvalues) below `floor`."""
        if self.compound:
            return np.sqrt(np.maximum(tau, floor))
        values, vectors = np.linalg.eigh(np.tensordot(tau, self.basis, axes=1))
        return self._triangle(vectors * np.sqrt(np.maximum(values, floor)))

    def without_small(self, theta: FloatArray, *, limit: float) -> FloatArray:
        """Return theta with the variances (eigenvalues of T) below `limit` set to zero."""
        if self.compound:
            return np.where(theta**2 < limit, 0, np.abs(theta))
        values, vectors = np.linalg.eigh(self.covariance(theta))
        return self._triangle(vectors * np.sqrt(np.where(values < limit, 0, values)))

    def rank_deficient(self, theta: FloatArray) -> bool:
        """Return whether a variance, or the variance of a combination of effects, is zero."""
        if self.compound:
            return bool((theta == 0).any())
        values = np.linalg.eigvalsh(self.covariance(theta))
        return bool(values[0] <= 1e-10 * max(values[-1], 1e-300))

    def _triangle(self, root: FloatArray) -> FloatArray:
        """Return the lower triangle of the triangular root of `root` times its transpose, with a diagonal >= 0."""
        lower = np.transpose(np.linalg.qr(root.T)[1])
        lower = lower * np.where(np.diag(lower) < 0, -1, 1) + 0.0
        return np.asarray(lower[np.tril_indices(self.width)], dtype=float)


def unstructured(width: int) -> CovarianceStructure:
    """Return all covariance matrices of `width` effects; theta is the lower triangle of the Cholesky factor."""
    pairs = list(zip(*(place.tolist() for place in np.tril_indices(width)), strict=True))
    number = {pair: place for place, pair in enumerate(pairs)}
    basis = np.zeros((len(pairs), width, width))
    curvature = np.zeros((len(pairs),) * 3)
    for place, (row, column) in enumerate(pairs):
        basis[place, row, column] = basis[place, column, row] = 1
        for inner in range(column + 1):
            first, second = number[row, inner], number[column, inner]
            curvature[place, first, second] += 1
            curvature[place, second, first] += 1
    return CovarianceStructure(basis=basis, curvature=curvature, compound=False)


def compound_symmetric(width: int) -> CovarianceStructure:
    """Return covariances of `width` effects that share one part and have another of their own, all alike.

    The first theta is the standard deviation of the part in common, the second that of the effects' own.
    """
    basis = np.stack([np.ones((width, width)), np.eye(width)])
    curvature = np.zeros((2, 2, 2))
    curvature[0, 0, 0] = curvature[1, 1, 1] = 2
    return CovarianceStructure(basis=basis, curvature=curvature, compound=True)
