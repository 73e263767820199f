"""The deviance of a linear mixed model, profiled over fixed effects and residual variance, with its derivatives.

The model is y = X beta + Z b + e with b of covariance sigma^2 T and e of covariance sigma^2 I (Bates, Mächler, Bolker
and Walker, 2015, Journal of Statistical Software 67(1)). With H = I + Z T Z' and
P = H^-1 - H^-1 X (X'H^-1X)^-1 X'H^-1, the deviance at the best beta and sigma is

    log|H| + nu (1 + log(2 pi y'Py / nu)), with nu = n,                    for maximum likelihood,
    log|H| + log|X'H^-1X| + the same with nu = n - p,                      for REML.

The leading term's columns of Z are eliminated block by block; what is left is a dense symmetric system with as many
rows as the other terms have columns. Derivatives are exact (Searle, Casella and McCulloch, 1992, Variance Components,
chapter 6): they need the traces of P Zi Zi' and of P Zi Zi' P Zj Zj', which are sums over the blocks of G = Z'PZ.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.mixed.covariance import CovarianceStructure
from evaluation.statistics.mixed.moments import Moments

EXPLAINED = (
    "Fixed and random effects explain the values exactly (the residual standard deviation is 0), so nothing is left to "
    "estimate errors from."
)

# What is left of y'y below this share is rounding.
_EXACT = 1e-11


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """The deviance at one theta, and what its derivatives are computed from.

    Attributes
    ----------
    theta : numpy.ndarray
        Parameters of all terms, the leading term's first.
    deviance : float
        -2 log likelihood.
    rss : float
        y'Py; over nu, the residual variance.
    reduced : numpy.ndarray, shape (e, e)
        E'E once the leading term is eliminated.
    reduced_y : numpy.ndarray, shape (e,)
        E'y once the leading term is eliminated.
    root : numpy.ndarray, shape (e, e)
        Lower Cholesky factor of the reduced system.
    """

    theta: FloatArray
    deviance: float
    rss: float
    reduced: FloatArray
    reduced_y: FloatArray
    root: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Derivatives:
    """Traces and quadratic forms by tau, the coefficients of the terms' covariances; Vi is dH / dtau_i.

    Attributes
    ----------
    trace : numpy.ndarray, shape (s,)
        tr(P Vi); tr(H^-1 Vi) for maximum likelihood.
    information : numpy.ndarray, shape (s, s)
        tr(P Vi P Vj); with H^-1 for P for maximum likelihood.
    quadratic : numpy.ndarray, shape (s,)
        y'P Vi P y.
    cross : numpy.ndarray, shape (s, s)
        y'P Vi P Vj P y.
    beta : numpy.ndarray, shape (p,)
        Fixed effects.
    unscaled : numpy.ndarray, shape (p, p)
        Their covariance (X'H^-1X)^-1, in units of the residual variance.
    unscaled_slopes : numpy.ndarray, shape (s, p, p)
        Its derivatives by tau.
    """

    trace: FloatArray
    information: FloatArray
    quadratic: FloatArray
    cross: FloatArray
    beta: FloatArray
    unscaled: FloatArray
    unscaled_slopes: FloatArray


class ProfiledDeviance:
    """The deviance as a function of theta.

    Parameters
    ----------
    data : Moments
        Sums of squares and products.
    structures : sequence of CovarianceStructure
        Those of the terms, the leading term's first.
    reml : bool
        Whether to restrict the likelihood.
    """

    def __init__(self, data: Moments, structures: Sequence[CovarianceStructure], *, reml: bool) -> None:
        self.data = data
        self.structures = tuple(structures)
        self.reml = reml
        self.nu = data.n - data.p if reml else data.n
        bounds = np.cumsum([0, *(structure.parameters for structure in self.structures)]).tolist()
        self.parts = tuple(slice(low, high) for low, high in itertools.pairwise(bounds))

    def solve(self, theta: FloatArray) -> Solution:
        """Return the deviance at theta.

        Raises
        ------
        InsufficientDataError
            If nothing but rounding is left of y: the residual variance is 0.
        """
        data = self.data
        factor, *others = self._factors(theta)
        inner = np.linalg.cholesky(factor.T @ data.leading @ factor + np.eye(len(factor)))
        half = factor @ np.linalg.inv(inner).transpose(0, 2, 1)
        explained = _times_blocks(data.others_leading, half).reshape(len(data.others), -1)
        explained_y = np.einsum("jba,jb->ja", half, data.leading_y).ravel()
        reduced = data.others - explained @ explained.T
        reduced_y = data.others_y - explained @ explained_y
        system = self._times(self._times(reduced, others).T, others)
        system[np.diag_indices(data.random.stop)] += 1
        try:
            root = linalg.cholesky(system, lower=True, overwrite_a=True, check_finite=False)
        except linalg.LinAlgError as error:
            # Only variances of more than 1e13 times the residual's let rounding make the system indefinite.
            raise InsufficientDataError(EXPLAINED) from error
        scaled_y = self._times(reduced_y[None], others)[0]
        projected = linalg.solve_triangular(root, scaled_y, lower=True, check_finite=False)
        rss = data.yy - float(explained_y @ explained_y) - float(projected @ projected)
        if rss <= _EXACT * data.yy:
            raise InsufficientDataError(EXPLAINED)
        diagonal = np.log(np.diag(root))
        determinant = float(np.log(np.diagonal(inner, axis1=1, axis2=2)).sum() + diagonal[data.random].sum())
        if self.reml:
            determinant += float(diagonal[data.fixed].sum())
        return Solution(
            theta=theta,
            deviance=2 * determinant + self.nu * (1 + math.log(2 * math.pi * rss / self.nu)),
            rss=rss,
            reduced=reduced,
            reduced_y=reduced_y,
            root=root,
        )

    def differentiate(self, solution: Solution) -> Derivatives:
        """Return what gradient, Hessian and Satterthwaite's method need at a solution."""
        data, random, fixed, reduced = self.data, self.data.random, self.data.fixed, solution.reduced
        first, *others = self._covariances(solution.theta)
        # (I + Z1'Z1 T1)^-1 and its like below are exact where a variance is many times the residual's.
        rest: FloatArray = np.asarray(np.linalg.inv(np.eye(len(first)) + first @ data.leading), dtype=float)
        weighted, own = _times_blocks(data.others_leading, rest), data.leading @ rest
        inverse = self._inverse(solution)
        coefficients = inverse @ solution.reduced_y
        regressed = linalg.solve(reduced[fixed, fixed], reduced[fixed, random], assume_a="pos").T
        pull = _Pull(reduced[random, random] - regressed @ reduced[fixed, random], others, self._times)
        # Z'Py, of the leading term (levels by effects) and of the others.
        pulled = np.einsum("jba,jb->ja", rest, data.leading_y) - np.tensordot(coefficients, weighted, axes=1)
        pulled_rest = pull(solution.reduced_y[random] - regressed @ solution.reduced_y[fixed])
        directions, directions_rest = self._directions(pulled, pulled_rest)
        seen = np.tensordot(weighted, directions, axes=2) + reduced[:, random] @ directions_rest
        turned = np.einsum("jab,jbs->jas", own, directions)
        turned += np.tensordot(weighted[random], directions_rest, axes=(0, 0))
        turned -= np.tensordot(weighted, inverse @ seen, axes=(0, 0))
        turned_rest = pull(seen[random] - regressed @ seen[fixed])
        cross = np.tensordot(directions, turned, axes=((0, 1), (0, 1))) + directions_rest.T @ turned_rest
        quadratic = np.tensordot(pulled, directions, axes=2) + pulled_rest @ directions_rest
        flat = weighted.reshape(len(weighted), -1)
        if self.reml:
            trace, information = self._traces(
                weighted, inverse @ flat, own, pull(flat[random] - regressed @ flat[fixed]), pull(pull.matrix)
            )
        else:
            plain = _Pull(reduced[random, random], others, self._times)
            only = self._inverse(solution, size=random.stop)
            trace, information = self._traces(
                weighted[random], only @ flat[random], own, plain(flat[random]), plain(plain.matrix)
            )
        return Derivatives(
            trace=trace,
            information=information,
            quadratic=quadratic,
            cross=(cross + cross.T) / 2,
            beta=coefficients[fixed],
            unscaled=inverse[fixed, fixed],
            unscaled_slopes=self._unscaled_slopes(np.tensordot(inverse[fixed], weighted, axes=1), pull(regressed).T),
        )

    def gradient(self, solution: Solution, found: Derivatives) -> tuple[FloatArray, FloatArray]:
        """Return gradient and Hessian of the deviance by theta."""
        ratio = self.nu / solution.rss
        slopes = found.trace - ratio * found.quadratic
        bends = (
            2 * ratio * found.cross
            - found.information
            - np.outer(found.quadratic, found.quadratic) * ratio / solution.rss
        )
        jacobian = self.jacobian(solution.theta)
        return slopes @ jacobian, jacobian.T @ bends @ jacobian + self._curvature(slopes)

    def joint_hessian(self, solution: Solution, found: Derivatives) -> FloatArray:
        """Return the Hessian by theta and the logarithm of the residual variance, without profiling the latter."""
        ratio = self.nu / solution.rss
        jacobian = self.jacobian(solution.theta)
        count = len(jacobian)
        hessian = np.empty((count + 1, count + 1))
        bends = 2 * ratio * found.cross - found.information
        curvature = self._curvature(found.trace - ratio * found.quadratic)
        hessian[:count, :count] = jacobian.T @ bends @ jacobian + curvature
        hessian[count, :count] = hessian[:count, count] = ratio * found.quadratic @ jacobian
        hessian[count, count] = self.nu
        return hessian

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Return the derivatives of tau by theta."""
        blocks = [structure.jacobian(theta[part]) for structure, part in zip(self.structures, self.parts, strict=True)]
        return np.asarray(linalg.block_diag(*blocks), dtype=float)

    def tau(self, theta: FloatArray) -> FloatArray:
        """Return the coefficients of all terms' covariances."""
        parts = [structure.tau(theta[part]) for structure, part in zip(self.structures, self.parts, strict=True)]
        return np.concatenate(parts)

    def _curvature(self, slopes: FloatArray) -> FloatArray:
        blocks = [
            np.tensordot(slopes[part], structure.curvature, axes=1)
            for structure, part in zip(self.structures, self.parts, strict=True)
        ]
        return np.asarray(linalg.block_diag(*blocks), dtype=float)

    def _factors(self, theta: FloatArray) -> list[FloatArray]:
        return [structure.factor(theta[part]) for structure, part in zip(self.structures, self.parts, strict=True)]

    def _covariances(self, theta: FloatArray) -> list[FloatArray]:
        return [structure.covariance(theta[part]) for structure, part in zip(self.structures, self.parts, strict=True)]

    def _times(self, matrix: FloatArray, factors: Sequence[FloatArray]) -> FloatArray:
        """Return a matrix with columns like those of E, times the factors of the other terms' covariances."""
        product = matrix.copy()
        for place, factor in zip(self.data.places, factors, strict=False):
            blocks = matrix[:, place].reshape(len(matrix), -1, len(factor))
            product[:, place] = (blocks @ factor if len(factor) > 1 else blocks * factor).reshape(len(matrix), -1)
        return product

    def _inverse(self, solution: Solution, *, size: int | None = None) -> FloatArray:
        """Return the inverse of the reduced system's first rows, with the factors multiplied back from both sides."""
        root = solution.root[:size, :size]
        lower = linalg.lapack.dpotri(root, lower=1)[0] if root.size else root
        inverse = np.tril(lower) + np.tril(lower, -1).T
        transposed = [factor.T for factor in self._factors(solution.theta)[1:]]
        return self._times(self._times(inverse, transposed).T, transposed)

    def _directions(self, pulled: FloatArray, pulled_rest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the basis matrices of every parameter times Z'Py, zero outside of the parameter's term."""
        count = self.parts[-1].stop
        leading = np.zeros((*pulled.shape, count))
        leading[:, :, self.parts[0]] = np.einsum("ja,sab->jbs", pulled, self.structures[0].basis)
        rest = np.zeros((pulled_rest.size, count))
        for structure, part, place in zip(self.structures[1:], self.parts[1:], self.data.places[:-1], strict=True):
            vectors = pulled_rest[place].reshape(-1, structure.width)
            rest[place, part] = np.einsum("ja,sab->jbs", vectors, structure.basis).reshape(-1, structure.parameters)
        return leading, rest

    def _traces(
        self, weighted: FloatArray, flat: FloatArray, own: FloatArray, between: FloatArray, within: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return traces and information from the blocks of G: the others' with the leading one, and among themselves.

        The leading term's own block, `own` less weighted' flat, is never formed.
        """
        first, *others = self.structures
        trace = np.empty(self.parts[-1].stop)
        information = np.empty((trace.size, trace.size))
        part = self.parts[0]
        trace[part], information[part, part] = self._leading_traces(weighted, flat.reshape(weighted.shape), own)
        terms = list(zip(others, self.parts[1:], self.data.places[:-1], strict=True))
        for number, (structure, rows, place) in enumerate(terms):
            block = _blocks(between[place], structure, first)
            information[rows, part] = _contract(block, structure, first)
            information[part, rows] = information[rows, part].T
            own_block = _blocks(within[place, place], structure, structure)
            trace[rows] = np.tensordot(structure.basis, np.einsum("jajb->ab", own_block), axes=2)
            for other, columns, other_place in terms[number:]:
                block = _blocks(within[place, other_place], structure, other)
                information[rows, columns] = _contract(block, structure, other)
                information[columns, rows] = information[rows, columns].T
        return trace, information

    def _leading_traces(self, weighted: FloatArray, flat: FloatArray, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        (size, levels, width), basis = weighted.shape, self.structures[0].basis
        diagonal = np.einsum("eja,ejb->jab", weighted, flat)
        trace = np.tensordot(basis, (own - diagonal).sum(axis=0), axes=2)
        owns = np.einsum("jab,sbc->sjac", own, basis)
        crossing = np.einsum("sjac,tjca->st", owns, np.einsum("jab,sbc->sjac", diagonal, basis))
        rows, columns = weighted.reshape(size * levels, width), flat.reshape(size, levels * width)
        products = [columns @ (rows @ matrix).reshape(size, levels * width).T for matrix in basis]
        outer = np.array([[np.einsum("ef,fe->", first, second) for second in products] for first in products])
        return trace, np.einsum("sjac,tjca->st", owns, owns) - crossing - crossing.T + outer

    def _unscaled_slopes(self, leading: FloatArray, rest: FloatArray) -> FloatArray:
        """Return the derivatives of (X'H^-1X)^-1 from the products of (X'H^-1X)^-1 X'H^-1 and Z."""
        blocks = [np.einsum("pja,sab,qjb->spq", leading, self.structures[0].basis, leading, optimize=True)]
        for structure, place in zip(self.structures[1:], self.data.places[:-1], strict=True):
            rows = rest[:, place].reshape(len(rest), -1, structure.width)
            blocks.append(np.einsum("pja,sab,qjb->spq", rows, structure.basis, rows, optimize=True))
        return np.concatenate(blocks)


class _Pull:
    """Multiplication by (I + N T)^-1, where N belongs to the terms that do not lead, and T is their covariance."""

    def __init__(
        self,
        matrix: FloatArray,
        covariances: Sequence[FloatArray],
        times: Callable[[FloatArray, Sequence[FloatArray]], FloatArray],
    ) -> None:
        self.matrix = matrix
        self._factors = linalg.lu_factor(np.eye(len(matrix)) + times(matrix, covariances), check_finite=False)

    def __call__(self, right: FloatArray) -> FloatArray:
        return np.asarray(linalg.lu_solve(self._factors, right, check_finite=False), dtype=float)


def _times_blocks(matrix: FloatArray, blocks: FloatArray) -> FloatArray:
    """Return rows of blocks times a block diagonal matrix, both shapes (rows, J, q) and (J, q, q)."""
    if blocks.shape[1] == 1:
        return matrix * blocks[None, :, :, 0]
    return np.asarray((matrix.transpose(1, 0, 2) @ blocks).transpose(1, 0, 2), dtype=float)


def _blocks(matrix: FloatArray, first: CovarianceStructure, second: CovarianceStructure) -> FloatArray:
    """Return a matrix of two terms' columns as levels by effects by levels by effects."""
    rows, columns = matrix.shape
    return matrix.reshape(rows // first.width, first.width, columns // second.width, second.width)


def _contract(block: FloatArray, first: CovarianceStructure, second: CovarianceStructure) -> FloatArray:
    """Return tr(G Ej G' Ei) for all basis matrices of two terms, where G is the block of the two."""
    rows, q, columns, r = block.shape
    flat = block.transpose(1, 3, 0, 2).reshape(q * r, rows * columns)
    sums = (flat @ flat.T).reshape(q, r, q, r)
    return np.asarray(np.einsum("abcd,iac,jbd->ij", sums, first.basis, second.basis), dtype=float)
