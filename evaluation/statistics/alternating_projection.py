"""Qualities, biases and inconsistencies by alternating projection (Li et al., 2020; ITU-T P.910)."""

import numpy as np
import numpy.typing as npt

from evaluation.statistics.arrays import FloatArray

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

LEAST_VARIANCE = 1e-8
"""Added to variances, so that the weight of a rater without any residual is finite; as in the authors' own program."""


class AlternatingProjection:
    """The search for qualities, biases and inconsistencies of `evaluation.statistics.rater_model`.

    It works on what the plain means leave of the ratings, so that sums of squares stay exact.

    Parameters
    ----------
    scores : numpy.ndarray, shape (items, raters)
        Ratings, 0 where there is none.
    given : numpy.ndarray of bool, shape (items, raters)
        Which are there; at least one in each row and column.

    Attributes
    ----------
    quality, bias : numpy.ndarray, shapes (items,) and (raters,)
        The solution, once it was `run`.
    """

    def __init__(self, scores: FloatArray, given: BoolArray) -> None:
        self.complete = bool(given.all())
        self.mask = given.astype(float)
        self.per_item, self.per_rater = self.mask.sum(axis=1), self.mask.sum(axis=0)
        self.quality = scores.sum(axis=1) / self.per_item
        self.rest = (scores - self.quality[:, None]) * self.mask
        self.bias = self.rest.sum(axis=0) / self.per_rater
        self.rest = (self.rest - self.bias) * self.mask
        # The steps below change qualities and biases by `quality` and `bias` of the rest.
        self.squares = np.einsum("ji,ji->i", self.rest, self.rest)
        self.sums = self.rest.sum(axis=0)

    def run(self, tolerance: float, steps: int) -> tuple[int, bool]:
        """Take steps until the qualities change by less than the tolerance; return how many, and whether they do."""
        quality, bias = self._equal_weights(tolerance, steps)
        sums, squares = self._over_items(quality), self._over_items(quality**2)
        converged, step = False, 0
        while step < steps and not converged:
            step += 1
            # The sum of (rest - quality - bias) squared over the items of each rater.
            left = self.squares - 2 * (quality @ self.rest) - 2 * bias * self.sums
            left += squares + 2 * bias * sums + self.per_rater * bias**2
            weights = 1 / (np.maximum(left, 0) / self.per_rater + LEAST_VARIANCE)
            weighted = self.rest @ weights - self._over_raters(weights * bias)
            before, quality = quality, weighted / self._over_raters(weights)
            sums, squares = self._over_items(quality), self._over_items(quality**2)
            bias = (self.sums - sums) / self.per_rater
            converged = float(np.linalg.norm(quality - before)) < tolerance
        self.quality += quality
        self.bias += bias
        self.rest = (self.rest - quality[:, None] - bias) * self.mask
        return step, converged

    def _equal_weights(self, tolerance: float, steps: int) -> tuple[FloatArray, FloatArray]:
        """Return where to begin: the solution for raters who are equally consistent.

        Where nothing is missing these are the plain means. Where something is, plain means would depend on who happened
        to rate what, and a rater's constant could lead to another solution.
        """
        quality, bias = np.zeros(len(self.rest)), np.zeros(self.rest.shape[1])
        per_item = self.rest.sum(axis=1)
        for _ in range(0 if self.complete else steps):
            before, quality = quality, (per_item - self._over_raters(bias)) / self.per_item
            bias = (self.sums - self._over_items(quality)) / self.per_rater
            if float(np.linalg.norm(quality - before)) < tolerance:
                break
        return quality, bias

    def inconsistency(self) -> FloatArray:
        """Return the standard deviation of what is left, from the residuals themselves."""
        means = self.rest.sum(axis=0) / self.per_rater
        squares = np.einsum("ji,ji->i", self.rest, self.rest) / self.per_rater
        result: FloatArray = np.sqrt(np.maximum(squares - means**2, 0))
        return result

    def centre(self, group: IntArray, group_of_items: IntArray) -> None:
        """Give the biases of each group the mean 0."""
        means = np.bincount(group, weights=self.bias) / np.bincount(group)
        self.bias -= means[group]
        self.quality += means[group_of_items]

    def _over_raters(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values over the raters of each item."""
        result: FloatArray = np.full(len(self.mask), values.sum()) if self.complete else self.mask @ values
        return result

    def _over_items(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values over the items of each rater."""
        result: FloatArray = np.full(self.per_rater.size, values.sum()) if self.complete else values @ self.mask
        return result
