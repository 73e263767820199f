"""How the head moves in a plan: peaks, kinds, transitions (MTAP 2013, section 3)."""

from functools import cache

import numpy as np

from synth.clip_spec import ClipSpec
from synth.fap.table import column
from synth.head.published import example_sentence
from synth.head.words import first_frame
from synth.plan import plan_clip

PEAK = "太平山頂是香港最受歡迎的名勝景點，登臨其間，可俯瞰山下鱗次櫛比的摩天高樓和享譽全球的維多利亞港景色。"
ENGLISH = "It is a wonderful view, and the happy people on the boat believe it."
HEAD, EYES = (48, 49, 50), (23, 24, 25, 26)
DEGREE = np.pi / 180 * 1e5
"""AU of a degree."""


@cache
def still(text, lang="en", **given_fields):
    """A plan without chance in the eyes."""
    return plan_clip(ClipSpec(text=text, lang=lang, blinks=False, gaze=False, **given_fields))


def test_the_peaks_of_the_papers_sentence():
    """MTAP 2013, section 3.2: the stressed syllable, else the falling tone, else the first."""
    made = still(PEAK, "zh")
    moves = [unit for unit in made.head.units if unit.text]
    assert [move.text for move in moves] == [word.text for word in made.words]
    papers = {word.text: word for word in example_sentence()}
    for move, word in zip(moves, made.words, strict=True):
        tones = [syllable.tone for syllable in word.syllables]
        stressed = [k for k, syllable in enumerate(word.syllables) if syllable.stressed]
        falling = [k for k, tone in enumerate(tones) if tone == 4]
        rule, wanted = ("stressed", stressed) if stressed else ("falling", falling) if falling else ("first", [0])
        assert move.rule == rule
        syllable = word.syllables[wanted[0]]
        assert first_frame(syllable.start_s, 25) <= move.peak[0] <= first_frame(syllable.end_s, 25)
        if word.text in papers:
            assert [one.tone for one in papers[word.text].syllables] == tones
    rules = {move.text: move.rule for move in moves}
    assert rules["最受歡迎的"] == "stressed"
    assert rules["是香港"] == rules["名勝景點"] == "falling"
    assert rules["登臨其間"] == rules["摩天高樓"] == "first"
    assert {unit.rule for unit in made.head.units if not unit.text} == {"silence"}
    assert next((unit.P, unit.A) for unit in made.head.units if not unit.text) == (0.0, -0.5)


def test_the_head_is_down_at_the_peaks():
    """Positive pitch is down, and the peak is the lowest place of the word."""
    made = still(PEAK, "zh", transition="average")
    rather = []
    for unit in made.head.units:
        if unit.text:
            pitch = made.head.angles[unit.start : unit.stop, 0]
            rather.append((pitch <= made.head.angles[unit.peak[0], 0] + 1e-9).mean())
    assert np.median(rather) > 0.9


def test_english_peaks_are_on_stressed_syllables():
    made = still(ENGLISH)
    assert {unit.rule for unit in made.head.units if unit.text} == {"stressed"}
    wonderful = next(unit for unit in made.head.units if "wonderful" in unit.text)
    stressed = next(one for word in made.words if "wonderful" in word.text for one in word.syllables if one.stressed)
    assert stressed.text == "won"
    assert stressed.start_s - 0.04 <= wonderful.peak[0] / 25 <= stressed.end_s + 0.04


def test_the_kinds_of_head():
    prosodic, random, static = (still(PEAK, "zh", head=kind) for kind in ("prosodic", "random", "static"))
    assert not static.head.angles.any()
    assert static.head.units == ()
    assert {unit.rule for unit in random.head.units} == {"random"}
    assert [unit.start for unit in random.head.units] == [unit.start for unit in prosodic.head.units]
    assert np.abs(random.head.angles - prosodic.head.angles).max() > 1.0
    turning = [column(fap) for fap in (*HEAD, *EYES)]
    for made in (random, prosodic):
        np.testing.assert_allclose(made.faps[:, [column(fap) for fap in HEAD]], made.head.angles * DEGREE)
        # The eyes turn back as far, and so stay where they look.
        turned = made.faps - static.faps
        np.testing.assert_allclose(turned[:, [column(23), column(24)]], -turned[:, [column(49)] * 2], atol=1e-6)
        np.testing.assert_allclose(turned[:, [column(25), column(26)]], -turned[:, [column(48)] * 2], atol=1e-6)
        np.testing.assert_array_equal(np.delete(made.faps, turning, 1), np.delete(static.faps, turning, 1))


def test_the_transition_decides_how_words_follow_each_other():
    average, glide = (still(PEAK, "zh", transition=name).head for name in ("average", "glide"))
    assert average.lineage() == glide.lineage()
    # The paper's average has corners, where the speed changes at once.
    corners = [np.abs(np.diff(made.angles, 2, axis=0)).max() for made in (average, glide)]
    assert corners[0] > corners[1]


def test_short_words_nod_less():
    for unit in still("No! A? I. O, go.", fps=50).head.units:
        assert np.pi * max(unit.amp) * 50 / (unit.stop - unit.start) < 120.0 + 1e-6


def test_pitch_of_emphatic_words_is_larger():
    """MTAP 2013, Eq. 2: the amplitude follows (P, A)."""
    emphatic, calm = (
        still("wonderful", words=(("wonderful", *values),)).head.units[1].amp[0] for values in ((1, 1), (0, 0))
    )
    assert emphatic > calm > 0.0
