"""From annotated expressions to a set of models, as MTAP 2013 does it (sections 4.2 to 4.4), with all its errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.calibration import Calibration
from synth.expression.evaluation import HIDDEN, Scores, choose_hidden, cross_validate, mean_of
from synth.expression.inverse import PepPadModel
from synth.expression.model_set import KINDS, ModelSet
from synth.expression.network import NetworkModel
from synth.expression.pad_pep import LinearModel, QuadraticModel
from synth.expression.pep import MTAP, peps
from synth.expression.pep_fap import PepFapModel, template
from synth.expression.samples import check_pad, check_pairs
from synth.expression.validation import Split, correlations, intermediate, nmse, random_split, split_by_category
from synth.fap.table import check_sequence, column

Floats = NDArray[np.float64]
Progress = Callable[[int, int], None]

FOLDS = 10
TEST_SHARE = 0.2
"""Folds and test set of MTAP 2013, section 4.4."""

FEW = 10
"""Samples of a fold below which its own variance is not worth being compared with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """Annotated expressions that models are trained on.

    Attributes
    ----------
    name : str
        Name of the data.
    faps : (N, 68) float64
        FAPs in FAPU, measured on the expressions or put on the avatar.
    pad : (N, 3) float64
        Their annotation, each value in [-1, 1].
    emotions : tuple of N str
        The intended emotion of each, "" if none.
    note : str
        What may be concluded from results on these data.
    pseudo : bool
        Whether a program made expressions and annotation.
    digest : str
        Sha-256 of the data.
    reliability : (3,) float64, optional
        Reliability of P, A and D, means over raters (Spearman and Brown); None if it is not known.
    """

    name: str
    faps: Floats
    pad: Floats
    emotions: tuple[str, ...]
    note: str = ""
    pseudo: bool = False
    digest: str = ""
    reliability: Floats | None = None

    def __post_init__(self) -> None:
        check_pairs(check_pad(self.pad), check_sequence(self.faps), names=("PAD", "FAP"))
        if len(self.emotions) != len(self.pad):
            raise SpecError(f"{self.name}: {len(self.emotions)} emotions are named for {len(self.pad)} expressions.")
        known = self.reliability
        if known is not None and (known.shape != (3,) or not np.isfinite(known).all()):
            raise SpecError(f"{self.name}: the reliability, of shape {known.shape}, must be three finite numbers.")


@dataclass(frozen=True, kw_only=True, eq=False)
class SetEvaluation:
    """All that is known of the errors of a set's models.

    Attributes
    ----------
    hidden : int
        Hidden units of the networks.
    hidden_nmse : dict of int to float
        Mean NMSE over folds and PEPs by number of hidden units; empty if the number was given.
    scores : dict of str to Scores
        Cross-validation by kind of model.
    chosen_fold : dict of str to int
        The fold with the intermediate error, whose model is the final one.
    test_nmse, test_correlation : dict of str to (9,) float64
        The final models on the test set.
    pep_fap_nmse : (9,) float64
        Of the PEP to FAP translation: mean over the FAPs other than the key, on the test set.
    held_out : dict of str to float
        Mean NMSE, relative to the variance of all samples, on emotions that were left out of training as a whole; empty
        where there are no emotions.
    permuted : dict of str to float
        Mean NMSE in cross-validation when PAD is shuffled among the expressions: near 1, or something leaks.
    pooled : bool
        Whether errors are relative to the variance of all training samples instead of each fold's own (Eq. 12), as
        folds have fewer than `FEW` samples.
    """

    hidden: int
    hidden_nmse: dict[int, float]
    scores: dict[str, Scores]
    chosen_fold: dict[str, int]
    test_nmse: dict[str, Floats]
    test_correlation: dict[str, Floats]
    pep_fap_nmse: Floats
    held_out: dict[str, float] = field(default_factory=dict)
    permuted: dict[str, float] = field(default_factory=dict)
    pooled: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain JSON values; NaN becomes None."""
        return {
            "folds": len(next(iter(self.scores.values())).nmse),
            "hidden": self.hidden,
            "hidden_nmse": {str(size): plain(error) for size, error in self.hidden_nmse.items()},
            "pad_pep": {
                kind: {
                    "nmse": plain(scores.mean_nmse),
                    "correlation": plain(scores.mean_correlation),
                    "nmse_by_fold": plain(scores.fold_nmse),
                    "chosen_fold": self.chosen_fold[kind],
                    "test_nmse": plain(self.test_nmse[kind]),
                    "test_correlation": plain(self.test_correlation[kind]),
                    "held_out_nmse": plain(self.held_out.get(kind, np.nan)),
                    "permuted_nmse": plain(self.permuted.get(kind, np.nan)),
                }
                for kind, scores in self.scores.items()
            },
            "pooled": self.pooled,
            "pep_fap": {"nmse": plain(self.pep_fap_nmse)},
        }


def fit_set(
    samples: Samples,
    *,
    seed: int,
    sizes: Sequence[int] = HIDDEN,
    folds: int = FOLDS,
    on_progress: Progress | None = None,
) -> tuple[ModelSet, SetEvaluation]:
    """Train and evaluate all models on annotated expressions.

    A fifth of the samples is kept for the test; on the rest, ten folds choose the number of hidden units, tell the
    errors, and give each kind of model its final one, that of the fold with the intermediate NMSE (MTAP 2013, 4.4).
    The PEP to FAP translation is learned on all but the test set (Eqs. 3 and 4); a PEP whose key FAP never moves keeps
    padlab's own template.

    Parameters
    ----------
    samples : Samples
        The expressions.
    seed : int
        Seed of splits and first weights.
    sizes : sequence of int
        Numbers of hidden units to choose from.
    folds : int
        Number of folds.
    on_progress : callable, optional
        Called with the number of trained networks and of all, in each of several passes.

    Returns
    -------
    tuple of ModelSet and SetEvaluation

    Raises
    ------
    SpecError
        If there are too few samples, no expression moves, no number of hidden units is given, or the seed is negative.
    """
    if not sizes or seed < 0:
        raise SpecError(
            f"Training: {len(sizes)} sizes and seed {seed} given; a size and a seed of at least 0 are needed."
        )
    split = random_split(
        len(samples.pad), folds=folds, test_share=TEST_SHARE, rng=np.random.default_rng([seed, len(samples.pad)])
    )
    training = np.setdiff1d(np.arange(len(samples.pad)), split.test)
    pep_fap = PepFapModel.fit(samples.faps[training], fallback=template(MTAP))
    pep = np.clip(pep_fap.invert(samples.faps), -1.0, 1.0)
    if not np.ptp(pep[training], axis=0).any():
        raise SpecError(f"{samples.name}: the key FAPs are the same in all expressions, so there is nothing to learn.")
    if np.ptp(samples.pad, axis=0).max() == 0.0:
        raise SpecError(f"{samples.name}: all expressions have the same PAD, so there is nothing to learn from.")
    # The variance of a handful of samples is a matter of chance, and would decide about errors relative to it.
    few = min(map(len, split.folds)) < FEW
    spread = pep[training].std(axis=0) if few else None
    by_size = {}
    hidden = sizes[0]
    if len(sizes) > 1:
        by_size = choose_hidden(samples.pad, pep, split, seed=seed, sizes=sizes, spread=spread, on_progress=on_progress)
        hidden = min(by_size, key=lambda size: by_size[size])
    scores = cross_validate(samples.pad, pep, split, hidden=hidden, seed=seed, spread=spread, on_progress=on_progress)
    chosen = {kind: intermediate(scores[kind].fold_nmse) for kind in KINDS}
    final = {kind: scores[kind].models[chosen[kind]] for kind in KINDS}
    predicted = {kind: model.predict(samples.pad[split.test]) for kind, model in final.items()}
    evaluation = SetEvaluation(
        hidden=hidden,
        hidden_nmse=by_size,
        scores=scores,
        chosen_fold=chosen,
        test_nmse={kind: nmse(pep[split.test], values, spread=spread) for kind, values in predicted.items()},
        test_correlation={kind: correlations(pep[split.test], values) for kind, values in predicted.items()},
        pep_fap_nmse=translation_nmse(samples.faps[split.test], pep_fap),
        held_out=_held_out(samples, pep, hidden, seed),
        permuted=_permuted(samples.pad, pep, split, hidden=hidden, seed=seed, spread=spread),
        pooled=few,
    )
    models = ModelSet(
        ann=cast(NetworkModel, final["ann"]),
        linear=cast(LinearModel, final["linear"]),
        quadratic=cast(QuadraticModel, final["quadratic"]),
        pep_fap=pep_fap,
        pep_pad=PepPadModel.fit(pep, samples.pad, split),
        calibrations={
            kind: Calibration.of(model, samples.pad[training], pep[training], reliability=samples.reliability)
            for kind, model in final.items()
        },
        origin=_origin(samples, seed, evaluation),
    )
    return models, evaluation


def translation_nmse(faps: Floats, pep_fap: PepFapModel) -> Floats:
    """Return the NMSE of each PEP's translation to FAPs (K,): mean over its FAPs but the key (MTAP 2013, Table 6).

    The key FAP itself is the PEP but for its scale, so it has no error. NaN where no other FAP varies.
    """
    errors = nmse(faps, pep_fap.translate(pep_fap.invert(faps)))
    groups = [[column(fap) for fap in pep.faps if fap != pep.key] for pep in peps(pep_fap.scheme)]
    return np.array([mean_of(errors[group][:, None])[0] if group else np.nan for group in groups])


def plain(values: Floats | float) -> Any:
    """Return numbers as JSON has them: lists, and None for what is not finite."""
    if isinstance(values, np.ndarray):
        return [plain(value) for value in values.tolist()]
    return float(values) if np.isfinite(values) else None


def _origin(samples: Samples, seed: int, evaluation: SetEvaluation) -> dict[str, Any]:
    return {
        "data": samples.name,
        "pseudo": samples.pseudo,
        "note": samples.note,
        "samples": len(samples.pad),
        "data_digest": samples.digest,
        "seed": seed,
        "evaluation": evaluation.to_dict(),
    }


def _held_out(samples: Samples, pep: Floats, hidden: int, seed: int) -> dict[str, float]:
    if len({emotion for emotion in samples.emotions if emotion and samples.emotions.count(emotion) > 1}) < 2:
        return {}
    _, split = split_by_category(samples.emotions)
    scores = cross_validate(samples.pad, pep, split, hidden=hidden, seed=seed, restarts=1, spread=pep.std(axis=0))
    sizes = np.array([len(rows) for rows in split.folds])
    return {kind: float(np.average(one.fold_nmse, weights=sizes)) for kind, one in scores.items()}


def _permuted(
    pad: Floats, pep: Floats, split: Split, *, hidden: int, seed: int, spread: Floats | None
) -> dict[str, float]:
    order = np.random.default_rng([seed, 1]).permutation(len(pad))
    scores = cross_validate(pad[order], pep, split, hidden=hidden, seed=seed, restarts=1, spread=spread)
    return {kind: float(mean_of(one.mean_nmse[:, None])[0]) for kind, one in scores.items()}
