import time
from collections import Counter

import numpy as np
import pytest

from synth.corpus.portrayal import acii_counts
from synth.corpus.pseudo import generate
from synth.errors import SpecError
from synth.expression.pep import ACII, MTAP
from synth.expression.pep_fap import PepFapModel
from synth.expression.word_table import word_table


def test_the_size_of_cohn_kanade(like_mtap):
    expressions, pad = like_mtap
    assert len(expressions) == 486 == len(set(expressions.samples))
    subjects = set(expressions.subjects)
    assert len(subjects) == 97
    assert sum(name.startswith("F") for name in subjects) / 97 == pytest.approx(0.65, abs=0.005)
    assert set(Counter(expressions.subjects).values()) == {5, 6}
    assert pad.shape == (486, 3)
    assert expressions.scheme == MTAP
    assert len(expressions.landmarks.points) == 59


def test_the_size_of_jaffe(like_acii):
    expressions, pad = like_acii
    assert len(expressions) == 213 == len(pad)
    assert len(set(expressions.subjects)) == 10
    assert Counter(expressions.emotions) == Counter(dict(acii_counts()))
    for subject in set(expressions.subjects):
        own = Counter(e for e, s in zip(expressions.emotions, expressions.subjects, strict=True) if s == subject)
        assert set(own.values()) <= {2, 3, 4}
        assert len(own) == 7


@pytest.mark.parametrize("kind", ["like_mtap", "like_acii"])
def test_it_says_that_it_is_pseudo(kind, request):
    expressions, _ = request.getfixturevalue(kind)
    assert expressions.pseudo
    assert "pseudo" in expressions.name
    assert "pseudo" in expressions.note
    assert "not agreement with people" in expressions.note
    assert expressions.pad is None


def test_the_same_seed_gives_the_same_set(like_acii, rigs):
    expressions, pad = like_acii
    again, pad_again = generate(ACII, rigs, seed=1)
    assert again.digest == expressions.digest
    np.testing.assert_array_equal(pad_again, pad)
    other, pad_other = generate(ACII, rigs, seed=2)
    assert other.digest != expressions.digest
    assert not np.array_equal(pad_other, pad)


def test_it_takes_seconds(rigs):
    start = time.perf_counter()
    generate(MTAP, rigs, seed=3)
    assert time.perf_counter() - start < 30.0


def test_true_pad_spreads_as_the_published_agreement_asks(like_mtap):
    """SDs with which raters' SDs of .20, .32, .30 give pairwise correlations near .80, .44, .35 (MTAP 2013, 2.4)."""
    _, pad = like_mtap
    sd = pad.std(axis=0)
    np.testing.assert_allclose(sd, [0.40, 0.28, 0.22], atol=0.05)
    raters = np.array([0.20, 0.32, 0.30])
    np.testing.assert_allclose(sd**2 / (sd**2 + raters**2), [0.80, 0.44, 0.35], atol=0.1)
    assert np.abs(pad).max() <= 1.0


def test_emotions_look_as_published(like_acii):
    expressions, pad = like_acii
    emotions = np.array(expressions.emotions)
    published = {"happy": (0.63, 0.40, 0.29), "fear": (-0.08, 0.18, -0.39), "anger": (-0.59, 0.08, 0.47)}
    for emotion, mean in published.items():
        np.testing.assert_allclose(pad[emotions == emotion].mean(axis=0), mean, atol=0.2, err_msg=emotion)
    measured = dict(zip(expressions.acii_codes, expressions.acii_peps.T, strict=True))
    assert measured["3.2"][emotions == "happy"].mean() > 0.3
    assert measured["3.2"][emotions == "sad"].mean() < -0.1
    assert measured["1.1L"][emotions == "surprise"].mean() > 0.3
    assert measured["1.1R"][emotions == "anger"].mean() < -0.3
    assert measured["2.1L"][emotions == "fear"].mean() > 0.2
    for values in measured.values():
        assert abs(values[emotions == "neutral"].mean()) < 0.25


def test_every_parameter_moves(like_mtap):
    expressions, _ = like_mtap
    peps = PepFapModel.fit(expressions.faps).invert(expressions.faps)
    assert np.abs(peps).max() <= 1.0 + 1e-9
    assert (peps.std(axis=0) > 0.15).all()
    assert (expressions.acii_peps.std(axis=0) > 0.1).all()


def test_the_words_faces_are_in_it(like_mtap):
    """What is measured of a word's face points where the table has it."""
    expressions, _ = like_mtap
    words, _, faces = word_table()
    peps = PepFapModel.fit(expressions.faps).invert(expressions.faps)
    shown = np.array(expressions.displays)
    assert 0.35 <= np.char.startswith(shown, "word ").mean() <= 0.45
    for word, face in zip(words, faces, strict=True):
        own = peps[shown == f"word {word}"]
        assert len(own) >= 13
        mean = own.mean(axis=0)
        cosine = mean @ face / np.linalg.norm(mean) / np.linalg.norm(face)
        assert cosine > (0.75 if np.linalg.norm(face) > 0.6 else 0.5), (word, cosine)


def out_of_fold(pad, peps, terms):
    """Mean over parameters and ten folds of the NMSE of least squares on given terms."""
    design, errors = terms(pad), []
    for fold in range(10):
        test = np.arange(len(pad)) % 10 == fold
        found = np.linalg.lstsq(design[~test], peps[~test], rcond=None)[0]
        errors.append(((peps[test] - design[test] @ found) ** 2).mean(axis=0) / peps[test].var(axis=0))
    return np.mean(errors)


def test_a_straight_line_does_not_tell_it_all(like_mtap):
    """With five raters' noise, terms that bend and mix tell the PEPs better, as real faces do (MTAP 2013, Table 6)."""
    expressions, pad = like_mtap
    rated = pad + np.random.default_rng(0).normal(size=pad.shape) * np.array([0.20, 0.32, 0.30]) / np.sqrt(5)
    peps = PepFapModel.fit(expressions.faps).invert(expressions.faps)
    one = np.ones((len(pad), 1))
    P, A, D = rated.T
    line = out_of_fold(rated, peps, lambda x: np.hstack([x, one]))
    bent = out_of_fold(rated, peps, lambda x: np.hstack([x, x**2, np.stack([P * A, P * D, A * D], axis=1), one]))
    shuffled = np.random.default_rng(1).permutation(rated)
    assert bent < line - 0.02
    assert line < 0.9
    assert out_of_fold(shuffled, peps, lambda x: np.hstack([x, one])) > 0.98


def test_what_cannot_be_made_is_refused(rigs):
    with pytest.raises(SpecError, match="no kind 'other'"):
        generate("other", rigs, seed=1)
    with pytest.raises(SpecError, match="at least four"):
        generate(MTAP, {"mei": rigs["mei"]}, seed=1)
