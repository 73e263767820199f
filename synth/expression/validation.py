"""How well a model predicts: errors, correlations, and the ways the papers part their samples."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_CONSTANT = 1e-12
"""Standard deviation below which a parameter of size 1 counts as constant."""


def nmse(actual: Floats, predicted: Floats, *, spread: Floats | None = None) -> Floats:
    """Return the normalised mean square error of each column (MTAP 2013, Eq. 12).

    ``mean((y - y_hat)^2) / var(y)`` with the variance of the same samples (divisor N). 0 is perfect; 1 is as good as
    the mean; a column that does not vary has none (NaN).

    Parameters
    ----------
    actual, predicted : (N, K)
        Real and predicted values.
    spread : (K,), optional
        Standard deviations to be used instead of those of the samples, for samples that are alike on purpose.

    Returns
    -------
    (K,) float64

    Raises
    ------
    SpecError
        If the shapes differ or there are fewer than two samples.
    """
    actual, predicted = _pair(actual, predicted)
    sd = actual.std(axis=0) if spread is None else spread
    varies = sd > _CONSTANT
    error = np.mean((actual - predicted) ** 2, axis=0)
    return np.where(varies, error / np.where(varies, sd, 1.0) ** 2, np.nan)


def correlations(actual: Floats, predicted: Floats) -> Floats:
    """Return Pearson's correlation of each column (MTAP 2013, Eq. 12): (K,); NaN where one side does not vary."""
    actual, predicted = _pair(actual, predicted)
    spread, other = actual.std(axis=0), predicted.std(axis=0)
    varies = (spread > _CONSTANT) & (other > _CONSTANT)
    products = np.mean((actual - actual.mean(axis=0)) * (predicted - predicted.mean(axis=0)), axis=0)
    return np.where(varies, np.clip(products / np.where(varies, spread * other, 1.0), -1.0, 1.0), np.nan)


def _pair(actual: Floats, predicted: Floats) -> tuple[Floats, Floats]:
    if actual.shape != predicted.shape or actual.ndim != 2 or len(actual) < 2:
        raise SpecError(
            f"Validation: real values {actual.shape} and predicted ones {predicted.shape} must have one shape (N, K), "
            "with at least two samples."
        )
    return actual, predicted


@dataclass(frozen=True, eq=False)
class Split:
    """Samples for training, in folds, and samples kept for the test.

    Attributes
    ----------
    folds : tuple of (M_f,) int64
        The validation subset of each fold; each training sample is in just one.
    test : (T,) int64
        The test set, none of which is in a fold; may be empty.
    always : (A,) int64
        Samples that every model is trained on and none is validated with; may be empty.
    """

    folds: tuple[Indices, ...]
    test: Indices = field(default_factory=lambda: np.array([], dtype=np.int64))
    always: Indices = field(default_factory=lambda: np.array([], dtype=np.int64))

    def rest(self, fold: int) -> Indices:
        """Return the samples that a fold's model is trained on, in order: all but the fold's and the test's."""
        return np.sort(np.concatenate([self.always, *(rows for k, rows in enumerate(self.folds) if k != fold)]))


def random_split(count: int, *, folds: int = 10, test_share: float = 0.2, rng: np.random.Generator) -> Split:
    """Part samples at random: a test set, and the rest in folds of equal size but for one (MTAP 2013, section 4.4).

    Raises
    ------
    SpecError
        If the folds would have fewer than two samples, or there are fewer than two folds.
    """
    order = rng.permutation(count)
    held = round(test_share * count)
    if folds < 2 or not 0.0 <= test_share < 1.0 or (count - held) < 2 * folds:
        raise SpecError(
            f"Validation: {count} samples cannot be parted into a test set of {test_share:.0%} and {folds} folds "
            "of at least two samples each."
        )
    return Split(tuple(np.sort(part) for part in np.array_split(order[held:], folds)), np.sort(order[:held]))


def split_by_subject(
    subjects: Sequence[str],
    expressions: Sequence[str],
    *,
    folds: int = 10,
    test_each: int = 2,
    rng: np.random.Generator,
) -> Split:
    """Part samples so that the test set and each fold cover all subjects (ACII 2007, section 6.1).

    The test set takes so many different expressions of each subject, one sample of each; what remains of a subject is
    dealt out to the folds in turn.

    Parameters
    ----------
    subjects, expressions : sequence of str
        Who shows what, for each sample.
    folds, test_each : int
        How many folds, and how many expressions of each subject are tested.
    rng : numpy.random.Generator
        Source of chance.

    Raises
    ------
    SpecError
        If a subject has too few expressions for the test, or too few samples for each fold to cover it.
    """
    who, what = np.asarray(subjects), np.asarray(expressions)
    if who.shape != what.shape or folds < 2:
        raise SpecError("Validation: each sample needs a subject and an expression, and there must be two folds.")
    test: list[int] = []
    parts: list[list[int]] = [[] for _ in range(folds)]
    turn = 0
    for subject in np.unique(who):
        own = np.flatnonzero(who == subject)
        kinds = np.unique(what[own])
        if len(kinds) < test_each or len(own) - test_each < folds:
            raise SpecError(
                f"Validation: subject {subject!r} has {len(own)} samples of {len(kinds)} expressions, but {test_each} "
                f"expressions for the test and {folds} samples for the folds are needed."
            )
        tested = [int(rng.choice(own[what[own] == kind])) for kind in rng.choice(kinds, test_each, replace=False)]
        test += tested
        # Going on where the last subject ended keeps the folds alike in size.
        for row in rng.permutation(np.setdiff1d(own, tested)):
            parts[turn % folds].append(int(row))
            turn += 1
    return Split(tuple(np.sort(np.array(part, dtype=np.int64)) for part in parts), np.sort(np.array(test, dtype=int)))


def split_by_category(categories: Sequence[str]) -> tuple[tuple[str, ...], Split]:
    """Make each category a fold of its own, so that a model is tested on emotions that it has never seen.

    Returns
    -------
    tuple
        The categories and the split, without a test set. All models are trained on samples without a category, and on
        categories of a single sample.

    Raises
    ------
    SpecError
        If there are fewer than two categories with two samples.
    """
    labels = np.asarray(categories)
    names = [str(name) for name in np.unique(labels) if name and (labels == name).sum() > 1]
    if len(names) < 2:
        raise SpecError("Validation: holding out categories needs at least two of them, with two samples each.")
    folds = tuple(np.flatnonzero(labels == name) for name in names)
    return tuple(names), Split(folds, always=np.setdiff1d(np.arange(len(labels)), np.concatenate(folds)))


def intermediate(errors: Floats) -> int:
    """Return the fold with the intermediate error: the lower median (MTAP 2013, section 4.4)."""
    order = np.argsort(errors, kind="stable")
    return int(order[(len(order) - 1) // 2])
