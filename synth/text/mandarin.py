"""Chinese text into tokens with syllables and tones, and prosodic words as in MTAP 2013, Table 2.

Function words lean on content words: the copula, prepositions, conjunctions, auxiliaries, adverbs of one syllable and
those of degree, numerals, and pronouns and verbs of one syllable on what follows; particles (的 了 著 嗎), measure
words after digits and words of place after nouns (山上) on what precedes. Then neighbouring content words of up to two
syllables join (太平山頂). A prosodic word has two to five syllables where that can be, not counting particles; it never
goes across punctuation, and a word of place or time (山下, 今天) begins a new one. Words of degree have the stress on
their first syllable.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from synth.text import english
from synth.text.function_words import function_words
from synth.text.lexicon import word_lists
from synth.text.numbers import mandarin_number
from synth.text.scanning import Piece, normal, pieces
from synth.text.segmentation import DictionaryWord, readable, segment, simplified, tones
from synth.text.sentence import TextSyllable
from synth.text.token import Role, Token, glued, pauses

_LISTS = function_words("zh")
DEGREE = (word_lists("zh")["degree"] | word_lists("zh")["comparative"]) - _LISTS["unstressed"]
"""Words of degree and comparison, simplified, whose first syllable is stressed (MTAP 2013, section 3.2)."""

_PARTICLES = _LISTS["particles"]
_FORWARD = _LISTS["forward"]
_LOCALIZERS = frozenset("上下里中内外前后边间旁")
_LONGEST = 5
_JOINED = 4
_SYMBOLS = {"&": "和", "+": "加", "=": "等于", "-": "至", "–": "至", "~": "至"}


@dataclass(frozen=True, slots=True)
class _Group:
    """Tokens that make a prosodic word, or a part of one.

    Attributes
    ----------
    tokens : tuple of Token
        In order.
    leaning : int
        Syllables of the function words at the beginning.
    core : int
        Syllables of the rest, without particles.
    closed : bool
        Whether it ends with a particle.
    """

    tokens: tuple[Token, ...]
    leaning: int = 0
    core: int = 0
    closed: bool = False

    @property
    def size(self) -> int:
        return self.leaning + self.core

    def with_particle(self, token: Token) -> "_Group":
        return replace(self, tokens=(*self.tokens, token), closed=True)

    def joined(self, other: "_Group") -> "_Group":
        core = self.core + other.size if self.core else other.core
        leaning = self.leaning if self.core else self.leaning + other.leaning
        return _Group((*self.tokens, *other.tokens), leaning, core, other.closed)


def tokens(text: str) -> list[Token]:
    """Return the tokens of a text; Latin words have no syllables yet (`synth.text.english.pronounced` gives them)."""
    found: list[Token] = []
    before: Piece | None = None
    for piece in pieces(text):
        new = _piece_tokens(piece, before, found[-1] if found else None, text)
        if found and new and before is not None:
            gap = text[found[-1].end : new[0].start]
            if piece.kind != "han" and found[-1].spoken and new[0].spoken and glued(gap, before, piece):
                found[-1:] = [replace(english.join(found[-1], new.pop(0)), tag="n")]
            else:
                blank = gap != "" and before.kind == piece.kind == "han"
                new[0] = replace(new[0], after_break=blank or "\n" in gap or pauses(gap))
        found += new
        before = piece
    return found


def grouped(found: Sequence[Token]) -> list[list[Token]]:
    """Return the tokens as prosodic words, in order; every token needs its syllables."""
    segments: list[list[Token]] = []
    for token in found:
        if token.after_break or not segments:
            segments.append([])
        segments[-1].append(token)
    return [list(group.tokens) for run in segments for group in _merged(_leaning(run))]


def _piece_tokens(piece: Piece, before: Piece | None, last: Token | None, text: str) -> list[Token]:
    """Return the tokens of a piece, given the piece before it and the last token so far."""
    touching = before is not None and before.end == piece.start
    if piece.kind == "han":
        return _han(piece, last if before is not None and touching and before.kind == "number" else None)
    after_latin = before is not None and touching and before.kind == "latin"
    if piece.kind == "number":
        following = simplified(normal(text[piece.end : piece.end + 1]))
        number = _numeral(piece, mandarin_number(piece.text, following), "m")
        # The number of a name (MP4) leans on it.
        return [replace(number, role=Role.BACKWARD) if after_latin and number.role is Role.FORWARD else number]
    if piece.kind == "symbol" and piece.text in _SYMBOLS and not after_latin:
        return [_numeral(piece, _SYMBOLS[piece.text], "c")]
    return [replace(english.latin_token(piece, before, text), role=Role.HOST, tag="n")]


def _numeral(piece: Piece, read: str, tag: str) -> Token:
    """Return the token of a number or symbol that is read as these simplified characters."""
    role = Role.FORWARD if len(read) <= 2 else Role.HOST
    syllables = tuple(map(TextSyllable, read, tones([read])[0]))
    return Token(piece.start, piece.end, role, syllables, form=read, tag=tag)


def _han(piece: Piece, number: Token | None) -> list[Token]:
    """Return the tokens of Chinese characters; those whose reading is unknown are passed over, and part the others.

    ``number`` is the number in digits that is written right before them, if there is one.
    """
    found: list[Token] = []
    plain = simplified(piece.text)
    start = 0
    while start < len(plain):
        end = start
        while end < len(plain) and readable(plain[end]):
            end += 1
        words = segment(plain[start:end]) if end > start else []
        place = start
        for word, pitch in zip(words, tones([word.text for word in words]), strict=True):
            stop = place + len(word.text)
            peak = _degree_at(word.text)
            syllables = tuple(
                TextSyllable(character, tone, stress=position == peak)
                for position, (character, tone) in enumerate(zip(piece.text[place:stop], pitch, strict=True))
            )
            role = _role(word, found[-1] if place > start else None)
            if number is not None and place == 0 and len(word.text) == 1 and word.text not in _FORWARD:
                # A measure word goes the way of its number.
                role = Role.FORWARD if number.role is Role.FORWARD else Role.BACKWARD
            parted = place == start and start > 0
            found.append(
                Token(
                    piece.start + place,
                    piece.start + stop,
                    role,
                    syllables,
                    form=word.text,
                    tag=word.tag,
                    after_break=parted,
                )
            )
            place = stop
        start = end + 1
    return found


def _degree_at(word: str) -> int | None:
    """Return which syllable of a word tells a high degree, if one does: the first of 最 and 最好, 极 of 好极了."""
    if word.endswith("极了"):
        return len(word) - 2
    return 0 if word in DEGREE or (word.startswith("最") and word not in _LISTS["unstressed"]) else None


def _role(word: DictionaryWord, before: Token | None) -> Role:
    single = len(word.text) == 1
    if word.text in _PARTICLES:
        return Role.BACKWARD
    if word.text in _LOCALIZERS:
        return Role.BACKWARD if before is not None and before.tag.startswith("n") else Role.FORWARD
    if word.text in _FORWARD or word.text in DEGREE:
        return Role.FORWARD
    if word.tag in ("p", "c", "m", "q") and len(word.text) <= 2:
        return Role.FORWARD
    return Role.FORWARD if single and word.tag in ("d", "r", "v") else Role.HOST


def _leaning(run: list[Token]) -> list[_Group]:
    """Return content words with the function words that lean on them."""
    groups: list[_Group] = []
    waiting: list[Token] = []
    for token in run:
        if token.role is Role.FORWARD:
            waiting.append(token)
        elif token.role is Role.HOST:
            groups, waiting = _parted(groups, waiting, len(token.syllables))
            groups.append(_Group((*waiting, token), _count(waiting), len(token.syllables)))
            waiting = []
        elif waiting:
            groups.append(_Group(tuple(waiting), 0, _count(waiting)).with_particle(token))
            waiting = []
        elif groups:
            groups[-1] = groups[-1].with_particle(token)
        else:
            waiting.append(token)
    if waiting:
        groups.append(_Group(tuple(waiting), 0, _count(waiting)))
    return groups


def _parted(groups: list[_Group], waiting: list[Token], host: int) -> tuple[list[_Group], list[Token]]:
    """Take function words away from the front until the rest and the content word have five syllables at most.

    A single syllable so taken joins the prosodic word before, or stays if there is none.
    """
    place = 0
    while place < len(waiting) and _count(waiting[place:]) + host > _LONGEST:
        place += 1
    first, rest = waiting[:place], waiting[place:]
    if _count(first) != 1:
        return ([*groups, _Group(tuple(first), 0, _count(first))] if first else groups), rest
    if groups and groups[-1].size < _LONGEST and not groups[-1].closed:
        last = replace(groups[-1], tokens=(*groups[-1].tokens, *first), core=groups[-1].core + 1)
        return [*groups[:-1], last], rest
    return groups, waiting


def _merged(groups: list[_Group]) -> list[_Group]:
    """Join neighbours that make a prosodic word of up to four syllables, then single syllables with a neighbour."""
    merged: list[_Group] = []
    for group, later in zip(groups, [*groups[1:], None], strict=True):
        if merged and _belong(merged[-1], group) and not _needed(merged[-1], group, later):
            merged[-1] = merged[-1].joined(group)
        else:
            merged.append(group)
    place = 0
    while place < len(merged):
        alone = merged[place].size == 1 and not merged[place].closed
        after = alone and place + 1 < len(merged) and merged[place + 1].size < _LONGEST
        before = alone and place > 0 and merged[place - 1].size < _LONGEST
        if after:
            merged[place : place + 2] = [merged[place].joined(merged[place + 1])]
        elif before:
            merged[place - 1 : place + 1] = [merged[place - 1].joined(merged[place])]
        else:
            place += 1
    return merged


def _belong(left: _Group, right: _Group) -> bool:
    short = left.size == 1 or (right.core == 1 and left.core <= 2)
    opens = right.tokens[0].tag in ("s", "t") and left.size > 1
    return (
        right.leaning == 0
        and not opens
        and (not left.closed or short)
        and left.core + right.core <= _JOINED
        and left.size + right.size <= _LONGEST
    )


def _needed(left: _Group, group: _Group, later: _Group | None) -> bool:
    """Tell whether a single syllable after a group would stay alone if the group joined what is before it."""
    return (
        later is not None
        and later.size == 1
        and not later.closed
        and 2 <= group.size < _LONGEST
        and left.size > 1
        and left.size + group.size + 1 > _LONGEST
    )


def _count(found: Sequence[Token]) -> int:
    return sum(len(token.syllables) for token in found)
