"""Repeated-measures analysis of variance: conditions that every item, or every rater, has gone through."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import special
from scipy.linalg import helmert

from evaluation.errors import InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.groups import EPSILON, column_names, upper_tail
from evaluation.statistics.matrices import finite_array
from evaluation.statistics.result import Result
from evaluation.statistics.unit_means import unit_means


@dataclass(frozen=True, kw_only=True)
class RepeatedMeasuresAnova(Result):
    """A repeated-measures analysis of variance with one factor.

    Attributes
    ----------
    F : float
        Variance ratio; infinite if the conditions differ by the same in all subjects.
    df_conditions, df_error : int
        Degrees of freedom, not corrected.
    p : float
        Probability of an F at least as large if all conditions had one mean, supposing sphericity.
    gg_epsilon : float or None
        Estimate of Greenhouse and Geisser of how nearly spherical the differences are: 1 if they are, 1 / (k - 1) at
        worst; None if nothing is left to estimate it from.
    p_gg : float or None
        Probability with degrees of freedom multiplied by it.
    hf_epsilon : float or None
        Estimate of Huynh and Feldt, which may exceed 1; None if there are too few subjects. With one group of subjects
        Lecoutre's correction of it changes nothing.
    p_hf : float or None
        Probability with degrees of freedom multiplied by it, or by 1 if it exceeds 1.
    mauchly_w, mauchly_p : float or None
        Mauchly's test of sphericity; None for two conditions, which are always spherical, and for fewer subjects than
        conditions.
    ges, pes : float
        Generalised and partial eta squared: share of the variance that the conditions explain, with and without the
        variance between subjects in the whole.
    SS_conditions, SS_subjects, SS_error : float
        Sums of squares.
    n : int
        Number of subjects: items or raters.
    conditions : tuple of str
        Names of the conditions.
    means : tuple of float
        Their means.
    """

    F: float
    df_conditions: int
    df_error: int
    p: float
    gg_epsilon: float | None
    p_gg: float | None
    hf_epsilon: float | None
    p_hf: float | None
    mauchly_w: float | None
    mauchly_p: float | None
    ges: float
    pes: float
    SS_conditions: float
    SS_subjects: float
    SS_error: float
    n: int
    conditions: tuple[str, ...]
    means: tuple[float, ...]

    def apa(self) -> str:
        """Return the result as a sentence, for instance ``F(1.55, 32.49) = 6.29, p = .008, ηp² = .23, ηG² = .02``.

        The degrees of freedom and the probability are those that Greenhouse and Geisser correct, where there are any
        for three conditions or more.
        """
        factor, p = 1.0, self.p
        if self.df_conditions > 1 and self.gg_epsilon is not None and self.p_gg is not None:
            factor, p = self.gg_epsilon, self.p_gg
        freedom = ", ".join(
            str(df) if factor == 1 else wording.number(df * factor) for df in (self.df_conditions, self.df_error)
        )
        sizes = f"ηp² = {wording.share(self.pes)}, ηG² = {wording.share(self.ges)}"
        ratio = f"F({freedom}) = {wording.number(self.F)}, {wording.p_value(p)}, {sizes}"
        return ratio if factor == 1 else f"{ratio} (Greenhouse-Geisser ε = {wording.share(factor)})"

    def to_frame(self) -> pd.DataFrame:
        """Return the result as a frame of one row; NaN where there is no number."""
        names = [
            *("F", "df_conditions", "df_error", "p", "gg_epsilon", "p_gg", "hf_epsilon", "p_hf", "mauchly_w"),
            *("mauchly_p", "ges", "pes", "SS_conditions", "SS_subjects", "SS_error", "n"),
        ]
        values = {name: getattr(self, name) for name in names}
        return pd.DataFrame({name: [math.nan if value is None else value] for name, value in values.items()})


def repeated_measures(matrix: npt.ArrayLike, names: Sequence[str] | None = None) -> RepeatedMeasuresAnova:
    """Compare the means of conditions that every subject has gone through.

    Parameters
    ----------
    matrix : array_like, shape (subjects, conditions)
        One value of each subject in each condition; the subjects are items (means over raters) or raters (means over
        items).
    names : sequence of str, optional
        Names of the conditions; 1, 2, 3, … if not given.

    Returns
    -------
    RepeatedMeasuresAnova
        F, the corrections for lacking sphericity, and effect sizes, as R's afex gives them.

    Raises
    ------
    DataError
        If it is no matrix of finite numbers, or the number of names is wrong or two are the same.
    InsufficientDataError
        If there are fewer than two subjects or conditions, or neither conditions nor their differences vary.

    References
    ----------
    Greenhouse and Geisser (1959), Psychometrika 24:95; Huynh and Feldt (1976), Journal of Educational Statistics 1:69;
    Mauchly (1940), Annals of Mathematical Statistics 11:204, with the second term of the distribution by Anderson
    (2003), An Introduction to Multivariate Statistical Analysis, 10.7.4; generalised eta squared by Olejnik and Algina
    (2003), Psychological Methods 8:434. Jia et al. (2013) showed each sentence in three conditions: F(2, 38) by item.
    """
    table = finite_array(matrix, axes=("subjects", "conditions"), name="matrix")
    n, k = table.shape
    titles = column_names(names, k)
    if n < 2 or k < 2:
        raise InsufficientDataError(f"Two subjects and two conditions are needed; there are {n} and {k}.")
    shifted = table - table[0, 0]
    grand = float(shifted.mean())
    centred = shifted - grand
    centred -= centred.mean()
    by_subject, by_condition = centred.mean(axis=1), centred.mean(axis=0)
    residuals = centred - by_subject[:, np.newaxis] - by_condition
    sums = n * float(by_condition @ by_condition), k * float(by_subject @ by_subject), float((residuals**2).sum())
    # Squares of differences that are no more than the rounding of the values mean that nothing varies.
    negligible = table.size * (4 * EPSILON * float(np.abs(table).max())) ** 2
    conditions, subjects, error = (0.0 if squares <= negligible else squares for squares in sums)
    if conditions + error == 0:
        raise InsufficientDataError("No subject's values differ between conditions, so nothing can be compared.")
    df_conditions, df_error = k - 1, (k - 1) * (n - 1)
    F = (conditions / df_conditions) / (error / df_error) if error > 0 else math.inf
    spheres = _Sphericity.of(residuals) if error > 0 else _Sphericity(None, None, None, None)
    return RepeatedMeasuresAnova(
        F=F,
        df_conditions=df_conditions,
        df_error=df_error,
        p=upper_tail(F, df_conditions, df_error),
        gg_epsilon=spheres.gg,
        p_gg=_corrected(F, df_conditions, df_error, spheres.gg),
        hf_epsilon=spheres.hf,
        p_hf=_corrected(F, df_conditions, df_error, spheres.hf),
        mauchly_w=spheres.W,
        mauchly_p=spheres.p,
        ges=conditions / (conditions + subjects + error),
        pes=conditions / (conditions + error),
        SS_conditions=conditions,
        SS_subjects=subjects,
        SS_error=error,
        n=n,
        conditions=titles,
        means=tuple((float(table[0, 0]) + (grand + by_condition)).tolist()),
        flags=_flags(error, spheres, n, k),
    )


def repeated_measures_by_unit(
    values: npt.ArrayLike, conditions: Sequence[Hashable], units: Sequence[Hashable]
) -> RepeatedMeasuresAnova:
    """Compare the means of conditions with items, or raters, as the units that went through all of them.

    Parameters
    ----------
    values : array_like, shape (n,)
        Ratings; NaN where one is missing.
    conditions, units : sequence, shape (n,)
        Condition of each rating, and its unit: the item to analyse by item, the rater to analyse by rater.

    Returns
    -------
    RepeatedMeasuresAnova
        That of the units' mean ratings; a flag says which units were left out because a condition is missing.

    Raises
    ------
    DataError, InsufficientDataError
        As `evaluation.statistics.unit_means.unit_means` and `repeated_measures`.

    References
    ----------
    As `repeated_measures`. Why both units matter: Clark (1973), The language-as-fixed-effect fallacy, Journal of Verbal
    Learning and Verbal Behavior 12:335.
    """
    table = unit_means(values, conditions, units)
    found = repeated_measures(table.matrix, table.conditions)
    return replace(found, flags=table.flags + found.flags)


@dataclass(frozen=True)
class _Sphericity:
    gg: float | None
    hf: float | None
    W: float | None
    p: float | None

    @classmethod
    def of(cls, residuals: FloatArray) -> "_Sphericity":
        """Estimate how spherical the differences between conditions are, from what subjects and conditions leave."""
        n, k = residuals.shape
        d, df = k - 1, n - 1
        contrasts = (residuals / np.abs(residuals).max()) @ helmert(k).T
        roots = np.linalg.svd(contrasts, compute_uv=False)[: min(d, df)] ** 2
        gg = min(1.0, float(roots.sum() ** 2 / (roots @ roots)) / d)
        spare = df - d * gg
        # Of so few subjects the estimate is a ratio of two roundings.
        hf = (n * d * gg - 2) / (d * spare) if spare > 1e-9 * df else None
        if d == 1 or df < d:
            return cls(gg, hf, None, None)
        if roots[-1] <= roots[0] * (4 * EPSILON * max(n, k)) ** 2:
            return cls(gg, hf, 0.0, 0.0)
        log_W = float(np.log(roots).sum()) - d * math.log(float(roots.mean()))
        return cls(gg, hf, math.exp(log_W), _mauchly_p(log_W, d, df))


def _mauchly_p(log_W: float, d: int, df: int) -> float:
    rho = 1 - (2 * d**2 + d + 2) / (6 * d * df)
    # R has 3 k, the number of conditions, where Anderson has 3 d; k gives the values of R and afex.
    k = d + 1
    second = (d + 2) * (d - 1) * (d - 2) * (2 * d**3 + 6 * d**2 + 3 * k + 2) / (288 * (df * d * rho) ** 2)
    freedom = d * (d + 1) / 2 - 1
    chi_squared = -df * rho * log_W
    first = float(special.chdtrc(freedom, chi_squared))
    return min(1.0, max(0.0, first + second * (float(special.chdtrc(freedom + 4, chi_squared)) - first)))


def _corrected(F: float, df_conditions: int, df_error: int, epsilon: float | None) -> float | None:
    if epsilon is None:
        return None
    factor = min(1.0, epsilon)
    return upper_tail(F, factor * df_conditions, factor * df_error)


def _flags(error: float, spheres: _Sphericity, n: int, k: int) -> tuple[str, ...]:
    flags = []
    if error == 0:
        flags.append("The conditions differ by the same in all subjects, so F is infinite.")
    elif k > 2 and spheres.W is None:
        flags.append(f"Mauchly's test needs at least as many subjects as conditions; there are {n} and {k}.")
    elif spheres.W == 0:
        flags.append("A contrast of the conditions is the same in all subjects, so sphericity is out of the question.")
    elif spheres.p is not None and spheres.p < 0.05:
        flags.append(
            f"Mauchly's test rejects sphericity (W = {wording.share(spheres.W or 0.0)}, {wording.p_value(spheres.p)}), "
            "so the uncorrected p is too small."
        )
    if error > 0 and spheres.hf is None:
        flags.append("There are too few subjects for the estimate of Huynh and Feldt.")
    return tuple(flags)
