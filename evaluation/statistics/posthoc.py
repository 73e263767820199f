"""Comparisons of all pairs of conditions, after a test that found them not all alike."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy import special, stats

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray, centred, check_confidence
from evaluation.statistics.comparisons import Comparison, Comparisons, pairs_of, without_variance
from evaluation.statistics.groups import EPSILON, column_names, group_vectors, moments
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.multiplicity import METHOD_NAMES, Method, adjusted_p, check_method
from evaluation.statistics.studentized_range import quantile, upper_tail


def tukey_hsd(groups: Mapping[str, npt.ArrayLike], *, confidence: float = 0.95) -> Comparisons:
    """Compare all pairs of groups of one variance by Tukey's honestly significant difference.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group; groups may differ in size (Tukey-Kramer).
    confidence : float
        Confidence that all intervals hold at once, between 0 and 1.

    Returns
    -------
    Comparisons
        The adjusted p and the interval of each pair are those of R's ``TukeyHSD``; t and p are those of a t test with
        the variance pooled over all groups, and without adjustment.

    Raises
    ------
    DataError
        If a value is not a finite number, two groups are written alike or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than two groups, a group is empty, no group has two values, or values vary in no group.

    References
    ----------
    Tukey (1953), The Problem of Multiple Comparisons; Kramer (1956), Biometrics 12:307; that it is conservative for
    unequal sizes: Hayter (1984), Annals of Statistics 12:61.
    """
    check_confidence(confidence)
    found = moments(group_vectors(groups))
    number, df = found.sizes.size, int(found.sizes.sum()) - found.sizes.size
    if df < 1:
        raise InsufficientDataError("Each group has only one value; at least one group needs two or more.")
    squares = math.fsum(found.squares.tolist())
    if squares <= found.negligible:
        raise InsufficientDataError("The values vary in no group, so differences between groups cannot be tested.")
    later, earlier = pairs_of(number)
    errors = np.sqrt(squares / df * (1 / found.sizes[later] + 1 / found.sizes[earlier]))
    differences = found.offsets[later] - found.offsets[earlier]
    t = differences / errors
    halves = quantile(confidence, number, [df])[0] / math.sqrt(2) * errors
    return _compared(
        found.names,
        differences,
        t,
        df=np.full(t.size, float(df)),
        adjusted=upper_tail(np.abs(t) * math.sqrt(2), number, df),
        halves=halves,
        test="Tukey's HSD",
        confidence=confidence,
    )


def games_howell(groups: Mapping[str, npt.ArrayLike], *, confidence: float = 0.95) -> Comparisons:
    """Compare all pairs of groups that may differ in variance and size, by Games and Howell.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group, two or more.
    confidence : float
        Confidence that all intervals hold at once, between 0 and 1.

    Returns
    -------
    Comparisons
        Welch's t and degrees of freedom of each pair; p without adjustment, and adjusted by the studentised range. A
        pair of two groups in which nothing varies has none, which the flags say.

    Raises
    ------
    DataError
        If a value is not a finite number, two groups are written alike or `confidence` is not between 0 and 1.
    InsufficientDataError
        If there are fewer than two groups, a group has fewer than two values, or values vary in no group.

    References
    ----------
    Games and Howell (1976), Journal of Educational Statistics 1:113; df by Welch (1947), Biometrika 34:28.
    """
    check_confidence(confidence)
    vectors = group_vectors(groups)
    for name, vector in vectors.items():
        if vector.size < 2:
            raise InsufficientDataError(f"The group {name} has only one value; its variance needs two or more.")
    found = moments(vectors)
    later, earlier = pairs_of(found.sizes.size)
    rounding = found.sizes * (4 * EPSILON * found.largest) ** 2
    variances = np.where(found.squares <= rounding, 0.0, found.squares / (found.sizes - 1) / found.sizes)
    errors = variances[later] + variances[earlier]
    tested = errors > 0
    if not tested.any():
        raise InsufficientDataError("The values vary in no group, so differences between groups cannot be tested.")
    total = np.where(tested, errors, 1.0)
    # As shares of their sum, so that no square of a square can overflow.
    shares = [(variances[side] / total) ** 2 / (found.sizes[side] - 1) for side in (later, earlier)]
    df = np.where(tested, 1 / np.where(tested, shares[0] + shares[1], 1.0), math.nan)
    differences = found.offsets[later] - found.offsets[earlier]
    t = np.where(tested, differences / np.sqrt(total), math.nan)
    adjusted, halves = np.full(t.size, math.nan), np.full(t.size, math.nan)
    number = found.sizes.size
    # Rounding may leave a df that is 1 a little short of it.
    freedom = np.maximum(df[tested], 1.0)
    adjusted[tested] = upper_tail(np.abs(t[tested]) * math.sqrt(2), number, freedom)
    halves[tested] = quantile(confidence, number, freedom) * np.sqrt(errors[tested] / 2)
    return _compared(
        found.names, differences, t, df=df, adjusted=adjusted, halves=halves, test="Games-Howell", confidence=confidence
    )


def dunn(groups: Mapping[str, npt.ArrayLike], *, method: Method = "holm", confidence: float = 0.95) -> Comparisons:
    """Compare all pairs of groups by their mean ranks, after a Kruskal-Wallis test.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.
    method : {"holm", "bonferroni", "BH", "BY", "none"}
        Adjustment of the p values for the number of pairs; see `evaluation.statistics.multiplicity.adjust`.
    confidence : float
        Pairs with an adjusted p of at most 1 less this are called significant.

    Returns
    -------
    Comparisons
        Differences of mean ranks over all groups, with z corrected for ties and two-sided p. (Stata's and R's
        ``dunn.test`` print the one-sided p, which is half of it.)

    Raises
    ------
    DataError
        If a value is not a finite number, two groups are written alike, `method` is unknown, or `confidence` is not
        between 0 and 1.
    InsufficientDataError
        If there are fewer than two groups, a group is empty, or all values are the same.

    References
    ----------
    Dunn (1964), Multiple comparisons using rank sums, Technometrics 6:241, with the correction for ties of her
    section 5.
    """
    check_confidence(confidence)
    check_method(method)
    vectors = group_vectors(groups)
    values = np.concatenate(list(vectors.values()))
    sizes = np.array([vector.size for vector in vectors.values()])
    total = values.size
    repeats = np.unique(values, return_counts=True)[1].astype(float)
    if repeats.size == 1:
        raise InsufficientDataError("All values are the same, so their ranks cannot be compared.")
    ties = float((repeats**3 - repeats).sum()) / (total - 1)
    variance = (total * (total + 1.0) - ties) / 12
    ranks = stats.rankdata(values)
    means = np.add.reduceat(ranks, np.concatenate([[0], np.cumsum(sizes)[:-1]])) / sizes
    later, earlier = pairs_of(sizes.size)
    differences = means[later] - means[earlier]
    z = differences / np.sqrt(variance * (1 / sizes[later] + 1 / sizes[earlier]))
    return _compared(
        tuple(vectors),
        differences,
        z,
        df=None,
        adjusted=adjusted_p(2 * special.ndtr(-np.abs(z)), method=method),
        halves=None,
        test="Dunn's test of mean ranks",
        confidence=confidence,
        method=method,
    )


def paired_comparisons(
    values: npt.ArrayLike,
    *,
    conditions: Sequence[object] | None = None,
    method: Method = "holm",
    confidence: float = 0.95,
) -> Comparisons:
    """Compare all pairs of conditions that the same items (or raters) went through, by paired t tests.

    Each pair has its own error term, so that nothing is supposed about sphericity.

    Parameters
    ----------
    values : array_like, shape (items, conditions)
        A value of each item in each condition, for instance its mean over raters; none may be missing.
    conditions : sequence, optional
        Names of the columns; left out, "1", "2" and so on.
    method : {"holm", "bonferroni", "BH", "BY", "none"}
        Adjustment of the p values for the number of pairs; see `evaluation.statistics.multiplicity.adjust`.
    confidence : float
        Confidence of each interval by itself, between 0 and 1.

    Returns
    -------
    Comparisons
        Mean differences with t, items - 1 degrees of freedom, and p. A pair whose difference is the same for all items
        has none, which the flags say.

    Raises
    ------
    DataError
        If a value is missing or infinite, this is no table, names do not fit, `method` is unknown, or `confidence` is
        not between 0 and 1.
    InsufficientDataError
        If there are fewer than two items or conditions, or no difference varies.

    References
    ----------
    Student (1908), Biometrika 6:1; Holm (1979), Scandinavian Journal of Statistics 6:65; separate error terms: Boik
    (1981), Psychometrika 46:241.
    """
    check_confidence(confidence)
    check_method(method)
    table = finite_array(values, axes=("items", "conditions"), name="values")
    items, number = table.shape
    if number < 2 or items < 2:
        raise InsufficientDataError(
            f"Paired comparisons need two items and two conditions or more; there are {items} and {number}."
        )
    names = column_names(None if conditions is None else [str(name) for name in conditions], number)
    later, earlier = pairs_of(number)
    differences, errors = np.empty(later.size), np.empty(later.size)
    rounding = 4 * EPSILON * float(np.abs(table).max())
    for place, (one, other) in enumerate(zip(later, earlier, strict=True)):
        mean, spread = centred(table[:, one] - table[:, other])
        differences[place] = mean
        constant = float(np.abs(spread).max()) <= rounding
        errors[place] = 0.0 if constant else math.sqrt(float(spread @ spread) / (items - 1) / items)
    tested = errors > 0
    if not tested.any():
        raise InsufficientDataError("The differences are the same for all items, so they cannot be tested.")
    t = np.where(tested, differences / np.where(tested, errors, 1.0), math.nan)
    df = np.full(t.size, items - 1.0)
    return _compared(
        names,
        differences,
        t,
        df=df,
        adjusted=adjusted_p(2 * special.stdtr(df, -np.abs(t)), method=method),
        halves=np.where(tested, float(special.stdtrit(items - 1, (1 + confidence) / 2)) * errors, math.nan),
        test="Paired t tests",
        confidence=confidence,
        method=method,
    )


def _compared(
    names: Sequence[str],
    differences: FloatArray,
    statistics: FloatArray,
    *,
    df: FloatArray | None,
    adjusted: FloatArray,
    halves: FloatArray | None,
    test: str,
    confidence: float,
    method: Method | None = None,
) -> Comparisons:
    later, earlier = pairs_of(len(names))
    sizes = np.abs(statistics)
    p = 2 * (special.ndtr(-sizes) if df is None else special.stdtr(df, -sizes))
    pairs = tuple(
        Comparison(
            first=names[one],
            second=names[other],
            difference=float(differences[place]),
            statistic=float(statistics[place]),
            df=None if df is None or math.isnan(df[place]) else float(df[place]),
            p=float(p[place]),
            p_adjusted=float(adjusted[place]),
            ci=_around(float(differences[place]), math.nan if halves is None else float(halves[place])),
        )
        for place, (one, other) in enumerate(zip(later, earlier, strict=True))
    )
    return Comparisons(
        test=test,
        adjustment="p adjusted by the studentised range" if method is None else f"{METHOD_NAMES[method]} adjustment",
        symbol="z" if df is None else "t",
        confidence=confidence,
        simultaneous=method is None,
        pairs=pairs,
        flags=without_variance(pairs),
    )


def _around(middle: float, half: float) -> tuple[float, float] | None:
    return None if math.isnan(half) else (middle - half, middle + half)
