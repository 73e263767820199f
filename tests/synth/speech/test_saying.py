import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.speech.saying import EMPTY_S, check_sentence, silent_speech, spoken_text
from synth.text.sentence import Sentence, TextSyllable, TextWord


def sentence(text: str, *spans: tuple[int, int]) -> Sentence:
    words = tuple(TextWord(text[start:end], start, end, (TextSyllable("a"),)) for start, end in spans)
    return Sentence(text, "en", words)


def as_written(text: str, _word: TextWord, _before: str) -> list[str]:
    return list(text)


@pytest.mark.parametrize(
    ("text", "spans", "said"),
    [
        ("«ab», cd!?", [(1, 3), (6, 8)], " ab , cd! "),
        ("ab… , cd", [(0, 2), (6, 8)], "ab…   cd"),
        ("ab *😀* cd", [(0, 2), (7, 9)], "ab     cd"),
    ],
)
def test_between_words_the_strongest_sign_of_a_pause_stays(text, spans, said):
    found, places, words = spoken_text(sentence(text, *spans), as_written)
    assert found == said
    assert places == list(range(len(text)))
    assert words == ("ab", "cd")


@given(st.text("ab ,.!"), st.lists(st.sampled_from(["", "x", " longer "]), min_size=2, max_size=2))
def test_each_character_said_has_its_place(gap, pieces):
    said = sentence(f"ab{gap}cd", (0, 2), (2 + len(gap), 4 + len(gap)))
    found, places, words = spoken_text(said, lambda _text, _word, _before: pieces)
    assert len(found) == len(places)
    assert words == ("".join(pieces),) * 2
    assert places == sorted(places)
    assert found.startswith("".join(pieces))


def test_the_reader_knows_what_is_said_before():
    before = []

    def read(text: str, word: TextWord, last: str) -> list[str]:
        before.append((text, word.text, last))
        return list(text.upper())

    spoken_text(sentence("ab,cd", (0, 2), (3, 5)), read)
    assert before == [("ab", "ab", ""), ("cd", "cd", ",")]


def test_sentences_that_no_voice_takes():
    check_sentence(sentence("ab", (0, 2)), "en")
    with pytest.raises(SpecError, match="speaks 'zh'; the sentence is in 'en'"):
        check_sentence(sentence("ab", (0, 2)), "zh")
    with pytest.raises(SpecError, match="20001 characters; give at most 20000"):
        check_sentence(sentence("a" * 20_001, (0, 2)), "en")


def test_silence():
    speech = silent_speech("nobody", 1000)
    assert speech.duration_s == len(speech.samples) / speech.rate == EMPTY_S
    assert not np.any(speech.samples)
    assert speech.voice == "nobody"
