import numpy as np
import pytest
from scipy.optimize import least_squares

from synth.errors import SpecError
from synth.expression.levenberg_marquardt import Options
from synth.expression.network import NetworkModel, Networks, start_parameters
from synth.expression.training import Job, train_networks

PAD = np.random.default_rng(1).uniform(-1, 1, (80, 3))
PEP = np.column_stack([np.tanh(3 * PAD[:, 0] * PAD[:, 1]), np.abs(PAD[:, 2]), PAD @ [0.3, -0.2, 0.1]])
ROWS = np.arange(60)


def jobs(held=None):
    return [
        Job(hidden=size, target=target, rows=ROWS, held=held, key=(size,)) for size in (4, 2) for target in range(3)
    ]


def test_networks_learn_what_is_not_linear():
    trained = train_networks(PAD, PEP, [Job(hidden=6, target=k, rows=ROWS) for k in range(3)], seed=0)
    model = NetworkModel.of_parameters(np.stack([one.params for one in trained]))
    error = np.mean((model.predict(PAD[60:]) - PEP[60:]) ** 2, axis=0) / PEP[60:].var(axis=0)
    assert (error < 0.05).all()


def test_the_training_error_is_that_of_the_training_rows():
    for job, one in zip(jobs(), train_networks(PAD, PEP, jobs(), seed=3), strict=True):
        left = NetworkModel.of_parameters(one.params[None]).predict(PAD[ROWS])[:, 0] - PEP[ROWS, job.target]
        # Predictions are cut to [-1, 1], where all wanted values lie.
        assert left @ left <= one.sse * (1 + 1e-9)
        assert np.isnan(one.held_mse)


def scipy_sse(pad, wanted, job, seed):
    """What scipy's Levenberg-Marquardt reaches from the same first weights with as many evaluations."""
    problem, which = Networks([pad], [wanted], [0], hidden=job.hidden), np.array([0])
    rng = np.random.default_rng([seed, job.hidden, job.target, *job.key])
    found = least_squares(
        lambda b: problem.residuals(b[None], which)[0][0],
        start_parameters(job.hidden, float(wanted.mean()), rng),
        lambda b: problem.jacobian(b[None], which, problem.residuals(b[None], which)[1])[0].T,
        method="lm",
        max_nfev=200,
    )
    return 2 * found.cost


def test_it_trains_as_well_as_scipy():
    noisy = PEP + 0.1 * np.random.default_rng(6).normal(size=PEP.shape)
    trained = train_networks(PAD, noisy, jobs(), seed=5)
    ratios = [
        one.sse / scipy_sse(PAD[ROWS], noisy[ROWS, job.target], job, 5)
        for one, job in zip(trained, jobs(), strict=True)
    ]
    assert np.median(ratios) < 1.01


def test_results_do_not_depend_on_order_threads_or_company():
    together = train_networks(PAD, PEP, jobs(np.arange(60, 80)), seed=7, threads=2)
    backwards = train_networks(PAD, PEP, jobs(np.arange(60, 80))[::-1], seed=7, threads=1)[::-1]
    alone = train_networks(PAD, PEP, jobs(np.arange(60, 80))[:1], seed=7)
    for one, other in zip(together, backwards, strict=True):
        np.testing.assert_array_equal(one.params, other.params)
    np.testing.assert_allclose(alone[0].params, together[0].params, rtol=1e-9)
    other_seed = train_networks(PAD, PEP, jobs(np.arange(60, 80))[:1], seed=8)
    assert not np.allclose(other_seed[0].params, alone[0].params)


def test_early_stopping_keeps_the_best_on_the_validation_part():
    held = np.arange(60, 80)
    for job, one in zip(jobs(held), train_networks(PAD, PEP, jobs(held), seed=2), strict=True):
        left = NetworkModel.of_parameters(one.params[None]).predict(PAD[held])[:, 0] - PEP[held, job.target]
        assert one.held_mse >= np.mean(left**2) - 1e-12
        # Going on by hand from first weights never finds better ones among the steps that were made.
        shorter = train_networks(PAD, PEP, [job], seed=2, options=Options(max_iterations=max(1, one.iterations // 2)))
        assert one.held_mse <= shorter[0].held_mse + 1e-12


def test_progress_is_told():
    told = []
    train_networks(PAD, PEP, jobs(), seed=0, on_progress=lambda *counts: told.append(counts))
    assert told[0] == (0, 6)
    assert told[-1] == (6, 6)


@pytest.mark.parametrize(
    ("job", "message"),
    [
        (Job(hidden=0, target=0, rows=ROWS), "0 hidden units"),
        (Job(hidden=1, target=3, rows=ROWS), "no output 3"),
        (Job(hidden=1, target=0, rows=np.array([80])), "80 samples"),
        (Job(hidden=1, target=0, rows=ROWS, held=np.array([], dtype=int)), "no rows"),
    ],
)
def test_wrong_jobs_are_refused(job, message):
    with pytest.raises(SpecError, match=message):
        train_networks(PAD, PEP, [job], seed=0)
