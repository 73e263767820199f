"""Segments of speech: eSpeak NG's phoneme names as IPA phones on a time line, and their syllables."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from synth.speech.spoken import SILENCE

ESPEAK_LANGUAGES = {"en": "en-us", "zh": "cmn"}
"""eSpeak NG's names of our languages."""

SHORTEST_PAUSE_S = 0.06
"""A shorter silence is the closure of the phone that follows, or the end of the one before it: no pause."""

_VOWELS = frozenset("aeiouyɑæɐəɚɛɜɝɪɨɔɒʊʌøœɤɯʉ")
_GLIDES = frozenset("iuy")
_SYLLABIC = "\u0329"
_MARKS = "ːʰ\u0329\u0303"
_AFFRICATES = "tʃ dʒ tɕ tʂ ts"
_DIPHTHONGS = "aɪ aʊ eɪ oʊ əʊ ɔɪ ɪə iə eə ʊə ai ei ɑu au ou"
_PHONE = re.compile(
    "|".join(
        [
            *(f"{symbol}[{_MARKS}]*" for symbol in _AFFRICATES.split()),
            *_DIPHTHONGS.split(),
            rf"[^\W\d_][{_MARKS}]*",
        ]
    )
)

# eSpeak NG's Mandarin names have tone digits, and these in place of IPA.
_MANDARIN = "cmn"
_MANDARIN_TONE = re.compile(r"\d|ɜ(?!ː)")
_MANDARIN_NAMES = {
    **{"s.": "ʂ", "ts.": "tʂ", "ts.h": "tʂʰ", "tsh": "tsʰ", "tɕh": "tɕʰ", "ph": "pʰ", "th": "tʰ", "kh": "kʰ", "χ": "x"},
    **{"i.": "ɨ", "i̪": "ɨ", "o-": "ɤ", "onɡ": "oŋ", "ər": "ɚ", "r": "ɚ", "io": "iɔ", "yæ": "yɛ"},
}

_CLUSTERS = """
    pl bl kl ɡl fl sl pɹ bɹ tɹ dɹ kɹ ɡɹ fɹ θɹ ʃɹ tw dw kw ɡw sw θw hw sp st sk sm sn sf spl spɹ stɹ skɹ skw
    pj bj tj dj kj ɡj fj vj mj nj lj hj θj sj spj stj skj
"""
_ENGLISH_CLUSTERS = frozenset(_CLUSTERS.split())


class Sound(NamedTuple):
    """A phone without a time.

    Parameters
    ----------
    symbol : str
        IPA without stress and tone marks.
    nucleus : bool
        Whether a syllable has it as its centre.
    stressed : bool
        Whether it bears the primary stress.
    initial : bool
        Whether a word begins with it.
    """

    symbol: str
    nucleus: bool
    stressed: bool
    initial: bool


@dataclass(frozen=True, slots=True)
class Segment:
    """A phone or pause on the time line.

    Parameters
    ----------
    sound : Sound
        What is heard; the symbol is `SILENCE` in a pause.
    start_s, end_s : float
        Seconds from the beginning.
    character : int
        Where in the spoken text the word stands to which it belongs.
    """

    sound: Sound
    start_s: float
    end_s: float
    character: int

    @property
    def is_pause(self) -> bool:
        """Whether nothing is heard."""
        return self.sound.symbol == SILENCE


# Sample at which it begins, place in the text, and what is heard.
_Piece = tuple[int, int, list[Sound]]

_PAUSE = Sound(SILENCE, nucleus=False, stressed=False, initial=False)


class NameReader:
    """Turn phoneme names into sounds, one after the other; remembers the language that names in brackets switch to.

    Parameters
    ----------
    lang : str
        eSpeak NG's language in the beginning, for instance "cmn".
    """

    def __init__(self, lang: str) -> None:
        self._lang = lang

    def read(self, name: str, *, initial: bool = False) -> list[Sound]:
        """Return the sounds of a name, none for pauses and switches of language."""
        if name.startswith("("):
            self._lang = name.strip("()")
            return []
        stressed = "ˈ" in name
        name = name.replace("ˈ", "").replace("ˌ", "").replace("ᵻ", "ɪ")
        if self._lang == _MANDARIN:
            name = _MANDARIN_TONE.sub("", name)
            name = _MANDARIN_NAMES.get(name, name)
        symbols = _PHONE.findall(name)
        centre = next((place for place in range(len(symbols)) if _is_centre(symbols, place)), -1)
        return [
            Sound(symbol, place == centre, stressed and place == centre, initial and place == 0)
            for place, symbol in enumerate(symbols)
        ]


def _is_centre(symbols: Sequence[str], place: int) -> bool:
    """Tell whether a phone is a vowel that glides into no other, or a syllabic consonant."""
    glides = symbols[place] in _GLIDES and place + 1 < len(symbols) and symbols[place + 1][0] in _VOWELS
    return sound(symbols[place]).nucleus and not glides


def sound(symbol: str, *, stressed: bool = False) -> Sound:
    """Return the sound of a single phone in IPA, without marks of stress and tone."""
    nucleus = symbol[0] in _VOWELS or _SYLLABIC in symbol
    return Sound(symbol, nucleus, stressed and nucleus, initial=False)


def read_phonemes(text: str, lang: str) -> list[Sound]:
    """Return the sounds of a transcription by eSpeak NG: names separated by "_", words by blanks."""
    reader = NameReader(lang)
    sounds: list[Sound] = []
    for word in text.split():
        initial = True
        for name in word.split("_"):
            new = reader.read(name, initial=initial)
            sounds.extend(new)
            initial = initial and not new
    return sounds


def read_events(events: Iterable[Sequence[str | int]], lang: str, *, rate: int, samples: int) -> list[Segment]:
    """Return the segments of an utterance, without gaps from 0 to its end.

    Parameters
    ----------
    events : iterable of (kind, character, sample, name)
        As `synth.speech.espeak_process` gives them.
    lang : str
        eSpeak NG's language.
    rate : int
        Samples in a second.
    samples : int
        How many there are.
    """
    reader = NameReader(lang)
    pieces: list[_Piece] = []
    initial, now = True, 0
    for kind, character, sample, name in events:
        now = min(max(now, int(sample)), samples)
        sounds = reader.read(str(name), initial=initial) if kind == "phoneme" else []
        initial = (initial and not sounds) or kind == "word"
        pieces.append((now, int(character), sounds))
    ends = [piece[0] for piece in pieces[1:]] + [samples]
    raw: list[Segment] = []
    if pieces and pieces[0][0] > 0:
        raw.append(Segment(_PAUSE, 0.0, pieces[0][0] / rate, 0))
    for (start, character, sounds), end in zip(_sharing(pieces, ends), ends, strict=True):
        if end > start:
            raw.extend(_timed(sounds, start / rate, end / rate, character))
    return _without_short_pauses(raw)


def _sharing(pieces: Sequence[_Piece], ends: Sequence[int]) -> list[_Piece]:
    """Let sounds without a time of their own share that of the sounds before them, or else after them.

    eSpeak NG makes for instance the vowel and the last sound of "bill" in one, and gives all the time to the vowel.
    """
    result: list[_Piece] = []
    last: int | None = None
    waiting: list[Sound] = []
    for piece, end in zip(pieces, ends, strict=True):
        start, character, sounds = piece
        if end == start and sounds and last is not None and result[last][1] == character:
            result[last] = (*result[last][:2], [*result[last][2], *sounds])
            sounds = []
        elif end == start:
            waiting, sounds = [*waiting, *sounds], []
        elif sounds:
            sounds, waiting, last = [*waiting, *sounds], [], len(result)
        result.append((start, character, sounds))
    return result


def _timed(sounds: Sequence[Sound], start_s: float, end_s: float, character: int) -> Iterator[Segment]:
    """Share a time among the sounds of one name: the centre has twice the time of the others."""
    sounds = sounds or [_PAUSE]
    weights = [2 if sound.nucleus else 1 for sound in sounds]
    whole, done, now = sum(weights), 0, start_s
    for sound, weight in zip(sounds, weights, strict=True):
        done += weight
        following = end_s if done == whole else start_s + (end_s - start_s) * done / whole
        yield Segment(sound, now, following, character)
        now = following


def _without_short_pauses(segments: Sequence[Segment]) -> list[Segment]:
    """Join pauses that touch, and give the short ones to the phone after them, or before them at the end."""
    result: list[Segment] = []
    pause: Segment | None = None
    for segment in segments:
        if segment.is_pause:
            pause = segment if pause is None else replace(pause, end_s=segment.end_s)
            continue
        start_s = segment.start_s
        if pause is not None and pause.end_s - pause.start_s < SHORTEST_PAUSE_S:
            start_s = pause.start_s
        elif pause is not None:
            result.append(pause)
        result.append(replace(segment, start_s=start_s))
        pause = None
    if pause is not None:
        if result and pause.end_s - pause.start_s < SHORTEST_PAUSE_S:
            result[-1] = replace(result[-1], end_s=pause.end_s)
        else:
            result.append(pause)
    return result


def syllable_sizes(sounds: Sequence[Sound], lang: str) -> list[int]:
    """Return how many of the sounds make up each syllable.

    Each syllable takes as many consonants before its vowel as an English or Mandarin syllable can begin with; none
    reaches over the beginning of a word.

    Parameters
    ----------
    sounds : sequence of Sound
        Without pauses.
    lang : str
        eSpeak NG's language.

    Returns
    -------
    list of int
        They sum to the number of sounds; one syllable at least if there is a sound.
    """
    starts: list[int] = []
    previous = -1
    for place in (place for place, sound in enumerate(sounds) if sound.nucleus):
        starts.append(0 if previous < 0 else _onset(sounds, previous + 1, place, lang))
        previous = place
    if not starts:
        return [len(sounds)] if sounds else []
    return [end - start for start, end in zip(starts, [*starts[1:], len(sounds)], strict=True)]


def _onset(sounds: Sequence[Sound], first: int, nucleus: int, lang: str) -> int:
    """Return where the syllable with this nucleus begins, at ``first`` or later."""
    for place in range(nucleus, first - 1, -1):
        if sounds[place].initial:
            return place
    start = nucleus
    while start > first and sounds[start - 1].symbol in _GLIDES:
        start -= 1
    glides = start
    while start > first:
        cluster = "".join(sound.symbol for sound in sounds[start - 1 : glides])
        single = glides - start == 0 and cluster != "ŋ" and cluster[0] not in _VOWELS
        if not single and (lang == _MANDARIN or cluster not in _ENGLISH_CLUSTERS):
            break
        start -= 1
    return start
