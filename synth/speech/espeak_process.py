"""Drive eSpeak NG in a process of its own: ``python -m synth.speech.espeak_process``, JSON in, JSON and sound out.

eSpeak NG is licensed under the GPL-3, padlab is not; they speak through pipes and share no memory. Only
`synth.speech.espeak` calls this program. It serves one request and ends, for what eSpeak NG says depends on what it
said before in the process.

The request is one JSON object on standard input:

=============  =====================================================================================
``voice``      eSpeak NG's name of the voice, with its variant: "en-us", "cmn+f2"
``library``    path of the shared library
``data``       path of the folder ``espeak-ng-data``
``rate``       words per minute, 80 to 450
``pitch``      0 to 99
``text``       what to say; "" to say nothing
``words``      texts whose phonemes are wanted
=============  =====================================================================================

The answer on standard output is a line of JSON, then the sound (16-bit little-endian samples, one channel):

=============  =====================================================================================
``version``    of eSpeak NG
``rate``       samples in a second
``events``     lists ``[kind, character, sample, name]``: kind "word", "phoneme" or "end"; the character is the place
               in the text from 0; the name is that of the phoneme in IPA, "" for pauses
``phonemes``   for each of ``words`` its phonemes in IPA, separated by "_", words by blanks
=============  =====================================================================================

A failure is one sentence on standard error, with exit status 1.
"""

import contextlib
import ctypes
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

# From eSpeak NG's interface (speak_lib.h, revision 12).
_SYNCHRONOUS, _PHONEME_EVENTS, _IPA_EVENTS, _NO_EXIT = 2, 0x0001, 0x0002, 0x8000
_RATE, _PITCH = 1, 3
_UTF8, _BY_CHARACTER = 1, 1
_IPA, _SEPARATOR = 0x02, ord("_") << 8
_KINDS = {1: "word", 7: "phoneme", 5: "end"}
_LAST, _PHONEME = 0, 7


class ProgramError(Exception):
    """eSpeak NG did not do what it was asked."""


class _Name(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Name),
    ]


_Callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event))


class _Engine:
    """The library, ready to speak with one voice.

    Raises
    ------
    ProgramError
        If it cannot be loaded, or its data or the voice are not found.
    """

    def __init__(self, request: dict[str, Any]) -> None:
        data = request["data"]
        try:
            self._library = ctypes.CDLL(request["library"])
            # A long path to the data is cut off without a word; the path from inside the folder above is short.
            os.chdir(os.path.dirname(data))  # noqa: PTH120 - pathlib would be half of this program's start
        except OSError as error:
            raise ProgramError(f"eSpeak NG could not be loaded ({error})") from None
        self._declare()
        options = _PHONEME_EVENTS | _IPA_EVENTS | _NO_EXIT
        self.rate = int(self._library.espeak_Initialize(_SYNCHRONOUS, 0, b".", options))
        if self.rate <= 0:
            raise ProgramError(f"eSpeak NG found no data in {data}")
        if self._library.espeak_SetVoiceByName(request["voice"].encode()) != 0:
            raise ProgramError(f"eSpeak NG has no voice {request['voice']!r} in {data}")
        self._library.espeak_SetParameter(_RATE, request["rate"], 0)
        self._library.espeak_SetParameter(_PITCH, request["pitch"], 0)

    def _declare(self) -> None:
        pointer, number = ctypes.c_void_p, ctypes.c_int
        self._library.espeak_Info.restype = ctypes.c_char_p
        self._library.espeak_Info.argtypes = [pointer]
        self._library.espeak_TextToPhonemes.restype = ctypes.c_char_p
        self._library.espeak_TextToPhonemes.argtypes = [ctypes.POINTER(ctypes.c_char_p), number, number]
        self._library.espeak_Synth.argtypes = [
            *(ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint, number),
            *(ctypes.c_uint, ctypes.c_uint, pointer, pointer),
        ]

    def version(self) -> str:
        return str(self._library.espeak_Info(None).decode("ascii", "replace"))

    def speak(self, text: str) -> tuple[list[tuple[str, int, int, str]], bytes]:
        """Return the events and the sound of a text."""
        events: list[tuple[str, int, int, str]] = []
        sound = bytearray()

        def take(samples: Any, count: int, event: Any) -> int:
            if samples and count > 0:
                sound.extend(ctypes.string_at(samples, 2 * count))
            position = 0
            while event[position].type != _LAST:
                one = event[position]
                if one.type in _KINDS:
                    # The interface ends names after 8 bytes, even inside a character.
                    name = one.id.string.decode("utf-8", "ignore") if one.type == _PHONEME else ""
                    events.append((_KINDS[one.type], one.text_position - 1, one.sample, name))
                position += 1
            return 0

        callback = _Callback(take)
        self._library.espeak_SetSynthCallback(callback)
        content = text.encode("utf-8")
        failed = self._library.espeak_Synth(content, len(content) + 1, 0, _BY_CHARACTER, 0, _UTF8, None, None)
        if failed or self._library.espeak_Synchronize():
            raise ProgramError("eSpeak NG stopped before the end of the text")
        return events, bytes(sound)

    def phonemes(self, text: str) -> str:
        """Return the phonemes of a text, clause by clause."""
        rest = ctypes.c_char_p(text.encode("utf-8"))
        clauses = []
        while rest.value:
            clause = self._library.espeak_TextToPhonemes(ctypes.byref(rest), _UTF8, _IPA | _SEPARATOR)
            clauses.append((clause or b"").decode("utf-8", "ignore"))
        return " ".join(clauses)


def answer(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """Return the answer to a request, and the sound.

    Raises
    ------
    ProgramError
        If eSpeak NG fails.
    """
    engine = _Engine(request)
    events: Sequence[tuple[str, int, int, str]] = ()
    sound = b""
    if request["text"]:
        events, sound = engine.speak(request["text"])
    phonemes = [engine.phonemes(word) for word in request["words"]]
    return {"version": engine.version(), "rate": engine.rate, "events": events, "phonemes": phonemes}, sound


def main() -> int:
    """Serve the request on standard input."""
    # The library itself complains on standard output; that must stay clean.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        try:
            head, sound = answer(json.loads(sys.stdin.buffer.read()))
        except ProgramError as error:
            sys.stderr.write(f"{error}\n")
            return 1
        with contextlib.suppress(BrokenPipeError):
            out.write(json.dumps(head, ensure_ascii=True, separators=(",", ":")).encode() + b"\n" + sound)
    return 0


if __name__ == "__main__":
    sys.exit(main())
