"""The voice of eSpeak NG, in English and Mandarin, from a process of its own (see `synth.speech.espeak_process`).

eSpeak NG is licensed under the GPL-3. padlab neither links nor loads it: it starts a small program that does, writes
the text to it, and reads times and sound from it.
"""

import importlib.util
import json
import re
import subprocess
import sys
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import opencc
from pypinyin import Style, lazy_pinyin

from synth.errors import SpecError, SpeechError
from synth.speech import espeak_process
from synth.speech.alignment import align
from synth.speech.saying import check_sentence, silent_speech, spoken_text
from synth.speech.segments import ESPEAK_LANGUAGES, Segment, Sound, read_events, read_phonemes, syllable_sizes
from synth.speech.spoken import Speech
from synth.text.english import tokens
from synth.text.sentence import LANGUAGES, Sentence, TextWord

RATE_WPM = 175
PITCH = 50

_SAMPLE_RATE = 22050
_LIBRARY = re.compile(r"(lib)?espeak-ng\.(so|dylib|dll)")
_INSIDE_WORDS = "'’-."
_CHINESE = re.compile("[\u3400-\u9fff]")
_IONG = re.compile(r"[jqx]iong[1-5]")
_TIMEOUT_S = 120.0
_KEPT_TRANSCRIPTIONS = 50_000


@dataclass(frozen=True, slots=True)
class _Utterance:
    """What eSpeak NG made of a text."""

    version: str
    rate: int
    segments: tuple[Segment, ...]
    alone: tuple[tuple[Sound, ...], ...]
    sound: bytes


class EspeakVoice:
    """Speaks with eSpeak NG.

    Parameters
    ----------
    lang : {"en", "zh"}
        Language of the sentences; passages in the other writing are read as eSpeak NG reads them.
    rate_wpm : int
        Words per minute, 80 to 450.
    pitch : int
        0 to 99.
    variant : str
        eSpeak NG's name of a variant of the voice, for instance "f2" or "m3"; "" for the plain voice.

    Attributes
    ----------
    name : str
        "espeak-ng" with all that the sound depends on.
    version : str
        Of eSpeak NG.

    Raises
    ------
    SpecError
        If an argument is out of its range.
    SpeechError
        If eSpeak NG is not installed.
    """

    def __init__(self, lang: str, *, rate_wpm: int = RATE_WPM, pitch: int = PITCH, variant: str = "") -> None:
        self._espeak_lang = _espeak_name(lang)
        if not 80 <= rate_wpm <= 450:
            raise SpecError(f"The speaking rate is {rate_wpm!r}; it goes from 80 to 450 words per minute.")
        if not 0 <= pitch <= 99:
            raise SpecError(f"The pitch is {pitch!r}; it goes from 0 to 99.")
        known = _variants()
        if variant and variant not in known:
            raise SpecError(f"There is no variant {variant!r} of the voice; there are: {', '.join(known)}.")
        self.lang, self.rate_wpm, self.pitch, self.variant = lang, int(rate_wpm), int(pitch), variant

    @property
    def name(self) -> str:
        """Name of the voice with all that the sound depends on."""
        return f"espeak-ng {self._voice} {self.rate_wpm} wpm pitch {self.pitch}"

    @property
    def version(self) -> str:
        """Version of eSpeak NG."""
        return _version()

    @property
    def _voice(self) -> str:
        return f"{self._espeak_lang}+{self.variant}" if self.variant else self._espeak_lang

    def speak(self, sentence: Sentence) -> Speech:
        """Speak a sentence; equal sentences give equal speech.

        What is said are its words, with the punctuation between them for the pauses. Signs outside of words, such as
        emoji, are not read. A sentence without words is a short silence.

        Raises
        ------
        SpecError
            If the sentence is in another language than the voice, or too long.
        SpeechError
            If eSpeak NG cannot be started, or has no sound for the sentence.
        """
        check_sentence(sentence, self.lang)
        if not sentence.words:
            return silent_speech(f"{self.name} ({self.version})", _SAMPLE_RATE)
        text, places, words = spoken_text(sentence, _english if self.lang == "en" else _chinese)
        said = _utterance(
            text, words, lang=self._espeak_lang, voice=self._voice, rate_wpm=self.rate_wpm, pitch=self.pitch
        )
        if all(segment.is_pause for segment in said.segments):
            raise SpeechError(f"eSpeak NG has no sound for {sentence.text[:40]!r}; write it in other words.")
        segments = [
            replace(segment, character=places[min(max(segment.character, 0), len(places) - 1)])
            for segment in said.segments
        ]
        aligned = align(segments, sentence, said.alone, self._espeak_lang, stress=self.lang == "en")
        samples = np.frombuffer(said.sound, dtype="<i2").astype(np.int16)
        samples.flags.writeable = False
        voice = f"{self.name} ({said.version})"
        return Speech(aligned.phones, aligned.words, aligned.syllables, samples, said.rate, voice)


def transcribe(words: Sequence[str], lang: str) -> list[list[tuple[str, bool]]]:
    """Return the syllables of words as eSpeak NG pronounces each alone.

    Parameters
    ----------
    words : sequence of str
        One call of many words is much quicker than many calls; words asked for before are remembered.
    lang : {"en", "zh"}
        How to read them.

    Returns
    -------
    list of list of (str, bool)
        For each word its syllables: the phones in IPA without stress marks, and whether the primary stress is on it.
        Empty for a word that eSpeak NG has no sound for.

    Raises
    ------
    SpecError
        If the language is unknown.
    SpeechError
        If eSpeak NG cannot be started.
    """
    name = _espeak_name(lang)
    result = []
    for sounds in _transcribe(["".join(_sayable(word, lang)) for word in words], name):
        syllables = []
        done = 0
        for size in syllable_sizes(sounds, name):
            part = sounds[done : done + size]
            syllables.append(("".join(sound.symbol for sound in part), any(sound.stressed for sound in part)))
            done += size
        result.append(syllables)
    return result


def forget_speech() -> None:
    """Forget what was said and transcribed, so that it is done anew: results stay the same, for measurements."""
    _utterance.cache_clear()
    _transcriptions.clear()


def _espeak_name(lang: str) -> str:
    if lang not in ESPEAK_LANGUAGES:
        raise SpecError(f"There is no voice for the language {lang!r}; there are: {', '.join(LANGUAGES)}.")
    return ESPEAK_LANGUAGES[lang]


def _english(text: str, _word: TextWord, _before: str) -> list[str]:
    """Return what to say for each character of a word: numbers and symbols as the analysis reads them."""
    pieces = _sayable(text, "en")
    for token in tokens(text):
        if not all(sign.isalpha() or sign in _INSIDE_WORDS for sign in text[token.start : token.end]):
            blanks = [""] * (token.end - token.start - 1)
            pieces[token.start : token.end] = [f" {' '.join(token.spoken)} ", *blanks]
    return pieces


def _chinese(text: str, word: TextWord, before: str) -> list[str]:
    """Return what to say for each character of a word: numbers as the analysis reads them."""
    syllables = [syllable.text for syllable in word.syllables]
    if text and not text.isalpha() and all(map(_CHINESE.fullmatch, syllables)):
        return ["".join(_sayable("".join(syllables), "zh", before)), *([""] * (len(text) - 1))]
    return _sayable(text, "zh", before)


def _sayable(text: str, lang: str, before: str = "") -> list[str]:
    """Return for each character of a text what to give to eSpeak NG for it, so that all of it can be read.

    eSpeak NG's Mandarin spells 花儿 and 熊 in English letters: it takes 儿 as an ending that it cannot say, and knows
    no syllables in -iong. A character that sounds the same, and a spelling that it does know, avoid both.
    """
    pieces: list[str] = []
    for sign in text:
        piece = " " if unicodedata.category(sign)[0] in "CZ" else sign
        if lang == "zh" and not sign.isascii():
            piece = _spelled(_simplified(piece))
            if piece == "儿" and before and not before.isascii():
                piece = "而"
        pieces.append(piece)
        before = piece
    return pieces


@lru_cache(maxsize=20_000)
def _simplified(character: str) -> str:
    """Return the simplified form of a character if it is one character too."""
    converted = str(_converter().convert(character))
    return converted if len(converted) == 1 else character


@lru_cache(maxsize=20_000)
def _spelled(character: str) -> str:
    """Return a character, or if its syllable ends in -iong a spelling that eSpeak NG reads as that syllable."""
    syllable = "".join(lazy_pinyin(character, style=Style.TONE3, neutral_tone_with_five=True))
    return syllable.replace("iong", "ong") if _IONG.fullmatch(syllable) else character


@lru_cache(maxsize=1)
def _converter() -> opencc.OpenCC:
    return opencc.OpenCC("t2s")


@lru_cache(maxsize=32)
def _utterance(text: str, words: tuple[str, ...], *, lang: str, voice: str, rate_wpm: int, pitch: int) -> _Utterance:
    """Let eSpeak NG say a text, and each word alone; what was said before is remembered."""
    answer, sound = _ask(voice=voice, text=text, words=words, rate=rate_wpm, pitch=pitch)
    segments = read_events(answer["events"], lang, rate=answer["rate"], samples=len(sound) // 2)
    alone = tuple(tuple(read_phonemes(phonemes, lang)) for phonemes in answer["phonemes"])
    return _Utterance(answer["version"], answer["rate"], tuple(segments), alone, sound)


@lru_cache(maxsize=1)
def _version() -> str:
    return str(_ask(voice=ESPEAK_LANGUAGES["en"])[0]["version"])


_transcriptions: dict[tuple[str, str], tuple[Sound, ...]] = {}


def _transcribe(words: Sequence[str], lang: str) -> list[tuple[Sound, ...]]:
    """Return the sounds of each word alone; only those never asked for before need a process."""
    known = {word: _transcriptions[lang, word] for word in words if (lang, word) in _transcriptions}
    missing = [word for word in dict.fromkeys(words) if word not in known]
    if missing:
        answer, _ = _ask(voice=lang, words=missing)
        for word, phonemes in zip(missing, answer["phonemes"], strict=True):
            known[word] = tuple(read_phonemes(phonemes, lang))
        if len(_transcriptions) + len(missing) > _KEPT_TRANSCRIPTIONS:
            _transcriptions.clear()
        _transcriptions.update({(lang, word): known[word] for word in missing})
    return [known[word] for word in words]


def _ask(
    *, voice: str, text: str = "", words: Sequence[str] = (), rate: int = RATE_WPM, pitch: int = PITCH
) -> tuple[dict[str, Any], bytes]:
    """Start the program, give it one request, and return its answer and the sound."""
    library, data = _installed()
    request = {
        **{"voice": voice, "text": text, "words": list(words), "rate": rate, "pitch": pitch},
        **{"library": str(library), "data": str(data)},
    }
    # Isolated and without site-packages: the program needs none of them, and starts in a third of the time.
    command = [sys.executable, "-I", "-S", espeak_process.__file__]
    try:
        done = subprocess.run(  # noqa: S603 - a fixed program, no shell
            command, input=json.dumps(request).encode(), capture_output=True, timeout=_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SpeechError(f"eSpeak NG did not answer ({error}); try again, or use recorded speech.") from error
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        reason = said[-1] if said else f"its program ended with status {done.returncode}"
        raise SpeechError(f"{reason}; reinstall espeakng-loader, or use recorded speech.")
    head, _, sound = done.stdout.partition(b"\n")
    return json.loads(head), sound


@lru_cache(maxsize=1)
def _installed() -> tuple[Path, Path]:
    """Return where the library and its data are, without loading anything."""
    found = importlib.util.find_spec("espeakng_loader")
    folder = Path(found.origin).parent if found is not None and found.origin else None
    library = next((path for path in sorted(folder.iterdir()) if _LIBRARY.match(path.name)), None) if folder else None
    if folder is None or library is None:
        raise SpeechError("eSpeak NG is not installed; install espeakng-loader, or use recorded speech.")
    return library, folder / "espeak-ng-data"


@lru_cache(maxsize=1)
def _variants() -> tuple[str, ...]:
    """Return the variants of a voice that eSpeak NG's data hold, in order."""
    folder = _installed()[1] / "voices" / "!v"
    return tuple(sorted(path.name for path in folder.iterdir())) if folder.is_dir() else ()
