"""Chinese text into the words of jieba's dictionary, with their parts of speech and tones.

Traditional characters are made simplified first (OpenCC), since the dictionary is simplified; every character keeps its
place. Only the dictionary decides (jieba's hidden Markov model for unknown words is off), it is read from the package
(no cache file is written or believed), and nothing is added to it: the same text gives the same words everywhere.
"""

import threading
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import jieba
import opencc
from pypinyin import Style, lazy_pinyin
from pypinyin.constants import PINYIN_DICT

NEUTRAL = 5
"""The neutral tone."""

_LONGEST = 5
_LOADING = threading.Lock()
_NEUTRAL_PARTICLES = frozenset("的地得了着著吗呢吧啊呀嘛啦么们")


@dataclass(frozen=True, slots=True)
class DictionaryWord:
    """A word of the dictionary, or a character that is not in it.

    Parameters
    ----------
    text : str
        Simplified.
    tag : str
        Part of speech in the notation of ICTCLAS, as jieba's dictionary has it ("n", "v", "ns"); "" if unknown.
    """

    text: str
    tag: str


def readable(character: str) -> bool:
    """Tell whether the reading of a Chinese character is known."""
    return ord(character) in PINYIN_DICT


def simplified(text: str) -> str:
    """Return Chinese characters in their simplified forms, one for each."""
    converter = _converter()
    whole = str(converter.convert(text))
    if len(whole) == len(text):
        return whole
    forms = (converter.convert(character) for character in text)
    return "".join(form if len(form) == 1 else character for form, character in zip(forms, text, strict=True))


def segment(text: str) -> list[DictionaryWord]:
    """Return the words of simplified Chinese characters, by the likeliest path through jieba's dictionary.

    Words of more than five characters that consist of two words of the dictionary are given as these.
    """
    tokenizer, tags = _dictionary()
    words = (part for word in tokenizer.cut(text, HMM=False) for part in _halves(word, tags))
    return [DictionaryWord(word, tags.get(word, "")) for word in words]


def tones(words: list[str]) -> list[list[int]]:
    """Return the tones of the characters of simplified words: 1 to 4, and 5 for the neutral tone.

    They are those of the dictionary, as Hanyu Pinyin writes them, except that 一 and 不 have the tones by which they
    are spoken, since those decide where a tone falls: 一 and 不 rise before a fourth tone, and 一 falls before the
    others, unless it counts or ends its word. A third tone before a third tone stays 3, for it falls neither way.
    """
    read = [_word_tones(word) for word in words]
    flat = [(word, place, character) for word, text in enumerate(words) for place, character in enumerate(text)]
    for (word, place, character), (later, position, following) in pairwise(flat):
        after = read[later][position]
        if character == "不" and after == 4:
            read[word][place] = 2
        elif character == "一" and after != NEUTRAL and not _counts(words[word], place, following):
            read[word][place] = 2 if after == 4 else 4
        elif character == "一" and following == "个":
            read[word][place] = 2
    return read


def _word_tones(word: str) -> list[int]:
    if word in _NEUTRAL_PARTICLES:
        return [NEUTRAL]
    readings = lazy_pinyin(word, style=Style.TONE3, neutral_tone_with_five=True)
    if len(readings) != len(word):
        readings = [lazy_pinyin(one, style=Style.TONE3, neutral_tone_with_five=True)[0] for one in word]
    return [int(reading[-1]) if reading[-1:] in set("12345") else NEUTRAL for reading in readings]


def _counts(word: str, place: int, following: str) -> bool:
    """Tell whether 一 is a figure and not "a": in a row of digits, after 第 or 十, or at the end of a longer word."""
    before = word[place - 1] if place else ""
    ends = len(word) > 1 and place == len(word) - 1
    return (
        ends or (before != "" and before in "第十零二三四五六七八九点") or following in "零一二三四五六七八九十点月号日"
    )


def _halves(word: str, tags: dict[str, str]) -> tuple[str, ...]:
    if len(word) <= _LONGEST:
        return (word,)
    for place in sorted(range(2, len(word) - 1), key=lambda place: abs(2 * place - len(word))):
        if word[:place] in tags and word[place:] in tags:
            return (*_halves(word[:place], tags), *_halves(word[place:], tags))
    return (word,)


def _converter() -> opencc.OpenCC:
    with _LOADING:
        return _load_converter()


def _dictionary() -> tuple[jieba.Tokenizer, dict[str, str]]:
    with _LOADING:
        return _load_dictionary()


@cache
def _load_converter() -> opencc.OpenCC:
    converter = opencc.OpenCC("t2s")
    # The first conversion reads the tables; it happens here because the lock is held.
    converter.convert("漢")
    return converter


@cache
def _load_dictionary() -> tuple[jieba.Tokenizer, dict[str, str]]:
    tokenizer = jieba.Tokenizer()
    # `initialize` would do the same, but by way of a cache in the folder for temporary files that anyone may write.
    with tokenizer.get_dict_file() as content:
        tokenizer.FREQ, tokenizer.total = tokenizer.gen_pfdict(content)
    tokenizer.initialized = True
    with tokenizer.get_dict_file() as content:
        lines = (line.decode("utf-8").split() for line in content)
        return tokenizer, {fields[0]: fields[2] for fields in lines if len(fields) == 3}
