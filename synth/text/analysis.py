"""From a text to a sentence: prosodic words with syllables, tones, stress and appraisal, and the sentence's goal."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

from synth.errors import SpecError
from synth.files import shown
from synth.speech.espeak import transcribe
from synth.text import english, mandarin
from synth.text.appraisal import appraise
from synth.text.english import Transcriber
from synth.text.intent import goal_of
from synth.text.scanning import has_chinese
from synth.text.sentence import LANGUAGES, LONGEST_TEXT, Sentence, TextSyllable, TextWord
from synth.text.token import Token

_NAMES = {"en": "English", "zh": "Chinese"}
_LETTER = re.compile("[^\\W_]")

Annotation = tuple[str, float | None, float | None]
"""A word with its P and A; None leaves the value to the automatic appraisal."""

_Values = tuple[float | None, float | None]
_Part = tuple[int, int, _Values | None]
"""Start and end of a part of the text, and the values of the annotated word that it is, if it is one."""


def guess_language(text: str) -> str:
    """Return "zh" if a text has Chinese characters, else "en"."""
    return "zh" if has_chinese(text) else "en"


def analyse(
    text: str,
    lang: str | None = None,
    *,
    annotation: Sequence[Annotation] | None = None,
    transcriber: Transcriber | None = None,
) -> Sentence:
    """Analyse a text as one sentence.

    Parameters
    ----------
    text : str
        Up to `LONGEST_TEXT` characters, in traditional or simplified Chinese or in English. Blanks, line ends,
        punctuation, emoji and other characters that are not spoken may be anywhere in it.
    lang : {"en", "zh"}, optional
        Its language; guessed from its characters if not given. Chinese characters in English are not spoken, English
        words in Chinese are.
    annotation : sequence of (str, float or None, float or None), optional
        Words as they are in the text, in its order, each with its P and A. Each is a prosodic word, and its values
        stand instead of the automatic ones, except where they are None; what the words leave out of the text is
        analysed as usual.
    transcriber : callable, optional
        Gives the syllables and stress of English words; eSpeak NG if not given.

    Returns
    -------
    Sentence
        With at least one word; words are in order, do not overlap, and stand in the text at their offsets.

    Raises
    ------
    SpecError
        If the text is too long, has control characters, or has nothing that can be spoken; if the language is unknown;
        if an annotated word is not in the text after the one before it, or cannot be spoken.
    """
    _check(text)
    lang = guess_language(text) if lang is None else lang
    if lang not in LANGUAGES:
        raise SpecError(f"The language {shown(lang)} is unknown; it must be {' or '.join(LANGUAGES)}.")
    parts = _parts(text, annotation or ())
    tokens = [_tokens(text, lang, start, end) for start, end, _ in parts]
    spoken = _pronounced(tokens, transcriber or partial(transcribe, lang="en"))
    words: list[TextWord] = []
    values: list[_Values] = []
    for (start, end, value), found in zip(parts, spoken, strict=True):
        if value is not None and not found:
            raise SpecError(f"The annotated word {shown(text[start:end])} has nothing that can be spoken.")
        groups = [found] if value is not None else _grouped(found, lang)
        words += [_word(text, lang, group) for group in groups]
        values += [value or (None, None)] * len(groups)
    if not words:
        raise SpecError(f"The text {shown(text)} has nothing that can be spoken in {_NAMES[lang]}.")
    appraised = appraise(words, text, lang)
    final = (
        replace(word, P=word.P if P is None else P, A=word.A if A is None else A)
        for word, (P, A) in zip(appraised, values, strict=True)
    )
    goal, dominance = goal_of(text, lang)
    return Sentence(text, lang, tuple(final), goal, dominance)


def _check(text: str) -> None:
    if len(text) > LONGEST_TEXT:
        raise SpecError(f"The text has {len(text)} characters; it may have up to {LONGEST_TEXT}.")
    for place, character in enumerate(text, start=1):
        if unicodedata.category(character) in ("Cc", "Cs") and character not in "\t\n\r":
            name = f"U+{ord(character):04X}"
            raise SpecError(f"The text has the control character {name} at place {place}; it may have none.")


def _parts(text: str, annotation: Sequence[Annotation]) -> list[_Part]:
    """Return the annotated words and what is between them."""
    parts: list[_Part] = []
    place = 0
    for number, (word, pleasure, arousal) in enumerate(annotation, start=1):
        start = _find(text, word, place)
        if start is None:
            raise SpecError(f"Annotated word {number}, {shown(word)}, is not in the text after the word before it.")
        parts += [(place, start, None), (start, start + len(word), (pleasure, arousal))]
        place = start + len(word)
    return [*parts, (place, len(text), None)]


def _find(text: str, word: str, place: int) -> int | None:
    """Return where a word stands at or after a place, not as a part of a longer word in Latin letters or number."""
    start = text.find(word, place) if word else -1
    while start >= 0:
        left, right = text[start - 1 : start + 1] if start else "", text[start + len(word) - 1 : start + len(word) + 1]
        if not _inside(left) and not _inside(right):
            return start
        start = text.find(word, start + 1)
    return None


def _inside(pair: str) -> bool:
    return len(pair) == 2 and all(_LETTER.fullmatch(one) and not has_chinese(one) for one in pair)


def _tokens(text: str, lang: str, start: int, end: int) -> list[Token]:
    found = mandarin.tokens(text[start:end]) if lang == "zh" else english.tokens(text[start:end])
    return [replace(token, start=token.start + start, end=token.end + start) for token in found]


def _pronounced(parts: Iterable[list[Token]], transcriber: Transcriber) -> list[list[Token]]:
    """Return the tokens of all parts with their syllables, for which the transcriber is asked once."""
    parts = list(parts)
    spoken = iter(english.pronounced((token for part in parts for token in part), transcriber))
    return [[next(spoken) for _ in part] for part in parts]


def _grouped(found: list[Token], lang: str) -> list[list[Token]]:
    return mandarin.grouped(found) if lang == "zh" else english.grouped(found)


def _word(text: str, lang: str, group: list[Token]) -> TextWord:
    start, end = group[0].start, group[-1].end
    return TextWord(text[start:end], start, end, _stressed(group, lang))


def _stressed(group: list[Token], lang: str) -> tuple[TextSyllable, ...]:
    if lang == "en":
        return english.stressed(group)
    # English words in Chinese have no stress: there it marks words of degree.
    return tuple(replace(one, stress=False) if token.spoken else one for token in group for one in token.syllables)
