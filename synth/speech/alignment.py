"""Alignment: which phones of an utterance belong to which prosodic word and syllable of its sentence.

The voice tells for each phone the place in the text where the word that it reads begins, but its words are not ours: it
reads "of the" or 香港 in one go, and 1997 in three. Places and prosodic words that overlap form a block. Where a block
holds several words, or a word holds another number of syllables than was expected, the phones heard are matched with
those that the voice gives for each word alone, by the least cost of exchanging, adding and dropping (Needleman and
Wunsch 1970). Nothing here can fail: each word and each syllable has a time of its own, if need be a part of a phone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, chain
from typing import TypeVar

from synth.speech.segments import Segment, Sound, syllable_sizes
from synth.speech.spoken import Phone, Span
from synth.text.sentence import Sentence

_Item = TypeVar("_Item")

# Above this, matching takes too long to be worth it; phones are then shared out by number.
_LARGEST_TABLE = 400_000
_GAP, _SAME_LETTER, _VOWELS, _CONSONANTS, _UNLIKE = 1.0, 0.3, 0.6, 0.8, 2.0


@dataclass(frozen=True, slots=True)
class Alignment:
    """Phones, words and syllables, as `synth.speech.spoken.Speech` holds them."""

    phones: tuple[Phone, ...]
    words: tuple[Span, ...]
    syllables: tuple[tuple[Span, ...], ...]


@dataclass(slots=True)
class _Block:
    """Segments, without pauses, and the words that they can belong to."""

    segments: list[Segment]
    words: list[int] = field(default_factory=list)


def align(
    segments: Sequence[Segment], sentence: Sentence, expected: Sequence[Sequence[Sound]], lang: str, *, stress: bool
) -> Alignment:
    """Give the segments of an utterance to the words and syllables of its sentence.

    Parameters
    ----------
    segments : sequence of Segment
        In order, without gaps; at least one is no pause.
    sentence : Sentence
        What was said, at least one word.
    expected : sequence of sequences of Sound
        What the voice says for each word alone.
    lang : str
        eSpeak NG's language.
    stress : bool
        Whether stress is marked on the phones.
    """
    spoken: list[list[Segment]] = [[] for _ in sentence.words]
    for block in _blocks([one for one in segments if not one.is_pause], sentence):
        parts = _cut(block.segments, [expected[place] for place in block.words])
        for place, part in zip(block.words, parts, strict=True):
            spoken[place].extend(part)
    phones: list[Phone] = []
    words, syllables = [], []
    for number, (word, part) in enumerate(zip(sentence.words, spoken, strict=True)):
        divided = divide(part, len(word.syllables), expected[number], lang)
        flat = [segment for syllable in divided for segment in syllable]
        stressed = _stressed(flat, lang) if stress else [False] * len(flat)
        phones.extend(
            Phone(one.sound.symbol, one.start_s, one.end_s, number, mark)
            for one, mark in zip(flat, stressed, strict=True)
        )
        words.append(Span(flat[0].start_s, flat[-1].end_s))
        syllables.append(tuple(Span(one[0].start_s, one[-1].end_s) for one in divided))
    pauses = [Phone(one.sound.symbol, one.start_s, one.end_s, _around(one, words)) for one in segments if one.is_pause]
    ordered = tuple(sorted([*phones, *pauses], key=lambda phone: phone.start_s))
    return Alignment(ordered, tuple(words), tuple(syllables))


def _around(pause: Segment, words: Sequence[Span]) -> int | None:
    """Return the number of the word inside which a pause falls."""
    inside = (number for number, word in enumerate(words) if word.start_s < pause.start_s < word.end_s)
    return next(inside, None)


def _blocks(segments: Sequence[Segment], sentence: Sentence) -> list[_Block]:
    """Group segments and words: those whose places in the text overlap belong together."""
    regions: list[_Block] = []
    places: list[int] = []
    for segment in segments:
        place = max(segment.character, places[-1] if places else 0)
        if not places or place > places[-1]:
            places.append(place)
            regions.append(_Block([]))
        regions[-1].segments.append(segment)
    blocks: list[_Block] = []
    waiting = 0
    for region, place, end in zip(regions, places, [*places[1:], len(sentence.text) + places[-1]], strict=True):
        while waiting < len(sentence.words) and sentence.words[waiting].start < end:
            region.words.append(waiting)
            waiting += 1
        continues = bool(blocks and blocks[-1].words) and sentence.words[blocks[-1].words[-1]].end > place
        if blocks and (continues or not region.words or not blocks[-1].words):
            blocks[-1].segments.extend(region.segments)
            blocks[-1].words.extend(region.words)
        else:
            blocks.append(region)
    return blocks


def divide(part: list[Segment], count: int, expected: Sequence[Sound], lang: str) -> list[list[Segment]]:
    """Divide a word's segments into as many syllables as its text has.

    Parameters
    ----------
    part : list of Segment
        At least one, no pauses.
    count : int
        How many syllables there must be; if need be, segments are halved.
    expected : sequence of Sound
        How the word sounds alone, if that is known; matters if ``part`` has another number of syllables.
    lang : str
        eSpeak NG's language.
    """
    found = _sized(part, syllable_sizes([one.sound for one in part], lang))
    if len(found) == count:
        return found
    alone = _sized(expected, syllable_sizes(expected, lang))
    if len(alone) == count:
        return _cut(part, alone)
    if len(found) > count:
        return [list(chain.from_iterable(group)) for group in _shared_out(found, count)]
    return _shared_out(_enough(part, count), count)


def _stressed(part: Sequence[Segment], lang: str) -> list[bool]:
    """Tell for each segment of a word whether its syllable bears the primary stress."""
    marks: list[bool] = []
    for syllable in _sized(part, syllable_sizes([one.sound for one in part], lang)):
        marks.extend([any(one.sound.stressed for one in syllable)] * len(syllable))
    return marks


def _cut(segments: list[Segment], expected: Sequence[Sequence[Sound]]) -> list[list[Segment]]:
    """Cut segments into one part for each of the expected rows of sounds, no part empty."""
    count = len(expected)
    segments = _enough(segments, count)
    sounds = [sound for part in expected for sound in part]
    borders = list(accumulate(len(part) for part in expected))[:-1]
    if not borders:
        return [segments]
    if not sounds or len(sounds) * len(segments) > _LARGEST_TABLE:
        cuts = [round(len(segments) * (number + 1) / count) for number in range(count - 1)]
    else:
        matched = _match([segment.sound for segment in segments], sounds)
        cuts = [matched[border] for border in borders]
    for number in range(count - 1):
        low = cuts[number - 1] + 1 if number else 1
        cuts[number] = min(max(cuts[number], low), len(segments) - (count - 1 - number))
    return [segments[start:end] for start, end in zip([0, *cuts], [*cuts, len(segments)], strict=True)]


def _match(heard: Sequence[Sound], expected: Sequence[Sound]) -> list[int]:
    """Return for each number of expected sounds how many of the heard ones match them, by the cheapest path."""
    rows, columns = len(heard) + 1, len(expected) + 1
    cost = [[_GAP * column for column in range(columns)]]
    for row in range(1, rows):
        above, line = cost[-1], [_GAP * row]
        for column in range(1, columns):
            exchanged = above[column - 1] + _difference(heard[row - 1], expected[column - 1])
            line.append(min(exchanged, above[column] + _GAP, line[-1] + _GAP))
        cost.append(line)
    reached = [0] * columns
    row, column = rows - 1, columns - 1
    reached[column] = row
    while column > 0:
        if row > 0 and cost[row][column] == cost[row - 1][column] + _GAP:
            row -= 1
            continue
        exchanged = row > 0 and (
            cost[row][column] == cost[row - 1][column - 1] + _difference(heard[row - 1], expected[column - 1])
        )
        row, column = row - exchanged, column - 1
        reached[column] = row
    return reached


def _difference(one: Sound, other: Sound) -> float:
    """Return the cost of hearing one sound for another."""
    if one.symbol == other.symbol:
        return 0.0
    if one.symbol[0] == other.symbol[0]:
        return _SAME_LETTER
    if one.nucleus != other.nucleus:
        return _UNLIKE
    return _VOWELS if one.nucleus else _CONSONANTS


def _sized(items: Sequence[_Item], sizes: Sequence[int]) -> list[list[_Item]]:
    """Divide a row into parts of these sizes."""
    return [list(items[end - size : end]) for size, end in zip(sizes, accumulate(sizes), strict=True)]


def _shared_out(items: Sequence[_Item], count: int) -> list[list[_Item]]:
    """Divide a row into parts as equal as possible."""
    return [list(items[len(items) * part // count : len(items) * (part + 1) // count]) for part in range(count)]


def _enough(segments: Sequence[Segment], count: int) -> list[Segment]:
    """Return at least ``count`` segments, by halving the longest again and again."""
    result = list(segments)
    while len(result) < count:
        longest = max(range(len(result)), key=lambda place: result[place].end_s - result[place].start_s)
        whole = result[longest]
        middle = (whole.start_s + whole.end_s) / 2
        rest = replace(whole, sound=whole.sound._replace(initial=False), start_s=middle)
        result[longest : longest + 1] = [replace(whole, end_s=middle), rest]
    return result
