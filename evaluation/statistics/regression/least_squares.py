"""Linear least squares to nearly full precision, also for columns that are nearly combinations of each other."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from evaluation.statistics.arrays import FloatArray

_EPSILON = float(np.finfo(float).eps)
# Well-behaved problems lose no more than three digits, and are not worth a second look.
_WELL_BEHAVED = 30.0
_MOST_STEPS = 8
_TINY = float(np.finfo(float).tiny)
# Rows that are taken at a time, so few that they stay in the processor's cache.
_BLOCK = 2048
# Larger problems, by their number of products, have only their coefficients refined and not their standard errors.
_LARGE = 2e7
# 2**27 + 1: a product with it splits a number into two halves of 26 bits.
_SPLIT = 134217729.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """The solution of min ‖y - X b‖.

    Attributes
    ----------
    coefficients : numpy.ndarray, shape (p,)
        b.
    residuals : numpy.ndarray, shape (n,)
        y - X b.
    inverse : numpy.ndarray, shape (p, p)
        The inverse of XᵀX.
    """

    coefficients: FloatArray
    residuals: FloatArray
    inverse: FloatArray


class Factors(NamedTuple):
    """A matrix X as Q R times a power of two for each column.

    Attributes
    ----------
    A : numpy.ndarray, shape (n, p)
        X with its columns divided by the powers of two.
    scales : numpy.ndarray, shape (p,)
        The powers.
    Q, R : numpy.ndarray, shapes (n, p) and (p, p)
        A = Q R, the columns of Q orthonormal and R triangular.
    """

    A: FloatArray
    scales: FloatArray
    Q: FloatArray
    R: FloatArray

    def dependent_column(self) -> int | None:
        """Return the place of the first column that is zero or a combination of those before it, to rounding."""
        rests = np.abs(np.diagonal(self.R))
        limits = 16 * _EPSILON * math.sqrt(len(self.A)) * linalg.norm(self.R, axis=0)
        lost = np.flatnonzero(rests <= limits)
        return int(lost[0]) if lost.size else None


def factorise(X: FloatArray) -> Factors:
    """Return the factors of a matrix of finite numbers, shape (n, p), with n at least p, by Householder's QR."""
    largest = np.abs(X).max(axis=0)
    # Powers of two cost no digits.
    scales = np.ldexp(1.0, np.frexp(np.where(largest > 0, largest, 1.0))[1])
    A = X / scales
    Q, R = linalg.qr(A, mode="economic", check_finite=False)
    return Factors(A, scales, Q, R)


def solve(factors: Factors, y: FloatArray) -> Solution:
    """Solve min ‖y - X b‖ by QR, with iterative refinement where rounding would show.

    Residuals are formed with twice the digits, so that coefficients and standard errors are right to nearly all digits
    unless columns are combinations of each other to the last ones.

    Parameters
    ----------
    factors : Factors
        Those of X, whose columns must be independent (see `Factors.dependent_column`).
    y : numpy.ndarray, shape (n,)
        Finite numbers.

    Returns
    -------
    Solution
        Coefficients, residuals and the inverse of XᵀX.

    References
    ----------
    Björck (1967), Iterative refinement of linear least squares solutions I, BIT 7:257; products and sums with twice
    the digits by Dekker (1971), Numerische Mathematik 18:224.
    """
    A, scales, R = factors.A, factors.scales, factors.R
    size = math.ldexp(1.0, math.frexp(float(np.abs(y).max()))[1]) if y.any() else 1.0
    p = A.shape[1]
    rests = np.abs(np.diagonal(R))
    spread = float(rests.max() / rests.min())
    # The inverse solves the same system with other right-hand sides: r + A x = 0, Aᵀ r = -I.
    count = 1 + p if spread > _WELL_BEHAVED and A.size * p < _LARGE else 1
    f, g = np.zeros((len(y), count)), np.zeros((p, count))
    f[:, 0] = y / size
    g[:, 1:] = -np.eye(p)[:, : count - 1]
    r, x = _step(factors, f, g)
    if spread > _WELL_BEHAVED or linalg.norm(f[:, 0]) > _WELL_BEHAVED * linalg.norm(r[:, 0]):
        r, x = _refined(factors, f, g, (r, x))
    if count > 1:
        inverse = (x[:, 1:] + x[:, 1:].T) / 2
    else:
        opposite = linalg.solve_triangular(R, np.eye(p))
        inverse = opposite @ opposite.T
    return Solution(
        coefficients=x[:, 0] * size / scales,
        residuals=r[:, 0] * size,
        inverse=inverse / np.outer(scales, scales),
    )


def _step(factors: Factors, f: FloatArray, g: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve r + A x = f, Aᵀ r = g."""
    Q, R = factors.Q, factors.R
    inner = Q.T @ f - linalg.solve_triangular(R, g, trans="T")
    return f - Q @ inner, linalg.solve_triangular(R, inner)


def _refined(
    factors: Factors, f: FloatArray, g: FloatArray, found: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    (r, x), last = found, math.inf
    for _ in range(_MOST_STEPS):
        change_r, change_x = _step(factors, *_rests(factors.A, f, g, r, x))
        size = float((np.abs(change_x).max(axis=0) / np.maximum(np.abs(x).max(axis=0), _TINY)).max())
        if not size < last / 2:
            break
        r, x, last = r + change_r, x + change_x, size
    return r, x


def _rests(A: FloatArray, f: FloatArray, g: FloatArray, r: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return f - r - A x and g - Aᵀ r, with twice the digits inside."""
    above = np.empty_like(f)
    high, low = g.copy(), np.zeros_like(g)
    for start in range(0, len(A), _BLOCK):
        rows = slice(start, start + _BLOCK)
        above[rows] = _rest_above(A[rows], f[rows], r[rows], x)
        for place in range(r.shape[1]):
            total, rest = _sums(*_two_product(A[rows], -r[rows, place, None]))
            high[:, place], rounding = _two_sum(high[:, place], total)
            low[:, place] += rounding + rest
    return above, high + low


def _rest_above(A: FloatArray, f: FloatArray, r: FloatArray, x: FloatArray) -> FloatArray:
    high, low = _two_sum(f, -r)
    for column, values in zip(A.T, x, strict=True):
        product, error = _two_product(column[:, None], -values)
        high, rounding = _two_sum(high, product)
        low = low + (rounding + error)
    return high + low


def _sums(high: FloatArray, low: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sums of the rows, and what rounding took from them with the sums of `low`."""
    while len(high) > 1:
        half = (len(high) + 1) // 2
        rest = len(high) - half
        total, rounding = _two_sum(high[:rest], high[half:])
        high = np.concatenate([total, high[rest:half]])
        low = np.concatenate([low[:rest] + low[half:] + rounding, low[rest:half]])
    return high[0], low[0]


def _two_sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded sum and what rounding took from it."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _two_product(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded product and what rounding took from it."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    shifted = _SPLIT * a
    high = shifted - (shifted - a)
    return high, a - high
