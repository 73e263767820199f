"""Evaluation of the polynomial as ACII 2007 describes it (section 6.1, Table 7)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.evaluation import mean_of
from synth.expression.pad_pep import QuadraticModel
from synth.expression.validation import correlations, intermediate, split_by_subject

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AciiEvaluation:
    """Correlations of real and estimated PEPs.

    Attributes
    ----------
    codes : tuple of K str
        The PEPs.
    by_fold : (F, K) float64
        On each fold's validation subset; NaN where a PEP does not vary there.
    chosen_fold : int
        The fold with the intermediate correlation, whose model is the final one.
    test : (K,) float64
        The final model on the test set.
    """

    codes: tuple[str, ...]
    by_fold: Floats
    chosen_fold: int
    test: Floats

    @property
    def mean(self) -> Floats:
        """Mean over folds (K,)."""
        return mean_of(self.by_fold)

    @property
    def minimum(self) -> Floats:
        """Lowest of the folds (K,)."""
        return np.asarray(np.fmin.reduce(self.by_fold, axis=0))

    @property
    def maximum(self) -> Floats:
        """Highest of the folds (K,)."""
        return np.asarray(np.fmax.reduce(self.by_fold, axis=0))


def evaluate_polynomial(
    pad: Floats,
    pep: Floats,
    *,
    codes: Sequence[str],
    subjects: Sequence[str],
    expressions: Sequence[str],
    folds: int = 10,
    seed: int,
) -> AciiEvaluation:
    """Fit and test the second-order polynomial (Eq. 3) on folds that each cover all subjects.

    Parameters
    ----------
    pad : (N, 3)
        PAD values.
    pep : (N, K)
        PEP values.
    codes : sequence of K str
        Their codes.
    subjects, expressions : sequence of N str
        Who shows what; two expressions of each subject are kept for the test.
    folds : int
        Number of folds.
    seed : int
        Seed of the split.

    Raises
    ------
    SpecError
        If the samples are not pairs of finite numbers, names are missing, or a subject has too few samples.
    """
    if not len(pad) == len(pep) == len(subjects) == len(expressions) or pep.ndim != 2 or len(codes) != pep.shape[1]:
        raise SpecError(
            f"Evaluation: {len(pad)} PAD, {len(pep)} PEP, {len(subjects)} subjects, {len(expressions)} expressions and "
            f"{len(codes)} codes are given, but each sample needs one of each, and each PEP a code."
        )
    split = split_by_subject(subjects, expressions, folds=folds, rng=np.random.default_rng([seed, len(pad)]))
    models = [QuadraticModel.fit(pad[rows], pep[rows]) for rows in map(split.rest, range(folds))]
    by_fold = np.stack(
        [correlations(pep[rows], model.predict(pad[rows])) for rows, model in zip(split.folds, models, strict=True)]
    )
    chosen = intermediate(mean_of(by_fold.T))
    return AciiEvaluation(
        codes=tuple(codes),
        by_fold=by_fold,
        chosen_fold=chosen,
        test=correlations(pep[split.test], models[chosen].predict(pad[split.test])),
    )
