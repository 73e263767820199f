import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.expression.evaluation import Scores, choose_hidden, cross_validate, mean_of, network_jobs
from synth.expression.model_set import KINDS
from synth.expression.network import NetworkModel
from synth.expression.validation import Split, random_split

COUNT = 150
PAD = np.random.default_rng(1).uniform(-1, 1, (COUNT, 3))
SPLIT = random_split(COUNT, folds=5, rng=np.random.default_rng(2))


def network(hidden, seed=3):
    """A network whose outputs bend within the range of its inputs."""
    rng = np.random.default_rng(seed)
    return NetworkModel.of(
        rng.normal(size=(3, hidden, 3)) * 2.5, rng.normal(size=(3, hidden)), rng.uniform(0.2, 0.3, (3, hidden)), [0] * 3
    )


@pytest.fixture(scope="module")
def bent():
    """PEPs made by a network, with a little noise, and what is found on them."""
    pep = network(3).predict(PAD) + 0.02 * np.random.default_rng(4).normal(size=(COUNT, 3))
    return pep, cross_validate(PAD, pep, SPLIT, hidden=4, seed=0)


def test_networks_recover_a_network(bent):
    _, scores = bent
    errors = {kind: one.mean_nmse.mean() for kind, one in scores.items()}
    assert errors["ann"] < 0.1
    assert errors["ann"] < 0.5 * min(errors["linear"], errors["quadratic"])
    assert scores["ann"].mean_correlation.min() > 0.9


def test_scores_are_those_of_equation_12_on_what_a_model_has_not_seen(bent):
    pep, scores = bent
    assert set(scores) == set(KINDS)
    for one in scores.values():
        assert one.nmse.shape == one.correlation.shape == (5, 3)
        for k, (rows, model) in enumerate(zip(SPLIT.folds, one.models, strict=True)):
            left = pep[rows] - model.predict(PAD[rows])
            np.testing.assert_allclose(one.nmse[k], np.mean(left**2, axis=0) / pep[rows].var(axis=0))
            r = [np.corrcoef(model.predict(PAD[rows])[:, j], pep[rows, j])[0, 1] for j in range(3)]
            np.testing.assert_allclose(one.correlation[k], r)
        np.testing.assert_allclose(one.mean_nmse, one.nmse.mean(axis=0))
        np.testing.assert_allclose(one.fold_nmse, one.nmse.mean(axis=1))
        np.testing.assert_allclose(one.mean_correlation, one.correlation.mean(axis=0))


def test_no_model_sees_its_fold_or_the_test_set(bent):
    pep, scores = bent
    changed_pad, changed_pep = PAD.copy(), pep.copy()
    for rows in (SPLIT.folds[1], SPLIT.test):
        changed_pad[rows], changed_pep[rows] = -PAD[rows[::-1]], 0.9 - pep[rows]
    again = cross_validate(changed_pad, changed_pep, SPLIT, hidden=4, seed=0)
    for kind in KINDS:
        first, second = scores[kind].models, again[kind].models
        np.testing.assert_allclose(first[1].predict(PAD), second[1].predict(PAD), atol=1e-9)
        # The models of other folds have learned from it.
        assert not np.allclose(first[0].predict(PAD), second[0].predict(PAD), atol=1e-3)


def test_exactly_linear_data_have_no_linear_error():
    pep = PAD @ np.array([[0.4, 0.0, 0.2], [0.1, -0.3, 0.2], [0.0, 0.0, 0.5]]).T + 0.05
    scores = cross_validate(PAD, pep, SPLIT, hidden=1, seed=0, kinds=("linear", "quadratic"))
    for one in scores.values():
        np.testing.assert_allclose(one.nmse, 0.0, atol=1e-20)
        np.testing.assert_allclose(one.correlation, 1.0)


def test_shuffled_annotation_predicts_nothing(bent):
    pep, _ = bent
    order = np.random.default_rng(7).permutation(COUNT)
    for one in cross_validate(PAD[order], pep, SPLIT, hidden=4, seed=0, restarts=1).values():
        assert one.mean_nmse.mean() > 0.95
        assert abs(one.mean_correlation.mean()) < 0.25


def test_errors_may_be_measured_by_another_spread(bent):
    pep, scores = bent
    spread = np.array([0.5, 1.0, 2.0])
    other = cross_validate(PAD, pep, SPLIT, hidden=4, seed=0, kinds=("linear",), spread=spread)["linear"]
    own = np.stack([pep[rows].var(axis=0) for rows in SPLIT.folds])
    np.testing.assert_allclose(other.nmse, scores["linear"].nmse * own / spread**2)


def test_a_pep_that_never_moves_spoils_no_mean(bent):
    pep, scores = bent
    still = pep.copy()
    still[:, 1] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = cross_validate(PAD, still, SPLIT, hidden=2, seed=0)
        sizes = choose_hidden(PAD, np.zeros_like(pep), SPLIT, seed=0, sizes=(1, 2))
        means = [(one.mean_nmse, one.mean_correlation, one.fold_nmse) for one in found.values()]
    assert np.isnan(list(sizes.values())).all()
    for nmse, correlation, by_fold in means:
        assert np.isnan(nmse).tolist() == np.isnan(correlation).tolist() == [False, True, False]
        assert np.isfinite(by_fold).all()
    expected = scores["linear"].nmse[:, [0, 2]].mean(axis=1)
    np.testing.assert_allclose(found["linear"].fold_nmse, expected)
    for model in found["ann"].models:
        np.testing.assert_allclose(model.predict(PAD)[:, 1], 0.0, atol=1e-6)


def test_the_size_is_chosen_by_error_on_the_folds(bent):
    pep, _ = bent
    found = choose_hidden(PAD, pep, SPLIT, seed=0, sizes=(1, 4))
    assert list(found) == [1, 4]
    assert found[4] < 0.7 * found[1]
    for size, error in found.items():
        alone = cross_validate(PAD, pep, SPLIT, hidden=size, seed=0, kinds=("ann",), restarts=1)["ann"]
        assert error == pytest.approx(alone.nmse.mean(), rel=1e-6)


def test_restarts_find_no_worse_networks(bent):
    pep, scores = bent
    once = cross_validate(PAD, pep, SPLIT, hidden=4, seed=0, kinds=("ann",), restarts=1)["ann"]
    for k in range(5):
        (held,) = {job.held.tobytes() for job in network_jobs(SPLIT, 1, (4,), seed=0) if job.key[0] == k}
        rows = np.frombuffer(held, dtype=np.int64)
        best, first = (
            np.mean((one.models[k].predict(PAD[rows]) - pep[rows]) ** 2, axis=0) for one in (scores["ann"], once)
        )
        assert (best <= first + 1e-12).all()


def test_results_depend_on_the_seed_alone(bent):
    pep, scores = bent
    again = cross_validate(PAD, pep, SPLIT, hidden=4, seed=0, kinds=("ann",))["ann"]
    np.testing.assert_array_equal(again.nmse, scores["ann"].nmse)
    other = cross_validate(PAD, pep, SPLIT, hidden=4, seed=1, kinds=("ann",))["ann"]
    assert not np.array_equal(other.nmse, scores["ann"].nmse)


@settings(max_examples=40, deadline=None)
@given(st.integers(25, 120), st.integers(2, 8), st.integers(0, 2**32 - 1), st.integers(1, 3))
def test_each_fold_keeps_a_part_for_early_stopping(count, folds, seed, restarts):
    split = random_split(count, folds=folds, rng=np.random.default_rng(seed))
    jobs = network_jobs(split, 2, (1, 3), seed=seed, restarts=restarts)
    assert len({(job.hidden, job.target, *job.key) for job in jobs}) == len(jobs) == 2 * 2 * folds * restarts
    parts = {}
    for job in jobs:
        both = np.concatenate([job.rows, job.held])
        np.testing.assert_array_equal(np.sort(both), split.rest(job.key[0]))
        assert len(job.held) == max(1, round(0.15 * len(both)))
        # All sizes, PEPs and restarts of a fold are compared on the same part.
        assert parts.setdefault(job.key[0], job.held.tobytes()) == job.held.tobytes()
    assert all(job.held is None for job in network_jobs(split, 2, (1,), seed=seed, early_stopping=False))


@given(arrays(np.float64, (4, 3), elements=st.floats(-1e3, 1e3) | st.just(np.nan)))
def test_means_leave_out_what_is_not_there(values):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = np.nanmean(values, axis=0)
    np.testing.assert_allclose(mean_of(values), expected, atol=1e-9)
    scores = Scores(nmse=values, correlation=values, models=())
    np.testing.assert_array_equal(scores.mean_nmse, mean_of(values))


def test_progress_is_told(bent):
    told = []
    choose_hidden(PAD, bent[0], SPLIT, seed=0, sizes=(1, 2), on_progress=lambda *counts: told.append(counts))
    assert told[0] == (0, 30)
    assert told[-1] == (30, 30)


def test_wrong_input_is_refused(bent):
    pep, _ = bent
    with pytest.raises(SpecError, match=r"'cubic'.*ann, linear, quadratic"):
        cross_validate(PAD, pep, SPLIT, hidden=1, seed=0, kinds=("cubic",))
    with pytest.raises(SpecError, match="0 hidden units"):
        cross_validate(PAD, pep, SPLIT, hidden=0, seed=0, kinds=("ann",))
    for kind in KINDS:
        with pytest.raises(SpecError, match="not a number"):
            cross_validate(np.where(PAD > 0.5, np.nan, PAD), pep, SPLIT, hidden=1, seed=0, kinds=(kind,))
        with pytest.raises(SpecError, match="finite"):
            cross_validate(PAD, np.where(pep > 0.1, np.nan, pep), SPLIT, hidden=1, seed=0, kinds=(kind,))
    with pytest.raises(SpecError, match="at least two samples"):
        cross_validate(PAD, pep, Split((np.arange(1), np.arange(1, 9))), hidden=1, seed=0, kinds=("linear",))
