import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.text.scanning import has_chinese, normal, pieces


@given(st.text())
def test_pieces_are_in_order_and_where_they_say(text):
    assert len(normal(text)) == len(text)
    place = 0
    for piece in pieces(text):
        assert place <= piece.start < piece.end <= len(text)
        assert normal(text)[piece.start : piece.end] == piece.text
        place = piece.end


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("It’s 5:30 p.m.", ["It's", "5:30", "p.m."]),
        ("在2013年用Python", ["在", "2013", "年用", "Python"]),
        ("ＡＢＣ１２３％", ["ABC", "123%"]),
        ("$5 million, -3.5 °C and 1,250", ["$5 million", "-3.5 °C", "and", "1,250"]),
        ("2024-05-01 a-5 3-5", ["2024-05-01", "a", "5", "3", "-", "5"]),
        ("cafe\u0301 😀 ★ かな", ["cafe\u0301"]),
        ("…—“”?!", []),
    ],
)
def test_pieces(text, expected):
    assert [piece.text for piece in pieces(text)] == expected


def test_chinese_is_told_by_its_characters():
    assert has_chinese("Hong Kong 香港")
    assert has_chinese("𠀀")
    assert not has_chinese("Hong Kong, かな, 한국")
