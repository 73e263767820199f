"""What an analysis of variance supposes: groups of equal variance, and normal residuals."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray, centred, finite_vector, is_constant
from evaluation.statistics.groups import EPSILON, check_sizes, group_vectors, moments, segment_sums, variance_ratio
from evaluation.statistics.result import Result

# Royston's approximation of the probability was fitted to samples of up to this size.
SHAPIRO_LIMIT = 5000


@dataclass(frozen=True, kw_only=True)
class AssumptionTest(Result):
    """A test of something that an analysis of variance supposes; a small p says that it does not hold.

    Attributes
    ----------
    test : str
        Name of the test.
    symbol : str
        What its statistic is called: F, K², χ² or W.
    statistic : float
        The statistic.
    df : tuple of int
        Degrees of freedom: two of F, one of K² and χ², none of W.
    p : float
        Probability of a statistic at least as extreme if the supposition holds.
    n : int
        Number of values.
    """

    test: str
    symbol: str
    statistic: float
    df: tuple[int, ...]
    p: float
    n: int

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``Brown-Forsythe: F(2, 27) = 1.12, p = .341``."""
        freedom = f"({', '.join(map(str, self.df))})" if self.df else ""
        value = wording.share(self.statistic) if self.symbol == "W" else wording.number(self.statistic)
        return f"{self.test}: {self.symbol}{freedom} = {value}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN for degrees of freedom that the statistic does not have."""
        first, second = (*map(float, self.df), math.nan, math.nan)[:2]
        return pd.DataFrame(
            {
                "test": [self.test],
                "statistic": [self.statistic],
                "df": [first],
                "df_within": [second],
                "p": [self.p],
                "n": [self.n],
            }
        )


def levene(groups: Mapping[str, npt.ArrayLike], *, center: Literal["median", "mean"] = "median") -> AssumptionTest:
    """Test whether groups have one variance: an analysis of variance of the distances from each group's centre.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.
    center : {"median", "mean"}
        The centre: the median makes the test that of Brown and Forsythe, which bears with skewed values; the mean that
        of Levene.

    Returns
    -------
    AssumptionTest
        F, its degrees of freedom and probability.

    Raises
    ------
    DataError
        If a value is not a finite number or `center` is another word.
    InsufficientDataError
        If there are fewer than two groups, a group is empty, no group has three values, or all distances are the same.

    References
    ----------
    Brown and Forsythe (1974), Robust tests for the equality of variances, Journal of the American Statistical
    Association 69:364; Levene (1960), in Contributions to Probability and Statistics, 278.
    """
    if center not in ("median", "mean"):
        raise DataError(f"center is {center!r}, but must be 'median' or 'mean'.")
    vectors = group_vectors(groups)
    if max(vector.size for vector in vectors.values()) < 3:
        raise InsufficientDataError("No group has three values, so all distances within a group are the same.")
    largest = max(float(np.abs(vector).max()) for vector in vectors.values())
    distances = {name: np.abs(_centred_at(vector, center)) for name, vector in vectors.items()}
    try:
        ratio = variance_ratio(moments(distances, largest=largest))
    except InsufficientDataError as error:
        raise InsufficientDataError("All values lie equally far from the centre of their group.") from error
    flags = [] if ratio.SSW > 0 else ["Within each group all values lie equally far from its centre: F is infinite."]
    return AssumptionTest(
        test="Brown-Forsythe" if center == "median" else "Levene",
        symbol="F",
        statistic=ratio.F,
        df=(ratio.df_between, ratio.df_within),
        p=ratio.p,
        n=sum(vector.size for vector in vectors.values()),
        flags=tuple(flags),
    )


def bartlett(groups: Mapping[str, npt.ArrayLike]) -> AssumptionTest:
    """Test whether groups of normal values have one variance; values that are not normal mislead it.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.

    Returns
    -------
    AssumptionTest
        K squared, its degrees of freedom and probability.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups or the values of a group do not vary.

    References
    ----------
    Bartlett (1937), Properties of sufficiency and statistical tests, Proceedings of the Royal Society A 160:268.
    """
    vectors = group_vectors(groups)
    differences = {}
    for name, vector in vectors.items():
        differences[name] = centred(vector)[1]
        if is_constant(vector, differences[name]):
            raise InsufficientDataError(
                f"The values of the group {name} do not vary, and Bartlett's test needs a variance of each group; "
                "Levene's does not."
            )
    statistic = _bartlett(list(differences.values()))
    df = len(vectors) - 1
    return AssumptionTest(
        test="Bartlett",
        symbol="K²",
        statistic=statistic,
        df=(df,),
        p=float(special.chdtrc(df, statistic)),
        n=sum(vector.size for vector in vectors.values()),
    )


def fligner(groups: Mapping[str, npt.ArrayLike]) -> AssumptionTest:
    """Test whether groups have one variance, by the ranks of the distances from each group's median.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.

    Returns
    -------
    AssumptionTest
        Chi squared, its degrees of freedom and probability. Distances are ranked as the computer subtracts them, as
        R and scipy do, so that 0.3 and 1.3 - 1.0 are not tied; if that changes the result, a flag says by how much.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups, no group has two values, or all distances are the same.

    References
    ----------
    Fligner and Killeen (1976), Journal of the American Statistical Association 71:210, in the form of Conover, Johnson
    and Johnson (1981), Technometrics 23:351.
    """
    vectors = group_vectors(groups)
    sizes = np.array([vector.size for vector in vectors.values()])
    check_sizes(sizes)
    values = np.concatenate(list(vectors.values()))
    distances = np.concatenate([np.abs(_centred_at(vector, "median")) for vector in vectors.values()])
    tied = joined(distances, within=8 * EPSILON * float(np.abs(values).max()))
    if not tied.any():
        raise InsufficientDataError("All values lie equally far from the median of their group.")
    statistic, exact = (_scores_test(ranked, sizes) for ranked in (distances, tied.astype(float)))
    df = sizes.size - 1
    flags = []
    if abs(statistic - exact) > 1e-9 * (1 + exact):
        flags.append(
            "Some distances from the median differ by rounding only and are ranked as different, as R ranks them; "
            f"ranked as ties they give χ²({df}) = {exact:.4f}, {wording.p_value(float(special.chdtrc(df, exact)))}."
        )
    return AssumptionTest(
        test="Fligner-Killeen",
        symbol="χ²",
        statistic=statistic,
        df=(df,),
        p=float(special.chdtrc(df, statistic)),
        n=values.size,
        flags=tuple(flags),
    )


def shapiro(values: npt.ArrayLike) -> AssumptionTest:
    """Test whether values come from a normal distribution.

    Parameters
    ----------
    values : array_like, shape (n,)
        Finite numbers, at least three.

    Returns
    -------
    AssumptionTest
        W and its probability; a flag if there are more than 5,000 values.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than three values or they are all the same.

    References
    ----------
    Shapiro and Wilk (1965), Biometrika 52:591; Royston (1995), algorithm AS R94, Applied Statistics 44:547.
    """
    vector = finite_vector(values, name="values")
    if vector.size < 3:
        raise InsufficientDataError(
            f"The test of Shapiro and Wilk needs three values or more; there are {vector.size}."
        )
    differences = centred(vector)[1]
    return _shapiro(differences, largest=float(np.abs(vector).max()))


def shapiro_residuals(groups: Mapping[str, npt.ArrayLike]) -> AssumptionTest:
    """Test whether the residuals of an analysis of variance, the differences from the groups' means, are normal.

    Parameters
    ----------
    groups : mapping of str to array_like, shape (n_i,)
        Values of each group.

    Returns
    -------
    AssumptionTest
        W and its probability; a flag if there are more than 5,000 values.

    Raises
    ------
    DataError
        If a value is not a finite number.
    InsufficientDataError
        If there are fewer than two groups or three values, or no group varies within itself.

    References
    ----------
    As `shapiro`.
    """
    vectors = group_vectors(groups)
    residuals = np.concatenate([centred(vector)[1] for vector in vectors.values()])
    if residuals.size < 3:
        raise InsufficientDataError("The test of Shapiro and Wilk needs three values or more; there are 2.")
    return _shapiro(residuals, largest=max(float(np.abs(vector).max()) for vector in vectors.values()))


def joined(values: FloatArray, *, within: float) -> npt.NDArray[np.int64]:
    """Return whole numbers in the order of the values, the same for neighbours no further apart than `within`."""
    order = np.argsort(values)
    steps = np.diff(values[order]) > within
    numbers = np.empty(values.size, dtype=np.int64)
    numbers[order] = np.concatenate([[0], np.cumsum(steps)])
    return numbers


def _centred_at(vector: FloatArray, center: str) -> FloatArray:
    return vector - np.median(vector) if center == "median" else centred(vector)[1]


def _bartlett(differences: Sequence[FloatArray]) -> float:
    """Return Bartlett's statistic, from logarithms of variances that would be too small or too large to be written."""
    freedoms = np.array([vector.size - 1 for vector in differences])
    scales = np.array([np.abs(vector).max() for vector in differences])
    squares = [float(((vector / scale) ** 2).sum()) for vector, scale in zip(differences, scales, strict=True)]
    logs = np.log(np.array(squares) / freedoms) + 2 * (np.log(scales) - math.log(scales.max()))
    freedom = int(freedoms.sum())
    pooled = math.log(float(freedoms @ np.exp(logs)) / freedom)
    correction = 1 + (float((1 / freedoms).sum()) - 1 / freedom) / (3 * (freedoms.size - 1))
    # Of equal variances rounding may leave a little less than 0.
    return max(0.0, float(freedoms @ (pooled - logs)) / correction)


def _scores_test(distances: FloatArray, sizes: npt.NDArray[np.int64]) -> float:
    """Return the variance between groups of normal scores, in units of the variance of all scores."""
    n = distances.size
    scores = special.ndtri((1 + stats.rankdata(distances) / (n + 1)) / 2)
    scores -= scores.mean()
    return float((segment_sums(scores, sizes) ** 2 / sizes).sum() * (n - 1) / (scores @ scores))


def _shapiro(differences: FloatArray, *, largest: float) -> AssumptionTest:
    scale = float(np.abs(differences).max())
    if scale <= 4 * EPSILON * largest:
        raise InsufficientDataError("The values do not vary, so there is no distribution to test.")
    n = differences.size
    flags: tuple[str, ...] = ()
    if n > SHAPIRO_LIMIT:
        flags = (
            f"There are {n} values; the probability of W is known for up to {SHAPIRO_LIMIT} and is rough beyond, and "
            "of so many values the test calls the smallest departure significant.",
        )
    with warnings.catch_warnings():
        # The flag says what scipy warns of.
        warnings.simplefilter("ignore", UserWarning)
        W, p = map(float, stats.shapiro(differences / scale))
    return AssumptionTest(test="Shapiro-Wilk", symbol="W", statistic=W, df=(), p=p, n=n, flags=flags)
