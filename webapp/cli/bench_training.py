"""``padlab bench train``: how fast networks are trained, beside scipy's Levenberg-Marquardt on the same fits."""

import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import TypeVar

import click
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from synth.expression.evaluation import HIDDEN, network_jobs
from synth.expression.levenberg_marquardt import Options
from synth.expression.network import start_parameters
from synth.expression.training import Job, Trained, train_networks
from synth.expression.validation import random_split
from webapp.cli.context import echo_json

Floats = NDArray[np.float64]
Result = TypeVar("Result")

SAMPLES, FOLDS, TARGETS = 486, 10, 9
"""The size of MTAP 2013's database, its folds and PEPs."""

ITERATIONS = 150
"""Steps of ours: after them the training error equals scipy's (the ratio of the errors is among the figures)."""

EVALUATIONS = 200
"""What scipy is given, the papers' size of a training."""

SEED = 0

_COMPARED = ((0, 0), (4, 4), (8, 8))
"""Fold and PEP of the fits that scipy does, too, for each number of hidden units."""

_NUMERIC = (1, 4, 8, 14)
"""Numbers of hidden units for which scipy also goes without derivatives, which takes long."""

_STANDARD_DEVIATIONS = (0.40, 0.28, 0.22)
_NOISE = 0.25


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def train(as_json: bool) -> None:
    """Measure the full sweep of MTAP 2013: networks of 1 to 20 hidden units, ten folds, nine PEPs (1,800 trainings).

    None stops early. For each number of hidden units, its 90 trainings and three of the same fits by scipy (method
    "lm", the same first weights) take turns; the ratio is the median over these pairs of times for one fit. Scipy has
    200 evaluations at most, ours 150, with which they reach the same training error. The data are made by chance, as
    noisy as the papers' ratings.
    """
    figures = measure()
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def measure(sizes: tuple[int, ...] = HIDDEN) -> dict[str, float]:
    """Return the figures by name.

    Parameters
    ----------
    sizes : tuple of int
        Numbers of hidden units; of others than `_NUMERIC` alone, the first is also fitted without derivatives.
    """
    without_derivatives = set(_NUMERIC) & set(sizes) or set(sizes[:1])
    pad, pep = _data()
    split = random_split(SAMPLES, folds=FOLDS, rng=np.random.default_rng(SEED))
    jobs = network_jobs(split, TARGETS, sizes, seed=SEED, early_stopping=False)
    options = Options(max_iterations=ITERATIONS)
    # The first call of each library loads code.
    train_networks(pad, pep, jobs[:2], seed=SEED, options=options)
    analytic, numeric, errors, evaluations = [], [], [], []
    for size in sizes:
        own = [job for job in jobs if job.hidden == size]
        seconds, trained = _timed(partial(train_networks, pad, pep, own, seed=SEED, options=options))
        each = seconds / len(own)
        for fold, target in _COMPARED:
            place = next(k for k, job in enumerate(own) if job.key[0] == fold and job.target == target)
            fit = _Fit(pad, pep, own[place])
            other_seconds, other = _timed(partial(fit.by_scipy, analytic=True))
            analytic.append(other_seconds / each)
            errors.append(trained[place].sse / other.sse)
            evaluations.append((trained[place].iterations, other.iterations))
        if size in without_derivatives:
            other_seconds, _ = _timed(partial(fit.by_scipy, analytic=False))
            numeric.append(other_seconds / each)
    sweep, _ = _timed(partial(train_networks, pad, pep, jobs, seed=SEED, options=options))
    return {
        "train.ratio_to_scipy_analytic": round(median(analytic), 2),
        "train.ratio_to_scipy_numeric": round(median(numeric), 2),
        "train.median_sse_ratio": round(median(errors), 5),
        "train.sweep_seconds": round(sweep, 2),
        "train.sweep_fits": len(jobs),
        "train.lowest_ratio_to_scipy_analytic": round(min(analytic), 2),
        "train.median_iterations": median(own for own, _ in evaluations),
        "train.median_scipy_evaluations": median(other for _, other in evaluations),
    }


class _Fit:
    """One network's fit as scipy is best served: plain arrays, and activations that are computed once for each step."""

    def __init__(self, pad: Floats, pep: Floats, job: Job) -> None:
        self._inputs = np.column_stack([pad[job.rows], np.ones(len(job.rows))])
        self._wanted = pep[job.rows, job.target]
        self._hidden = job.hidden
        rng = np.random.default_rng([SEED, job.hidden, job.target, *job.key])
        self._start = start_parameters(job.hidden, float(self._wanted.mean()), rng)
        self._jacobian = np.empty((len(job.rows), len(self._start)))
        self._jacobian[:, -1] = 1.0
        self._at: Floats = np.full(len(self._start), np.nan)
        self._activations: Floats = np.empty((len(job.rows), job.hidden))

    def residuals(self, params: Floats) -> Floats:
        """Return outputs minus wanted outputs (N,)."""
        H = self._hidden
        if not np.array_equal(params, self._at):
            self._at = params.copy()
            self._activations = np.tanh(self._inputs @ params[: 4 * H].reshape(4, H))
        left: Floats = self._activations @ params[4 * H : -1] + (params[-1] - self._wanted)
        return left

    def jacobian(self, params: Floats) -> Floats:
        """Return their derivatives (N, 5 H + 1)."""
        H = self._hidden
        self.residuals(params)
        slopes = (1.0 - self._activations**2) * params[4 * H : -1]
        for k in range(3):
            np.multiply(slopes, self._inputs[:, k : k + 1], out=self._jacobian[:, k * H : (k + 1) * H])
        self._jacobian[:, 3 * H : 4 * H] = slopes
        self._jacobian[:, 4 * H : -1] = self._activations
        return self._jacobian

    def by_scipy(self, *, analytic: bool) -> Trained:
        """Return what scipy's Levenberg-Marquardt finds."""
        # Evaluations for finite differences do not count as such for scipy.
        found = least_squares(
            self.residuals, self._start, self.jacobian if analytic else "2-point", method="lm", max_nfev=EVALUATIONS
        )
        return Trained(found.x, 2.0 * float(found.cost), float("nan"), int(found.nfev), str(found.message))


def _data() -> tuple[Floats, Floats]:
    """Make PAD values and outputs that are not linear in them, with noise."""
    rng = np.random.default_rng(SEED)
    pad = np.clip(rng.normal(size=(SAMPLES, 3)) * _STANDARD_DEVIATIONS, -1.0, 1.0)
    directions = 1.5 * rng.normal(size=(TARGETS, 6, 3))
    bends = np.tanh(np.einsum("khi,ni->nkh", directions, pad) + rng.normal(size=(TARGETS, 6)))
    pep = np.einsum("kh,nkh->nk", 0.4 * rng.normal(size=(TARGETS, 6)), bends)
    return pad, np.clip(pep + _NOISE * rng.normal(size=pep.shape), -1.0, 1.0)


def _timed(work: Callable[[], Result]) -> tuple[float, Result]:
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result
