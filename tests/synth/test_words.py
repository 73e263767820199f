import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.pad import PAD, emotion_words
from synth.words import (
    CHINESE,
    FACES,
    WORDS,
    Norm,
    conversion,
    find_norm,
    fit_conversion,
    known_words,
    look_up,
    nearest_words,
    norms,
    to_norm,
)

points = st.builds(PAD, *[st.floats(-1.0, 1.0)] * 3)


def norm(name: str, **words: tuple[float, float, float]) -> Norm:
    values = {word: PAD(*pad) for word, pad in words.items()}
    return Norm(name=name, title="", kind=WORDS, source="", scale="", words=values)


def correlations(first: Norm, second: Norm) -> list[float]:
    """Pearson's r of P, A and D over the words of the second."""
    x, y = (np.array([one.words[word].as_tuple() for word in second.words]) for one in (first, second))
    return [np.corrcoef(x[:, k], y[:, k])[0, 1] for k in range(3)]


def test_the_norms_there_are():
    assert {name: len(one.words) for name, one in norms().items()} == {
        "chinese": 14,
        "mtap2013-evaluated": 14,
        "acii2007-evaluated": 6,
        "acii2007-jaffe": 7,
        "russell1977": 149,
        "alma2005": 24,
    }
    assert all(
        one.kind == (WORDS if name in {"chinese", "russell1977", "alma2005"} else FACES)
        for name, one in norms().items()
    )
    for one in norms().values():
        assert one.title
        assert one.source
        assert one.scale
        assert set(one.notes) <= set(one.words)
        assert one.confirmed <= set(one.words)


def test_the_chinese_norm_is_the_papers_fourteen_words():
    assert dict(find_norm(CHINESE).words) == dict(emotion_words())


def test_input_and_evaluated_values_correlate_as_the_papers_say():
    # MTAP 2013, 5.2: 0.873, 0.569, 0.624. ACII 2007, 6.2: 0.89, 0.68, 0.70 (0.685 is printed as 0.68).
    chinese = find_norm(CHINESE)
    assert correlations(chinese, find_norm("mtap2013-evaluated")) == pytest.approx([0.873, 0.569, 0.624], abs=5e-4)
    assert correlations(chinese, find_norm("acii2007-evaluated")) == pytest.approx([0.89, 0.68, 0.70], abs=6e-3)


def test_the_papers_differ_in_what_was_seen_for_angry_only():
    new, old = find_norm("mtap2013-evaluated"), find_norm("acii2007-evaluated")
    assert [word for word in old.words if old.words[word] != new.words[word]] == ["Angry"]
    assert old.words["Angry"] == PAD(-0.17, 0.02, -0.08)
    assert new.words["Angry"] == PAD(-0.56, 0.51, 0.42)
    assert "Angry" in old.notes
    assert "Angry" in new.notes


def test_values_of_the_other_norms():
    russell, alma, jaffe = (find_norm(name) for name in ("russell1977", "alma2005", "acii2007-jaffe"))
    assert (next(iter(russell.words)), list(russell.words)[-1]) == ("Bold", "Sad")
    assert russell.words["Terrified"] == PAD(-0.62, 0.82, -0.43)
    assert len(russell.confirmed) == 29
    assert "-0.28" in russell.notes["Guilty"]
    assert alma.words["Fears confirmed"] == PAD(-0.5, -0.3, -0.7)
    assert (alma.words["Anger"], alma.words["Fear"]) == (russell.words["Angry"], russell.words["Fearful"])
    # ACII 2007, Table 6.
    assert jaffe.words["Surprise"] == PAD(0.41, 0.55, 0.19)
    assert jaffe.words["Disgust"] == PAD(-0.59, -0.01, 0.40)


def test_the_input_values_are_means_from_minus_four_to_four_divided_by_five():
    # Means that circulate for the same words; divided by four as in MTAP 2013, Eq. 13, they would be larger.
    for word, means in {
        "Happy": (2.77, 1.21, 1.42),
        "Sad": (-0.89, 0.17, -0.70),
        "Boring": (-0.53, -1.25, -0.84),
    }.items():
        printed = emotion_words()[word].as_tuple()
        assert printed == pytest.approx([value / 5 for value in means], abs=0.005 + 1e-9)
        assert printed != pytest.approx([value / 4 for value in means], abs=0.02)


def test_a_slope_worked_out_by_hand():
    # P: (0.2*0.1 + 0.4*0.2 + 0.4*0.1) / (0.04 + 0.16 + 0.16) = 0.14 / 0.36; A doubles and D stays exactly.
    source = norm("s", a=(0.2, 0.1, 0.3), b=(0.4, -0.2, -0.1), c=(0.4, 0.3, 0.2), more=(1.0, 1.0, 1.0))
    target = norm("t", C=(0.1, 0.6, 0.2), B=(0.2, -0.4, -0.1), A=(0.1, 0.2, 0.3), less=(0.0, 0.0, 0.0))
    found = fit_conversion(source, target)
    assert found.shared == (("a", "A"), ("b", "B"), ("c", "C"))
    assert found.slopes == pytest.approx((0.14 / 0.36, 2.0, 1.0))
    residuals = [0.1 - 0.2 * 0.14 / 0.36, 0.2 - 0.4 * 0.14 / 0.36, 0.1 - 0.4 * 0.14 / 0.36]
    assert found.residual_sd == pytest.approx((np.sqrt(np.dot(residuals, residuals) / 2), 0.0, 0.0), abs=1e-12)
    for A, converted, beyond in ((0.5, 1.0, False), (-0.6, -1.0, True)):
        pad, clipped = found.apply(PAD(0.36, A, -0.5))
        assert pad.as_tuple() == pytest.approx((0.14, converted, -0.5))
        assert clipped == beyond


def test_norms_that_do_not_go_together_are_not_converted():
    source = norm("s", a=(0.2, 0.1, 0.3), b=(0.4, -0.2, -0.1), c=(0.4, 0.3, 0.2))
    with pytest.raises(SpecError, match="share 2 words"):
        fit_conversion(source, norm("t", a=(0.2, 0.1, 0.3), b=(0.4, -0.2, -0.1)))
    turned = norm("t", a=(0.2, -0.1, 0.3), b=(0.4, 0.2, -0.1), c=(0.4, -0.3, 0.2))
    with pytest.raises(SpecError, match="of A do not rise together"):
        fit_conversion(source, turned)
    flat = norm("f", a=(0.2, 0.1, 0.0), b=(0.4, -0.2, 0.0), c=(0.4, 0.3, 0.0))
    with pytest.raises(SpecError, match="of D do not rise together"):
        fit_conversion(flat, source)


def test_a_norm_has_words_and_each_once():
    for words in ({}, {"Happy": (0.1, 0.1, 0.1), "joy": (0.2, 0.2, 0.2)}):
        with pytest.raises(SpecError, match="Norm n: "):
            norm("n", **words)


@given(points)
def test_every_norm_is_converted_to_every_other(pad):
    for source in norms():
        assert to_norm(pad, source, source) == (pad, False)
        for target in norms():
            found, clipped = to_norm(pad, source, target)
            slopes = conversion(source, target).slopes
            wanted = [slope * value for slope, value in zip(slopes, pad.as_tuple(), strict=True)]
            assert clipped == any(abs(value) > 1 for value in wanted)
            assert found.as_tuple() == pytest.approx(np.clip(wanted, -1, 1))


def test_mehrabians_scale_is_wider_than_the_chinese():
    # The reason why norms are not mixed: each dimension shrinks to between a third and three fifths.
    found = conversion("russell1977")
    assert len(found.shared) == 11
    assert found.slopes == pytest.approx((0.553, 0.349, 0.532), abs=5e-4)
    assert found.residual_sd == pytest.approx((0.158, 0.079, 0.083), abs=5e-4)
    assert ("Fearful", "Scared") in found.shared
    assert len(conversion("alma2005").shared) == 3


@pytest.mark.parametrize("word", emotion_words())
def test_words_of_the_papers_are_taken_as_they_are(word):
    for written in (word, word.upper(), f" {word.lower()} "):
        found = look_up(written)
        assert (found.word, found.norm, found.pad, found.raw) == (word, CHINESE, emotion_words()[word], found.pad)
    assert look_up(word).lineage()["conversion"] is None


@pytest.mark.parametrize(
    ("word", "meant", "source"),
    [
        ("surprised", "Surprise", CHINESE),
        ("Relaxed", "Relax", CHINESE),
        ("bored", "Boring", CHINESE),
        ("fear", "Scared", CHINESE),
        ("joy", "Happy", CHINESE),
        ("disgusting", "Disgust", CHINESE),
        ("joyful", "Joyful", "russell1977"),
        ("pride", "Proud", "russell1977"),
        ("in_love", "In love", "russell1977"),
        ("Blasé", "Blase", "russell1977"),
        ("self satisfied", "Self-satisfied", "russell1977"),
        ("HappyFor", "Happy for", "alma2005"),
        ("gloating", "Gloating", "alma2005"),
    ],
)
def test_synonyms_and_spellings(word, meant, source):
    found = look_up(word)
    assert (found.word, found.norm) == (meant, source)


def test_a_word_has_its_lineage():
    found = look_up("guilty")
    lineage = found.lineage()
    slopes = conversion("russell1977").slopes
    assert lineage["raw"] == [-0.57, 0.28, -0.34]
    assert lineage["PAD"] == pytest.approx([a * b for a, b in zip(slopes, lineage["raw"], strict=True)])
    assert lineage["conversion"]["slopes"] == list(slopes)
    assert lineage["conversion"]["shared"] == 11
    assert (lineage["norm"], lineage["clipped"]) == ("russell1977", False)
    assert "-0.28" in lineage["note"]


def test_a_norm_may_be_chosen():
    assert look_up("happy", norm="russell1977").raw == PAD(0.81, 0.51, 0.46)
    assert look_up("fear", norm="acii2007-jaffe").raw == PAD(-0.08, 0.18, -0.39)
    with pytest.raises(SpecError, match="norm alma2005 has no word 'terrified'"):
        look_up("terrified", norm="alma2005")
    for call in (look_up, lambda word, norm: known_words(norm=norm)):
        with pytest.raises(SpecError, match="no norm 'nrc'; there are chinese, "):
            call("happy", norm="nrc")


def test_what_people_saw_in_faces_is_not_what_a_word_means():
    with pytest.raises(SpecError, match="no word 'neutral'"):
        look_up("neutral")


@pytest.mark.parametrize("word", ["", "!?", "glad", "悲伤"])
def test_an_unknown_word_is_told_shortly(word):
    with pytest.raises(SpecError, match=r"no word .*padlab words --norm") as caught:
        look_up(word)
    assert len(str(caught.value)) < 150


def test_a_word_that_is_nearly_known_gets_a_hint():
    with pytest.raises(SpecError, match=r"Did you mean Terrified\?"):
        look_up("terified")


def test_known_words_are_found_again_and_mean_different_things():
    found = known_words()
    assert [one.word for one in found[:14]] == list(emotion_words())
    assert all(look_up(one.word) == one for one in found)
    # 14, then 149 less the 11 and 24 less the 9 that mean the same as earlier ones.
    assert len(found) == 14 + 138 + 15


@given(points, st.integers(1, 8))
def test_nearest_words_are_in_order_and_none_is_nearer(pad, count):
    found = nearest_words(pad, count)
    distances = [distance for _, distance in found]
    assert len(found) == count
    assert distances == sorted(distances)
    assert distances == [one.pad.distance(pad) for one, _ in found]
    chosen = {one.word for one, _ in found}
    assert all(one.pad.distance(pad) >= distances[-1] for one in known_words() if one.word not in chosen)


def test_nearest_words_of_a_norm():
    pad = look_up("Gloating", norm="alma2005").pad
    found = nearest_words(pad, 99, norm="alma2005")
    assert len(found) == 24
    assert (found[0][0].word, found[0][1]) == ("Gloating", 0.0)
    with pytest.raises(SpecError, match="0 words"):
        nearest_words(pad, 0)
