"""Drive hibari-tts in a process of its own: ``python -m synth.speech.hibari_process``, JSON in, JSON and sound out.

ONNX Runtime, which computes the voice's network, and Mesa, which draws the face, have crashed in one process; they
never meet in one. Only `synth.speech.hibari` calls this program. It serves one request and ends.

The request is one JSON object on standard input:

============  ======================================================================================
``voice``     hibari-tts's name of a voice that is in its package: "heart"
``text``      what to say; "" to say nothing
``words``     texts whose phonetic text is wanted
``ends``      signs of the phonetic text that end a sentence; each sentence is spoken in one go
``clauses``   signs that end a clause
``most``      how many signs are spoken in one go; longer sentences are parted
============  ======================================================================================

The answer on standard output is a line of JSON, then the sound (16-bit little-endian samples, one channel):

============  ======================================================================================
``rate``      samples in a second
``parts``     what was spoken in one go, in order, as objects; their sounds follow each other
``words``     for each of ``words`` its phonetic text
============  ======================================================================================

A part has its phonetic text (``signs``), for each sign where in the text the word stands that it is of (``places``),
how long the silence before them, each sign, and the silence after them last, in frames of 600 samples (``frames``), and
how many ``samples`` there are.

A failure is one sentence on standard error, with exit status 1.
"""

import contextlib
import importlib
import json
import os
import sys
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

_DURATIONS = "/Cast_32_output_0"
"""Name of the network's tensor that holds how long each sign lasts."""

_SEED = 0
_FULL_SCALE = 32767.0

Sign = tuple[str, int]
"""A sign of the phonetic text, and where in the text the word stands that it is of."""


class _Engine:
    """The program with its network, which also tells how long each sign lasts, on one thread."""

    def __init__(self, voice: str) -> None:
        path = importlib.import_module("hibari.voices").voice_path(voice, download_missing=False)
        network = Path(path).read_bytes() + told(_DURATIONS)
        self._engine = importlib.import_module("hibari").Hibari(voice, model=network, threads=1)
        self._sound = importlib.import_module("hibari.dsp").synth
        self.rate = int(self._engine.sample_rate)

    def signs(self, text: str) -> list[Sign]:
        """Return the phonetic text of a text, of the signs that the network knows."""
        signs: list[Sign] = []
        place = 0
        for token in self._engine.g2p.phonemize_tokens(self._engine.g2p.tokenize(text)):
            place = max(text.find(token.text, place), place)
            signs.extend((character, place) for character in token.phonemes or "" if character in self._engine.vocab)
            if token.whitespace:
                signs.append((" ", place))
        return signs

    def speak(self, signs: Sequence[Sign]) -> tuple[dict[str, Any], bytes]:
        """Speak a phonetic text in one go."""
        said = "".join(character for character, _ in signs)
        request = {"ids": np.array([self._engine.ids(said)]), "speed": np.ones(1, np.float32)}
        *spectra, frames = self._engine.sess.run(None, request)
        wave = self._sound(*(spectrum[0] for spectrum in spectra), np.random.default_rng(_SEED))
        samples = np.rint(np.clip(wave, -1.0, 1.0) * _FULL_SCALE).astype("<i2")
        part = {
            **{"signs": said, "places": [place for _, place in signs]},
            **{"frames": frames.astype(int).tolist(), "samples": len(samples)},
        }
        return part, samples.tobytes()


def answer(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """Return the answer to a request, and the sound."""
    engine = _engine(request["voice"])
    signs = engine.signs(request["text"])
    # Nothing is heard of what has no letter, and the network has not learnt it.
    parts = [
        engine.speak(part)
        for part in parted(signs, request["most"], ends=request["ends"], clauses=request["clauses"])
        if any(character.isalpha() for character, _ in part)
    ]
    words = ["".join(character for character, _ in engine.signs(word)) for word in request["words"]]
    return {"rate": engine.rate, "parts": [part for part, _ in parts], "words": words}, b"".join(
        sound for _, sound in parts
    )


def parted(signs: Sequence[Sign], most: int, *, ends: str, clauses: str) -> list[list[Sign]]:
    """Part a phonetic text into its sentences, and those of more than ``most`` signs into clauses, or else words.

    Parameters
    ----------
    signs : sequence of (str, int)
        The phonetic text.
    most : int
        At least 1.
    ends, clauses : str
        Signs that end a sentence (before a blank) and a clause.
    """
    sentences: list[list[Sign]] = [[]]
    for number, sign in enumerate(signs):
        sentences[-1].append(sign)
        if sign[0] in ends and (number + 1 == len(signs) or signs[number + 1][0] == " "):
            sentences.append([])
    parts: list[list[Sign]] = []
    for sentence in sentences:
        rest = sentence
        while len(rest) > most:
            cuts = (_up_to_last(rest[:most], marks) for marks in (clauses, " "))
            cut = next((cut for cut in cuts if cut), most)
            parts.append(rest[:cut])
            rest = rest[cut:]
        parts.append(rest)
    return [part for part in parts if part]


def told(tensor: str) -> bytes:
    """Return what makes a tensor inside of a network one of its outputs, when added at the end of an ONNX file.

    An ONNX file is one message of Protocol Buffers, where a field that comes again is merged with what was there:
    graph (7) of a model, output (12) of a graph, name (1) of an output (onnx.proto).
    """
    message = tensor.encode()
    for field in (1, 12, 7):
        message = bytes([field << 3 | 2, len(message)]) + message
    return message


def _up_to_last(signs: Sequence[Sign], marks: str) -> int:
    """Return how many signs there are up to the last one of these marks; 0 if there is none."""
    return max((place + 1 for place, sign in enumerate(signs) if sign[0] in marks), default=0)


@lru_cache(maxsize=1)
def _engine(voice: str) -> _Engine:
    return _Engine(voice)


def main() -> int:
    """Serve the request on standard input."""
    # Whatever the engine prints goes to standard error; standard output must stay clean.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        try:
            head, sound = answer(json.loads(sys.stdin.buffer.read()))
        except Exception as error:  # ONNX Runtime's errors have nothing narrower in common.
            sys.stderr.write(f"hibari-tts failed ({' '.join(str(error).split()) or type(error).__name__})\n")
            return 1
        with contextlib.suppress(BrokenPipeError):
            out.write(json.dumps(head, ensure_ascii=True, separators=(",", ":")).encode() + b"\n" + sound)
    return 0


if __name__ == "__main__":
    sys.exit(main())
