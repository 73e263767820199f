"""Training of many networks at once: all folds, targets and restarts of a size in batches, on all cores."""

import math
import os
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from synth.errors import SpecError
from synth.expression.levenberg_marquardt import Options, Solution, minimise
from synth.expression.network import Networks, parameter_count, start_parameters
from synth.expression.samples import check_pad, check_pairs

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

MAX_HIDDEN = 100

_BATCH_BYTES = 24_000_000
"""Size of a batch's Jacobians: so large that threads seldom wait for each other between two steps of Python."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Job:
    """One network to be trained.

    Attributes
    ----------
    hidden : int
        Number of hidden units.
    target : int
        Column of the outputs.
    rows : (N_f,) int64
        Samples that it is trained on.
    held : (M_f,) int64, optional
        Samples of the validation part, for early stopping.
    key : tuple of int
        With the seed, what its first weights are drawn from.
    """

    hidden: int
    target: int
    rows: Indices
    held: Indices | None = None
    key: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Trained:
    """One trained network.

    Attributes
    ----------
    params : (5 H + 1,) float64
        Its parameters, see `synth.expression.network.Networks`.
    sse : float
        Sum of squared residuals on the training rows.
    held_mse : float
        Mean squared residual on the validation part; NaN without one.
    iterations : int
        Steps of Levenberg and Marquardt.
    reason : str
        Why training ended, see `synth.expression.levenberg_marquardt`.
    """

    params: Floats
    sse: float
    held_mse: float
    iterations: int
    reason: str


def train_networks(
    inputs: Floats,
    outputs: Floats,
    jobs: Sequence[Job],
    *,
    seed: int,
    options: Options | None = None,
    threads: int | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[Trained]:
    """Train networks by the method of Levenberg and Marquardt (MTAP 2013, section 4.3).

    Parameters
    ----------
    inputs : (N, 3)
        PAD values, each from -1 to 1.
    outputs : (N, K)
        Wanted outputs, finite numbers.
    jobs : sequence of Job
        What to train; each job's result depends on its own fields and the seed alone.
    seed : int
        Seed of the first weights.
    options : Options, optional
        How to go about it; by default 200 iterations at most.
    threads : int, optional
        Batches trained at a time; by default as many as there are processor cores.
    on_progress : callable, optional
        Called with the number of trained networks and of all.

    Returns
    -------
    list of Trained
        In the order of the jobs.

    Raises
    ------
    SpecError
        If the samples are not pairs of finite numbers, or a job asks for rows or columns that are not there.
    """
    pad, wanted = check_pad(inputs), np.asarray(outputs, dtype=np.float64)
    check_pairs(pad, wanted)
    if wanted.ndim != 2 or not np.isfinite(wanted).all():
        raise SpecError(f"Training: the outputs, of shape {wanted.shape}, must be finite numbers (N, K).")
    for job in jobs:
        _check_job(job, wanted.shape)
    results: list[Trained | None] = [None] * len(jobs)
    tell = on_progress or (lambda _finished, _all: None)
    tell(0, len(jobs))
    finished = 0
    # The matrices are small: BLAS's own threads would only wait for each other.
    at_once = threads or os.cpu_count() or 1
    with threadpool_limits(1, user_api="blas"), ThreadPoolExecutor(at_once) as pool:
        batches = _batches(jobs, at_once)
        for numbers, trained in zip(
            batches,
            pool.map(lambda numbers: _train([jobs[k] for k in numbers], pad, wanted, seed, options), batches),
            strict=True,
        ):
            for number, one in zip(numbers, trained, strict=True):
                results[number] = one
            finished += len(numbers)
            tell(finished, len(jobs))
    return [one for one in results if one is not None]


def _check_job(job: Job, shape: tuple[int, ...]) -> None:
    if not 1 <= job.hidden <= MAX_HIDDEN:
        raise SpecError(
            f"Training: a network of {job.hidden} hidden units is asked for; 1 to {MAX_HIDDEN} are possible."
        )
    if not 0 <= job.target < shape[1]:
        raise SpecError(f"Training: there is no output {job.target}; there are {shape[1]}, counted from 0.")
    for rows in (job.rows, job.held):
        if rows is not None and (not len(rows) or rows.min() < 0 or rows.max() >= shape[0]):
            raise SpecError(f"Training: a part has no rows, or rows beyond the {shape[0]} samples.")


def _batches(jobs: Sequence[Job], threads: int) -> list[list[int]]:
    """Group the numbers of jobs of one size evenly, the largest networks first, so that no thread waits at the end."""
    by_size: dict[tuple[int, bool], list[int]] = defaultdict(list)
    for number, job in enumerate(jobs):
        by_size[job.hidden, job.held is not None].append(number)
    batches = []
    for (hidden, _), numbers in sorted(by_size.items(), reverse=True):
        longest = max(len(jobs[number].rows) for number in numbers)
        each = max(1, _BATCH_BYTES // (8 * longest * parameter_count(hidden)))
        rounds = math.ceil(len(numbers) / (each * threads))
        count = min(rounds * threads, len(numbers))
        batches += [part.tolist() for part in np.array_split(np.array(numbers), count)]
    return batches


def _train(jobs: Sequence[Job], pad: Floats, wanted: Floats, seed: int, options: Options | None) -> list[Trained]:
    problems = _problems(jobs, [job.rows for job in jobs], pad, wanted)
    held = [job.held for job in jobs if job.held is not None]
    validation = _problems(jobs, held, pad, wanted) if held else None
    start = np.stack(
        [
            start_parameters(
                job.hidden,
                float(wanted[job.rows, job.target].mean()),
                np.random.default_rng([seed, job.hidden, job.target, *job.key]),
            )
            for job in jobs
        ]
    )
    found: Solution = minimise(
        problems, start, options=options, validation=None if validation is None else validation.errors
    )
    errors = np.full(len(jobs), np.nan)
    if validation is not None:
        errors = validation.errors(found.params, np.arange(len(jobs))) / [len(rows) for rows in held]
    return [
        Trained(found.params[k], float(found.sse[k]), float(errors[k]), int(found.iterations[k]), found.reasons[k])
        for k in range(len(jobs))
    ]


def _problems(jobs: Sequence[Job], rows: Sequence[Indices], pad: Floats, wanted: Floats) -> Networks:
    """Make the least-squares problems of some rows; jobs on the same rows share their inputs."""
    parts: dict[bytes, int] = {}
    inputs: list[Floats] = []
    numbers: list[int] = []
    for own in rows:
        key = own.tobytes()
        if key not in parts:
            parts[key] = len(inputs)
            inputs.append(pad[own])
        numbers.append(parts[key])
    targets = [wanted[own, job.target] for own, job in zip(rows, jobs, strict=True)]
    return Networks(inputs, targets, numbers, hidden=jobs[0].hidden)
