"""Cross-validation of the PAD to PEP models, and the choice of the networks' size (MTAP 2013, section 4.4)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.levenberg_marquardt import Options
from synth.expression.model_set import KINDS
from synth.expression.network import NetworkModel
from synth.expression.pad_pep import LinearModel, PadPepModel, QuadraticModel
from synth.expression.training import Job, Trained, train_networks
from synth.expression.validation import Split, correlations, nmse

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Progress = Callable[[int, int], None]

HIDDEN = tuple(range(1, 21))
"""Numbers of hidden units that the paper tried."""

RESTARTS = 5
"""First weights from which each network of the chosen size is trained; the best on the validation part stays."""

_HELD_SHARE = 0.15
"""Part of a fold's training samples that is kept for early stopping."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Errors and correlations of one kind of model.

    Attributes
    ----------
    nmse, correlation : (F, K) float64
        Of each PEP on each fold (MTAP 2013, Eq. 12); NaN where a PEP does not vary.
    models : tuple of PadPepModel
        The model of each fold.
    """

    nmse: Floats
    correlation: Floats
    models: tuple[PadPepModel, ...]

    @property
    def mean_nmse(self) -> Floats:
        """Mean over folds (K,)."""
        return mean_of(self.nmse)

    @property
    def mean_correlation(self) -> Floats:
        """Mean over folds (K,)."""
        return mean_of(self.correlation)

    @property
    def fold_nmse(self) -> Floats:
        """Mean over PEPs, for each fold (F,)."""
        return mean_of(self.nmse.T)


def cross_validate(
    pad: Floats,
    pep: Floats,
    split: Split,
    *,
    hidden: int,
    seed: int,
    kinds: Sequence[str] = KINDS,
    restarts: int = RESTARTS,
    spread: Floats | None = None,
    options: Options | None = None,
    on_progress: Progress | None = None,
) -> dict[str, Scores]:
    """Train each kind of model on all folds but one and test it on that, for each fold.

    Parameters
    ----------
    pad : (N, 3)
        PAD values.
    pep : (N, K)
        PEP values.
    split : Split
        The folds.
    hidden : int
        Hidden units of the networks.
    seed : int
        Seed of their first weights and validation parts.
    kinds : sequence of str
        Which of "ann", "linear" and "quadratic".
    restarts : int
        Networks trained for each fold and PEP, of which the best on the validation part counts.
    spread : (K,), optional
        As in `synth.expression.validation.nmse`.
    options, on_progress
        As in `synth.expression.training.train_networks`.

    Returns
    -------
    dict of str to Scores
        By kind.

    Raises
    ------
    SpecError
        If the samples are not pairs of finite numbers, or too few.
    """
    fits: dict[str, Callable[[Floats, Floats], PadPepModel]] = {
        "linear": LinearModel.fit,
        "quadratic": QuadraticModel.fit,
    }
    found = {}
    for kind in kinds:
        if kind == "ann":
            jobs = network_jobs(split, pep.shape[1], (hidden,), seed=seed, restarts=restarts)
            trained = train_networks(pad, pep, jobs, seed=seed, options=options, on_progress=on_progress)
            models: Sequence[PadPepModel] = _best_of(jobs, trained, len(split.folds), pep.shape[1])
        elif kind in fits:
            models = [fits[kind](pad[rows], pep[rows]) for rows in map(split.rest, range(len(split.folds)))]
        else:
            raise SpecError(f"There is no kind of model {kind!r}; there are {', '.join(KINDS)}.")
        found[kind] = _scored(pad, pep, split, models, spread)
    return found


def choose_hidden(
    pad: Floats,
    pep: Floats,
    split: Split,
    *,
    seed: int,
    sizes: Sequence[int] = HIDDEN,
    spread: Floats | None = None,
    options: Options | None = None,
    on_progress: Progress | None = None,
) -> dict[int, float]:
    """Return the mean NMSE over folds and PEPs for each number of hidden units; the lowest is the best choice.

    Each fold and PEP has one network of each size: 1,800 trainings for sizes 1 to 20, ten folds and nine PEPs.
    Parameters and errors are those of `cross_validate`.
    """
    jobs = network_jobs(split, pep.shape[1], sizes, seed=seed)
    trained = train_networks(pad, pep, jobs, seed=seed, options=options, on_progress=on_progress)
    result = {}
    for size in sizes:
        own = [(job, one) for job, one in zip(jobs, trained, strict=True) if job.hidden == size]
        models = _best_of([job for job, _ in own], [one for _, one in own], len(split.folds), pep.shape[1])
        result[size] = float(mean_of(_scored(pad, pep, split, models, spread).nmse.reshape(-1, 1))[0])
    return result


def network_jobs(
    split: Split, targets: int, sizes: Sequence[int], *, seed: int, restarts: int = 1, early_stopping: bool = True
) -> list[Job]:
    """Return the trainings of all folds, PEPs, sizes and restarts; each fold keeps a part for early stopping."""
    parts: list[tuple[Indices, Indices | None]] = []
    for fold in range(len(split.folds)):
        rows = split.rest(fold)
        if not early_stopping:
            parts.append((rows, None))
            continue
        held = np.sort(np.random.default_rng([seed, fold]).permutation(rows)[: max(1, round(_HELD_SHARE * len(rows)))])
        parts.append((np.setdiff1d(rows, held), held))
    return [
        Job(hidden=size, target=target, rows=rows, held=held, key=(fold, restart))
        for size in sizes
        for fold, (rows, held) in enumerate(parts)
        for target in range(targets)
        for restart in range(restarts)
    ]


def _best_of(jobs: Sequence[Job], trained: Sequence[Trained], folds: int, targets: int) -> list[NetworkModel]:
    """Put the networks of each fold together, of each PEP's restarts the one with the lowest validation error."""
    best: dict[tuple[int, int], Trained] = {}
    for job, one in zip(jobs, trained, strict=True):
        place = job.key[0], job.target
        if place not in best or one.held_mse < best[place].held_mse:
            best[place] = one
    return [
        NetworkModel.of_parameters(np.stack([best[fold, target].params for target in range(targets)]))
        for fold in range(folds)
    ]


def _scored(
    pad: Floats, pep: Floats, split: Split, models: Sequence[PadPepModel], spread: Floats | None = None
) -> Scores:
    predicted = [model.predict(pad[rows]) for model, rows in zip(models, split.folds, strict=True)]
    actual = [pep[rows] for rows in split.folds]
    pairs = list(zip(actual, predicted, strict=True))
    return Scores(
        nmse=np.stack([nmse(a, p, spread=spread) for a, p in pairs]),
        correlation=np.stack([correlations(a, p) for a, p in pairs]),
        models=tuple(models),
    )


def mean_of(values: Floats) -> Floats:
    """Return the mean of each column without its NaN; NaN for a column of nothing else."""
    there = np.isfinite(values)
    counts = there.sum(axis=0)
    sums = np.where(there, values, 0.0).sum(axis=0)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
