"""Canonical correlation of two sets of measurements of the same things."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import linalg, stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array
from evaluation.statistics.result import Result

# A column that differs from a combination of those before it by less than this share of its own size is taken as one.
_NEGLIGIBLE = 1e-10
_PERFECT = "A canonical correlation is 1 to rounding, so that F has no bound."


@dataclass(frozen=True, kw_only=True)
class MultivariateTest(Result):
    """A test that some canonical correlations are all zero.

    Attributes
    ----------
    statistic : str
        Name of the statistic.
    value : float
        Its value; infinite where a correlation is 1 and the statistic has no bound.
    F : float or None
        Its F approximation; None where there are too few rows for one.
    df1, df2 : float or None
        Degrees of freedom of F, which may be fractions.
    p : float or None
        Probability of an F at least as large if the correlations were zero.
    """

    statistic: str
    value: float
    F: float | None
    df1: float | None
    df2: float | None
    p: float | None

    def apa(self) -> str:
        """Return the test as a sentence, for instance ``Wilks' Λ = .35, F(9, 34.22) = 2.05, p = .064``."""
        write = wording.share if self.statistic.startswith("Wilks") else wording.number
        name = f"{self.statistic} = {write(self.value)}"
        if self.F is None or self.p is None or self.df1 is None or self.df2 is None:
            return name
        ratio = f"F({_degrees(self.df1)}, {_degrees(self.df2)}) = {wording.number(self.F)}"
        return f"{name}, {ratio}, {wording.p_value(self.p)}"

    def to_frame(self) -> pd.DataFrame:
        """Return the test as a frame of one row; NaN where there is no F."""
        numbers = {name: getattr(self, name) for name in ("value", "F", "df1", "df2", "p")}
        return pd.DataFrame(
            {"statistic": [self.statistic]}
            | {name: [math.nan if number is None else number] for name, number in numbers.items()}
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class CanonicalCorrelation(Result):
    """The canonical correlations of two sides, p columns of x and q of y; there are s = min(p, q) pairs of variates.

    Columns that combine others do not count in p and q; see `canonical_correlation`.

    Attributes
    ----------
    correlations : tuple of float
        The s canonical correlations, 0 to 1, largest first.
    n : int
        Number of rows.
    x_names, y_names : tuple of str
        Names of the columns.
    x_left_out, y_left_out : tuple of str
        Columns that are combinations of those before them: their weights are zero.
    x_weights, y_weights : numpy.ndarray, shapes (columns of x, s) and (columns of y, s)
        Standardised coefficients: a variate is the sum of the standardised columns (SD 1) times these, and has SD 1.
    x_structure, y_structure : numpy.ndarray, shapes as the weights
        Correlation of each column with its own side's variates ("structure coefficients" or "loadings").
    x_redundancy, y_redundancy : tuple of float
        Share of the variance of the side's standardised columns that the other side's variate explains, by pair.
    sequence : tuple of MultivariateTest
        Wilks' lambda with Rao's F: the first tests that all s correlations are zero, the next that all but the
        first are, and so on.
    overall : tuple of MultivariateTest
        Wilks, Pillai, Hotelling-Lawley and Roy for all correlations together.
    """

    correlations: tuple[float, ...]
    n: int
    x_names: tuple[str, ...]
    y_names: tuple[str, ...]
    x_left_out: tuple[str, ...]
    y_left_out: tuple[str, ...]
    x_weights: FloatArray
    y_weights: FloatArray
    x_structure: FloatArray
    y_structure: FloatArray
    x_redundancy: tuple[float, ...]
    y_redundancy: tuple[float, ...]
    sequence: tuple[MultivariateTest, ...]
    overall: tuple[MultivariateTest, ...]

    def apa(self) -> str:
        """Return the first correlation: ``Rc = .80, Wilks' Λ = .35, F(9, 34.22) = 2.05, p = .064``."""
        return f"Rc = {wording.share(self.correlations[0])}, {self.sequence[0].apa()}"

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each pair of variates, with the test that its and all later correlations are zero."""
        return pd.DataFrame(
            {
                "pair": range(1, len(self.correlations) + 1),
                "correlation": self.correlations,
                "wilks_lambda": [test.value for test in self.sequence],
                "F": [test.F for test in self.sequence],
                "df1": [test.df1 for test in self.sequence],
                "df2": [test.df2 for test in self.sequence],
                "p": [test.p for test in self.sequence],
                "x_redundancy": self.x_redundancy,
                "y_redundancy": self.y_redundancy,
            }
        )

    def variables_to_frame(self) -> pd.DataFrame:
        """Return a row for each column of both sides and each pair, with its weight and structure coefficient."""
        sides = (
            ("x", self.x_names, self.x_weights, self.x_structure),
            ("y", self.y_names, self.y_weights, self.y_structure),
        )
        rows = [
            (side, name, pair + 1, float(weights[place, pair]), float(structure[place, pair]))
            for side, names, weights, structure in sides
            for place, name in enumerate(names)
            for pair in range(len(self.correlations))
        ]
        return pd.DataFrame(rows, columns=["side", "variable", "pair", "weight", "structure"])

    def tests_to_frame(self) -> pd.DataFrame:
        """Return a row for each of the four overall tests."""
        return pd.concat([test.to_frame() for test in self.overall], ignore_index=True)


def canonical_correlation(
    x: npt.ArrayLike | pd.DataFrame,
    y: npt.ArrayLike | pd.DataFrame,
    *,
    x_names: Sequence[str] | None = None,
    y_names: Sequence[str] | None = None,
) -> CanonicalCorrelation:
    """Find the combinations of the columns of x and of y that correlate most.

    Parameters
    ----------
    x, y : array_like, shapes (n, p) and (n, q)
        Measurements; a row of x and the same row of y belong to one thing. p and q may differ.
    x_names, y_names : sequence of str, optional
        Names of the columns; left out, those of a frame, or x1, x2 ... and y1, y2 ...

    Returns
    -------
    CanonicalCorrelation
        Correlations, weights, structure, redundancy and tests.

    Raises
    ------
    DataError
        If a side is no table of finite numbers, the sides differ in rows, or the names do not fit.
    InsufficientDataError
        If a column does not vary, or there are fewer than p + q + 1 rows: then the sides correlate perfectly whatever
        they are.

    Notes
    -----
    Each side's standardised columns are made orthonormal (QR), and the singular values of the product of the two bases
    are the correlations (Björck and Golub, 1973); no covariance matrix is formed or inverted. A column that is, to one
    part in 10^10, a combination of the columns before it adds nothing to its side: it is left out and named, it does
    not count in p or q, and it keeps its structure coefficients. 1 - r² is formed from the sine of the angle, so that
    Wilks' lambda is right for correlations near 1 too; a sine that small counts as 0, and r as 1. The sign of each pair
    is such that the largest structure coefficient of x is positive.

    The tests suppose rows from a multivariate normal distribution (one side may be fixed). F is exact for
    min(p, q) = 1 and, by Rao, for min(p, q) = 2. Roy's F is an upper bound, so its p is a lower one.

    References
    ----------
    Hotelling (1936), Biometrika 28:321. Björck and Golub (1973), Math. Comp. 27:579. Rao (1951), Bull. Int. Stat. Inst.
    33(2):177, for Wilks' lambda; Pillai (1955), Ann. Math. Stat. 26:117; McKeon (1974), Biometrika 61:381, for
    Hotelling-Lawley. Redundancy: Stewart and Love (1968), Psychol. Bull. 70:160. Jia et al. (2013), section 4.3,
    correlate PAD with PEP.
    """
    side_x, side_y = _Side.of(x, x_names, "x"), _Side.of(y, y_names, "y")
    n, p, q = len(side_x.basis), side_x.rank, side_y.rank
    if len(side_y.basis) != n:
        raise DataError(f"x has {n} rows and y has {len(side_y.basis)}, but each row of x needs its row of y.")
    if n < p + q + 1:
        raise InsufficientDataError(
            f"Canonical correlation of {p} with {q} columns needs at least {p + q + 1} rows; there are {n}."
        )
    left, cosines, right = linalg.svd(side_x.basis.T @ side_y.basis, full_matrices=False)
    left, right = _with_signs(side_x, left, right.T)
    variates = side_y.basis @ right
    sines = linalg.norm(variates - side_x.basis @ (side_x.basis.T @ variates), axis=0)
    tolerance = max(side_x.tolerance, side_y.tolerance)
    squares = np.where(sines <= tolerance, 1.0, np.minimum(cosines, 1) ** 2)
    remainders = np.where(sines <= tolerance, 0.0, np.where(squares < 0.5, 1 - squares, sines**2))
    x_structure, y_structure = side_x.columns.T @ (side_x.basis @ left), side_y.columns.T @ variates
    traces_and_root = _traces_and_root(squares, remainders, n=n, p=p, q=q)
    sequence = tuple(_wilks(squares[k:], remainders[k:], n=n, p=p, q=q, before=k) for k in range(len(squares)))
    return CanonicalCorrelation(
        correlations=tuple(np.sqrt(squares).tolist()),
        n=n,
        x_names=side_x.names,
        y_names=side_y.names,
        x_left_out=side_x.left_out,
        y_left_out=side_y.left_out,
        x_weights=_read_only(side_x.weights(left)),
        y_weights=_read_only(side_y.weights(right)),
        x_structure=_read_only(x_structure),
        y_structure=_read_only(y_structure),
        x_redundancy=tuple(((x_structure**2).mean(axis=0) * squares).tolist()),
        y_redundancy=tuple(((y_structure**2).mean(axis=0) * squares).tolist()),
        sequence=sequence,
        overall=(sequence[0], *traces_and_root),
        flags=_flags(side_x.left_out + side_y.left_out, (*sequence, *traces_and_root)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Side:
    """One side: its columns with norm 1, and the orthonormal basis and triangle of those that are not combinations."""

    names: tuple[str, ...]
    columns: FloatArray
    kept: list[int]
    basis: FloatArray
    triangle: FloatArray
    tolerance: float

    @classmethod
    def of(cls, values: npt.ArrayLike | pd.DataFrame, names: Sequence[str] | None, side: str) -> "_Side":
        if names is None and isinstance(values, pd.DataFrame):
            names = [str(column) for column in values.columns]
        table = finite_array(values, axes=("rows", "columns"), name=side)
        if 0 in table.shape:
            raise InsufficientDataError(f"{side} has {table.shape[0]} rows and {table.shape[1]} columns: it is empty.")
        names = tuple(names) if names is not None else tuple(f"{side}{k + 1}" for k in range(table.shape[1]))
        if len(names) != table.shape[1]:
            raise DataError(f"{side} has {table.shape[1]} columns, but {len(names)} names.")
        _, differences = centred_columns(table)
        constant = np.flatnonzero(constant_columns(table, differences))
        if constant.size:
            raise InsufficientDataError(
                f"The column {names[constant[0]]} of {side} does not vary, so nothing correlates with it; leave it out."
            )
        # Scaled by the largest first, so that squares of small numbers do not vanish.
        sizes = np.abs(differences).max(axis=0)
        scaled = differences / sizes
        norms = linalg.norm(scaled, axis=0)
        columns = scaled / norms
        # A large common part has cost the columns digits: what is left of a combination is then that much larger.
        rounding = float(np.max(np.abs(table).max(axis=0) / (sizes * norms)))
        tolerance = max(_NEGLIGIBLE, 8 * math.sqrt(len(table)) * float(np.finfo(float).eps) * rounding)
        kept = _independent(columns, tolerance)
        if not kept:
            raise InsufficientDataError(
                f"The columns of {side} differ by hardly more than the rounding of their values; take away what these "
                "have in common before they are rounded."
            )
        basis, triangle = linalg.qr(columns[:, kept], mode="economic")
        return cls(names=names, columns=columns, kept=kept, basis=basis, triangle=triangle, tolerance=tolerance)

    @property
    def rank(self) -> int:
        return len(self.kept)

    @property
    def left_out(self) -> tuple[str, ...]:
        return tuple(name for place, name in enumerate(self.names) if place not in self.kept)

    def weights(self, rotation: FloatArray) -> FloatArray:
        result = np.zeros((len(self.names), rotation.shape[1]))
        result[self.kept] = linalg.solve_triangular(self.triangle, rotation)
        return result


def _independent(columns: FloatArray, tolerance: float) -> list[int]:
    kept: list[int] = []
    basis = np.empty((len(columns), 0))
    for place in range(columns.shape[1]):
        rest = columns[:, place]
        # Twice is enough to make what is left orthogonal to working precision (Kahan; Parlett, 1980, section 6.9).
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        size = float(linalg.norm(rest))
        if size > tolerance:
            kept.append(place)
            basis = np.column_stack([basis, rest / size])
    return kept


def _with_signs(side_x: _Side, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    structure = side_x.columns.T @ (side_x.basis @ left)
    largest = structure[np.abs(structure).argmax(axis=0), np.arange(structure.shape[1])]
    signs = np.where(largest < 0, -1.0, 1.0)
    return left * signs, right * signs


def _wilks(squares: FloatArray, remainders: FloatArray, *, n: int, p: int, q: int, before: int) -> MultivariateTest:
    rows, columns = p - before, q - before
    both = rows * columns
    # Rao's t is 1 where one side has one column left, where the formula may be 0 / 0.
    t = math.sqrt((both**2 - 4) / (rows**2 + columns**2 - 5)) if min(rows, columns) > 1 else 1.0
    df2 = (n - 1 - (p + q + 1) / 2) * t - both / 2 + 1
    if (remainders == 0).any():
        return _test("Wilks' Λ", 0.0, math.inf, both, df2)
    logarithms = np.where(squares < 0.5, np.log1p(-np.minimum(squares, 0.5)), np.log(remainders))
    logarithm = math.fsum(logarithms)
    F = math.expm1(-logarithm / t) * df2 / both
    return _test("Wilks' Λ", math.exp(logarithm), F, both, df2)


def _traces_and_root(
    squares: FloatArray, remainders: FloatArray, *, n: int, p: int, q: int
) -> tuple[MultivariateTest, MultivariateTest, MultivariateTest]:
    s, m, N = min(p, q), (abs(p - q) - 1) / 2, (n - p - q - 2) / 2
    pillai, left = math.fsum(squares), math.fsum(remainders)
    F = (2 * N + s + 1) / (2 * m + s + 1) * pillai / left if left > 0 else math.inf
    perfect = bool((remainders == 0).any())
    lawley = math.inf if perfect else math.fsum(squares / remainders)
    root = math.inf if perfect else float(squares[0] / remainders[0])
    largest = max(p, q)
    df2 = n - 1 - largest
    return (
        _test("Pillai's V", pillai, F, s * (2 * m + s + 1), s * (2 * N + s + 1)),
        _hotelling_lawley(lawley, N=N, p=p, q=q),
        _test("Roy's root", root, root * df2 / largest, largest, df2),
    )


def _hotelling_lawley(value: float, *, N: float, p: int, q: int) -> MultivariateTest:
    name, both = "Hotelling-Lawley U", p * q
    if min(p, q) == 1:
        return _test(name, value, value * (2 * N + 2) / both, both, 2 * N + 2)
    # McKeon matches the first two moments; with so few rows there is no first moment to match.
    if N <= 0:
        return MultivariateTest(
            statistic=name, value=value, F=None, df1=None, df2=None, p=None, flags=(f"{name}: too few rows for an F.",)
        )
    df2 = 4 + (both + 2) * 2 * (2 * N + 1) * (N - 1) / (both + 2 + 2 * N * (p + q + 1))
    return _test(name, value, value * 2 * N / (df2 - 2) * df2 / both, both, df2)


def _test(statistic: str, value: float, F: float, df1: float, df2: float) -> MultivariateTest:
    p, flags = float(stats.f.sf(F, df1, df2)), (_PERFECT,) if math.isinf(F) else ()
    return MultivariateTest(statistic=statistic, value=value, F=F, df1=df1, df2=df2, p=p, flags=flags)


def _flags(left_out: tuple[str, ...], tests: Iterable[MultivariateTest]) -> tuple[str, ...]:
    combined = (f"Combinations of other columns, left out: {', '.join(left_out)}.",) if left_out else ()
    return (*combined, *dict.fromkeys(flag for test in tests for flag in test.flags))


def _degrees(df: float) -> str:
    return f"{df:g}" if math.isclose(df, round(df)) else wording.number(df)


def _read_only(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array
