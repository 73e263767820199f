import re
from itertools import pairwise

import numpy as np
import pytest

from synth.errors import SpecError, SpeechError
from synth.speech.recorded import read_recording
from synth.speech.sound import write_wav
from synth.speech.spoken import SILENCE, Span
from synth.text.sentence import Sentence, TextSyllable, TextWord

RATE = 16_000
SENTENCE = Sentence(
    "Good morning",
    "en",
    (
        TextWord("Good", 0, 4, (TextSyllable("Good", stress=True),)),
        TextWord("morning", 5, 12, (TextSyllable("mor", stress=True), TextSyllable("ning"))),
    ),
)
HEADER = "start_s,end_s,symbol,word"
ROWS = ["0.1,0.2,ɡ,0", "0.2,0.3,ʊ,0", "0.3,0.4,d,0", "0.5,0.6,m,1", "0.6,0.7,ɔː,1", "0.7,0.8,n,1", "0.8,0.9,ɪ,1"]
LINES = [*ROWS, "0.9,1.0,ŋ,1"]


@pytest.fixture
def read(tmp_path):
    def make(lines: list[str], header: str = HEADER, seconds: float = 1.2, sentence: Sentence = SENTENCE):
        write_wav(tmp_path / "a.wav", np.arange(round(RATE * seconds)).astype(np.int16), RATE)
        (tmp_path / "a.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
        return read_recording(tmp_path / "a.wav", tmp_path / "a.csv", sentence)

    return make


def test_gaps_are_pauses_and_words_have_their_times(read):
    speech = read(LINES)
    assert [phone.symbol for phone in speech.phones] == [SILENCE, *"ɡʊd", SILENCE, "m", "ɔː", *"nɪŋ", SILENCE]
    assert all(first.end_s == second.start_s for first, second in pairwise(speech.phones))
    assert speech.phones[0].start_s == 0.0
    assert speech.duration_s == 1.2 == len(speech.samples) / speech.rate
    assert speech.words == (Span(0.1, 0.4), Span(0.5, 1.0))
    # Without numbers of syllables the vowels decide: mɔː-nɪŋ.
    assert speech.syllables == ((Span(0.1, 0.4),), (Span(0.5, 0.7), Span(0.7, 1.0)))
    assert speech.voice == "recording a.wav"


def test_syllables_and_stress_of_the_file(read):
    counts = ["0,1", "0,1", "0,1", "0,1", "0,1", "0,1", "1,0", "1,"]
    lines = [f"{line},{count}" for line, count in zip(LINES, counts, strict=True)]
    speech = read(lines, HEADER + ",syllable,stress")
    assert speech.syllables[1] == (Span(0.5, 0.8), Span(0.8, 1.0))
    assert [phone.symbol for phone in speech.phones if phone.stress] == ["ɡ", "ʊ", "d", "m", "ɔː", "n"]


def test_marks_are_taken_off_and_times_rounded_alike_touch(read):
    lines = ["0,0.1004,ˈɡ,0", "0.1,0.3,ʊ˥1,0", "0.3004,0.4,d,0", "0.4,0.5,_,", *LINES[3:7], "0.9,1.2005,ŋ,1"]
    speech = read(lines)
    assert [phone.symbol for phone in speech.phones] == [*"ɡʊd", SILENCE, "m", "ɔː", *"nɪŋ"]
    assert speech.duration_s == 1.2


def test_a_pause_inside_a_word_is_the_words(read):
    speech = read([*LINES[:4], "0.6,0.65,_,1", "0.65,0.7,ɔː,1", *LINES[5:]])
    assert speech.words[1] == Span(0.5, 1.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({0: "0.1,0.1,ɡ,0"}, "line 2, column end_s: the phone ends at 0.1 s; it must end after 0.1 s."),
        ({1: "0.15,0.3,ʊ,0"}, "line 3, column start_s: the phone begins at 0.15 s, before the one above it ends"),
        ({7: "0.9,1.3,ŋ,1"}, "line 9, column end_s: the value is '1.3'; it must be a number from 0 to 1.201."),
        ({7: "0.9,nan,ŋ,1"}, "line 9, column end_s: the value is 'nan'"),
        ({2: "0.3,0.4,,0"}, "line 4, column symbol: the field is empty"),
        ({2: "0.3,0.4,?,0"}, "line 4, column symbol: the value is '?'; it must be a phone in IPA"),
        ({2: "0.3,0.4,ˈ,0"}, "line 4, column symbol: the value is 'ˈ'"),
        ({2: "0.3,0.4,d,2"}, "line 4, column word: the value is 2; the sentence has the words 0 to 1."),
        ({2: "0.3,0.4,d,x"}, "line 4, column word: the value is 'x'; it must be a whole number"),
        ({4: "0.6,0.7,ɔː,0"}, "line 6, column word: word 0 comes after word 1; words must be in order."),
        ({2: "0.3,0.4,d"}, "line 4: has 3 fields; there must be 4"),
    ],
)
def test_malformed_lines_are_named(read, changed, message):
    lines = [changed.get(number, line) for number, line in enumerate(LINES)]
    with pytest.raises(SpecError, match=re.escape(message)):
        read(lines)


def test_words_must_stay_in_order_across_phones_outside_of_words(read):
    lines = [*LINES[:3], "0.4,0.5,h,", *LINES[3:], "1.0,1.05,h,", "1.05,1.1,d,0"]
    with pytest.raises(SpecError, match=re.escape("line 12, column word: word 0 comes after word 1")):
        read(lines)


def test_every_word_must_be_there(read):
    with pytest.raises(SpecError, match=re.escape("no phone belongs to word 1 ('morning'); each of the 2 words")):
        read(LINES[:3])


def test_columns(read):
    with pytest.raises(SpecError, match="line 1: there is no column word"):
        read(["0,1,a"], "start_s,end_s,symbol")
    with pytest.raises(SpecError, match="line 1: the column 'tone' is unknown"):
        read(["0,1,a,0,3"], HEADER + ",tone")
    with pytest.raises(SpecError, match="line 1: nothing follows the first line"):
        read([])


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ("00000222", "line 7, column syllable: the value is 2; the word has the syllables 0 to 1."),
        ("00011100", "word 1 ('morning'): its syllables are numbered [1, 1, 1, 0, 0]; each phone must have one"),
        ("00000000", "word 1 ('morning'): its syllables are numbered [0, 0, 0, 0, 0]"),
        ("000 0011", "word 1 ('morning'): its syllables are numbered [0, 0, 1, 1]"),
    ],
)
def test_syllables_must_fit_the_word(read, counts, message):
    lines = [f"{line},{count.strip()}" for line, count in zip(LINES, counts, strict=True)]
    with pytest.raises(SpecError, match=re.escape(message)):
        read(lines, HEADER + ",syllable")


def test_stress_is_a_flag(read):
    with pytest.raises(SpecError, match=re.escape("line 2, column stress: the value is 'yes'; it must be 1, 0 or")):
        read([f"{line},yes" for line in LINES], HEADER + ",stress")


def test_the_sound_must_be_a_wav_file(read, tmp_path):
    read(LINES)
    (tmp_path / "a.wav").write_bytes(b"RIFF, but not really")
    with pytest.raises(SpeechError, match=r"a\.wav is no WAV file that can be read .*convert it"):
        read_recording(tmp_path / "a.wav", tmp_path / "a.csv", SENTENCE)
