import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.text.numbers import english_number, english_ordinal, mandarin_number

_DIGITS = {character: digit for digit, character in enumerate("零一二三四五六七八九")}
_UNITS = {"十": 10, "百": 100, "千": 1000}


@pytest.mark.parametrize(
    ("text", "english", "mandarin"),
    [
        ("0", "zero", "零"),
        ("17", "seventeen", "十七"),
        ("105", "one hundred and five", "一百零五"),
        ("1,250", "one thousand two hundred and fifty", "一千二百五十"),
        ("1999", "nineteen ninety nine", "一千九百九十九"),
        ("1905", "nineteen oh five", "一千九百零五"),
        ("2000", "two thousand", "二千"),
        ("100005", "one hundred thousand and five", "十万零五"),
        ("110000", "one hundred and ten thousand", "十一万"),
        ("100000001", "one hundred million and one", "一亿零一"),
        ("3.14", "three point one four", "三点一四"),
        ("-3.5", "minus three point five", "负三点五"),
        ("007", "zero zero seven", "零零七"),
        (
            "1234567890123",
            "one two three four five six seven eight nine zero one two three",
            "一二三四五六七八九零一二三",
        ),
        ("25%", "twenty five percent", "百分之二十五"),
        ("36 °C", "thirty six degrees Celsius", "三十六摄氏度"),
        ("3/4", "three quarters", "四分之三"),
        ("½", "one half", "二分之一"),
        ("$1", "one dollar", "一美元"),
        ("$5.50", "five dollars fifty", "五点五零美元"),
        ("$5 million", "five million dollars", "五百万美元"),
        ("8:05", "eight oh five", "八点零五分"),
        ("9:00", "nine o'clock", "九点整"),
        ("2024-05-21", "May twenty first twenty twenty four", "二零二四年五月二十一日"),
    ],
)
def test_readings(text, english, mandarin):
    assert " ".join(english_number(text)) == english
    assert mandarin_number(text) == mandarin


def test_what_follows_decides_in_mandarin():
    assert mandarin_number("2013", "年") == "二零一三"
    assert mandarin_number("2", "个") == "两"
    assert mandarin_number("2", "月") == "二"


@pytest.mark.parametrize(("value", "words"), [(1, "first"), (12, "twelfth"), (20, "twentieth"), (33, "thirty third")])
def test_ordinals(value, words):
    assert " ".join(english_ordinal(value)) == words


@given(st.integers(1, 10**12 - 1))
def test_chinese_numerals_mean_the_number(value):
    read = mandarin_number(str(value))
    assert "零零" not in read
    assert not read.endswith("零")
    assert _meaning(read) == value


@given(st.integers(0, 10**12 - 1))
def test_english_numbers_differ(value):
    words = english_number(f"{value:,}")
    assert words != english_number(f"{value + 1:,}")
    assert all(word.isalpha() for word in words)


def _meaning(read):
    total, part, digit = 0, 0, 0
    for character in read:
        if character in _DIGITS:
            digit = _DIGITS[character]
        elif character in _UNITS:
            part, digit = part + (digit or 1) * _UNITS[character], 0
        else:
            total, part, digit = total + (part + digit) * {"万": 10**4, "亿": 10**8}[character], 0, 0
    return total + part + digit
