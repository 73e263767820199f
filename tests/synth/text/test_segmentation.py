import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.text.segmentation import segment, simplified, tones


def words(text):
    return [word.text for word in segment(simplified(text))]


@settings(deadline=None)
@given(st.text(st.characters(min_codepoint=0x4E00, max_codepoint=0x9FFF)))
def test_characters_keep_their_places(text):
    plain = simplified(text)
    assert len(plain) == len(text)
    assert "".join(words(text)) == plain


def test_traditional_is_segmented_as_simplified():
    assert words("太平山頂是香港最受歡迎的名勝景點") == words("太平山顶是香港最受欢迎的名胜景点")


def test_long_words_are_parted():
    assert words("中華人民共和國") == ["中华人民", "共和国"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("摩天高楼", [2, 1, 1, 2]),
        ("了", [5]),
        ("不是", [2, 4]),
        ("不好", [4, 3]),
        ("一天", [4, 1]),
        ("一定", [2, 4]),
        ("一个", [2, 4]),
        ("第一", [4, 1]),
        ("统一", [3, 1]),
        ("一百一十一", [4, 3, 1, 2, 1]),
        # A third tone before a third tone stays as dictionaries write it.
        ("景点", [3, 3]),
    ],
)
def test_tones(text, expected):
    assert tones([text]) == [expected]


def test_tones_change_across_words():
    assert tones(["不", "去", "一", "座"]) == [[2], [4], [2], [4]]
