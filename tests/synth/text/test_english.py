import pytest

from synth.text import english
from synth.text.syllabification import syllable_count


def transcribe(words):
    """Stand in for the speech engine: stress on the first syllable."""
    return [[("x", place == 0) for place in range(syllable_count(word))] for word in words]


def groups(text):
    found = english.pronounced(english.tokens(text), transcribe)
    return [text[group[0].start : group[-1].end] for group in english.grouped(found)]


@pytest.mark.parametrize(
    "parted",
    [
        "The peak | is the most popular | attraction | in Hong Kong",
        "I don't think | it is a good | idea",
        "Give | her brother's | book to me",
        "We saw her | and they thanked us",
        "Mr. Smith | paid | $5.50 | for 5 km | by 8:30 p.m.",
        "what it | would have been",
        "the world-famous | R&D | of COVID-19",
        "The 21st | century",
    ],
)
def test_a_content_word_with_its_clitics(parted):
    assert groups(parted.replace(" | ", " ")) == parted.split(" | ")


def test_no_prosodic_word_goes_across_punctuation():
    assert groups("Come in, the 😀 water is (very) warm — really") == [
        "Come in",
        "the",
        "water is",
        "very",
        "warm",
        "really",
    ]


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("U.S.", ["U", "S"]),
        ("MTV", ["M", "T", "V"]),
        ("UNESCO", ["UNESCO"]),
        ("Dr", ["doctor"]),
        ("etc.", ["et", "cetera"]),
        ("1st", ["first"]),
        ("5km", ["five", "kilometres"]),
        ("MP4", ["M", "P", "four"]),
        ("2010-2013", ["twenty", "ten", "to", "twenty", "thirteen"]),
    ],
)
def test_how_tokens_are_read(text, spoken):
    (token,) = english.tokens(text)
    assert list(token.spoken) == spoken


def test_one_syllable_has_the_stress():
    found = english.pronounced(english.tokens("and about 25 mountains"), transcribe)
    marks = [[(one.text, one.stress) for one in english.stressed(group)] for group in english.grouped(found)]
    assert [[text for text, stress in group if stress] for group in marks] == [["five"], ["moun"]]


def test_the_engine_is_asked_once_and_its_silence_is_borne():
    asked = []

    def silent(words):
        asked.append(list(words))
        return [[] for _ in words]

    found = english.pronounced(english.tokens("a beautiful, beautiful W rhythm"), silent)
    assert asked == [["a", "beautiful", "rhythm"]]
    assert [[one.text for one in token.syllables] for token in found][2:] == [
        ["beau", "ti", "ful"],
        ["dou", "ble", "u"],
        ["rhythm"],
    ]
