"""What the words of Chinese prosodic words contribute to appraisal."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from synth.text.lexicon import high_words, polarities, word_lists
from synth.text.marks import HIGH, KEY_FACT, Mark, Role
from synth.text.scanning import normal
from synth.text.segmentation import DictionaryWord, segment, simplified
from synth.text.sentence import TextWord

_CLAUSE_END = re.compile(r"[,.;:!?()\"…—。，！？；：、（）“”《》]")
_LISTS_OF_WORDS = (
    "neutral_words",
    "not_negation",
    "negation",
    "prohibition",
    "degree",
    "comparative",
    "not_superlative",
)
_MOST_PIECES = 4
_TAILS = {"您": "r", "你": "r", "的": "uj", "了": "ul"}
_PARTICLE_TAGS = ("u", "y")
_GRADED_TAGS = ("a", "v", "i", "l", "z", "b", "d")
_QUALITY_TAGS = ("a", "i", "l", "z", "b")
_FACT_TAGS = ("n", "t", "s", "v", "i", "l", "j")
_NOUN_TAGS = frozenset({"n", "an", "vn"})
_NUMERALS = frozenset("〇零一二两三四五六七八九十百千万亿半第")
_TIMES = frozenset("天年月日周夜晚分秒")


@dataclass(frozen=True, slots=True)
class _Piece:
    text: str
    tag: str
    word: int
    clause: int


def chinese_marks(words: Sequence[TextWord], text: str) -> list[Mark]:
    """Return the marks of prosodic words, dictionary word by dictionary word.

    Parameters
    ----------
    words : sequence of TextWord
        Prosodic words of a Chinese text, traditional or simplified.
    text : str
        The text.

    Returns
    -------
    list of Mark
        In order.
    """
    pieces = list(_pieces(words, normal(text)))
    return [_mark(pieces, place) for place in range(len(pieces))]


def _pieces(words: Sequence[TextWord], text: str) -> Iterator[_Piece]:
    clause, end = 0, 0
    for index, word in enumerate(words):
        if _CLAUSE_END.search(text[end : word.start]):
            clause += 1
        written = simplified("".join(text[word.start : word.end].split()))
        for entry, tag in _entries(written):
            yield _Piece(entry, tag, index, clause)
        end = word.end


def _entries(written: str) -> list[tuple[str, str]]:
    """Return the words of the lexicon or, where there are none, of the dictionary, the longest first."""
    found = list(_split(segment(written)))
    entries, place = [], 0
    while place < len(found):
        for count in range(min(_MOST_PIECES, len(found) - place), 0, -1):
            joined = "".join(part.text for part in found[place : place + count])
            if count == 1 or (len(joined) > 1 and _is_known(joined)):
                entries.append((joined, found[place].tag if count == 1 else "l"))
                place += count
                break
    return entries


def _split(found: Sequence[DictionaryWord]) -> Iterator[DictionaryWord]:
    """Part words of the dictionary that hide one of the lexicon: 很漂亮, 美的, 谢谢您, or 不难 and 吃 for 不难吃."""
    for part, following in zip(found, [*found[1:], DictionaryWord("", "")], strict=True):
        if _is_known(part.text):
            yield part
        elif (head := _head(part.text, following.text)) is not None:
            yield DictionaryWord(head, "d")
            yield DictionaryWord(part.text[len(head) :], "a")
        elif part.text[-1] in _TAILS and part.text[:-1] in polarities("zh"):
            yield DictionaryWord(part.text[:-1], "a")
            yield DictionaryWord(part.text[-1], _TAILS[part.text[-1]])
        else:
            yield part


def _head(text: str, following: str) -> str | None:
    """Return the word of degree, comparison or negation that a word begins with, if one that appraises comes after."""
    lists, known = word_lists("zh"), polarities("zh")
    for length in range(1, len(text)):
        rest = text[length:]
        if text[:length] in lists["degree"] | lists["comparative"] | lists["negation"] and (
            rest in known or rest + following in known
        ):
            return text[:length]
    return None


def _is_known(text: str) -> bool:
    lists = word_lists("zh")
    return text in polarities("zh") or any(text in lists[name] for name in _LISTS_OF_WORDS)


def _mark(pieces: Sequence[_Piece], place: int) -> Mark:
    piece = pieces[place]
    plain = Mark(piece.text, piece.word, piece.clause, particle=piece.tag.startswith(_PARTICLE_TAGS))
    if plain.particle or piece.text in word_lists("zh")["not_negation"]:
        return plain
    acting = _acting(pieces, place, plain)
    if acting is not None:
        return acting
    P, A = _appraisal(pieces, place)
    if A < KEY_FACT and _is_key_fact(pieces, place, appraises=P != 0):
        A = KEY_FACT
    return replace(plain, P=P, A=A, graded=P != 0 or piece.tag.startswith(_GRADED_TAGS))


def _acting(pieces: Sequence[_Piece], place: int, plain: Mark) -> Mark | None:
    """Return the mark of a word that acts on those after it; None for others."""
    text, lists = plain.text, word_lists("zh")
    if text in lists["prohibition"]:
        return replace(plain, role=Role.PROHIBITION)
    if text in lists["negation"]:
        return replace(plain, role=_negation_role(pieces, place), A=_degree_within(text))
    if text in lists["comparative"]:
        return replace(plain, role=Role.DEGREE, A=KEY_FACT, graded=True)
    if text in lists["degree"] and _is_degree(pieces, place):
        return replace(plain, role=Role.DEGREE, A=HIGH, graded=True)
    return None


def _degree_within(negation: str) -> float:
    """Return A of a negation: 毫无 and 毫不 deny altogether."""
    return HIGH if negation.startswith("毫") else 0.0


def _negation_role(pieces: Sequence[_Piece], place: int) -> Role:
    clause = [piece.text for piece in pieces if piece.clause == pieces[place].clause]
    asks = clause[-1] == "吗" or not word_lists("zh")["rhetorical"].isdisjoint(clause)
    before, after = _neighbour(pieces, place, -1), _neighbour(pieces, place, 1)
    either_or = before is not None and after is not None and after.text.startswith(before.text)
    compares = after is not None and after.text == "比"
    return Role.PLAIN if asks or either_or or compares else Role.NEGATION


def _neighbour(pieces: Sequence[_Piece], place: int, step: int) -> _Piece | None:
    other = place + step
    if 0 <= other < len(pieces) and pieces[other].clause == pieces[place].clause:
        return pieces[other]
    return None


def _is_degree(pieces: Sequence[_Piece], place: int) -> bool:
    """Tell a word of degree from its other senses (十分 is also ten minutes) by what follows."""
    if pieces[place].text not in word_lists("zh")["degree_only_before_graded"]:
        return True
    after = _neighbour(pieces, place, 1)
    if after is not None and after.tag.startswith(_PARTICLE_TAGS):
        after = _neighbour(pieces, place, 2)
    return after is not None and (after.text in polarities("zh") or after.tag.startswith(_QUALITY_TAGS))


def _appraisal(pieces: Sequence[_Piece], place: int) -> tuple[int, float]:
    """Return P and A of a word by itself."""
    piece, known = pieces[place], polarities("zh")
    text = piece.text
    if text.startswith("最") and len(text) > 1:
        after = _neighbour(pieces, place, 1)
        superlative = text not in word_lists("zh")["not_superlative"] or (after is not None and after.text == "的")
        return (known.get(text[1:], 0), HIGH) if superlative else (0, 0.0)
    if text in word_lists("zh")["neutral_words"]:
        return 0, 0.0
    if text in known:
        completes_verb = text == "好" and (before := _neighbour(pieces, place, -1)) and before.tag.startswith("v")
        return (0, 0.0) if completes_verb else (known[text], HIGH if text in high_words("zh") else 0.0)
    if len(text) == 4 and text[::2] == text[1::2]:
        return known.get(text[::2], 0), 0.0
    return 0, 0.0


def _is_key_fact(pieces: Sequence[_Piece], place: int, *, appraises: bool) -> bool:
    """Tell whether a word carries content: names, nouns, numbers, times, and verbs that say what happens."""
    piece, lists = pieces[place], word_lists("zh")
    if appraises:
        return piece.text not in lists["attitude_verbs"] and (
            piece.tag in _NOUN_TAGS or _is_object_of_description(pieces, place) or _has_object(pieces, place)
        )
    if any(character.isascii() and character.isalnum() for character in piece.text):
        return True
    if piece.text in lists["light_verbs"]:
        return _follows_modal(pieces, place)
    if piece.tag.startswith("m"):
        return _counts(piece.text) and piece.text not in lists["generic_nouns"]
    return not _says_little(piece) and (piece.tag.startswith(_FACT_TAGS) or (piece.tag == "" and len(piece.text) > 1))


def _says_little(piece: _Piece) -> bool:
    """Tell nouns without content of their own: generic ones, and where something is by what is known (山下)."""
    lists = word_lists("zh")
    localised = len(piece.text) == 2 and piece.text[1] in lists["localisers"] and piece.tag.startswith(("s", "f"))
    return localised or piece.text in lists["neutral_words"] or piece.text in lists["generic_nouns"]


def _follows_modal(pieces: Sequence[_Piece], place: int) -> bool:
    """Tell whether a verb says what one can do, but not at the start of a clause, where it may ask."""
    lists, before = word_lists("zh"), _neighbour(pieces, place, -1)
    able = before is not None and before.text in lists["modal"] and pieces[place].text not in lists["modal"]
    return able and _neighbour(pieces, place, -2) is not None


def _counts(text: str) -> bool:
    """Tell a number from a measure word and from 一 as "a" (一把), but not with a measure of time (一天)."""
    if _NUMERALS.isdisjoint(text):
        return False
    return text[0] != "一" or len(text) != 2 or text[1] in _TIMES or text[1] in _NUMERALS


def _is_object_of_description(pieces: Sequence[_Piece], place: int) -> bool:
    """Tell whether a verb that appraises is used as a noun: the last of a phrase with 的, as 帮助 in 您的热情帮助."""
    following = _neighbour(pieces, place, 1)
    before = [_neighbour(pieces, place, step) for step in (-1, -2)]
    return (
        pieces[place].tag.startswith("v")
        and (following is None or following.tag.startswith(_PARTICLE_TAGS))
        and any(piece is not None and piece.text == "的" for piece in before)
    )


def _has_object(pieces: Sequence[_Piece], place: int) -> bool:
    """Tell whether a word that appraises is a verb with an object, as 冲毁 in 冲毁了三座桥."""
    following = _neighbour(pieces, place, 1)
    if following is not None and following.text == "了":
        following = _neighbour(pieces, place, 2)
    return pieces[place].tag.startswith("v") and following is not None and following.tag.startswith(("n", "m", "r"))
