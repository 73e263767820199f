"""The pieces of a text that are spoken: Chinese, Latin letters, numbers and a few symbols, with their offsets."""

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass

_LATIN = r"A-Za-zÀ-ÖØ-öø-\u024f\u1e00-\u1eff"
_MARKS = r"\u0300-\u036f"
_WORD = rf"[{_LATIN}][{_LATIN}{_MARKS}]*(?:'[{_LATIN}][{_LATIN}{_MARKS}]*)*"
_HAN = r"〇\u3400-\u4dbf\u4e00-\u9fff\U00020000-\U000323af"
_PLAIN = r"(?:\d{1,3}(?:,\d{3})+(?!\d)|\d+)(?:\.\d+)?"
_NUMBER = "|".join(
    (
        r"\d{4}(?P<separator>[-/.])\d{1,2}(?P=separator)\d{1,2}(?!\d)",
        r"\d{1,2}:\d{2}(?::\d{2})?(?!\d)",
        r"\d+/\d+(?![\d/])",
        rf"[$€£¥]\ ?{_PLAIN}(?:\ (?:thousand|million|billion|trillion)\b)?",
        rf"{_PLAIN}\ ?(?:%|‰|℃|℉|°[CF]?)",
        _PLAIN,
        "[½¼¾]",
    )
)
_PIECES = re.compile(
    rf"(?P<number>(?:(?<![\w.])[-−](?=\d))?(?:{_NUMBER}))"
    rf"|(?P<latin>(?:[{_LATIN}]\.){{2,}}(?![{_LATIN}])|{_WORD})"
    rf"|(?P<han>[{_HAN}]+)"
    r"|(?P<symbol>[&+=@]|(?<=\d)[-–~](?=\d))",
    re.VERBOSE | re.ASCII,
)
_CHINESE = re.compile(f"[{_HAN}]")
_SAME = str.maketrans({"’": "'", "ʼ": "'", "‘": "'", "〜": "~"})


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of a text.

    Parameters
    ----------
    kind : {"han", "latin", "number", "symbol"}
        What it is made of.
    text : str
        In its normal form, as long as it is written.
    start, end : int
        Where it stands in the text.
    """

    kind: str
    text: str
    start: int
    end: int


def normal(text: str) -> str:
    """Return the text with full-width and other compatible forms made plain, character for character."""
    plain = (unicodedata.normalize("NFKC", one) for one in text)
    return "".join(one if len(one) == 1 else old for one, old in zip(plain, text, strict=True)).translate(_SAME)


def has_chinese(text: str) -> bool:
    """Tell whether a text has Chinese characters."""
    return _CHINESE.search(normal(text)) is not None


def pieces(text: str) -> Iterator[Piece]:
    """Yield the pieces of a text in order; what lies between them (blanks, punctuation, emoji) is not spoken."""
    for found in _PIECES.finditer(normal(text)):
        yield Piece(str(found.lastgroup), found[0], found.start(), found.end())
