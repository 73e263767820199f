"""Bootstrap intervals for means of many groups, without simulation where the values are in equal steps."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy import special

from evaluation.errors import DataError
from evaluation.statistics.arrays import FloatArray, check_confidence

IntArray = npt.NDArray[np.intp]
ComplexArray = npt.NDArray[np.complex128]

# Values are taken for multiples of 1 over one of these, if they are so to twelve digits.
_DENOMINATORS = (*range(1, 17), 18, 20, 24, 25, 30, 32, 36, 40, 48, 50, 60, 64, 100, 120, 128)
_NEAR = 1e-12
_MOST_STEPS = 20_000
# Groups whose standard deviation is a smaller share of their values do not vary but by rounding.
_ROUNDING = 1e-13
_MOST_INTEGER = 2.0**53
_LEAST_RESAMPLES = 100
# Resampled sums further from their mean than so many standard deviations are as good as impossible.
_REACH = 12
# Numbers that are held at once.
_MOST_AT_ONCE = 2_000_000


def bca_intervals(
    values: FloatArray,
    group: IntArray,
    groups: int,
    *,
    confidence: float = 0.95,
    rng: np.random.Generator | None = None,
    resamples: int = 2000,
) -> FloatArray:
    """Return bias-corrected and accelerated bootstrap intervals for the means of groups of values.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Finite numbers.
    group : numpy.ndarray of int, shape (n,)
        The group of each, from 0 to groups - 1; none is empty.
    groups : int
        How many groups there are.
    confidence : float
        Confidence of the intervals, between 0 and 1.
    rng : numpy.random.Generator, optional
        For values that are not in equal steps.
    resamples : int
        How many resamples are drawn for these, 100 or more.

    Returns
    -------
    numpy.ndarray, shape (groups, 2)
        Lower and upper limits; both the mean where a group does not vary.

    Raises
    ------
    DataError
        If an option is out of range, or a generator is needed and missing.

    Notes
    -----
    The bias correction is z0, the normal quantile of the share of resampled means below the mean (those equal to it
    count half); the acceleration, of the jackknife, is sum(d^3) / (6 sum(d^2)^1.5), d the differences from the mean.
    Where all values are in equal steps the distribution of the resampled sum is that of n draws with replacement from
    the values, the n-fold convolution of their frequencies, which Fourier transforms give exactly.

    References
    ----------
    Efron (1987), Better bootstrap confidence intervals, J. Amer. Statist. Assoc. 82:171.
    """
    check_confidence(confidence)
    n = np.bincount(group, minlength=groups).astype(float)
    start = values[0] if values.size else 0.0
    mean = start + np.bincount(group, weights=values - start, minlength=groups) / np.maximum(n, 1)
    rest = values - mean[group]
    # In units of the largest difference, so that powers of small numbers do not vanish.
    unit = float(np.abs(rest).max(initial=0)) or 1.0
    squares = np.bincount(group, weights=(rest / unit) ** 2, minlength=groups)
    largest = np.zeros(groups)
    np.maximum.at(largest, group, np.abs(values) / unit)
    varied = np.sqrt(squares / np.maximum(n, 1)) > _ROUNDING * largest
    cubes = np.bincount(group, weights=(rest / unit) ** 3, minlength=groups)
    acceleration = np.where(varied, cubes / (6 * np.where(varied, squares, 1) ** 1.5), 0)
    lattice = _lattice(values)
    if lattice is None and rng is None:
        raise DataError("The ratings are not in equal steps, so that their bootstrap needs a generator rng.")
    if resamples < _LEAST_RESAMPLES:
        raise DataError(f"resamples is {resamples}, but must be {_LEAST_RESAMPLES} or more.")
    limits = np.column_stack([mean, mean])
    if lattice is not None:
        steps, step = lattice
        for part, sums, masses in _resampled_sums(steps, group, n, np.flatnonzero(varied)):
            cumulated = np.cumsum(masses, axis=1)
            middle = np.arange(len(part)), sums
            levels = _levels(cumulated[middle] - masses[middle] / 2, acceleration[part], confidence)
            for column, level in enumerate(levels):
                place = np.minimum((cumulated < level[:, None]).sum(axis=1), masses.shape[1] - 1)
                limits[part, column] = mean[part] + step * (place - sums) / n[part]
        return limits
    ends = np.cumsum(n).astype(np.intp)
    order = np.argsort(group, kind="stable")
    for place in np.flatnonzero(varied):
        own = rest[order[ends[place] - int(n[place]) : ends[place]]]
        means = _drawn(own, resamples, np.random.default_rng(rng))
        below = float((np.count_nonzero(means < 0) + np.count_nonzero(means == 0) / 2) / resamples)
        # Half a resample at least, or the correction would be infinite.
        below = min(max(below, 0.5 / resamples), 1 - 0.5 / resamples)
        low, high = _levels(np.array([below]), acceleration[[place]], confidence)
        limits[place] = mean[place] + np.quantile(means, [low[0], high[0]])
    return limits


def _levels(below: FloatArray, acceleration: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Return the shares of the resampled means that lie below the lower and the upper limit."""
    correction = special.ndtri(np.clip(below, 1e-12, 1 - 1e-12))
    levels = []
    for z in (float(special.ndtri((1 - confidence) / 2)), float(special.ndtri((1 + confidence) / 2))):
        shifted = correction + z
        # Only confidences beyond any use come near a quotient that is not positive.
        levels.append(special.ndtr(correction + shifted / np.maximum(1 - acceleration * shifted, 1e-3)))
    return levels[0], levels[1]


def _drawn(values: FloatArray, resamples: int, rng: np.random.Generator) -> FloatArray:
    """Return the means of resamples, drawn in parts so that memory stays small."""
    part = max(1, _MOST_AT_ONCE // values.size)
    means = [
        values[rng.integers(values.size, size=(min(part, resamples - start), values.size))].mean(axis=1)
        for start in range(0, resamples, part)
    ]
    return np.concatenate(means)


def _lattice(values: FloatArray) -> tuple[IntArray, float] | None:
    """Return each value as a number of steps from the smallest, and the length of a step; None if there is no step."""
    if not values.size:
        return np.zeros(0, dtype=np.intp), 1.0
    above = values - values.min()
    near = _NEAR * float(np.abs(values).max())
    for denominator in _DENOMINATORS:
        steps = np.round(above * denominator)
        if np.abs(above * denominator - steps).max() <= near * denominator:
            common = max(1.0, float(np.gcd.reduce(np.unique(steps[steps < _MOST_INTEGER]).astype(np.int64))))
            if steps.max() / common > _MOST_STEPS:
                return None
            return (steps / common).astype(np.intp), common / denominator
    return None


def _resampled_sums(
    steps: IntArray, group: IntArray, n: FloatArray, places: IntArray
) -> Iterator[tuple[IntArray, IntArray, FloatArray]]:
    """Yield groups, their sums, and the probabilities of the sums of their resamples.

    Each is given as the numbers of the groups, shape (k,); where in the probabilities the own sum of each is, shape
    (k,); and the probabilities of whole numbers in a row, shape (k, m).
    """
    k = n.size
    sums = np.bincount(group, weights=steps, minlength=k).astype(np.intp)
    squares = np.bincount(group, weights=(steps - (sums / np.maximum(n, 1))[group]) ** 2, minlength=k)
    whole = n * steps.max(initial=0) + 1
    # The transform repeats itself after its length, so that it need hold only what is not as good as impossible.
    needed = np.minimum(whole, 2 * _REACH * np.sqrt(squares) + 4)
    lengths = 2 ** np.ceil(np.log2(np.maximum(needed, 8))).astype(np.intp)
    for length in np.unique(lengths[places]):
        alike = places[lengths[places] == length]
        rows = max(1, _MOST_AT_ONCE // int(length))
        for start in range(0, alike.size, rows):
            part = alike[start : start + rows]
            row = np.full(k, -1, dtype=np.intp)
            row[part] = np.arange(part.size)
            mine = row[group] >= 0
            cells = row[group[mine]] * length + steps[mine] % length
            counts = np.bincount(cells, minlength=part.size * length).reshape(part.size, length)
            spectrum = _power(np.fft.rfft(counts / n[part, None]), n[part].astype(np.int64))
            masses = np.maximum(np.fft.irfft(spectrum, int(length)), 0)
            first = np.where(whole[part] <= length, 0, sums[part] - length // 2)
            turned = np.take_along_axis(masses, (first[:, None] + np.arange(length)) % length, axis=1)
            yield part, sums[part] - first, turned / turned.sum(axis=1, keepdims=True)


def _power(base: ComplexArray, exponents: npt.NDArray[np.int64]) -> ComplexArray:
    """Return each row to the power of its exponent, by squaring."""
    result = np.ones_like(base)
    left = exponents.copy()
    while left.any():
        odd = (left & 1).astype(bool)
        result[odd] *= base[odd]
        left >>= 1
        base = base * base
    return result
