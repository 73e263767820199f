"""Linear least squares by a QR decomposition, never by an inverse."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from synth.errors import SpecError

Floats = NDArray[np.float64]

_REFINEMENTS = 3
_RANK_TOLERANCE = 1e-13


def least_squares(terms: Floats, values: Floats) -> Floats:
    """Return the coefficients with which terms come nearest to values.

    Householder's QR decomposition of the terms, each scaled to length 1, with the columns in an order that shows how
    many of them are independent; then a few steps of iterative refinement, whose residuals are summed in extended
    precision (Björck 1967). A term that is a combination of others to the last digits gets the coefficient 0.

    Parameters
    ----------
    terms : (N, P)
        The regressors of each sample, a constant among them if there is to be one.
    values : (N, K)
        What is to be explained.

    Returns
    -------
    (P, K) float64

    Raises
    ------
    SpecError
        If the two differ in number, there are none, or one is not a finite number.
    """
    X, Y = np.asarray(terms, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if X.ndim != 2 or Y.ndim != 2 or len(X) != len(Y) or not len(X):
        raise SpecError(f"Least squares: terms {X.shape} and values {Y.shape} must be (N, P) and (N, K), N at least 1.")
    if not (np.isfinite(X).all() and np.isfinite(Y).all()):
        raise SpecError("Least squares: a term or value is not a finite number.")
    lengths = np.linalg.norm(X, axis=0)
    # A power of two scales without rounding.
    scale = 2.0 ** np.round(np.log2(np.where(lengths > 0.0, lengths, 1.0)))
    Q, R, order = qr(X / scale, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int((diagonal > _RANK_TOLERANCE * max(len(X), 1) ** 0.5 * diagonal.max(initial=0.0)).sum())
    chosen = order[:rank]
    used = X[:, chosen] / scale[chosen]
    Q, R = Q[:, :rank], R[:rank, :rank]
    exact_used, exact_values = used.astype(np.longdouble), Y.astype(np.longdouble)
    solution, residual = np.zeros((rank, Y.shape[1])), Y
    for _ in range(1 + _REFINEMENTS):
        solution = solution + solve_triangular(R, Q.T @ residual)
        residual = np.asarray(exact_values - exact_used @ solution.astype(np.longdouble), dtype=np.float64)
    result = np.zeros((X.shape[1], Y.shape[1]))
    result[chosen] = solution / scale[chosen][:, None]
    return result
