"""How numbers are read: cardinal and ordinal numbers, years, dates, times, fractions, percentages, money, degrees.

What is read is found by `synth.text.scanning`. Chinese readings are strings of numerals, English ones are words.
"""

import re
from collections.abc import Callable

_ONES = (
    *("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"),
    *("thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"),
)
_TENS = ("zero", "ten", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")
_SCALES = ((10**12, "trillion"), (10**9, "billion"), (10**6, "million"), (1000, "thousand"))
_ORDINALS = {
    "one": "first", "two": "second", "three": "third", "five": "fifth", "eight": "eighth", "nine": "ninth",
    "twelve": "twelfth",
}  # fmt: skip
_MONTHS = (
    *("January", "February", "March", "April", "May", "June"),
    *("July", "August", "September", "October", "November", "December"),
)
_FRACTIONS = {"½": ("1", "2"), "¼": ("1", "4"), "¾": ("3", "4")}
_CURRENCIES = {
    "$": ("dollar", "dollars", "美元"),
    "€": ("euro", "euros", "欧元"),
    "£": ("pound", "pounds", "英镑"),
    "¥": ("yuan", "yuan", "元"),
}
_SIGNS = {
    "%": (("percent",), ("百分之", "")),
    "‰": (("per", "thousand"), ("千分之", "")),
    "℃": (("degrees", "Celsius"), ("", "摄氏度")),
    "°C": (("degrees", "Celsius"), ("", "摄氏度")),
    "℉": (("degrees", "Fahrenheit"), ("", "华氏度")),
    "°F": (("degrees", "Fahrenheit"), ("", "华氏度")),
    "°": (("degrees",), ("", "度")),
}
_SCALE_CHARACTERS = {"thousand": "千", "million": "百万", "billion": "十亿", "trillion": "万亿"}
_MEASURES = frozenset("个位名座只条张次种家件年天周倍")
_DIGITS = "零一二三四五六七八九"
_PLACES = ("", "十", "百", "千")
_MYRIADS = ("", "万", "亿", "万亿")
# A longer number is read digit by digit, as a telephone or account number is.
_LONGEST = 12

_Match = re.Match[str]

_DATE = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})", re.ASCII)
_TIME = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}))?", re.ASCII)
_FRACTION = re.compile(r"(\d+)/(\d+)|[½¼¾]", re.ASCII)
_MONEY = re.compile(r"([$€£¥]) ?([\d.]+) ?(thousand|million|billion|trillion)?", re.ASCII)
_SIGNED = re.compile(r"([\d.]+) ?(%|‰|℃|℉|°[CF]?)", re.ASCII)


def english_number(text: str) -> tuple[str, ...]:
    """Return the words by which a number is read in English.

    Parameters
    ----------
    text : str
        A number as `synth.text.scanning.pieces` finds it, for instance "1,250", "-3.5", "25%", "$5 million", "8:30".

    Returns
    -------
    tuple of str
        At least one word, without hyphens: ("twenty", "five", "percent").
    """
    if text[0] in "-−":
        return ("minus", *english_number(text[1:]))
    plain = text.replace(",", "")
    for pattern, read in _ENGLISH:
        if found := pattern.fullmatch(plain):
            return read(found)
    return _english_plain(plain, year="," not in text)


def english_ordinal(value: int) -> tuple[str, ...]:
    """Return the words of an ordinal number: ("twenty", "first") for 21."""
    *others, last = _english_whole(value)
    if last in _ORDINALS:
        return (*others, _ORDINALS[last])
    return (*others, last[:-1] + "ieth" if last.endswith("y") else last + "th")


def mandarin_number(text: str, following: str = "") -> str:
    """Return the Chinese numerals by which a number is read in Mandarin.

    Parameters
    ----------
    text : str
        A number as `synth.text.scanning.pieces` finds it.
    following : str
        What is written after it: digits of a year are read one by one (2013年), and 2 is 两 before a measure word.

    Returns
    -------
    str
        Simplified Chinese characters: "百分之二十五" for "25%".
    """
    if text[0] in "-−":
        return "负" + mandarin_number(text[1:], following)
    plain = text.replace(",", "")
    for pattern, read in _MANDARIN:
        if found := pattern.fullmatch(plain):
            return read(found)
    if following.startswith("年") and len(plain) == 4 and plain.isdigit():
        return _mandarin_digits(plain)
    return "两" if plain == "2" and following in _MEASURES else _mandarin_plain(plain)


def _english_plain(text: str, *, year: bool = False) -> tuple[str, ...]:
    whole, _, decimals = text.partition(".")
    if len(whole) > _LONGEST or (len(whole) > 1 and whole[0] == "0"):
        words = tuple(_ONES[int(digit)] for digit in whole)
    elif year and not decimals and len(whole) == 4 and 1100 <= int(whole) <= 2099:
        words = _english_year(int(whole))
    else:
        words = _english_whole(int(whole or 0))
    return (*words, "point", *(_ONES[int(digit)] for digit in decimals)) if decimals else words


def _english_whole(value: int) -> tuple[str, ...]:
    for scale, name in _SCALES:
        if value >= scale:
            rest = value % scale
            words = (*_english_whole(value // scale), name)
            return (*words, *(["and"] if 0 < rest < 100 else []), *_english_whole(rest)) if rest else words
    if value >= 100:
        words = (_ONES[value // 100], "hundred")
        return (*words, "and", *_english_whole(value % 100)) if value % 100 else words
    if value >= 20:
        return (_TENS[value // 10], _ONES[value % 10]) if value % 10 else (_TENS[value // 10],)
    return (_ONES[value],)


def _english_year(value: int) -> tuple[str, ...]:
    """Return a year in pairs (nineteen ninety nine), except in the first ten years of a millennium."""
    century, rest = divmod(value, 100)
    if value < 1100 or value % 1000 < 10:
        return _english_whole(value)
    if not rest:
        return (*_english_whole(century), "hundred")
    return (*_english_whole(century), *(["oh"] if rest < 10 else []), *_english_whole(rest))


def _english_minutes(value: int) -> tuple[str, ...]:
    if not value:
        return ("o'clock",)
    return ("oh", *_english_whole(value)) if value < 10 else _english_whole(value)


def _english_date(found: _Match) -> tuple[str, ...]:
    year, month, day = map(int, found.groups())
    if 1 <= month <= 12:
        return (_MONTHS[month - 1], *english_ordinal(day), *_english_year(year))
    return (*_english_year(year), *_english_whole(month), *_english_whole(day))


def _english_time(found: _Match) -> tuple[str, ...]:
    hour, *others = (int(one) for one in found.groups() if one is not None)
    return (*_english_whole(hour), *(word for one in others for word in _english_minutes(one)))


def _english_fraction(found: _Match) -> tuple[str, ...]:
    over, under = _FRACTIONS.get(found[0]) or found.groups()
    if max(len(over), len(under)) > 4 or int(under) < 2:
        return (*_english_plain(over), "over", *_english_plain(under))
    name = {"2": ("half",), "4": ("quarter",)}.get(under, english_ordinal(int(under)))
    if over != "1":
        name = ("halves",) if under == "2" else (*name[:-1], name[-1] + "s")
    return (*_english_whole(int(over)), *name)


def _english_money(found: _Match) -> tuple[str, ...]:
    sign, amount, scale = found.groups()
    one, many, _ = _CURRENCIES[sign]
    whole, _, cents = amount.partition(".")
    if len(cents) == 2 and cents[0] != "0" and not scale:
        return (*_english_plain(whole), one if whole == "1" else many, *_english_whole(int(cents)))
    return (*_english_plain(amount), *([scale] if scale else []), one if amount == "1" and not scale else many)


def _english_signed(found: _Match) -> tuple[str, ...]:
    return (*_english_plain(found[1]), *_SIGNS[found[2]][0])


def _mandarin_plain(text: str) -> str:
    whole, _, decimals = text.partition(".")
    long = len(whole) > _LONGEST or (len(whole) > 2 and whole[0] == "0")
    read = _mandarin_digits(whole) if long else _mandarin_whole(int(whole or 0))
    return f"{read}点{_mandarin_digits(decimals)}" if decimals else read


def _mandarin_digits(text: str) -> str:
    return "".join(_DIGITS[int(digit)] for digit in text)


def _mandarin_minutes(text: str) -> str:
    return _mandarin_digits(text) if text[0] == "0" else _mandarin_whole(int(text))


def _mandarin_whole(value: int) -> str:
    """Return a whole number below 10 to the 16th in myriads, with one zero for empty places between digits."""
    if value == 0:
        return _DIGITS[0]
    groups = []
    while value:
        value, group = divmod(value, 10_000)
        groups.append(group)
    read = ""
    for power in reversed(range(len(groups))):
        group = groups[power]
        if not group:
            continue
        if read and (group < 1000 or not groups[power + 1]) and not read.endswith("零"):
            read += "零"
        read += _mandarin_group(group) + _MYRIADS[power]
    return read[1:] if read.startswith("一十") else read


def _mandarin_group(group: int) -> str:
    read, gap = "", False
    for place in reversed(range(4)):
        digit = group // 10**place % 10
        if digit:
            read += ("零" if gap and read else "") + _DIGITS[digit] + _PLACES[place]
            gap = False
        else:
            gap = True
    return read


def _mandarin_date(found: _Match) -> str:
    year, month, day = found.groups()
    return f"{_mandarin_digits(year)}年{_mandarin_plain(month)}月{_mandarin_plain(day)}日"


def _mandarin_time(found: _Match) -> str:
    hour, minute, second = found.groups()
    rest = "整" if minute == "00" and second is None else _mandarin_minutes(minute) + "分"
    return f"{_mandarin_whole(int(hour))}点{rest}" + (f"{_mandarin_minutes(second)}秒" if second else "")


def _mandarin_fraction(found: _Match) -> str:
    over, under = _FRACTIONS.get(found[0]) or found.groups()
    return f"{_mandarin_plain(under)}分之{_mandarin_plain(over)}"


def _mandarin_money(found: _Match) -> str:
    sign, amount, scale = found.groups()
    return _mandarin_plain(amount) + _SCALE_CHARACTERS.get(scale, "") + _CURRENCIES[sign][2]


def _mandarin_signed(found: _Match) -> str:
    before, after = _SIGNS[found[2]][1]
    return before + _mandarin_plain(found[1]) + after


_ENGLISH: tuple[tuple[re.Pattern[str], Callable[[_Match], tuple[str, ...]]], ...] = (
    (_DATE, _english_date),
    (_TIME, _english_time),
    (_FRACTION, _english_fraction),
    (_MONEY, _english_money),
    (_SIGNED, _english_signed),
)
_MANDARIN: tuple[tuple[re.Pattern[str], Callable[[_Match], str]], ...] = (
    (_DATE, _mandarin_date),
    (_TIME, _mandarin_time),
    (_FRACTION, _mandarin_fraction),
    (_MONEY, _mandarin_money),
    (_SIGNED, _mandarin_signed),
)
