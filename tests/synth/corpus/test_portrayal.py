import numpy as np
import pytest

from synth.corpus.facs import emotion_displays
from synth.corpus.portrayal import (
    BLENDS,
    FEW_UNITS,
    WORD_SCALE,
    acii_counts,
    emotion_shares,
    neutral,
    of_blend,
    of_emotion,
    of_units,
    of_word,
    true_pad,
)
from synth.expression.pep_fap import template
from synth.fap.table import column
from synth.pad import emotion_words

# ACII 2007, Table 6.
PUBLISHED = {
    "anger": (-0.59, 0.08, 0.47),
    "disgust": (-0.59, -0.01, 0.40),
    "fear": (-0.08, 0.18, -0.39),
    "happy": (0.63, 0.40, 0.29),
    "sad": (-0.28, -0.12, -0.37),
    "surprise": (0.41, 0.55, 0.19),
}
NEUTRAL = (0.03, -0.04, -0.07)


def drawn(emotion, count=300, strength=1.0):
    rng = np.random.default_rng(0)
    return [of_emotion(emotion, strength, rng) for _ in range(count)]


def test_numbers_of_table_4():
    assert dict(acii_counts()) == {
        **{"happy": 31, "surprise": 30, "anger": 30, "neutral": 30, "sad": 31, "fear": 32, "disgust": 29}
    }
    assert sum(acii_counts().values()) == 213
    assert sum(emotion_shares().values()) == pytest.approx(1.0)
    assert set(emotion_shares()) == set(emotion_displays())


@pytest.mark.parametrize("word", emotion_words())
def test_a_word_at_full_strength_has_its_pad(word):
    shown = of_word(word, 1.0)
    np.testing.assert_allclose(true_pad(shown, shown.faps), WORD_SCALE * np.array(emotion_words()[word].as_tuple()))


@pytest.mark.parametrize("word", ["Happy", "Hostile", "Boring"])
def test_strength_leads_from_neutral_to_the_word(word):
    full = WORD_SCALE * np.array(emotion_words()[word].as_tuple())
    half = of_word(word, 0.5)
    np.testing.assert_allclose(true_pad(half, half.faps), (full + NEUTRAL) / 2, atol=1e-9)


def test_neutral_is_the_published_neutral():
    np.testing.assert_allclose(true_pad(neutral(), neutral().faps), NEUTRAL)
    assert not neutral().faps.any()


@pytest.mark.parametrize("emotion", PUBLISHED)
def test_emotions_have_their_published_mean(emotion):
    mean = np.mean([true_pad(shown, shown.faps) for shown in drawn(emotion)], axis=0)
    np.testing.assert_allclose(mean, PUBLISHED[emotion], atol=0.16)


def test_a_face_that_shows_nothing_looks_neutral():
    for shown in (drawn("anger", 1)[0], of_units("12", 1.0, np.random.default_rng(0))):
        np.testing.assert_allclose(true_pad(shown, np.zeros(68)), NEUTRAL, atol=0.1)


def test_faces_of_like_pad_differ_as_facs_says():
    """Anger and disgust, sadness and fear: near in PAD, not in the face."""
    faces = {e: template().invert(np.array([p.faps for p in drawn(e)])).mean(axis=0) for e in PUBLISHED}
    brow, upper_lip, eye, mouth = 0, 5, 2, 6
    assert faces["disgust"][upper_lip] > faces["anger"][upper_lip] + 0.2
    assert faces["anger"][brow] < faces["disgust"][brow] - 0.3
    assert faces["fear"][eye] > faces["sad"][eye] + 0.3
    assert faces["fear"][mouth] > faces["sad"][mouth] + 0.2


def test_features_beyond_the_usual_face_are_seen():

    def seen(emotion, fap, value):
        shown = drawn(emotion, 1)[0]
        face = shown.faps.copy()
        face[column(fap)] += value
        return true_pad(shown, face) - true_pad(shown, shown.faps)

    assert seen("anger", 20, -200)[1] > 0.05
    assert seen("surprise", 12, 200)[0] > 0.03
    assert seen("happy", 34, -60)[2] > 0.03
    # Pressed lips may be tense ones: they are not less aroused.
    assert abs(seen("happy", 58, 200)[1]) < 0.06


def test_few_units_go_to_the_faces_like_them():
    def pad(formula):
        rng = np.random.default_rng(0)
        shown = [of_units(formula, 1.0, rng) for _ in range(50)]
        assert all(p.emotion == "" and not p.claims for p in shown)
        return np.mean([true_pad(p, p.faps) for p in shown], axis=0)

    assert pad("12")[0] > 0.2 > pad("15")[0]
    assert pad("4+7")[0] < -0.1
    assert pad("1+4")[2] < pad("4")[2]
    assert pad("1+2")[1] > pad("4")[1] - 0.1
    assert len(FEW_UNITS) == len(set(FEW_UNITS)) == 10


def test_blends_lie_between():
    rng = np.random.default_rng(2)
    for first, second in BLENDS:
        shown = of_blend(first, second, 1.0, rng)
        assert set(shown.claims) == {first, second}
        assert sum(shown.claims.values()) == pytest.approx(1.0)
        assert max(shown.claims.values()) <= 2 / 3
        assert shown.emotion == ""
    happy_surprise = [of_blend("happy", "surprise", 1.0, rng) for _ in range(100)]
    mean = np.mean([true_pad(p, p.faps) for p in happy_surprise], axis=0)
    assert mean[0] > 0.2
    assert mean[1] > 0.15


def test_a_contemptuous_face_is_one_sided_at_times():
    faces = np.array([p.faps for p in drawn("contempt", 60)])
    assert (np.abs(faces[:, column(12)] - faces[:, column(13)]) > 1).mean() > 0.9


def test_heads_do_not_nod():
    faces = np.array([p.faps for p in drawn("sad", 60)])
    assert not faces[:, [column(48), column(49), column(50)]].any()
    assert faces[:, column(25)].any()
