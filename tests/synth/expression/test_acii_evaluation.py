import warnings

import numpy as np
import pytest

from synth.errors import SpecError
from synth.expression.acii_evaluation import evaluate_polynomial
from synth.expression.measurement import ACII_CODES
from synth.expression.validation import split_by_subject

SUBJECTS = tuple(f"s{k % 10}" for k in range(213))
EXPRESSIONS = tuple(f"e{k // 10 % 7}" for k in range(213))


def samples(noise, seed=3):
    """213 samples as in ACII 2007, whose PEPs are the polynomial of PAD (Eq. 3) and noise."""
    rng = np.random.default_rng(seed)
    pad = rng.uniform(-1, 1, (213, 3))
    squares, slopes = rng.uniform(-0.15, 0.15, (2, 3, 12))
    return pad, pad**2 @ squares + pad @ slopes + noise * rng.normal(size=(213, 12))


def evaluate(pad, pep, **changes):
    options = {"codes": ACII_CODES, "subjects": SUBJECTS, "expressions": EXPRESSIONS, "seed": 4} | changes
    return evaluate_polynomial(pad, pep, **options)


def test_a_polynomial_is_found_exactly():
    found = evaluate(*samples(0.0))
    assert found.by_fold.shape == (10, 12)
    np.testing.assert_allclose(found.by_fold, 1.0)
    np.testing.assert_allclose(found.test, 1.0)
    assert found.codes == ACII_CODES


def test_the_procedure_is_that_of_the_paper():
    pad, pep = samples(0.15)
    found = evaluate(pad, pep)
    split = split_by_subject(SUBJECTS, EXPRESSIONS, rng=np.random.default_rng([4, 213]))
    terms = np.hstack([pad**2, pad, np.ones((213, 1))])
    by_fold, fitted = np.zeros((10, 12)), []
    for k, rows in enumerate(split.folds):
        others = np.concatenate([own for j, own in enumerate(split.folds) if j != k])
        fitted.append(np.linalg.lstsq(terms[others], pep[others], rcond=None)[0])
        guess = np.clip(terms[rows] @ fitted[-1], -1, 1)
        by_fold[k] = [np.corrcoef(guess[:, j], pep[rows, j])[0, 1] for j in range(12)]
    np.testing.assert_allclose(found.by_fold, by_fold)
    np.testing.assert_allclose(found.minimum, by_fold.min(axis=0))
    np.testing.assert_allclose(found.maximum, by_fold.max(axis=0))
    np.testing.assert_allclose(found.mean, by_fold.mean(axis=0))
    # "The trained function with the average fitting performance": five folds are better, four are worse.
    chosen = by_fold.mean(axis=1)[found.chosen_fold]
    assert (by_fold.mean(axis=1) < chosen).sum() == 4
    guess = terms[split.test] @ fitted[found.chosen_fold]
    np.testing.assert_allclose(found.test, [np.corrcoef(guess[:, j], pep[split.test, j])[0, 1] for j in range(12)])


def test_noise_correlates_with_nothing():
    pad, _ = samples(0.0)
    found = evaluate(pad, np.random.default_rng(6).normal(size=(213, 12)) * 0.2)
    assert abs(found.mean.mean()) < 0.1
    assert (found.minimum <= found.mean).all()
    assert (found.mean <= found.maximum).all()


def test_a_seed_gives_one_split():
    pad, pep = samples(0.15)
    np.testing.assert_array_equal(evaluate(pad, pep).by_fold, evaluate(pad, pep).by_fold)
    assert not np.array_equal(evaluate(pad, pep).by_fold, evaluate(pad, pep, seed=5).by_fold)


def test_a_pep_that_never_moves_has_no_correlation():
    pad, pep = samples(0.15)
    pep[:, 3] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = evaluate(pad, pep)
        figures = np.stack([found.mean, found.minimum, found.maximum, found.test])
    assert np.isnan(figures[:, 3]).all()
    assert np.isfinite(np.delete(figures, 3, axis=1)).all()


def test_wrong_samples_are_refused():
    pad, pep = samples(0.1)
    for changed in (
        {"pad": pad[:-1]},
        {"pep": pep[:-1]},
        {"pep": np.vstack([pep, pep[:1]])},
        {"pep": pep[:, 0]},
        {"subjects": SUBJECTS[:-1]},
        {"expressions": EXPRESSIONS[:-1]},
        {"codes": ACII_CODES[:-1]},
    ):
        with pytest.raises(SpecError, match="each sample needs one of each"):
            evaluate(**({"pad": pad, "pep": pep} | changed))
    with pytest.raises(SpecError, match="finite"):
        evaluate(pad, np.full_like(pep, np.nan))
    always_the_same = tuple("e" if subject == "s3" else f"e{k % 7}" for k, subject in enumerate(SUBJECTS))
    with pytest.raises(SpecError, match="'s3'"):
        evaluate(pad, pep, expressions=always_the_same)
