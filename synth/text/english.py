"""English text into tokens, their syllables, and prosodic words: a content word with its clitics.

Articles, prepositions, conjunctions, auxiliaries, subject and possessive pronouns and words of degree lean on the
content word after them. Pronouns that can be objects (it, me, them) lean on the content word right before them, unless
an auxiliary follows; so do units and a.m. and p.m. A function word with nothing to lean on in its direction leans the
other way. More than four function words in a row are parted: the first ones make prosodic words of their own. Names of
several words of one syllable (Hong Kong, New York) are one prosodic word.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

from synth.text.function_words import function_words
from synth.text.numbers import english_number, english_ordinal
from synth.text.scanning import Piece, pieces
from synth.text.sentence import TextSyllable
from synth.text.syllabification import syllable_count, written_syllables
from synth.text.token import Role, Token, glued, pauses

Transcriber = Callable[[Sequence[str]], list[list[tuple[str, bool]]]]
"""What gives each word's syllables, as phonemes, and whether they carry the primary stress."""

_LISTS = function_words("en")
_AUXILIARIES = _LISTS["auxiliaries"]
_FORWARD = _AUXILIARIES | _LISTS["forward"]
_OBJECTS = _LISTS["objects"]
_MOST_CLITICS = 4

_TITLES = {
    "Mr": "mister", "Mrs": "missus", "Ms": "miz", "Dr": "doctor", "Prof": "professor", "St": "saint", "Mt": "mount",
    "Jr": "junior", "Sr": "senior",
}  # fmt: skip
_ABBREVIATIONS = {
    "etc": ("et", "cetera"), "vs": ("versus",), "e.g.": ("for", "example"), "i.e.": ("that", "is"),
    "approx": ("approximately",),
}  # fmt: skip
_UNITS = {
    "km": "kilometres", "m": "metres", "cm": "centimetres", "mm": "millimetres", "kg": "kilograms", "g": "grams",
    "min": "minutes", "h": "hours",
}  # fmt: skip
_HALVES_OF_DAY = frozenset(("am", "pm", "a.m.", "p.m."))
_SYMBOLS = {"&": "and", "+": "plus", "=": "equals", "@": "at"}
_ORDINAL = frozenset(("st", "nd", "rd", "th"))
_RANGE = "to"
_VOWEL = re.compile("[AEIOUY]")


def tokens(text: str) -> list[Token]:
    """Return the tokens of a text, with the words by which they are read; Chinese characters are passed over."""
    found: list[Token] = []
    before: Piece | None = None
    for piece in pieces(text):
        if piece.kind == "han":
            continue
        token = latin_token(piece, before, text)
        if before is None:
            found.append(token)
        elif glued(gap := text[before.end : piece.start], before, piece):
            found[-1] = join(found[-1], token)
        else:
            abbreviated = before.text in _TITLES or before.text in _ABBREVIATIONS
            found.append(replace(token, after_break=pauses(gap, abbreviated=abbreviated)))
        before = piece
    return found


def latin_token(piece: Piece, before: Piece | None, text: str) -> Token:
    """Return the token of a piece in Latin letters, a number or a symbol; ``before`` is the piece before it, if any."""
    form = piece.text.lower()
    near = before is not None and before.kind == "number" and text[before.end : piece.start] in ("", " ")
    if piece.kind == "number":
        spoken = english_number(piece.text)
    elif piece.kind == "symbol":
        spoken = (_SYMBOLS.get(piece.text, _RANGE),)
        form = spoken[0]
    elif before is not None and before.end == piece.start and form in _ORDINAL and before.text.isdigit():
        return Token(before.start, piece.end, Role.HOST, spoken=english_ordinal(int(before.text)), form=form)
    elif near and piece.text in _UNITS:
        return Token(piece.start, piece.end, Role.BACKWARD, spoken=(_UNITS[piece.text],), form=form)
    else:
        spoken = _read_word(piece.text)
    role = Role.FORWARD if form in _FORWARD or piece.text in _TITLES or piece.kind == "symbol" else Role.HOST
    if near and form in _HALVES_OF_DAY:
        role, spoken = Role.BACKWARD, tuple(form.replace(".", "").upper())
    return Token(piece.start, piece.end, role, spoken=spoken, form=form)


def join(first: Token, second: Token) -> Token:
    """Return one token for two that are written as one word; an ordinal number takes in the digits before it."""
    spoken = second.spoken if second.start == first.start else first.spoken + second.spoken
    return replace(first, end=second.end, role=Role.HOST, spoken=spoken, form=first.form + second.form)


def pronounced(found: Iterable[Token], transcribe: Transcriber) -> list[Token]:
    """Return the tokens with their syllables.

    Parameters
    ----------
    found : iterable of Token
        Tokens; those that have syllables already are left as they are.
    transcribe : callable
        Gives the syllables of words; called at most once.

    Returns
    -------
    list of Token
        Each with one stressed syllable: the last with primary stress, or without any, the first of its last word.
        A syllable's text is its letters where these can be parted, else its phonemes.
    """
    found = list(found)
    wanted = sorted({word for token in found if not token.syllables for word in token.spoken if not _is_letter(word)})
    known = dict(zip(wanted, transcribe(wanted), strict=True)) if wanted else {}
    return [token if token.syllables else replace(token, syllables=_syllables(token, known)) for token in found]


def grouped(found: Sequence[Token]) -> list[list[Token]]:
    """Return the tokens as prosodic words, in order."""
    groups: list[list[Token]] = []
    for segment in _segments(found):
        groups += _group_segment(segment)
    return groups


def stressed(group: Sequence[Token]) -> tuple[TextSyllable, ...]:
    """Return a prosodic word's syllables, of which only the last content word's keep the stress."""
    host = next((token for token in reversed(group) if token.role is Role.HOST), group[-1])
    return tuple(one if token is host else replace(one, stress=False) for token in group for one in token.syllables)


def _read_word(word: str) -> tuple[str, ...]:
    if word in _TITLES:
        return (_TITLES[word],)
    if word.lower() in _ABBREVIATIONS:
        return _ABBREVIATIONS[word.lower()]
    if word in ("a", "A"):
        return ("a",)
    letters = word.replace(".", "")
    if "." in word or len(letters) == 1 or (letters.isupper() and letters.isalpha() and not _VOWEL.search(letters)):
        return tuple(letter.upper() for letter in letters)
    return (word,)


def _is_letter(word: str) -> bool:
    return len(word) == 1 and word.isupper()


def _syllables(token: Token, known: dict[str, list[tuple[str, bool]]]) -> tuple[TextSyllable, ...]:
    found: list[tuple[str, bool]] = []
    for word in token.spoken:
        if _is_letter(word):
            spelled = ("dou", "ble", "u") if word == "W" else (word,)
            part = [(text, place == 0) for place, text in enumerate(spelled)]
        else:
            part = known[word] or [("", False)] * syllable_count(word)
            letters = written_syllables(word, len(part))
            part = [(text or phonemes or word, mark) for text, (phonemes, mark) in zip(letters, part, strict=True)]
        last = len(found)
        found += part
    peak = max((place for place, (_, mark) in enumerate(found) if mark), default=last)
    return tuple(TextSyllable(text, stress=place == peak) for place, (text, _) in enumerate(found))


def _segments(found: Sequence[Token]) -> list[list[Token]]:
    segments: list[list[Token]] = []
    for token in found:
        if token.after_break or not segments:
            segments.append([])
        segments[-1].append(token)
    return segments


def _group_segment(segment: list[Token]) -> list[list[Token]]:
    groups: list[list[Token]] = []
    waiting: list[Token] = []
    following = [later for _, later in pairwise([*segment, None])]
    for token, later in zip(segment, following, strict=True):
        if token.role is Role.HOST and groups and not waiting and _is_name(groups[-1][-1]) and _is_name(token):
            groups[-1].append(token)
        elif token.role is Role.HOST:
            groups += _chunks(waiting[:-_MOST_CLITICS])
            groups.append([*waiting[-_MOST_CLITICS:], token])
            waiting = []
        elif groups and not waiting and (token.role is Role.BACKWARD or _is_object(token, later)):
            groups[-1].append(token)
        else:
            waiting.append(token)
    if waiting and groups and len(waiting) <= _MOST_CLITICS:
        groups[-1] += waiting
    else:
        groups += _chunks(waiting)
    return groups


def _chunks(waiting: list[Token]) -> list[list[Token]]:
    """Return function words in as few and as equal prosodic words as may be."""
    count = -(-len(waiting) // _MOST_CLITICS)
    bounds = [len(waiting) * place // count for place in range(count + 1)] if count else []
    return [waiting[start:end] for start, end in pairwise(bounds)]


def _is_name(token: Token) -> bool:
    return (
        token.role is Role.HOST and len(token.syllables) == 1 and len(token.spoken) == 1 and token.spoken[0].istitle()
    )


def _is_object(token: Token, later: Token | None) -> bool:
    """Tell whether a pronoun after a content word is its object, and not what comes next's subject or possessor."""
    if token.form not in _OBJECTS:
        return False
    if token.form == "her" and later is not None and later.role is Role.HOST:
        return False
    return later is None or later.form not in _AUXILIARIES
