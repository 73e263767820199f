"""Random intercepts of one or more crossed factors: the sums and the curvature that the Laplace approximation needs."""

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.label_codes import IntArray


class Intercepts:
    """Random intercepts, all of variance 1, that standard deviations bring to the scale of the linear predictor.

    Parameters
    ----------
    codes : sequence of numpy.ndarray of int, each of shape (m,)
        Level of each row in each factor; the factor with the most levels first, as its block of the curvature is
        diagonal and is eliminated.
    """

    def __init__(self, codes: Sequence[IntArray]) -> None:
        self.codes = tuple(codes)
        self.levels = [int(code.max()) + 1 for code in codes]
        self.offsets = [0, *np.cumsum(self.levels).tolist()]
        self.pairs = {
            (f, g): codes[f] * self.levels[g] + codes[g] for f in range(len(codes)) for g in range(f + 1, len(codes))
        }

    @property
    def number(self) -> int:
        """How many intercepts there are in all."""
        return int(self.offsets[-1])

    def part(self, values: FloatArray, f: int) -> FloatArray:
        """Return what belongs to factor `f` of a vector over all intercepts."""
        return values[self.offsets[f] : self.offsets[f + 1]]

    def spread(self, values: FloatArray, sds: FloatArray) -> FloatArray:
        """Return the sum of the intercepts of each row, each times its standard deviation."""
        total = np.zeros(self.codes[0].size)
        for f, code in enumerate(self.codes):
            total += (sds[f] * self.part(values, f))[code]
        return total

    def gather(self, rows: FloatArray, sds: FloatArray) -> FloatArray:
        """Return the sum over the rows of each intercept, times its standard deviation: the transpose of `spread`."""
        return np.concatenate([sds[f] * np.bincount(code, rows, self.levels[f]) for f, code in enumerate(self.codes)])

    def curvature(self, weights: FloatArray, sds: FloatArray) -> "Curvature":
        """Return I + S Z' W Z S, where W are the rows' weights and S the standard deviations."""
        return Curvature(self, weights, sds)


class Curvature:
    """The matrix I + S Z' W Z S of random intercepts, factored.

    The block D of the first factor is diagonal. With C the block between it and the others, and B that of the others,
    only the Schur complement B - C' D^-1 C is factored, as crossed linear mixed models do it.
    """

    def __init__(self, intercepts: Intercepts, weights: FloatArray, sds: FloatArray) -> None:
        self._of = intercepts
        self._sds = sds
        levels, offsets = intercepts.levels, [offset - intercepts.levels[0] for offset in intercepts.offsets[1:]]
        sums = [1 + sds[f] ** 2 * np.bincount(code, weights, levels[f]) for f, code in enumerate(intercepts.codes)]
        self._diagonal = sums[0]
        others = offsets[-1]
        cross, block = np.empty((levels[0], others)), np.zeros((others, others))
        block[np.diag_indices(others)] = np.concatenate([np.empty(0), *sums[1:]])
        for (f, g), pair in intercepts.pairs.items():
            together = np.bincount(pair, weights, levels[f] * levels[g]).reshape(levels[f], levels[g])
            together *= sds[f] * sds[g]
            columns = slice(offsets[g - 1], offsets[g])
            if f == 0:
                cross[:, columns] = together
            else:
                block[offsets[f - 1] : offsets[f], columns] = together
                block[columns, offsets[f - 1] : offsets[f]] = together.T
        self._scaled = cross / self._diagonal[:, None]
        self._cross = cross
        # Empty matrices (one factor) have no Cholesky factor.
        self._factor = linalg.cho_factor(block - cross.T @ self._scaled, lower=True) if others else None
        self.log_determinant = float(np.log(self._diagonal).sum())
        if self._factor is not None:
            self.log_determinant += 2 * float(np.log(np.diag(self._factor[0])).sum())

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the inverse times a vector."""
        first, rest = right[: self._diagonal.size], right[self._diagonal.size :]
        if self._factor is None:
            alone: FloatArray = first / self._diagonal
            return alone
        below = linalg.cho_solve(self._factor, rest - self._scaled.T @ first)
        return np.concatenate([first / self._diagonal - self._scaled @ below, below])

    def inverse_parts(self) -> tuple[FloatArray, FloatArray]:
        """Return the diagonal of the inverse, and the variance z S H^-1 S z' of each row's sum of intercepts."""
        codes, sds, levels = self._of.codes, self._sds, self._of.levels
        if self._factor is None:
            return 1 / self._diagonal, (sds[0] ** 2 / self._diagonal)[codes[0]]
        inverse = linalg.cho_solve(self._factor, np.eye(len(self._factor[0])))
        across = -self._scaled @ inverse
        first = 1 / self._diagonal - (across * self._scaled).sum(axis=1)
        diagonal = np.concatenate([first, np.diag(inverse)])
        variance = np.zeros(codes[0].size)
        for f, code in enumerate(codes):
            variance += (sds[f] ** 2 * self._of.part(diagonal, f))[code]
        offsets = [offset - levels[0] for offset in self._of.offsets[1:]]
        for (f, g), pair in self._of.pairs.items():
            columns = slice(offsets[g - 1], offsets[g])
            table = across[:, columns] if f == 0 else inverse[offsets[f - 1] : offsets[f], columns]
            variance += 2 * sds[f] * sds[g] * table.ravel()[pair]
        return diagonal, variance
