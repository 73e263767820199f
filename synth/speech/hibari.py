"""The voice of hibari-tts, in English: a small neural network whose weights come with its package.

hibari-tts and its weights are licensed under the Apache License 2.0; they are distilled from Kokoro-82M, under the same
licence. It is the extra ``padlab[voice]``. It speaks in a process of its own (see `synth.speech.hibari_process`), for
ONNX Runtime, which computes the network, must not be in a process that draws faces.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError, SpeechError
from synth.speech import hibari_process
from synth.speech.alignment import align
from synth.speech.phonetic_text import CLAUSES, ENDS, Sign, TimedSound, read_signs
from synth.speech.saying import check_sentence, silent_speech, spoken_text
from synth.speech.segments import ESPEAK_LANGUAGES, SHORTEST_PAUSE_S, Segment, Sound, sound
from synth.speech.spoken import SILENCE, Speech
from synth.text.english import tokens
from synth.text.sentence import Sentence, TextWord

LANG = "en"
"""The language that it speaks."""

_PACKAGE = "hibari-tts"
_KNOWN_VERSION = "0.2.1"
_NEURAL_VOICE = "heart"
_REMEDY = "install it with `pip install 'padlab[voice]'`"
_TIMEOUT_S = 120.0

_RATE = 24_000
_HOP = 300
"""Samples of a hop: half a frame of the network, the unit of time in what follows."""

_HOPS_PER_FRAME = 2
_LEAD = 5
"""Hops by which a sign is heard before the network's durations say so.

Measured on 80 sentences: with it /p b/ are quietest at their centre, and vowels, nasals and hisses loudest within 20 ms
of theirs; without it all of them are heard 50 to 75 ms too early."""

_SHORTEST = 2
_EDGE = 4
"""Hops of silence that stay before and after what is heard."""

_QUIET = 0.01
"""What is below this part of the loudest hop (-40 dB) is not heard."""

_SHORTEST_PAUSE = round(SHORTEST_PAUSE_S * _RATE / _HOP)
_LONGEST_CLOSURE = 8
"""Hops of silence between phones, without punctuation, from which on it is a pause; less is the closure of a stop."""

_MOST_SIGNS = 400
"""The network has learnt from texts of up to about 500 signs."""

_BREAKS = {**dict.fromkeys(ENDS, 24), **dict.fromkeys(CLAUSES, 8)}
"""Hops of silence between what is spoken in one go and what follows."""

_SIGNS_OF_PAUSES = str.maketrans("。！？；：，、–’", ".!?;:,,—'")
_INSIDE_WORDS = "'-"

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Utterance:
    """What was made of a text."""

    segments: tuple[Segment, ...]
    alone: tuple[tuple[Sound, ...], ...]
    samples: NDArray[np.int16]


class HibariVoice:
    """Speaks English with hibari-tts, in the American voice "heart", the one that comes with the package.

    Parameters
    ----------
    lang : {"en"}
        Language of the sentences; words in other writings than Latin, Greek and Cyrillic have no sound.

    Attributes
    ----------
    name : str
        "hibari heart".
    version : str
        Of hibari-tts and of ONNX Runtime, which computes its network.

    Raises
    ------
    SpecError
        If the language is another.
    SpeechError
        If hibari-tts is not installed, or a version that is not known.
    """

    def __init__(self, lang: str = LANG) -> None:
        if lang != LANG:
            raise SpecError(f"The voice 'hibari' speaks {LANG!r}, not {lang!r}.")
        self.lang = lang
        self._version = _version()

    @property
    def name(self) -> str:
        """Name of the voice."""
        return f"hibari {_NEURAL_VOICE}"

    @property
    def version(self) -> str:
        """Version of the voice and of what computes it."""
        return self._version

    def speak(self, sentence: Sentence) -> Speech:
        """Speak a sentence; on one machine equal sentences give equal speech.

        What is said are its words, as the analysis reads them, with the punctuation between them for the pauses. A
        sentence without words is a short silence.

        Raises
        ------
        SpecError
            If the sentence is in another language than the voice, or too long.
        SpeechError
            If the voice cannot be started, or has no sound for the sentence.
        """
        check_sentence(sentence, self.lang)
        voice = f"{self.name} ({self.version})"
        if not sentence.words:
            return silent_speech(voice, _RATE)
        text, places, words = spoken_text(sentence, _read)
        said = _utterance(text.translate(_SIGNS_OF_PAUSES), words)
        if not said.segments:
            raise SpeechError(f"The voice 'hibari' has no sound for {sentence.text[:40]!r}; write it in other words.")
        segments = [replace(one, character=places[min(one.character, len(places) - 1)]) for one in said.segments]
        aligned = align(segments, sentence, said.alone, ESPEAK_LANGUAGES[LANG], stress=True)
        return Speech(aligned.phones, aligned.words, aligned.syllables, said.samples, _RATE, voice)


def forget_utterances() -> None:
    """Forget what was said, so that it is done anew: results stay the same, for measurements."""
    _utterance.cache_clear()


def _read(text: str, _word: TextWord, _before: str) -> list[str]:
    """Return what to say for each character of a word: all that is no plain word as the analysis reads it."""
    pieces = [sign if sign.isalpha() or sign in _INSIDE_WORDS else " " for sign in text.replace("’", "'")]
    for token in tokens(text):
        said = " ".join(token.spoken)
        if said.replace("’", "'").lower() != "".join(pieces[token.start : token.end]).lower():
            pieces[token.start : token.end] = [f" {said} ", *[""] * (token.end - token.start - 1)]
    return pieces


@lru_cache(maxsize=32)
def _utterance(text: str, words: tuple[str, ...]) -> _Utterance:
    """Let hibari-tts say a text, and tell the sounds of each word alone; what was said before is remembered."""
    answer, content = _ask(text, words)
    timed: list[TimedSound] = []
    pieces: list[NDArray[np.int16]] = []
    heard = done = 0
    spoken = np.frombuffer(content, dtype="<i2").astype(np.int16)
    for part in answer["parts"]:
        signs = [Sign(*one) for one in zip(part["signs"], part["places"], strict=True)]
        found, samples = _cut(signs, part["frames"], spoken[heard : heard + part["samples"]])
        heard += part["samples"]
        if not found:
            continue
        rest = _BREAKS.get(part["signs"].rstrip()[-1], 0)
        timed.extend(_moved(one, done) for one in found)
        pieces += [samples, np.zeros(rest * _HOP, np.int16)]
        done += len(samples) // _HOP + rest
    alone = tuple(tuple(_sounds(word)) for word in answer["words"])
    # No break follows the last one.
    whole = np.concatenate(pieces[:-1] or [np.zeros(0, np.int16)])
    whole.flags.writeable = False
    return _Utterance(tuple(_segments(timed, len(whole) // _HOP)), alone, whole)


def _ask(text: str, words: Sequence[str]) -> tuple[dict[str, Any], bytes]:
    """Start the program, give it one request, and return its answer and the sound."""
    request = {
        **{"voice": _NEURAL_VOICE, "text": text, "words": list(words)},
        **{"ends": ENDS, "clauses": CLAUSES, "most": _MOST_SIGNS},
    }
    # The modules beside the program are not for it to import.
    command = [sys.executable, "-P", hibari_process.__file__]
    try:
        done = subprocess.run(  # noqa: S603 - a fixed program, no shell
            command, input=json.dumps(request).encode(), capture_output=True, timeout=_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SpeechError(f"The voice 'hibari' did not answer ({error}); try again, or use another voice.") from error
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        reason = said[-1] if said else f"hibari-tts ended with status {done.returncode}"
        raise SpeechError(f"{reason}; re{_REMEDY}, or use another voice.")
    head, _, sound = done.stdout.partition(b"\n")
    return json.loads(head), sound


def _moved(one: TimedSound, hops: int) -> TimedSound:
    return replace(one, start=one.start + hops, end=one.end + hops)


def _segments(timed: Sequence[TimedSound], end: int) -> list[Segment]:
    """Return phones, and pauses wherever there are none, from 0 to the end."""
    pause = sound(SILENCE)
    pieces: list[tuple[Sound, int, int, int]] = []
    now = 0
    for one in timed:
        if one.start > now:
            pieces.append((pause, now, one.start, one.place))
        pieces.append((one.sound, one.start, one.end, one.place))
        now = one.end
    if end > now:
        pieces.append((pause, now, end, timed[-1].place))
    return [Segment(heard, start * _HOP / _RATE, stop * _HOP / _RATE, place) for heard, start, stop, place in pieces]


def _sounds(phonetic: str) -> list[Sound]:
    return [one.sound for one in read_signs([Sign(sign, 0) for sign in phonetic], [0] * (len(phonetic) + 1))]


def _cut(
    signs: Sequence[Sign], frames: Sequence[int], samples: NDArray[np.int16]
) -> tuple[list[TimedSound], NDArray[np.int16]]:
    """Return the phones of what was spoken in one go, and the sound with little silence before and after it.

    The first and the last of the network's durations are those of the silence around the signs.
    """
    hops = np.array(frames) * _HOPS_PER_FRAME
    borders = np.cumsum(hops)[:-1] - min(_LEAD, int(hops[0]))
    timed = read_signs(signs, borders.tolist())
    if not timed:
        return [], samples[:0]
    levels = np.sqrt(np.square(samples.reshape(-1, _HOP), dtype=np.float64).mean(axis=1))
    timed = _heard(timed, levels)
    start, end = max(timed[0].start - _EDGE, 0), min(timed[-1].end + _EDGE, len(levels))
    return [_moved(one, -start) for one in timed], samples[start * _HOP : end * _HOP]


def _heard(timed: Sequence[TimedSound], levels: Floats) -> list[TimedSound]:
    """Return the phones with pauses between them where nothing is heard.

    The network gives most of a pause to the phone before it, and a little time to each blank between words, which the
    phones on both sides share.
    """
    heard = np.flatnonzero(levels > _QUIET * levels.max())
    if not len(heard):
        return list(timed)
    result: list[TimedSound] = []
    start = min(timed[0].start, int(heard[0]))
    for one, following in pairwise(timed):
        end, again = _longest_rest(heard, one.start + _SHORTEST, following.start)
        if again - end < (_SHORTEST_PAUSE if following.after_mark else _LONGEST_CLOSURE):
            end = again = (one.end + following.start) // 2
        result.append(replace(one, start=start, end=end))
        start = again
    return [*result, replace(timed[-1], start=start, end=max(int(heard[-1]) + 1, timed[-1].start + _SHORTEST))]


def _longest_rest(heard: NDArray[np.intp], start: int, end: int) -> tuple[int, int]:
    """Return from when to when nothing is heard for longest between two times."""
    inside = heard[np.searchsorted(heard, start) : np.searchsorted(heard, end)]
    begins = np.array([start, *(inside + 1)])
    ends = np.array([*inside, end])
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest])


def _version() -> str:
    """Return the versions of the voice and of what computes it."""
    try:
        found, runtime = installed_version(_PACKAGE), installed_version("onnxruntime")
    except PackageNotFoundError:
        raise SpeechError(f"The voice 'hibari' is not installed; {_REMEDY}.") from None
    if found != _KNOWN_VERSION:
        raise SpeechError(f"The voice 'hibari' needs {_PACKAGE} {_KNOWN_VERSION}, but {found} is installed; {_REMEDY}.")
    return f"{found}, onnxruntime {runtime}"
