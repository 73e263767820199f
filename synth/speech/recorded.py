"""Recorded speech instead of synthesis: a WAV file, and a CSV file that tells when each phone is heard.

The CSV file's first line names its columns:

============  ======================================================================================
``start_s``   seconds from the beginning of the sound
``end_s``     seconds; more than ``start_s``, and not after the end of the sound
``symbol``    the phone in IPA; marks of stress and tone are taken off; ``_`` for a pause
``word``      number of the prosodic word, from 0, as ``padlab text`` lists them; empty outside of words
``syllable``  optional: number of the syllable in its word, from 0
``stress``    optional: 1 if the syllable has the primary stress, else 0 or empty
============  ======================================================================================

Lines are in order of time and do not overlap; what they leave out is a pause.
"""

import re
from itertools import pairwise
from pathlib import Path

from synth.csv_file import Row, read_csv
from synth.errors import SpecError
from synth.speech.alignment import divide
from synth.speech.segments import ESPEAK_LANGUAGES, Segment, sound
from synth.speech.sound import read_wav
from synth.speech.spoken import SILENCE, Phone, Span, Speech
from synth.text.sentence import Sentence, TextWord

REQUIRED = ("start_s", "end_s", "symbol", "word")
OPTIONAL = ("syllable", "stress")

# Times in text files are rounded; what is off by less than this is meant to touch.
_ROUNDING_S = 0.001
_MARKS = re.compile(r"[ˈˌˊˋˇ˙˥˦˧˨˩\d]")


def read_recording(wav: Path, alignment: Path, sentence: Sentence) -> Speech:
    """Return recorded speech with the times of its phones.

    Parameters
    ----------
    wav : Path
        The sound, as `synth.speech.sound.read_wav` reads it.
    alignment : Path
        CSV file with the columns above.
    sentence : Sentence
        What is said; each of its words must be in the file.

    Raises
    ------
    SpecError
        If the CSV file is malformed or does not fit the sentence or the sound; the message names the line.
    SpeechError
        If the sound is no WAV file that can be read.
    OSError
        If a file cannot be read.
    """
    samples, rate = read_wav(wav)
    duration = len(samples) / rate
    header, rows = read_csv(alignment, REQUIRED, expected=",".join(REQUIRED) + " [,syllable,stress]")
    header.permit((*REQUIRED, *OPTIONAL))
    phones: list[Phone] = []
    reached = 0
    counted: list[int | None] = []
    for row in rows:
        phone = _phone(row, sentence, phones[-1].end_s if phones else 0.0, duration)
        reached = _in_order(row, phone, reached)
        gap_s = phone.start_s - (phones[-1].end_s if phones else 0.0)
        if gap_s > 0:
            phones.append(Phone(SILENCE, phone.start_s - gap_s, phone.start_s))
            counted.append(None)
        phones.append(phone)
        counted.append(_syllable(row, sentence, phone))
    if phones[-1].end_s < duration:
        phones.append(Phone(SILENCE, phones[-1].end_s, duration))
        counted.append(None)
    words, syllables = [], []
    for number, word in enumerate(sentence.words):
        own = [(phone, count) for phone, count in zip(phones, counted, strict=True) if phone.word == number]
        own = [(phone, count) for phone, count in own if phone.symbol != SILENCE]
        if not own:
            wrong = f"no phone belongs to word {number} ({word.text!r})"
            raise SpecError(f"{alignment}: {wrong}; each of the {len(sentence.words)} words must be in the file.")
        words.append(Span(own[0][0].start_s, own[-1][0].end_s))
        syllables.append(_spans(own, word, sentence.lang, f"{alignment}: word {number} ({word.text!r})"))
    return Speech(tuple(phones), tuple(words), tuple(syllables), samples, rate, f"recording {wav.name}")


def _phone(row: Row, sentence: Sentence, earliest: float, duration: float) -> Phone:
    """Return the phone of a line, beginning where the one before it ends if that is meant."""
    start_s = row.number("start_s", 0.0, duration + _ROUNDING_S)
    end_s = row.number("end_s", 0.0, duration + _ROUNDING_S)
    end_s = min(end_s, duration)
    if start_s < earliest - _ROUNDING_S:
        raise row.fault(
            f"the phone begins at {start_s:g} s, before the one above it ends",
            f"it must begin at {earliest:g} s or later",
            column="start_s",
        )
    if abs(start_s - earliest) <= _ROUNDING_S:
        start_s = earliest
    if end_s <= start_s:
        raise row.fault(f"the phone ends at {end_s:g} s", f"it must end after {start_s:g} s", column="end_s")
    symbol = row.name("symbol")
    symbol = symbol if symbol == SILENCE else _MARKS.sub("", symbol)
    if not symbol[:1].isalpha() and symbol != SILENCE:
        right = f"it must be a phone in IPA, or {SILENCE} for a pause"
        raise row.fault(f"the value is {row.text('symbol')!r}", right, column="symbol")
    return Phone(symbol, start_s, end_s, _word(row, sentence), _flag(row))


def _word(row: Row, sentence: Sentence) -> int | None:
    if not row.text("word"):
        return None
    number = row.whole("word")
    if number >= len(sentence.words):
        last = len(sentence.words) - 1
        right = f"the sentence has the words 0 to {last}" if last >= 0 else "the sentence has no words; leave it empty"
        raise row.fault(f"the value is {number}", right, column="word")
    return number


def _in_order(row: Row, phone: Phone, reached: int) -> int:
    """Return the number of the last word so far."""
    if phone.word is None:
        return reached
    if phone.word < reached:
        raise row.fault(f"word {phone.word} comes after word {reached}", "words must be in order", column="word")
    return phone.word


def _flag(row: Row) -> bool:
    text = row.text("stress")
    if text not in ("", "0", "1"):
        raise row.fault(f"the value is {text!r}", "it must be 1, 0 or empty", column="stress")
    return text == "1"


def _syllable(row: Row, sentence: Sentence, phone: Phone) -> int | None:
    """Return the number of the syllable if the line gives it."""
    if phone.word is None or phone.symbol == SILENCE or not row.text("syllable"):
        return None
    number, count = row.whole("syllable"), len(sentence.words[phone.word].syllables)
    if number >= count:
        raise row.fault(f"the value is {number}", f"the word has the syllables 0 to {count - 1}", column="syllable")
    return number


def _spans(own: list[tuple[Phone, int | None]], word: TextWord, lang: str, place: str) -> tuple[Span, ...]:
    """Return the times of a word's syllables: as the file gives them, or from the vowels if it gives none."""
    numbers = [number for _, number in own if number is not None]
    if not numbers:
        segments = [Segment(sound(phone.symbol), phone.start_s, phone.end_s, 0) for phone, _ in own]
        divided = divide(segments, len(word.syllables), (), ESPEAK_LANGUAGES[lang])
        return tuple(Span(part[0].start_s, part[-1].end_s) for part in divided)
    ordered = all(first <= second for first, second in pairwise(numbers))
    if not ordered or len(numbers) < len(own) or set(numbers) != set(range(len(word.syllables))):
        right = f"each phone must have one, and 0 to {len(word.syllables) - 1} must come in order"
        raise SpecError(f"{place}: its syllables are numbered {numbers}; {right}.")
    parts = [[phone for phone, number in own if number == wanted] for wanted in range(len(word.syllables))]
    return tuple(Span(part[0].start_s, part[-1].end_s) for part in parts)
