import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.fitting import Samples, fit_set, plain, translation_nmse
from synth.expression.model_set import KINDS
from synth.expression.pep import peps
from synth.expression.pep_fap import template
from synth.expression.validation import intermediate, random_split
from synth.fap.table import column

COUNT = 120
PROBES = np.random.default_rng(9).uniform(-1, 1, (20, 3))


def faces(count, *, seed=0, noise=0.05):
    """PAD, and PEPs that follow them along curves."""
    rng = np.random.default_rng(seed)
    pad = rng.uniform(-0.9, 0.9, (count, 3))
    P, A, D = pad.T
    curves = [np.tanh(2 * P * A), A**2 - 0.4, np.sin(2 * D), 0.5 * P, 0.3 * (P + A + D), abs(P) - 0.4, 0.9 * abs(A)]
    pep = np.column_stack([*curves, 0.8 * P, P * D])
    return pad, np.clip(pep + noise * rng.normal(size=pep.shape), -1, 1)


def samples_of(pad, pep, *, emotions=3, **changes):
    named = tuple(f"e{k % emotions}" if emotions else "" for k in range(len(pad)))
    values = {"name": "curves", "faps": template().translate(pep), "pad": pad, "emotions": named} | changes
    return Samples(**values)


@pytest.fixture(scope="module")
def fitted():
    samples = samples_of(*faces(COUNT), note="Made for a test.", pseudo=True, digest="d1")
    return samples, *fit_set(samples, seed=5, sizes=(1, 4), folds=5)


@pytest.fixture(scope="module")
def small():
    """A small study: 42 symmetric faces of two emotions, with a mean over few raters."""
    pad, pep = faces(42)
    pep[:, 3] = 0.0
    samples = samples_of(pad, pep, emotions=2, reliability=np.array([0.9, 0.8, 0.3]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return samples, *fit_set(samples, seed=0, sizes=(1, 2))


def test_networks_find_curves_that_a_line_does_not(fitted):
    _, _, evaluation = fitted
    assert evaluation.hidden == 4
    assert evaluation.hidden_nmse[4] < evaluation.hidden_nmse[1]
    errors = {kind: one.mean_nmse.mean() for kind, one in evaluation.scores.items()}
    assert errors["ann"] < errors["quadratic"] < errors["linear"]
    assert evaluation.test_nmse["ann"].mean() < 0.5 * evaluation.test_nmse["linear"].mean()
    assert evaluation.held_out["ann"] < evaluation.held_out["linear"]


def test_shuffled_annotation_gives_no_model(fitted):
    _, _, evaluation = fitted
    assert set(evaluation.permuted) == set(KINDS)
    assert all(0.95 < error < 2.0 for error in evaluation.permuted.values())


def test_the_final_models_are_those_of_the_intermediate_fold(fitted):
    samples, models, evaluation = fitted
    pep = np.clip(models.pep_fap.invert(samples.faps), -1, 1)
    # MTAP 2013, section 4.4: a fifth for the test.
    split = random_split(COUNT, folds=5, test_share=0.2, rng=np.random.default_rng([5, COUNT]))
    assert len(split.test) == 24
    for kind in KINDS:
        scores = evaluation.scores[kind]
        chosen = intermediate(scores.nmse.mean(axis=1))
        assert evaluation.chosen_fold[kind] == chosen
        assert models.pad_pep(kind).digest == scores.models[chosen].digest
        guess, real = models.pad_pep(kind).predict(samples.pad[split.test]), pep[split.test]
        np.testing.assert_allclose(evaluation.test_nmse[kind], np.mean((guess - real) ** 2, axis=0) / real.var(axis=0))
        r = [np.corrcoef(guess[:, k], real[:, k])[0, 1] for k in range(9)]
        np.testing.assert_allclose(evaluation.test_correlation[kind], r)


def test_the_test_set_teaches_nothing(fitted):
    samples, models, evaluation = fitted
    split = random_split(COUNT, folds=5, test_share=0.2, rng=np.random.default_rng([5, COUNT]))
    pad, faps = samples.pad.copy(), samples.faps.copy()
    pad[split.test], faps[split.test] = pad[split.test][::-1], 0.5 * faps[split.test]
    again, other = fit_set(replace(samples, pad=pad, faps=faps), seed=5, sizes=(4,), folds=5)
    for kind in KINDS:
        np.testing.assert_allclose(again.pad_pep(kind).predict(PROBES), models.pad_pep(kind).predict(PROBES), atol=1e-9)
        np.testing.assert_array_equal(again.calibrations[kind].gain, models.calibrations[kind].gain)
    assert again.pep_fap.digest == models.pep_fap.digest
    assert other.test_nmse["ann"].mean() > 2 * evaluation.test_nmse["ann"].mean()


def test_the_same_seed_gives_the_same_set(fitted):
    samples, models, _ = fitted
    again, _ = fit_set(samples, seed=5, sizes=(1, 4), folds=5)
    assert again.to_json() == models.to_json()
    other, _ = fit_set(samples, seed=6, sizes=(4,), folds=5)
    assert other.ann.digest != models.ann.digest


def test_the_set_tells_where_it_comes_from(fitted):
    samples, models, evaluation = fitted
    origin = json.loads(json.dumps(models.origin, allow_nan=False))
    assert origin == models.origin
    assert {key: origin[key] for key in ("data", "pseudo", "note", "samples", "data_digest", "seed")} == {
        "data": "curves",
        "pseudo": True,
        "note": "Made for a test.",
        "samples": COUNT,
        "data_digest": "d1",
        "seed": 5,
    }
    figures = origin["evaluation"]
    assert (figures["folds"], figures["hidden"]) == (5, 4)
    for kind in KINDS:
        assert figures["pad_pep"][kind]["nmse"] == evaluation.scores[kind].mean_nmse.tolist()
        assert figures["pad_pep"][kind]["test_nmse"] == evaluation.test_nmse[kind].tolist()
    assert samples.reliability is None
    np.testing.assert_array_equal(models.calibrations["ann"].reliability, 1.0)


def test_the_translation_is_learned(fitted):
    samples, models, evaluation = fitted
    found = models.pep_fap.translate(models.pep_fap.invert(samples.faps))
    # A jaw that noise closes a little beyond closed cannot follow exactly.
    np.testing.assert_allclose(found, samples.faps, atol=0.01)
    np.testing.assert_allclose(evaluation.pep_fap_nmse, 0.0, atol=1e-9)
    assert models.pep_pad.correlation.min() > 0.8


def test_translation_errors_leave_the_key_out():
    # MTAP 2013, Table 6: as Eq. 12, written out for each FAP that follows a key.
    rng = np.random.default_rng(8)
    _, pep = faces(60)
    measured = template().translate(pep)
    measured += rng.normal(size=measured.shape) * 0.3 * measured.std(axis=0)
    found = translation_nmse(measured, template())
    translated = template().translate(template().invert(measured))
    for k, pep_of in enumerate(peps()):
        others = [column(fap) for fap in pep_of.faps if fap != pep_of.key]
        errors = [np.mean((measured[:, c] - translated[:, c]) ** 2) / measured[:, c].var() for c in others]
        assert found[k] == pytest.approx(np.mean(errors))
    assert (found > 0.05).all()


def test_a_small_study_is_enough(small):
    samples, models, evaluation = small
    assert set(evaluation.held_out) == set(KINDS)
    assert np.isfinite(list(evaluation.held_out.values())).all()
    json.dumps(evaluation.to_dict(), allow_nan=False)
    np.testing.assert_allclose(models.calibrations["linear"].reliability, [0.9, 0.8, 0.5])
    for kind in KINDS:
        drawn = models.for_drawing(kind).predict(samples.pad)
        assert np.corrcoef(drawn[:, 7], samples.pad[:, 0])[0, 1] > 0.8


def test_a_gaze_that_never_moves_keeps_the_template_and_stays(small):
    samples, models, evaluation = small
    np.testing.assert_array_equal(models.pep_fap.plus[3], template().plus[3])
    np.testing.assert_array_equal(models.pep_fap.minus[3], template().minus[3])
    figures = evaluation.to_dict()
    assert figures["pep_fap"]["nmse"][3] is None
    for kind in KINDS:
        assert [value is None for value in figures["pad_pep"][kind]["nmse"]] == [k == 3 for k in range(9)]
        assert None not in figures["pad_pep"][kind]["nmse_by_fold"]
        np.testing.assert_allclose(models.for_drawing(kind).predict(samples.pad)[:, 3], 0.0, atol=1e-6)


@pytest.mark.parametrize("emotions", [0, 1, 42])
def test_without_emotions_to_hold_out_none_are(emotions):
    _, evaluation = fit_set(samples_of(*faces(42), emotions=emotions), seed=0, sizes=(1,))
    assert evaluation.held_out == {}
    assert evaluation.to_dict()["pad_pep"]["ann"]["held_out_nmse"] is None


def test_annotation_that_says_nothing_is_refused():
    pad, pep = faces(42)
    with pytest.raises(SpecError, match="the same PAD"):
        fit_set(samples_of(np.full_like(pad, 0.25), pep), seed=0, sizes=(1,))


def test_small_folds_are_compared_with_all_training_samples():
    pad, pep = faces(42)
    _, evaluation = fit_set(samples_of(pad, pep), seed=0, sizes=(1, 2))
    assert evaluation.pooled
    # Relative to the variance of three or four samples, one fold would carry the mean far beyond 1.
    assert evaluation.scores["linear"].fold_nmse.max() < 3.0
    assert all(0.5 < error < 3.0 for error in evaluation.permuted.values())
    _, many = fit_set(samples_of(*faces(150)), seed=0, sizes=(1,))
    assert not many.pooled


def test_progress_is_told():
    told = []
    fit_set(samples_of(*faces(42)), seed=0, sizes=(1,), on_progress=lambda *counts: told.append(counts))
    assert told[0] == (0, 450)
    assert told[-1] == (450, 450)


@pytest.mark.parametrize(
    ("changes", "options", "message"),
    [
        ({}, {"folds": 18}, "42 samples"),
        ({}, {"folds": 1}, "1 folds"),
        ({}, {"sizes": ()}, "0 sizes"),
        ({}, {"sizes": (0,)}, "0 hidden units"),
        ({}, {"seed": -1}, "seed -1"),
        ({"faps": np.zeros((42, 68))}, {}, "curves: .*nothing to learn"),
        ({"faps": np.ones((42, 68))}, {}, "nothing to learn"),
    ],
)
def test_what_cannot_be_learned_from_is_refused(changes, options, message):
    with pytest.raises(SpecError, match=message):
        fit_set(samples_of(*faces(42), **changes), **({"seed": 0, "sizes": (1,)} | options))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pad": np.full((42, 3), np.nan)}, "not a number"),
        ({"pad": np.full((42, 3), 1.01)}, "row 0"),
        ({"pad": np.zeros((41, 3))}, "pairs"),
        ({"faps": np.full((42, 68), np.inf)}, "FAP 1 in frame 0"),
        ({"faps": np.zeros((42, 66))}, "68"),
        ({"emotions": ("joy",)}, "curves: 1 emotions"),
        ({"reliability": np.ones(2)}, "curves: the reliability"),
        ({"reliability": np.full(3, np.nan)}, "curves: the reliability"),
    ],
)
def test_wrong_samples_are_refused(changes, message):
    with pytest.raises(SpecError, match=message):
        replace(samples_of(*faces(42)), **changes)


@given(st.lists(st.floats()))
def test_numbers_become_plain_json(values):
    found = plain(np.array(values))
    assert json.loads(json.dumps(found, allow_nan=False)) == [v if np.isfinite(v) else None for v in values]
    assert all(plain(value) == other for value, other in zip(values, found, strict=True))
