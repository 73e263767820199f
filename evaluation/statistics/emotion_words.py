"""The emotion word nearest to a point of PAD space."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import linalg

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import centred_columns, finite_array
from evaluation.statistics.result import Result

Metric = Literal["euclidean", "mahalanobis"]
"""How distances are measured."""

MTAP_2013_WORDS: Mapping[str, tuple[float, float, float]] = {
    "Happy": (0.55, 0.24, 0.28),
    "Surprise": (0.34, 0.34, 0.04),
    "Sad": (-0.18, 0.03, -0.14),
    "Scornful": (-0.32, 0.06, 0.20),
    "Relax": (0.44, -0.13, 0.21),
    "Anxious": (-0.19, 0.06, -0.13),
    "Mildness": (0.31, -0.16, 0.08),
    "Scared": (-0.19, 0.26, -0.13),
    "Angry": (-0.40, 0.22, 0.12),
    "Disgust": (-0.36, 0.08, 0.13),
    "Optimistic": (0.50, 0.21, 0.35),
    "Hostile": (-0.42, 0.20, 0.22),
    "Boring": (-0.11, -0.25, -0.17),
    "Dependent": (0.08, -0.16, -0.30),
}
"""PAD of the fourteen words of the emotion14 instrument: the input PAD of Jia et al. (2013), Table 8, as printed.

The print seems to be scaled by 1/5 where Eq. 13 has 1/4: on that scale the words lie 1.25 times as far out.
"""

# Distances that differ by less, in terms of the larger coordinates, are equal.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class NearestWords(Result):
    """The words nearest to points.

    Attributes
    ----------
    words : tuple of str
        The words that there are.
    nearest : tuple of tuple of str
        Of each point the nearest word, or all those that tie for it.
    distance : numpy.ndarray, shape (points,)
        Distance to it.
    distances : numpy.ndarray, shape (points, words)
        Distances to all words.
    metric : {"euclidean", "mahalanobis"}
        How they were measured.
    """

    words: tuple[str, ...]
    nearest: tuple[tuple[str, ...], ...]
    distance: FloatArray
    distances: FloatArray
    metric: Metric

    @property
    def tied(self) -> tuple[bool, ...]:
        """Tell of each point whether several words are equally near."""
        return tuple(len(words) > 1 for words in self.nearest)

    def apa(self) -> str:
        """Return the nearest word of a single point, or how far points are from theirs on average."""
        metric = self.metric.capitalize()
        if len(self.nearest) == 1:
            what = "Nearest words (a tie)" if self.tied[0] else "Nearest word"
            return f"{what}: {', '.join(self.nearest[0])} ({metric} distance {wording.number(float(self.distance[0]))})"
        kinds = len({word for words in self.nearest for word in words})
        return (
            f"{len(self.nearest)} points are nearest to {kinds} of {len(self.words)} words, at a mean {metric} "
            f"distance of {wording.number(float(self.distance.mean()))}"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each point: word (several with "/" between in a tie), distance, whether it ties."""
        return pd.DataFrame(
            {
                "word": ["/".join(words) for words in self.nearest],
                "distance": self.distance,
                "tied": list(self.tied),
            }
        )


def nearest_words(
    points: npt.ArrayLike,
    table: Mapping[str, Sequence[float]] = MTAP_2013_WORDS,
    *,
    metric: Metric = "euclidean",
    covariance: npt.ArrayLike | None = None,
) -> NearestWords:
    """Return the word nearest to each point.

    Parameters
    ----------
    points : array_like, shape (n, d) or (d,)
        Points, in the units of the table: PAD from -1 to 1.
    table : mapping of str to sequence of float, length d
        Where each word lies; left out, the fourteen words of Jia et al. (2013).
    metric : {"euclidean", "mahalanobis"}
        "mahalanobis" counts a difference for less along directions in which points scatter much.
    covariance : array_like, shape (d, d), optional
        Covariance that the Mahalanobis distance is measured by, for instance of the annotations of one face; left out,
        that of the words of the table (n - 1).

    Returns
    -------
    NearestWords
        The nearest word of each point, or all those at the same distance, and the distances.

    Raises
    ------
    DataError
        If the points or the table are no finite numbers of the same dimensions, there are no words or no points, the
        metric is unknown, or the covariance is not symmetric and positive definite.
    InsufficientDataError
        If the words lie in a plane (line), so that they have no covariance to measure by.

    References
    ----------
    Mahalanobis (1936), Proc. Natl. Inst. Sci. India 2:49. Jia et al. (2013), Table 8 (the words).
    """
    names = tuple(str(word) for word in table)
    if not names:
        raise DataError("The table has no words.")
    places = finite_array(list(table.values()), axes=("words", "dimensions"), name="table")
    given = np.asarray(points, dtype=object)
    many = finite_array(given[None] if given.ndim == 1 else given, axes=("points", "dimensions"), name="points")
    if not len(many):
        raise DataError("There are no points.")
    if many.shape[1] != places.shape[1]:
        raise DataError(f"The points have {many.shape[1]} dimensions, but the words have {places.shape[1]}.")
    if metric not in ("euclidean", "mahalanobis"):
        raise DataError(f'metric is {metric!r}, but must be "euclidean" or "mahalanobis".')
    differences = many[:, None, :] - places
    if metric == "mahalanobis":
        root = _root(_covariance(places, covariance))
        flat = linalg.solve_triangular(root, differences.reshape(-1, places.shape[1]).T, lower=True)
        differences = flat.T.reshape(differences.shape)
    elif covariance is not None:
        raise DataError("A covariance is for the Mahalanobis distance alone.")
    distances: FloatArray = np.sqrt((differences**2).sum(axis=2))
    distance = distances.min(axis=1)
    equal = distances <= (distance + _ROUNDING * (distance + np.abs(differences).max(axis=(1, 2))))[:, None]
    nearest = tuple(tuple(names[k] for k in np.flatnonzero(row)) for row in equal)
    ties = sum(len(words) > 1 for words in nearest)
    return NearestWords(
        words=names,
        nearest=nearest,
        distance=distance,
        distances=distances,
        metric=metric,
        flags=(f"{ties} of {len(nearest)} points are equally near to several words.",) if ties else (),
    )


def _covariance(places: FloatArray, covariance: npt.ArrayLike | None) -> FloatArray:
    d = places.shape[1]
    if covariance is not None:
        matrix = finite_array(covariance, axes=("dimensions", "dimensions"), name="covariance")
        if matrix.shape != (d, d) or not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0):
            raise DataError(f"covariance must be a symmetric table of {d} x {d} numbers.")
        if not _regular(matrix):
            raise DataError("covariance must be positive definite, but has no spread in some direction.")
        return matrix
    _, rest = centred_columns(places)
    matrix = rest.T @ rest / max(len(places) - 1, 1)
    if not _regular(matrix):
        raise InsufficientDataError(f"The {len(places)} words have no spread in some direction: give a covariance.")
    return matrix


def _regular(matrix: FloatArray) -> bool:
    scales = np.sqrt(np.diag(matrix).clip(min=0))
    if not scales.all():
        return False
    return bool(np.linalg.eigvalsh(matrix / np.outer(scales, scales)).min() > 1e-10)


def _root(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.cholesky(matrix), dtype=float)
