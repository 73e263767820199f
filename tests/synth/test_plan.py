import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth.clip_spec import ClipSpec
from synth.errors import SpecError, SpeechError
from synth.fap.blend import MOUTH
from synth.fap.table import FAP_COUNT, column, faps
from synth.interchange.emotionml import read_emotionml, write_emotionml
from synth.pad import PAD
from synth.plan import expressed_pad, plan_clip, sentence_of
from synth.speech.spoken import Phone, Span, Speech
from synth.text.corpus import scenic_sentences
from synth.visemes import visemes_of

PEAK = "太平山頂是香港最受歡迎的名勝景點，登臨其間，可俯瞰山下鱗次櫛比的摩天高樓和享譽全球的維多利亞港景色。"
ENGLISH = "It is a wonderful view, and the happy people on the boat believe it."
HEAD, EYES, LIDS = (48, 49, 50), (23, 24, 25, 26), (19, 20)
DEGREE = np.pi / 180 * 1e5
"""AU of a degree."""

FASTEST = 25.0
"""Usable ranges that a FAP crosses in a second, at most; the tip of the tongue and the lids come to 20."""
FASTEST_HEAD = 600.0
"""Degrees per second, in any text, even between sounds of two frames; in sentences a third of that (see below)."""

unspoken = st.characters(exclude_categories=["Cs", "Cc"])
some = st.sampled_from(list("太平山頂好很不是的abcdeTOX '-.,!?。，！？…\u3000\u200d\u0301\n09%$€😀👩½②ªßŒйع"))
texts = st.text(unspoken | some | some, max_size=50)


@cache
def plan(text, lang="en", **given_fields):
    return plan_clip(ClipSpec(text=text, lang=lang, **given_fields))


def still(text, lang="en", **given_fields):
    """A plan without chance in the eyes."""
    return plan(text, lang, blinks=False, gaze=False, **given_fields)


def limits(made):
    """Return what each FAP may reach: a tenth beyond its usable range."""
    usable = np.array([faps()[fap].usable or (-np.inf, np.inf) for fap in range(1, FAP_COUNT + 1)])
    low, high = 1.1 * usable[:, 0], 1.1 * usable[:, 1]
    # The lower lip, which an open jaw carries, goes as much farther down.
    low[[column(fap) for fap in (5, 10, 11, 52, 57, 58)]] -= 1.1 * usable[column(3), 1]
    for lid in LIDS:
        # Lids that shut go as far as the lower ones leave them to.
        high[column(lid)] = max(high[column(lid)], 1024.0 - min(made.apex[column(21)], made.apex[column(22)], 0.0))
    return low - 1e-6, high + 1e-6


def check_track(made):
    low, high = limits(made)
    assert np.isfinite(made.faps).all()
    assert (made.faps >= low).all(), np.argwhere(made.faps < low)[0] + 1
    assert (made.faps <= high).all(), np.argwhere(made.faps > high)[0] + 1
    # At the beginning the face is neutral, but for a look aside, and the head at rest.
    assert not np.delete(made.faps[0], [column(fap) for fap in (*EYES, *LIDS)]).any()
    assert not made.head.angles[0].any()
    speed = np.abs(np.diff(made.faps, axis=0)).max(axis=0, initial=0.0) * made.spec.fps
    turning = [column(fap) for fap in (*HEAD, *EYES)]
    spans = np.array([np.ptp(faps()[fap].usable) if faps()[fap].usable else np.inf for fap in range(1, FAP_COUNT + 1)])
    spans = np.maximum(spans, high - low)
    assert (np.delete(speed / spans, turning) < FASTEST).all(), np.argmax(speed / spans) + 1
    assert (speed[[column(fap) for fap in HEAD]] < FASTEST_HEAD * DEGREE).all()


def check_speech(made):
    speech = made.speech
    assert len(made.words) == len(made.sentence.words) == len(speech.words)
    assert made.words[0].start_s >= 0.0
    assert all(one.end_s <= two.start_s + 1e-6 for one, two in zip(made.words, made.words[1:], strict=False))
    assert speech.duration_s < made.duration_s
    assert len(speech.samples) / speech.rate == pytest.approx(speech.duration_s, abs=0.04)


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(text=texts, lang=st.sampled_from(["en", "zh"]), seed=st.integers(0, 9), fps=st.sampled_from([10, 25, 50]))
def test_any_text_gives_a_plan_or_one_clear_error(text, lang, seed, fps):
    spec = ClipSpec(text=text, lang=lang, seed=seed, fps=fps)
    try:
        made = plan_clip(spec)
    except (SpecError, SpeechError) as error:
        assert "\n" not in str(error)
        assert str(error).endswith(".")
        assert text.strip()
        return
    check_track(made)
    json.dumps(made.lineage(), allow_nan=False)
    if text.strip():
        check_speech(made)


@pytest.mark.parametrize(
    ("unit", "lang"), [("The view is wonderful! ", "en"), ("風景很好，", "zh"), ("a", "en"), ("9", "zh"), ("?!x", "en")]
)
def test_texts_of_two_thousand_characters_are_planned(unit, lang):
    made = plan_clip(ClipSpec(text=(unit * 2000)[:2000], lang=lang, fps=10))
    check_track(made)
    check_speech(made)


@pytest.mark.parametrize("text", ["!!!", "...", "😀", "?"])
def test_what_cannot_be_spoken_is_said(text):
    with pytest.raises(SpecError, match="nothing that can be spoken"):
        plan_clip(ClipSpec(text=text))


@pytest.mark.parametrize("text", ["", "  \n"])
def test_without_text_the_expression_comes_and_stays(text):
    made = plan_clip(ClipSpec(text=text, pad=(0.55, 0.24, 0.28), blinks=False, gaze=False))
    assert (made.sentence, made.speech, made.words, made.head.units) == (None, None, (), ())
    np.testing.assert_allclose(made.faps[-1], made.apex)
    assert made.apex.any()
    assert not made.faps[0].any()
    assert made.duration_s == pytest.approx(0.4 + 0.5 + 1.6, abs=0.04)
    assert plan_clip(ClipSpec(text=text)).pad == PAD()


@pytest.mark.parametrize("head", ["prosodic", "random"])
@pytest.mark.parametrize("neutral_s", [0.0, 0.01, 0.4])
def test_the_head_begins_at_rest_and_gently(head, neutral_s):
    for seed in range(6):
        made = still("Wonderful!", seed=seed, head=head, neutral_s=neutral_s)
        assert not made.head.angles[0].any()
        assert np.abs(made.head.angles[1]).max() < 1.0, "no jump in the first frame"


def test_sentences_move_smoothly():
    """The bounds that are stated: sentences as they are written, at 25 frames per second."""
    for lang in ("en", "zh"):
        for number, text in enumerate(scenic_sentences(lang)[:8]):
            made = plan(text, lang, seed=number)
            check_track(made)
            assert (made.head.largest_speed < (200.0, 100.0, 100.0)).all()
            low, high = limits(replace(made, apex=np.zeros(FAP_COUNT)))
            assert ((made.faps >= low) & (made.faps <= high)).all(), "within 1.1 times the usable range"


def test_speeds_do_not_grow_with_the_frame_rate():
    """A jump would be twice as fast at twice the rate."""
    speeds = [np.abs(np.diff(still(ENGLISH, fps=fps).faps, axis=0)).max(axis=0) * fps for fps in (60, 120)]
    assert (speeds[1] < 1.4 * speeds[0] + 1e-9).all()


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_lips_shut_in_the_frame_nearest_to_the_middle_of_each_closure(lang):
    seen = 0
    for number, text in enumerate(scenic_sentences(lang)[:6]):
        made = still(text, lang, seed=number)
        gap = -made.faps[:, column(4)] - made.faps[:, column(5)]
        for phone in made.speech.phones:
            if visemes_of(phone.symbol) == ("PP",):
                centre_s = (phone.start_s + phone.end_s) / 2
                around = slice(round(phone.start_s * 25) - 1, round(phone.end_s * 25) + 2)
                shut = np.flatnonzero(gap[around] < gap[around].min() + 1.0) + around.start
                assert np.abs(shut / 25 - centre_s).min() < 0.0201, (text, phone)
                assert np.abs(shut / 25 - centre_s).max() < 0.0801, (text, phone)
                seen += 1
    assert seen > 5


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_the_jaw_is_lowest_within_a_frame_of_the_middle_of_open_vowels(lang):
    opened = {"aa", "ae"}
    vowels = {"aa", "ae", "E", "ih", "oh", "ou", "uh", "ee", "er", "oo"}
    away = []
    for text in scenic_sentences(lang):
        made = still(text, lang, model="neutral")
        jaw, phones = made.faps[:, column(3)], made.speech.phones
        for before, phone, after in zip(phones, phones[1:], phones[2:], strict=False):
            beside = {*visemes_of(before.symbol), *visemes_of(after.symbol)}
            if set(visemes_of(phone.symbol)) <= opened and not beside & vowels:
                around = slice(int(before.start_s * 25), int(np.ceil(after.end_s * 25)) + 1)
                lowest = (around.start + np.argmax(jaw[around])) / 25
                away.append(abs(lowest - (phone.start_s + phone.end_s) / 2))
    assert len(away) > 20
    assert max(away) < 0.05
    assert np.mean(np.array(away) < 0.0401) > 0.95


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_words_lie_on_their_phones(lang):
    text = scenic_sentences(lang)[3]
    made = plan(text, lang)
    for number, word in enumerate(made.words):
        own = [phone for phone in made.speech.phones if phone.word == number]
        assert word.start_s == pytest.approx(own[0].start_s, abs=0.04)
        assert word.end_s == pytest.approx(own[-1].end_s, abs=0.04)
        assert word.syllables[0].start_s >= word.start_s - 1e-9
        assert word.syllables[-1].end_s <= word.end_s + 1e-9
        assert (word.P, word.A) == (made.sentence.words[number].P, made.sentence.words[number].A)
    assert made.speech.phones[0].start_s == 0.0
    assert made.words[0].start_s == pytest.approx(made.spec.neutral_s, abs=0.01)


def test_the_target_is_the_prominent_word_with_the_sentences_dominance():
    """MTAP 2013, section 5.4."""
    for text, lang in ((PEAK, "zh"), (ENGLISH, "en"), ("Is it bad?", "en"), ("對不起，這裡很髒。", "zh")):
        made = plan(text, lang)
        prominent = max(made.words, key=lambda word: np.hypot(word.P, word.A))
        assert made.pad == PAD(prominent.P, prominent.A, made.sentence.D) == made.sentence.target
        assert expressed_pad(made.spec) == made.pad
    assert plan(PEAK, "zh").pad == PAD(1.0, 1.0, 0.5)
    assert plan("Is it bad?").pad.P == -1.0
    assert plan("Is it bad?").pad.D == -1.0


def test_given_values_override_those_found():
    given_pad = plan(ENGLISH, pad=(-0.5, 0.1, 0.2))
    assert given_pad.pad == expressed_pad(given_pad.spec) == PAD(-0.5, 0.1, 0.2)
    assert given_pad.sentence == plan(ENGLISH).sentence

    firm = plan(ENGLISH, dominance=1.0)
    assert (firm.sentence.goal, firm.sentence.D, firm.pad.D) == ("given", 1.0, 1.0)
    assert firm.pad.P == plan(ENGLISH).pad.P
    assert plan(ENGLISH, dominance=0.0).pad.D == 0.0

    words = plan(ENGLISH, words=(("wonderful view", -1.0, None), ("happy", 0.0, 0.25)))
    found = {word.text: (word.P, word.A) for word in words.words}
    assert found["happy"] == (0.0, 0.25)
    assert found["wonderful view"][0] == -1.0
    assert words.pad.P == -1.0
    with pytest.raises(SpecError, match=r"Annotated word 1, 'dreadful', is not in the text"):
        plan_clip(ClipSpec(text=ENGLISH, words=(("dreadful", -1, 1),)))


def test_mute_changes_nothing_that_is_seen():
    sounding, mute = plan(ENGLISH), plan(ENGLISH, mute=True)
    np.testing.assert_array_equal(sounding.faps, mute.faps)
    assert sounding.speech.phones == mute.speech.phones


def test_the_seed_changes_only_what_is_left_to_chance():
    one, two = plan(PEAK, "zh", seed=1), plan(PEAK, "zh", seed=2)
    assert one.sentence == two.sentence
    assert one.speech.phones == two.speech.phones
    assert one.pad == two.pad
    np.testing.assert_array_equal(one.apex, two.apex)
    chance = [column(fap) for fap in (*HEAD, *EYES, *LIDS)]
    np.testing.assert_array_equal(np.delete(one.faps, chance, 1), np.delete(two.faps, chance, 1))
    assert (one.faps[:, chance] != two.faps[:, chance]).any(axis=0).all()
    for first, second in zip(one.head.units, two.head.units, strict=True):
        assert (first.amp, first.rule, first.peak[0]) == (second.amp, second.rule, second.peak[0])
        assert first.avg != second.avg
    np.testing.assert_array_equal(
        still(PEAK, "zh", head="static", seed=1).faps, still(PEAK, "zh", head="static", seed=2).faps
    )


def test_blinks_and_gaze_are_switched_one_by_one():
    both, blinks, gaze, none = (
        plan(ENGLISH, blinks=blinks, gaze=gaze).faps
        for blinks, gaze in ((True, True), (True, False), (False, True), (False, False))
    )
    lids, eyes = [column(fap) for fap in LIDS], [column(fap) for fap in EYES]
    assert {*np.flatnonzero((blinks != none).any(axis=0))} == {*lids}
    assert {*np.flatnonzero((gaze != none).any(axis=0))} == {*eyes}
    np.testing.assert_allclose(both, blinks + gaze - none, atol=1e-9)


def test_delta_and_intensity():
    viseme = still(ENGLISH, delta=1.0)
    neutral = still(ENGLISH, model="neutral")
    mouth = [column(fap) for fap in MOUTH]
    times = np.arange(len(viseme.faps)) / 25
    spoken = (times >= viseme.words[0].start_s) & (times <= viseme.words[-1].end_s)
    # With the whole weight on visemes the mouth is that of a neutral face.
    np.testing.assert_allclose(viseme.faps[spoken][:, mouth], neutral.faps[spoken][:, mouth], atol=1e-6)
    assert np.abs(still(ENGLISH).faps - viseme.faps)[:, mouth].max() > 20.0
    np.testing.assert_allclose(still(ENGLISH, intensity=0.5).pep, 0.5 * still(ENGLISH).pep)
    np.testing.assert_array_equal(still(ENGLISH, intensity=0.0).faps, neutral.faps)


def test_the_expression_holds_while_there_is_speech_and_ebbs_away():
    made = still(ENGLISH, head="static")
    brow = max(range(31, 39), key=lambda fap: abs(made.apex[column(fap)]))
    course = made.faps[:, column(brow)] / made.apex[column(brow)]
    full = np.flatnonzero(course > 0.99)
    assert full[0] / 25 == pytest.approx(0.9, abs=0.08)
    assert full[-1] / 25 >= made.speech.duration_s
    assert 0.2 < course[-1] < 0.4


def recording(speech):
    """The same words said in half of the time, with another sound."""

    def halved(span):
        return Span(span.start_s / 2, span.end_s / 2)

    return Speech(
        phones=tuple(Phone(one.symbol, one.start_s / 2, one.end_s / 2, one.word, one.stress) for one in speech.phones),
        words=tuple(map(halved, speech.words)),
        syllables=tuple(tuple(map(halved, word)) for word in speech.syllables),
        samples=speech.samples[::2],
        rate=speech.rate,
        voice="recording a.wav",
    )


def test_the_voice_of_the_specification_speaks():
    plain = plan(ENGLISH)
    made = plan_clip(replace(plain.spec, voice="hibari"))
    assert made.lineage()["voice"].startswith("hibari heart (")
    assert plain.lineage()["voice"].startswith("espeak-ng ")
    assert made.lineage()["unknown_phones"] == []
    assert [word.text for word in made.words] == [word.text for word in plain.words]
    check_track(made)


def test_a_recording_stands_instead_of_the_voice():
    spoken = plan(ENGLISH)
    made = plan_clip(spoken.spec, speech=recording(spoken.speech))
    assert (made.recorded, spoken.recorded) == (True, False)
    assert made.lineage()["voice"] == "recording a.wav"
    assert len(made.faps) < len(spoken.faps)
    assert len(made.words) == len(spoken.words)
    check_track(made)


def test_the_lineage_tells_all_that_made_the_frames():
    made = plan(PEAK, "zh", seed=3)
    told = made.lineage()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert ClipSpec.from_dict(told["spec"]) == made.spec
    assert (told["text"], told["seed"], told["frames"]) == (PEAK, 3, len(made.faps))
    assert told["pad"] == [1.0, 1.0, 0.5]
    assert len(told["pep"]) == 9
    assert {int(fap): value for fap, value in told["fap"].items()} == {
        k + 1: value for k, value in enumerate(made.apex) if value
    }
    assert told["sentence"] == made.sentence.to_dict()
    assert [word["text"] for word in told["words"]] == [word.text for word in made.words]
    assert told["words"][0]["syllables"][0]["tone"] == 4
    assert told["voice"].startswith("espeak-ng")
    assert [phone["symbol"] for phone in told["phones"]] == [phone.symbol for phone in made.speech.phones]
    assert told["phones"][0] | {"visemes": ["sil"]} == told["phones"][0]
    assert all(phone["visemes"] == list(visemes_of(phone["symbol"])) for phone in told["phones"])
    assert told["unknown_phones"] == []
    assert [unit["peak"] for unit in told["head"]["units"]] == [list(unit.peak) for unit in made.head.units]
    assert "phones" not in plan_clip(ClipSpec()).lineage()


@pytest.mark.parametrize(
    "spec",
    [
        ClipSpec(text=PEAK, lang="zh", seed=5, mute=True, head="random", model="ann"),
        ClipSpec(text='You & <I>\n\'re "fine"!', words=(("fine", 0.3, None),), dominance=-0.25, pad=(0.1, 1 / 3, -1)),
        ClipSpec(text="Hello \U0001f600 there\t", transition="average", blinks=False, fps=50),
    ],
)
def test_emotionml_gives_the_same_clip_again(tmp_path, spec):
    made = plan_clip(spec)
    write_emotionml(tmp_path / "a.xml", made.sentence, clip=spec.to_dict())
    sentence, clip = read_emotionml(tmp_path / "a.xml")
    again = ClipSpec.from_dict(clip)
    assert again == spec
    assert again.canonical() == spec.canonical()
    assert sentence == made.sentence == sentence_of(again)
    np.testing.assert_array_equal(plan_clip(again).faps, made.faps)


def test_another_process_makes_the_same_plan():
    spec = ClipSpec(text=PEAK, lang="zh", seed=9)
    code = (
        "import hashlib, sys; from synth.plan import *; import json\n"
        "made = plan_clip(ClipSpec.from_dict(json.loads(sys.argv[1])))\n"
        "print(hashlib.sha256(made.faps.tobytes() + made.speech.samples.tobytes()).hexdigest())"
    )
    command = [sys.executable, "-c", code, spec.canonical()]
    said = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": "77"}).stdout
    made = plan_clip(spec)
    assert said.strip() == hashlib.sha256(made.faps.tobytes() + made.speech.samples.tobytes()).hexdigest()


@pytest.mark.parametrize("seed", range(40))
def test_silent_expressions_blink_in_the_hold_alone(seed):
    """What raters see of a face is its expression: no blink on the way to it, none that the end cuts off."""
    spec = ClipSpec(pad=(0.55, 0.24, 0.28), seed=seed, gaze=False)
    blinks = plan_clip(spec).faps - plan_clip(replace(spec, blinks=False)).faps
    begun = round((spec.neutral_s + spec.onset_s) * spec.fps)
    assert not blinks[:begun].any()
    assert not blinks[-1].any()
