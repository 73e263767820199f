"""Qualities, biases and inconsistencies by alternating projection (Li et al., 2020; ITU-T P.910)."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from evaluation.statistics.arrays import FloatArray

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

LEAST_VARIANCE = 1e-8
"""Added to variances, so that the weight of a rater without any residual is finite; as in the authors' own program."""

# Below this share of the sum of squares that it is left of, a remainder has lost digits and is computed anew.
_CANCELLED = 1e-3
# Rows that a processor's cache holds while they are worked on.
_BLOCK = 96


class AlternatingProjection:
    """The search for qualities, biases and inconsistencies of `evaluation.statistics.rater_model`.

    Each step reads the ratings once, a block at a time while it is near the processor; sums of squares are not formed
    again but follow from the products. Where that would lose digits the search works on what the plain means leave of
    the ratings.

    Parameters
    ----------
    scores : numpy.ndarray, shape (items, raters)
        Ratings, 0 where there is none.
    given : numpy.ndarray of bool, shape (items, raters), or None
        Which are there, at least one in each row and column; None if all are.

    Attributes
    ----------
    quality, bias, inconsistency : numpy.ndarray, shapes (items,), (raters,) and (raters,)
        The solution, once it was `run`.
    per_rater : numpy.ndarray, shape (raters,) or ()
        Ratings of each rater; one number if nothing is missing.
    rest : numpy.ndarray, shape (items, raters)
        The ratings, less what was taken away of them.
    largest : float
        The largest sum of squares of a rater's ratings; NaN if a rating is.
    """

    def __init__(self, scores: FloatArray, given: BoolArray | None) -> None:
        items, raters = scores.shape
        self.mask = None if given is None else given.astype(float)
        self.per_item, self.per_rater = self._over_raters(np.ones(raters)), self._over_items(np.ones(items))
        # The steps below change qualities and biases by `quality` and `bias` of the rest, beginning here.
        self.quality, self.bias, self.rest = np.zeros(items), np.zeros(raters), scores
        self.inconsistency = np.zeros(raters)
        # Products with ones are the quickest sums, and whatever they round away is left in the rest.
        self.squares, self.sums, of_items, product = (
            np.zeros(raters),
            np.zeros(raters),
            np.zeros(items),
            np.zeros(raters),
        )
        for rows in self._blocks():
            block = scores[rows]
            of_items[rows] = block @ np.ones(raters)
            product += of_items[rows] @ block
            self.sums += np.ones(len(block)) @ block
            self.squares += np.einsum("ji,ji->i", block, block)
        self.largest = float(self.squares.max(initial=0))
        means = of_items / self.per_item
        biases = (self.sums - self._over_items(means)) / self.per_rater
        self.start = means, biases
        if self.mask is None:
            self.left = self._left(means, biases, product / raters)
        if self.mask is not None or (self.left < _CANCELLED * self.squares).any():
            self._take_away(means, biases)

    def _blocks(self) -> Iterator[slice]:
        return (slice(start, start + _BLOCK) for start in range(0, len(self.rest), _BLOCK))

    def _take_away(self, quality: FloatArray, bias: FloatArray) -> None:
        """Go on with what these leave of the ratings, where sums of the ratings themselves would lose digits."""
        scores, self.rest = self.rest, np.empty_like(self.rest)
        self.quality, self.bias = quality, bias
        self.start = np.zeros(quality.size), np.zeros(bias.size)
        self.squares = np.zeros(bias.size)
        for rows in self._blocks():
            block = np.subtract(scores[rows], quality[rows, None], out=self.rest[rows])
            block -= bias
            if self.mask is not None:
                block *= self.mask[rows]
            self.squares += np.einsum("ji,ji->i", block, block)
        self.sums = np.ones(quality.size) @ self.rest
        self.left = self.squares

    def run(self, tolerance: float, steps: int) -> tuple[int, bool]:
        """Take steps until the qualities change by less than the tolerance; return how many, and whether they do."""
        quality, bias, left = self._equal_weights(tolerance, steps)
        converged, step = False, 0
        while step < steps and not converged:
            step += 1
            weights = 1 / (left / self.per_rater + LEAST_VARIANCE)
            before = quality
            quality, product = self._qualities(weights, bias)
            bias = (self.sums - self._over_items(quality)) / self.per_rater
            left = self._left(quality, bias, product)
            converged = float(np.linalg.norm(quality - before)) < tolerance
        self.quality = self.quality + quality
        self.bias = self.bias + bias
        self.inconsistency = np.sqrt(self._exactly(left, quality, bias) / self.per_rater)
        return step, converged

    def _qualities(self, weights: FloatArray, bias: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the weighted means of the rest without biases, and their product with the rest."""
        items, raters = self.rest.shape
        taken, total = (np.broadcast_to(self._over_raters(one), items) for one in (weights * bias, weights))
        quality, product = np.empty(items), np.zeros(raters)
        for rows in self._blocks():
            block = self.rest[rows]
            quality[rows] = (block @ weights - taken[rows]) / total[rows]
            product += quality[rows] @ block
        return quality, product

    def _left(self, quality: FloatArray, bias: FloatArray, product: FloatArray) -> FloatArray:
        """Return the sum of (rest - quality - bias) squared over a rater's items; `product` is quality times rest."""
        left = self.squares - 2 * product - 2 * bias * self.sums
        left += self._over_items(quality**2) + 2 * bias * self._over_items(quality) + self.per_rater * bias**2
        result: FloatArray = np.maximum(left, 0)
        return result

    def _exactly(self, left: FloatArray, quality: FloatArray, bias: FloatArray) -> FloatArray:
        """Return what is left, summed over the residuals where the difference of large sums lost digits."""
        left = left.copy()
        small = np.flatnonzero(left < _CANCELLED * self.squares)
        if small.size:
            residuals = self.rest[:, small] - quality[:, None] - bias[small]
            if self.mask is not None:
                residuals *= self.mask[:, small]
            left[small] = np.einsum("ji,ji->i", residuals, residuals)
        return left

    def _equal_weights(self, tolerance: float, steps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where to begin, and what is left there: the solution for raters who are equally consistent.

        Where nothing is missing these are the plain means. Where something is, plain means would depend on who happened
        to rate what, and a rater's constant could lead to another solution.
        """
        quality, bias = self.start
        if self.mask is None:
            return quality, bias, self.left
        per_item = self.rest @ np.ones(bias.size)
        for _ in range(steps):
            before, quality = quality, (per_item - self._over_raters(bias)) / self.per_item
            bias = (self.sums - self._over_items(quality)) / self.per_rater
            if float(np.linalg.norm(quality - before)) < tolerance:
                break
        return quality, bias, self._left(quality, bias, quality @ self.rest)

    def centre(self, group: IntArray, group_of_items: IntArray) -> None:
        """Give the biases of each group the mean 0."""
        means = np.bincount(group, weights=self.bias) / np.bincount(group)
        self.bias -= means[group]
        self.quality += means[group_of_items]

    def _over_raters(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values over the raters of each item; one for all items if nothing is missing."""
        return np.asarray(values.sum()) if self.mask is None else self.mask @ values

    def _over_items(self, values: FloatArray) -> FloatArray:
        """Return the sum of the values over the items of each rater; one for all raters if nothing is missing."""
        return np.asarray(values.sum()) if self.mask is None else values @ self.mask
