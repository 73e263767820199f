"""Phonetic text as Kokoro and its kin read it: a sign for each phone, with marks of stress, blanks and punctuation."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from synth.speech.segments import Sound, sound

ENDS = ".!?…"
"""Marks that end a sentence."""

CLAUSES = ",;:—"
"""Marks that end a clause."""

_PRIMARY, _STRESS = "ˈ", "ˈˌ"
_LONG = "ː"
_MARKS = "ːʰʲ\u0303ᵝ"
_PUNCTUATION = ENDS + CLAUSES
_SOUNDLESS = frozenset(f' "()“”↓→↗↘{_PUNCTUATION}')

_IPA = {
    **{"A": "eɪ", "I": "aɪ", "O": "oʊ", "Q": "əʊ", "W": "aʊ", "Y": "ɔɪ", "T": "ɾ", "ᵊ": "ə", "ᵻ": "ɪ", "ɜ": "ɜː"},
    **{"ʤ": "dʒ", "ʧ": "tʃ", "ʣ": "dz", "ʥ": "dʑ", "ʦ": "ts", "ʨ": "tɕ", "ꭧ": "tʂ"},
}


class Sign(NamedTuple):
    """A sign of a phonetic text.

    Parameters
    ----------
    character : str
        One character; what is no mark and not among Kokoro's own letters is IPA.
    place : int
        Where in the text the word stands that it is of.
    """

    character: str
    place: int


@dataclass(frozen=True, slots=True)
class TimedSound:
    """A phone on the time line.

    Parameters
    ----------
    sound : Sound
        The phone.
    start, end : int
        From when to when it lasts, in a unit of the voice.
    place : int
        Where in the text the word stands that it is of.
    after_mark : bool
        Whether there is punctuation between it and the phone before it.
    """

    sound: Sound
    start: int
    end: int
    place: int
    after_mark: bool


def read_signs(signs: Iterable[Sign], borders: Sequence[int]) -> list[TimedSound]:
    """Return the phones of a phonetic text.

    A vowel begins with its mark of stress; marks of length and breath belong to the phone before them.

    Parameters
    ----------
    signs : iterable of Sign
        N signs.
    borders : sequence of int
        N + 1 times: where each sign begins, and where the last one ends.
    """
    result: list[TimedSound] = []
    stress, begun = "", None
    initial, after_mark = True, False
    for (character, place), start, end in zip(signs, borders[:-1], borders[1:], strict=True):
        if character in _SOUNDLESS:
            stress, begun, initial = "", None, True
            after_mark = after_mark or character in _PUNCTUATION
        elif character in _STRESS:
            stress, begun = character, start
        elif character in _MARKS:
            if not initial and begun is None:
                result[-1] = _prolonged(result[-1], character, end)
        else:
            made = sound(_symbol(character, stress), stressed=stress == _PRIMARY)._replace(initial=initial)
            result.append(TimedSound(made, start if begun is None else begun, end, place, after_mark))
            stress, begun = "" if made.nucleus else stress, None
            initial, after_mark = False, False
    return result


def _symbol(character: str, stress: str) -> str:
    """Return a sign in IPA; an "i" with stress is the vowel of "see", which the mouth is wider for than in "happy"."""
    return "iː" if character == "i" and stress else _IPA.get(character, character)


def _prolonged(one: TimedSound, mark: str, end: int) -> TimedSound:
    symbol = one.sound.symbol
    longer = symbol + _LONG if mark == _LONG and not symbol.endswith(_LONG) else symbol
    return replace(one, sound=one.sound._replace(symbol=longer), end=end)
