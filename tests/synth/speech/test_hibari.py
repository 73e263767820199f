import hashlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import PackageNotFoundError
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth.errors import SpecError, SpeechError
from synth.speech import hibari, hibari_process
from synth.speech.hibari import HibariVoice, forget_utterances
from synth.speech.phonetic_text import CLAUSES, ENDS
from synth.speech.saying import EMPTY_S
from synth.speech.spoken import SILENCE, Speech
from synth.text.analysis import analyse
from synth.text.corpus import scenic_sentences
from synth.text.sentence import Sentence, TextSyllable, TextWord
from synth.visemes import unknown_symbols

PEAK = "Victoria Peak is the most popular scenic spot in Hong Kong."
TEXTS = (PEAK, "Stop! Happy people, buy a bottle; Bob's shop is up there.", *scenic_sentences("en")[:6])


Answer = tuple[dict[str, Any], bytes]


@pytest.fixture(scope="module")
def engine() -> Iterator[Callable[[str, Sequence[str]], Answer]]:
    """The program's answers, from one process that stays: a start for each utterance would take minutes."""

    def ask(text: str, words: Sequence[str]) -> Answer:
        request = {"voice": "heart", "text": text, "words": words, "ends": ENDS, "clauses": CLAUSES, "most": 400}
        return pool.submit(hibari_process.answer, request).result()

    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        yield ask


@pytest.fixture
def _kept(engine: Callable[[str, Sequence[str]], Answer], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hibari, "_ask", engine)


kept = pytest.mark.usefixtures("_kept")


def speak(text: str) -> Speech:
    return HibariVoice().speak(analyse(text, "en"))


def check(speech: Speech, said: Sentence) -> None:
    """What `synth.speech.spoken.Speech` promises."""
    assert speech.phones[0].start_s == 0.0
    assert all(first.end_s == second.start_s for first, second in pairwise(speech.phones))
    assert abs(speech.duration_s - len(speech.samples) / speech.rate) < 1e-9
    assert speech.samples.dtype == np.int16
    assert not unknown_symbols(speech.phones)
    assert len(speech.words) == len(said.words)
    assert all(first.end_s <= second.start_s for first, second in pairwise(speech.words))
    for number, (word, syllables) in enumerate(zip(speech.words, speech.syllables, strict=True)):
        assert 0.0 <= word.start_s < word.end_s <= speech.duration_s
        assert len(syllables) == len(said.words[number].syllables)
        assert (syllables[0].start_s, syllables[-1].end_s) == (word.start_s, word.end_s)
        assert all(one.start_s < one.end_s for one in syllables)
        assert any(phone.word == number and phone.symbol != SILENCE for phone in speech.phones)
    assert all(phone.word is not None for phone in speech.phones if phone.symbol != SILENCE)


def symbols(speech: Speech, word: int) -> str:
    return " ".join(phone.symbol for phone in speech.phones if phone.word == word and phone.symbol != SILENCE)


def level(speech: Speech, start_s: float, end_s: float) -> float:
    """The sound's level in dB, full scale at 0."""
    part = speech.samples[round(start_s * speech.rate) : round(end_s * speech.rate)] / 32768.0
    return 10.0 * np.log10(np.mean(part**2) + 1e-12)


def test_words_have_their_phones():
    said = analyse(PEAK, "en")
    speech = speak(PEAK)
    assert [word.text for word in said.words][-3:] == ["scenic", "spot", "in Hong Kong"]
    assert symbols(speech, 0) == "v ɪ k t ɔ ɹ i ə"
    assert symbols(speech, 1) == "p iː k"
    assert symbols(speech, len(said.words) - 1) == "ɪ n h ɑ ŋ k ɑ ŋ"
    stressed = {phone.symbol for phone in speech.phones if phone.stress and phone.word == 0}
    assert "ɔ" in stressed
    assert "ɪ" not in stressed
    assert speech.voice.startswith("hibari heart (0.2.1, onnxruntime ")


@kept
@pytest.mark.parametrize("text", TEXTS)
def test_speech_is_whole(text):
    check(speak(text), analyse(text, "en"))


@kept
def test_phones_are_where_the_sound_is():
    """Closures are quiet at their centre and louder around it, vowels loud, hisses high, pauses silent."""
    closures, around, vowels, pauses, hisses = [], [], [], [], []
    for speech in map(speak, TEXTS):
        for phone in speech.phones:
            centre = (phone.start_s + phone.end_s) / 2.0
            near = level(speech, centre - 0.01, centre + 0.01)
            if phone.symbol in ("p", "b"):
                closures.append(near)
                around.append(max(level(speech, centre + lag - 0.01, centre + lag + 0.01) for lag in (-0.08, 0.08)))
            elif phone.symbol == SILENCE:
                pauses.append(level(speech, phone.start_s, phone.end_s))
            elif phone.stress and phone.symbol[0] in "aeɑæɔɛoi":
                vowels.append(near)
            elif phone.symbol in ("s", "ʃ"):
                hisses.append(_high_share(speech, centre))
    loud = np.median(vowels)
    # Measured: 34 dB below the vowels, 96 of 100, 38 dB below, and 0.99.
    assert np.median(closures) < loud - 20.0
    assert np.mean(np.array(closures) < np.array(around) - 6.0) > 0.8
    assert max(pauses) < loud - 25.0
    assert np.median(hisses) > 0.5


def _high_share(speech: Speech, centre: float) -> float:
    """The share of power above 4 kHz in 20 ms around a time."""
    first = round((centre - 0.01) * speech.rate)
    power = np.abs(np.fft.rfft(speech.samples[first : first + 480] * np.hanning(480))) ** 2
    return power[80:].sum() / power.sum()


@kept
@pytest.mark.parametrize("text", TEXTS)
def test_speech_ends_with_the_sound(text):
    speech = speak(text)
    heard = np.flatnonzero(np.abs(speech.samples.astype(int)) > 150) / speech.rate
    spoken = [phone for phone in speech.phones if phone.symbol != SILENCE]
    assert abs(spoken[0].start_s - heard[0]) < 0.1
    assert abs(spoken[-1].end_s - heard[-1]) < 0.1
    assert speech.duration_s - heard[-1] < 0.15


@kept
def test_numbers_are_read_as_the_analysis_reads_them():
    plain = speak("That is twelve kilometres in nineteen ninety-seven.")
    assert [one.symbol for one in speak("That is 12 km in 1997.").phones] == [one.symbol for one in plain.phones]
    assert symbols(speak("Dr. Smith"), 0) == symbols(speak("Doctor Smith"), 0) + " s m ɪ θ"


@kept
def test_signs_outside_of_words_are_not_read():
    plain, decorated = speak("Hello world"), speak('😀 Hello * "world"')
    assert [phone.symbol for phone in plain.phones] == [phone.symbol for phone in decorated.phones]


@kept
@pytest.mark.parametrize(
    ("text", "count"),
    [
        *[("We walk to the shore then we swim", 0), ("We walk to the shore, then we swim", 1)],
        *[("We walk to the shore。 Then we swim", 1), ("We walk to the shore – then we swim", 1)],
    ],
)
def test_punctuation_makes_pauses(text, count):
    assert [phone.symbol for phone in speak(text).phones[1:-1]].count(SILENCE) == count


@kept
@pytest.mark.parametrize("text", ["well known words go on and on " * 30, "one, two, three " * 40, "a" * 900])
def test_long_sentences_are_parted(text):
    check(speak(text), analyse(text, "en"))


def test_a_sentence_without_words_is_silence():
    speech = HibariVoice().speak(Sentence("…", "en", ()))
    assert [phone.symbol for phone in speech.phones] == [SILENCE]
    assert speech.duration_s == len(speech.samples) / speech.rate == EMPTY_S


def _unspoken(text: str) -> Sentence:
    return Sentence(text, "en", (TextWord(text, 0, len(text), (TextSyllable(text),)),))


@kept
def test_what_has_no_sound_is_refused():
    with pytest.raises(SpeechError, match=r"^The voice 'hibari' has no sound for '香港'; write it in other words\.$"):
        HibariVoice().speak(_unspoken("香港"))


def test_the_language_must_be_english():
    with pytest.raises(SpecError, match="'hibari' speaks 'en', not 'zh'"):
        HibariVoice("zh")
    with pytest.raises(SpecError, match="speaks 'en'; the sentence is in 'zh'"):
        HibariVoice().speak(analyse("你好", "zh"))


def test_nothing_of_the_engine_is_loaded():
    program = (
        "import sys\n"
        "from synth.speech.hibari import HibariVoice\n"
        "from synth.text.analysis import analyse\n"
        "HibariVoice().speak(analyse('Hello.', 'en'))\n"
        "sys.exit(', '.join({'onnxruntime', 'hibari'} & sys.modules.keys()) or None)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@kept
def test_another_process_gives_the_same_bytes():
    program = (
        "import hashlib\n"
        "from synth.speech.hibari import HibariVoice\n"
        "from synth.text.analysis import analyse\n"
        f"speech = HibariVoice().speak(analyse({PEAK!r}, 'en'))\n"
        "print(hashlib.sha256(speech.samples.tobytes() + repr(speech.phones).encode()).hexdigest())\n"
    )
    there = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True).stdout.strip()
    forget_utterances()
    speak("Something else before it.")
    speech = speak(PEAK)
    assert there == hashlib.sha256(speech.samples.tobytes() + repr(speech.phones).encode()).hexdigest()


@kept
def test_what_is_not_remembered_is_the_same():
    first = speak("The same again.")
    forget_utterances()
    second = speak("The same again.")
    assert first.samples.tobytes() == second.samples.tobytes()
    assert first.phones == second.phones


def _absent(name: str) -> str:
    raise PackageNotFoundError(name)


@pytest.mark.parametrize(
    ("installed", "message"),
    [
        (_absent, "The voice 'hibari' is not installed; install it with `pip install 'padlab[voice]'`."),
        (lambda _: "9.0", "The voice 'hibari' needs hibari-tts 0.2.1, but 9.0 is installed; install it with `pip "),
    ],
)
def test_what_is_not_installed_is_told(monkeypatch, installed, message):
    monkeypatch.setattr(hibari, "installed_version", installed)
    with pytest.raises(SpeechError) as caught:
        HibariVoice()
    assert str(caught.value).startswith(message)


def _program(source: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start another program instead of hibari-tts's."""
    program = folder / "program.py"
    program.write_text(source)
    monkeypatch.setattr(hibari_process, "__file__", str(program))


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (
            "import sys; sys.exit('a warning\\nThere is no network')",
            "There is no network; reinstall it with `pip install",
        ),
        (
            "import os; os._exit(3)",
            "hibari-tts ended with status 3; reinstall it with `pip install 'padlab[voice]'`, or ",
        ),
        ("import time; time.sleep(60)", "The voice 'hibari' did not answer"),
    ],
)
def test_failures_of_the_program_are_one_sentence(tmp_path, monkeypatch, source, message):
    _program(source, tmp_path, monkeypatch)
    monkeypatch.setattr(hibari, "_TIMEOUT_S", 2.0)
    with pytest.raises(SpeechError) as caught:
        speak("This was never said.")
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_an_engine_that_cannot_be_loaded_is_told(tmp_path, monkeypatch):
    (tmp_path / "onnxruntime.py").write_text("raise ImportError('a library\\nis missing')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(
        SpeechError, match=r"^hibari-tts failed \(a library is missing\); reinstall it with `pip install"
    ):
        speak("This was never said.")


def test_a_sentence_is_quick():
    speak(PEAK)
    forget_utterances()
    before = os.times()
    speak(PEAK)
    after = os.times()
    # 1 s on the machine that it was written on; processor time, which other programs do not change much.
    assert after.children_user - before.children_user < 4.0
    speak(PEAK)
    # What was said before needs no process.
    assert os.times().children_user == after.children_user


SIGNS = st.one_of(st.sampled_from("abc dEZ019.,!?'’-;:()$% é"), st.sampled_from("太æßⅣ²½٣жλ—…、"), st.characters())


@kept
@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(text=st.text(SIGNS, max_size=40))
def test_any_text_is_spoken_or_refused(text):
    try:
        said = analyse(text, "en")
    except SpecError:
        return
    try:
        speech = HibariVoice().speak(said)
    except SpeechError as error:
        assert "has no sound for" in str(error)
        return
    check(speech, said)
