import subprocess
import sys
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.text.analysis import analyse
from synth.text.sentence import LONGEST_TEXT
from synth.text.syllabification import syllable_count

PEAK = "太平山頂是香港最受歡迎的名勝景點，登臨其間，可俯瞰山下鱗次櫛比的摩天高樓和享譽全球的維多利亞港景色。"


def transcribe(words):
    """Stand in for the speech engine: stress on the first syllable."""
    return [[("x", place == 0) for place in range(syllable_count(word))] for word in words]


def check(sentence, text):
    assert sentence.text == text
    assert sentence.words
    place = 0
    for word in sentence.words:
        assert place <= word.start < word.end
        assert text[word.start : word.end] == word.text
        place = word.end


# Control characters are in some texts only, since one of them is enough for a refusal.
spoken = st.sampled_from("山的最是，。 12.,%$-:/'aeThe一不😀・й\n\u0301ＡＢ&+")
mixed = st.one_of(
    st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=LONGEST_TEXT),
    st.text(spoken, max_size=LONGEST_TEXT),
    st.text(st.one_of(spoken, st.characters(min_codepoint=0x3400, max_codepoint=0x9FFF)), max_size=LONGEST_TEXT),
    st.text(),
)


@settings(max_examples=300, deadline=None)
@given(text=mixed, lang=st.sampled_from(["en", "zh", None]))
def test_any_text_gives_a_sentence_or_says_why_not(text, lang):
    try:
        sentence = analyse(text, lang, transcriber=transcribe)
    except SpecError as error:
        assert str(error).endswith(".")
        return
    check(sentence, text)
    for word in sentence.words:
        assert all(one.text for one in word.syllables)


def test_the_language_is_guessed():
    assert analyse("Welcome to Hong Kong").lang == "en"
    assert analyse("歡迎來 Hong Kong").lang == "zh"
    assert analyse("Welcome 歡迎", "en", transcriber=transcribe).words[-1].text == "Welcome"


def test_english_stress_comes_from_the_speech_engine():
    words = analyse("The most beautiful attraction, again").words
    assert [one.text for word in words for one in word.syllables if one.stress] == ["beau", "trac", "gain"]
    assert all(one.tone is None for word in words for one in word.syllables)


def test_english_words_in_chinese_are_spoken_without_stress():
    words = analyse("我用Python编程").words
    assert [word.text for word in words] == ["我用Python", "编程"]
    assert [one.text for one in words[0].syllables] == ["我", "用", "Py", "thon"]
    assert not any(one.stress for one in words[0].syllables)


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("好" * 2001, {}, "2001 characters"),
        ("a\x00b", {}, r"U\+0000 at place 2"),
        ("a\ud800", {}, r"U\+D800"),
        ("", {}, "nothing that can be spoken"),
        ("😀 … ★", {}, "nothing that can be spoken in English"),
        ("香港", {"lang": "en"}, "nothing that can be spoken in English"),
        ("hello", {"lang": "fr"}, "'fr' is unknown; it must be en or zh"),
    ],
)
def test_what_cannot_be_analysed_is_refused(text, options, message):
    with pytest.raises(SpecError, match=message):
        analyse(text, **options, transcriber=transcribe)


def test_annotated_words_replace_the_automatic_ones():
    sentence = analyse("太平山頂是香港最受歡迎的名勝景點", annotation=[("太平", -1, 0.5), ("香港最", 1, 1)])
    check(sentence, "太平山頂是香港最受歡迎的名勝景點")
    assert [word.text for word in sentence.words] == ["太平", "山頂是", "香港最", "受歡迎的", "名勝景點"]
    assert (sentence.words[0].P, sentence.words[0].A) == (-1, 0.5)
    assert (sentence.words[2].P, sentence.words[2].A) == (1, 1)
    assert sentence.words[2].syllables[2].stress


def test_values_left_out_are_appraised():
    text = "The view is wonderful"
    automatic = analyse(text, transcriber=transcribe)
    whole = [(word.text, None, 0.25) for word in automatic.words]
    annotated = analyse(text, annotation=whole, transcriber=transcribe)
    assert [(word.P, word.A) for word in annotated.words] == [(word.P, 0.25) for word in automatic.words]


@pytest.mark.parametrize(
    ("annotation", "message"),
    [
        ([("cat", 0, 0), ("The", 0, 0)], "word 2, 'The'"),
        ([("at", 0, 0)], "word 1, 'at'"),
        ([("", 0, 0)], "word 1, ''"),
        ([("!", 0, 0)], "'!' has nothing"),
        ([("cat", 2, 0)], "P is 2"),
        ([("cat", 0, float("nan"))], "A is nan"),
    ],
)
def test_wrong_annotation_is_refused(annotation, message):
    with pytest.raises(SpecError, match=message):
        analyse("The cat sat!", annotation=annotation, transcriber=transcribe)


def test_a_fresh_process_says_the_same_in_many_threads_without_noise_or_files(tmp_path):
    program = (
        "import sys; from concurrent.futures import ThreadPoolExecutor; from synth.text.analysis import analyse\n"
        "with ThreadPoolExecutor(8) as pool: found = set(map(repr, pool.map(analyse, [sys.argv[1]] * 8)))\n"
        "sys.stdout.buffer.write('\\n'.join(found).encode())"
    )
    environment = {
        "TMPDIR": str(tmp_path),
        "HOME": str(tmp_path),
        "PYTHONHASHSEED": "7",
        "PYTHONPATH": ":".join(sys.path),
    }
    done = subprocess.run([sys.executable, "-c", program, PEAK], capture_output=True, env=environment, check=True)
    assert done.stdout.decode() == repr(analyse(PEAK))
    assert done.stderr == b""
    assert list(tmp_path.iterdir()) == []


def test_a_sentence_takes_less_than_20_ms_when_warm():
    texts = (PEAK, "Victoria Peak is the most popular attraction in Hong Kong, and it overlooks the harbour.")
    for text in texts:
        analyse(text, transcriber=transcribe)
        times = []
        for _ in range(5):
            start = time.perf_counter()
            analyse(text, transcriber=transcribe)
            times.append(time.perf_counter() - start)
        assert min(times) < 0.02
