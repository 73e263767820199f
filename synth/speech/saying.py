"""What the voices have in common: which sentences they take, and what of a sentence is said."""

from collections.abc import Callable

import numpy as np

from synth.errors import SpecError
from synth.speech.spoken import SILENCE, Phone, Speech
from synth.text.sentence import Sentence, TextWord

EMPTY_S = 0.5
"""Seconds of silence that a sentence without words lasts."""

Reader = Callable[[str, TextWord, str], list[str]]
"""From a word as it is written, the word, and what is said right before it, to what is said for each character."""

_LONGEST = 20_000

# Between words only what makes a pause is of use; of several signs the strongest counts.
_PAUSES = ("。！？!?.…", "；：;:—–", "，、,")


def check_sentence(sentence: Sentence, lang: str) -> None:
    """Raise a `SpecError` if a sentence is in another language than the voice, or too long."""
    if sentence.lang != lang:
        raise SpecError(f"The voice speaks {lang!r}; the sentence is in {sentence.lang!r}.")
    if len(sentence.text) > _LONGEST:
        raise SpecError(f"The sentence has {len(sentence.text)} characters; give at most {_LONGEST}.")


def silent_speech(voice: str, rate: int) -> Speech:
    """Return the speech of a sentence without words, at ``rate`` samples in a second."""
    count = round(EMPTY_S * rate)
    pause = Phone(SILENCE, 0.0, count / rate)
    return Speech((pause,), (), (), np.zeros(count, np.int16), rate, voice)


def spoken_text(sentence: Sentence, read: Reader) -> tuple[str, list[int], tuple[str, ...]]:
    """Return the text to say, for each of its characters the place in the sentence's text, and its words.

    Between the words there are blanks and at most one sign of a pause.

    Parameters
    ----------
    sentence : Sentence
        At least one word.
    read : callable
        Tells what to say for a word.
    """
    pieces: list[str] = []
    words: list[str] = []
    for word in sentence.words:
        done = len(pieces)
        pieces.extend(_gap(sentence.text[done : word.start], first=done == 0))
        said = read(sentence.text[len(pieces) : word.end], word, "".join(pieces[-1:]))
        pieces.extend(said)
        words.append("".join(said))
    pieces.extend(_gap(sentence.text[len(pieces) :], first=False))
    places = [place for place, piece in enumerate(pieces) for _ in piece]
    return "".join(pieces), places, tuple(words)


def _gap(text: str, *, first: bool) -> str:
    """Return blanks for the text between words, with its strongest sign of a pause kept in its place."""
    blank = " " * len(text)
    if first:
        return blank
    for signs in _PAUSES:
        place = next((place for place, sign in enumerate(text) if sign in signs), None)
        if place is not None:
            return blank[:place] + text[place] + blank[place + 1 :]
    return blank
