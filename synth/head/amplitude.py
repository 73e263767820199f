"""Eq. 2 of MTAP 2013: the amplitude of a prosodic word's head motion as a quadratic function of its P and A.

    Amp = P (C1 A^2 + C2 A + C3) + (1 - P) (C4 A^2 + C5 A + C6)

for each axis. P blends two parabolas in A: one for commendatory words (P = 1), one for neutral words (P = 0).

The paper prints no coefficients. `default_model` fits them to amplitudes that are generated from what it does print
(Tables 1 and 3, and in words that Amp rises with A) and from padlab's stated assumption about the trend. So they
show what Eq. 2 does, and not how the paper's speaker moved; `AmplitudeModel.fit` takes the data of a real recording.
"""

from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray
from scipy import optimize, stats

from synth.errors import SpecError
from synth.head.published import printed, published_counts, published_statistics

Floats = NDArray[np.float64]

TERMS = 6
"""Number of coefficients of an axis."""


@dataclass(frozen=True, eq=False)
class AmplitudeModel:
    """Eq. 2 with its coefficients.

    Attributes
    ----------
    coefficients : (6, 3) float64
        C1 to C6 in the rows; pitch, yaw and roll in the columns, in degrees.
    residual_sd : (3,) float64
        Standard deviation of the amplitudes about the fit, with n - 6 degrees of freedom; 0 for a fit through 6 values.
    explained : (3,) float64
        Share of the amplitudes' variance that the fit explains, 0 to 1.
    n : int
        Number of words it was fitted to.
    """

    coefficients: Floats
    residual_sd: Floats
    explained: Floats
    n: int

    @classmethod
    def fit(cls, P: npt.ArrayLike, A: npt.ArrayLike, amplitudes: npt.ArrayLike) -> Self:
        """Find the coefficients by linear least squares (singular values, no inverse).

        Parameters
        ----------
        P, A : array_like, shape (N,)
            Of each word, in [-1, 1]. Silence (P = 0, A = -0.5) belongs among them: the words of Table 1 alone have
            only two values of A where P is 0, through which no single parabola goes.
        amplitudes : array_like, shape (N, 3)
            Amp of pitch, yaw and roll in degrees, at least 0.

        Raises
        ------
        SpecError
            If the arrays are malformed, or the words do not determine all six coefficients.
        """
        p, a = _pa(P, A)
        y = np.asarray(amplitudes, dtype=np.float64)
        if y.shape != (len(p), 3):
            raise SpecError(
                f"Amplitude: the amplitudes have shape {y.shape}, but must be ({len(p)}, 3), a row for each word."
            )
        if not np.isfinite(y).all() or (y < 0.0).any():
            raise SpecError("Amplitude: an amplitude is negative or not finite; it is the way from valley to peak.")
        terms = _terms(p, a)
        coefficients, _, rank, _ = np.linalg.lstsq(terms, y, rcond=None) if len(p) else (y, y, 0, y)
        if rank < TERMS:
            raise SpecError(_deficiency(p, a, int(rank)))
        rest = np.sum((y - terms @ coefficients) ** 2, axis=0)
        total = np.sum((y - y.mean(axis=0)) ** 2, axis=0)
        freedom = len(p) - TERMS
        return cls(
            coefficients=np.asarray(coefficients, dtype=np.float64),
            residual_sd=np.sqrt(rest / freedom) if freedom else np.zeros(3),
            # An axis that never varies is explained wholly by its constant.
            explained=1.0 - np.divide(rest, total, out=np.zeros(3), where=total > 0.0),
            n=len(p),
        )

    def predict(self, P: npt.ArrayLike, A: npt.ArrayLike, *, extrapolate: bool = False) -> Floats:
        """Return the amplitudes (N, 3) in degrees, never less than 0, of words with P and A (N,) in [-1, 1].

        Parameters
        ----------
        P, A : array_like, shape (N,)
            Of each word.
        extrapolate : bool
            What to do with derogatory words, of which the paper's recording has none. As a rule they move as neutral
            words of the same A do: P below 0 counts as 0, the nearest that was seen. If True, Eq. 2 is carried on as
            it stands, at P = -1 to twice the neutral parabola less the commendatory one.

        Raises
        ------
        SpecError
            If the arrays are malformed.
        """
        p, a = _pa(P, A)
        return np.maximum(_terms(p if extrapolate else np.maximum(p, 0.0), a) @ self.coefficients, 0.0)


@dataclass(frozen=True, eq=False)
class AmplitudeSample:
    """Words with amplitudes.

    Attributes
    ----------
    P, A : (N,) float64
        Of each word or silence.
    amplitudes : (N, 3) float64
        Amp of pitch, yaw and roll in degrees.
    spoken : (N,) bool
        Whether it is a word rather than silence.
    """

    P: Floats
    A: Floats
    amplitudes: Floats
    spoken: NDArray[np.bool_]


@cache
def printed_sample() -> AmplitudeSample:
    """Return amplitudes that agree with what MTAP 2013 prints; generated, not measured.

    As many words as in Table 1 in each class of (P, A), and pauses at (0, -0.5). For each axis, over the words, mean
    and standard deviation (n - 1) of Amp are those of Table 3. Assumed, as ``head_motion.json`` states: class means
    that grow by one factor per step of A, alike for P = 0 and 1, and explain a given share of the variance; within a
    class log-normal amplitudes, of which the quantiles are taken, so that nothing is drawn. Means that grow by a
    factor cannot become negative at silence, as a straight line would for roll.
    """
    assumed = printed()["assumed"]
    silence = (float(printed()["silence"]["P"]), float(printed()["silence"]["A"]))
    classes = [*published_counts().items(), (silence, assumed["silences"])]
    P, A = (np.concatenate([np.full(n, pa[k]) for pa, n in classes]) for k in (0, 1))
    spoken = np.concatenate([np.full(n, pa != silence) for pa, n in classes])
    # Normal quantiles at (k - 1/2) / n within each class.
    quantiles = np.concatenate([stats.norm.ppf((np.arange(n) + 0.5) / n) for _, n in classes])
    sizes = [n for _, n in classes]
    table = published_statistics()
    amplitudes = [
        _axis_sample(A, spoken, quantiles, sizes, mean=mean, sd=sd, share=assumed["explained_variance"])
        for mean, sd in zip(table.amp_mean, table.amp_sd, strict=True)
    ]
    return AmplitudeSample(P=P, A=A, amplitudes=np.stack(amplitudes, axis=1), spoken=spoken)


@cache
def default_model() -> AmplitudeModel:
    """Return Eq. 2 fitted to `printed_sample`: coefficients derived from printed statistics and a stated assumption."""
    sample = printed_sample()
    return AmplitudeModel.fit(sample.P, sample.A, sample.amplitudes)


def _axis_sample(
    A: Floats,
    spoken: NDArray[np.bool_],
    quantiles: Floats,
    sizes: list[int],
    *,
    mean: float,
    sd: float,
    share: float,
) -> Floats:
    """Return amplitudes (N,) of one axis whose mean and standard deviation over the words are as given."""

    def class_means(growth: float) -> Floats:
        raw = np.exp(growth * A)
        return np.asarray(raw * (mean / raw[spoken].mean()), dtype=np.float64)

    def scattered(width: float) -> Floats:
        raw = np.exp(width * quantiles)
        class_raw_means = [part.mean() for part in np.split(raw, np.cumsum(sizes)[:-1])]
        return np.asarray(means * raw / np.repeat(class_raw_means, sizes), dtype=np.float64)

    growth = optimize.brentq(lambda at: class_means(at)[spoken].var(ddof=1) - share * sd**2, 0.0, 10.0, xtol=1e-14)
    means = class_means(growth)
    width = optimize.brentq(lambda at: scattered(at)[spoken].var(ddof=1) - sd**2, 0.0, 5.0, xtol=1e-14)
    return scattered(width)


def _terms(p: Floats, a: Floats) -> Floats:
    parabola = np.stack([a**2, a, np.ones_like(a)], axis=1)
    return np.hstack([p[:, None] * parabola, (1.0 - p[:, None]) * parabola])


def _pa(P: npt.ArrayLike, A: npt.ArrayLike) -> tuple[Floats, Floats]:
    p, a = np.asarray(P, dtype=np.float64), np.asarray(A, dtype=np.float64)
    if p.ndim != 1 or p.shape != a.shape:
        raise SpecError(f"Amplitude: P has shape {p.shape} and A {a.shape}, but both must be (N,).")
    for name, values in (("P", p), ("A", a)):
        if not (np.abs(values) <= 1.0).all():
            wrong = values[~(np.abs(values) <= 1.0)][0]
            raise SpecError(f"Amplitude: {name} is {wrong}, but must be a number from -1 to 1.")
    return p, a


def _deficiency(p: Floats, a: Floats, rank: int) -> str:
    """Return what lacks for six coefficients."""
    start = f"Amplitude: these {len(p)} amplitudes determine only {rank} of the 6 coefficients of Eq. 2; "
    for value in (0.0, 1.0):
        found = np.unique(a[p == value])
        if np.isin(p, (0.0, 1.0)).all() and len(found) < 3:
            listed = ", ".join(f"{one:g}" for one in found) or "none"
            hint = " (silence is one: P = 0, A = -0.5)" if value == 0.0 else ""
            return f"{start}where P is {value:g}, three different values of A are needed{hint}, but there are {listed}."
    return f"{start}give words with at least two values of P, and three values of A at each."
