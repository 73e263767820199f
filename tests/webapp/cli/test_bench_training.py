"""The benchmark of training: its names, what its figures mean, and that the rival is served well."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import approx_fprime

from synth.expression.evaluation import network_jobs
from synth.expression.levenberg_marquardt import Options
from synth.expression.training import train_networks
from synth.expression.validation import random_split
from webapp.cli import bench_training, main

CONTRACT = {
    "train.ratio_to_scipy_analytic",
    "train.ratio_to_scipy_numeric",
    "train.median_sse_ratio",
    "train.sweep_seconds",
}


@pytest.fixture(scope="module")
def figures() -> dict[str, float]:
    return bench_training.measure((1, 4))


def test_figures_have_their_names_and_a_meaning(figures: dict[str, float]) -> None:
    assert set(figures) >= CONTRACT
    assert all(np.isfinite(value) and value > 0 for value in figures.values())
    # Both minimise the same sums of squares from the same start.
    assert figures["train.median_sse_ratio"] == pytest.approx(1.0, abs=0.01)
    assert figures["train.sweep_fits"] == 2 * 10 * 9
    # Derivatives cost scipy time, and the median is at least the lowest.
    assert figures["train.ratio_to_scipy_numeric"] > figures["train.ratio_to_scipy_analytic"]
    assert figures["train.ratio_to_scipy_analytic"] >= figures["train.lowest_ratio_to_scipy_analytic"]
    # Times of one sweep and of its fits in batches are of one size: a wrong unit or a missing part would show.
    assert figures["train.sweep_seconds"] < 60


def test_ours_is_the_faster(figures: dict[str, float]) -> None:
    assert figures["train.ratio_to_scipy_analytic"] > 1


def _fit(hidden: int) -> tuple[bench_training._Fit, object]:
    pad, pep = bench_training._data()
    split = random_split(bench_training.SAMPLES, folds=bench_training.FOLDS, rng=np.random.default_rng(0))
    jobs = network_jobs(split, bench_training.TARGETS, (hidden,), seed=0, early_stopping=False)
    job = next(job for job in jobs if job.target == 4)
    return bench_training._Fit(pad, pep, job), SimpleNamespace(pad=pad, pep=pep, job=job)


def test_scipy_has_the_right_derivatives_and_our_first_weights() -> None:
    fit, ours = _fit(5)
    start = fit._start.copy()
    rng = np.random.default_rng(1)
    other = start + 0.1 * rng.normal(size=start.shape)
    for at in (start, other):
        numeric = approx_fprime(at, fit.residuals, 1e-7)
        np.testing.assert_allclose(fit.jacobian(at), numeric, atol=1e-4)
    # Damped until it cannot move, ours stays where it began: there both have the same sum of squares.
    still = Options(max_iterations=1, damping=1e12)
    (trained,) = train_networks(ours.pad, ours.pep, [ours.job], seed=bench_training.SEED, options=still)
    np.testing.assert_allclose(trained.params, start, atol=1e-6)
    assert trained.sse == pytest.approx(float(np.sum(fit.residuals(start) ** 2)), rel=1e-6)


def test_sweeps_without_the_sizes_of_numeric_fits_are_measured_too() -> None:
    assert np.isfinite(list(bench_training.measure((2,)).values())).all()


def test_the_command_prints_json_or_lines(monkeypatch: pytest.MonkeyPatch, figures: dict[str, float]) -> None:
    monkeypatch.setattr(bench_training, "measure", lambda: figures)
    told = CliRunner().invoke(main, ["bench", "train", "--json"])
    assert told.exit_code == 0
    assert json.loads(told.stdout) == figures
    plain = CliRunner().invoke(main, ["bench", "train"]).stdout.splitlines()
    assert [line.split("\t")[0] for line in plain] == list(figures)
