import itertools

from hypothesis import given
from hypothesis import strategies as st

from synth.speech.phonetic_text import Sign, read_signs


def signs(text: str) -> list[Sign]:
    return [Sign(character, place) for place, character in enumerate(text)]


def read(text: str):
    """Phones of a phonetic text whose signs last one unit each."""
    return read_signs(signs(text), range(len(text) + 1))


def test_kokoros_letters_are_ipa():
    found = read("ʧˈAnʤ wˈW bˈɑTᵊl")
    assert " ".join(one.sound.symbol for one in found) == "tʃ eɪ n dʒ w aʊ b ɑ ɾ ə l"


def test_a_vowel_begins_with_its_mark_of_stress():
    found = read("pˈik")
    assert [(one.sound.symbol, one.start, one.end) for one in found] == [("p", 0, 1), ("iː", 1, 3), ("k", 3, 4)]
    assert [one.sound.stressed for one in found] == [False, True, False]
    assert [one.sound.initial for one in found] == [True, False, False]


def test_secondary_stress_is_not_marked_but_lengthens_the_vowel():
    assert [(one.sound.symbol, one.sound.stressed) for one in read("ˌit hˈæpi")][::2] == [
        *[("iː", False), ("h", False), ("p", False)]
    ]
    assert read("hˈæpi")[-1].sound.symbol == "i"


def test_marks_belong_to_the_phone_before_them():
    found = read("ːɡɜːʰ")
    assert [(one.sound.symbol, one.start, one.end) for one in found] == [("ɡ", 1, 2), ("ɜː", 2, 5)]


def test_blanks_and_punctuation_part_words():
    found = read('a, "b" c.')
    assert [one.sound.initial for one in found] == [True, True, True]
    assert [one.after_mark for one in found] == [False, True, False]
    assert [one.place for one in found] == [0, 4, 7]


@given(st.text("abiAʧ ,.ˈˌːʰ"))
def test_phones_are_in_order(text):
    found = read(text)
    assert all(one.start < one.end for one in found)
    assert all(one.end <= following.start for one, following in itertools.pairwise(found))
    assert len(found) == sum(character in "abiAʧ" for character in text)
