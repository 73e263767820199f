"""Prosodic words on the time line: what the head's motion is made from, in any language.

A text-to-speech front end gives the words; pauses between them are found here. Times are in seconds, frame k of a
sequence is at ``k / fps``, and a stretch of time holds the frames from its start up to, but without, its end.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from synth.errors import SpecError

TONES = (1, 2, 3, 4, 5)
"""The tones of Mandarin; 5 is the neutral tone."""

FALLING_TONE = 4

SILENCE_P = 0.0
SILENCE_A = -0.5
"""P and A of silence (MTAP 2013, section 3.2)."""

MIN_SILENCE_S = 0.2
"""Shortest pause that counts as silence: below it are the gaps that stops leave inside fluent speech."""

# Two times that differ by less are the same: sums of decimal fractions do not meet exactly.
_SAME_TIME_S = 1e-6


@dataclass(frozen=True, slots=True)
class Syllable:
    """A syllable of a prosodic word.

    Parameters
    ----------
    text : str
        As written.
    start_s, end_s : float
        Seconds from the beginning of the sequence.
    tone : int, optional
        1 to 5 (neutral) in Mandarin; None in languages without tones.
    stressed : bool
        Whether it is prominent: in Chinese the superlative adverb or adjective (最, 極, 很), in English the syllable
        with the word's primary stress.

    Raises
    ------
    SpecError
        If a value is malformed or the syllable does not last.
    """

    text: str
    start_s: float
    end_s: float
    tone: int | None = None
    stressed: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.text, str) or not self.text.strip():
            raise SpecError(f"Syllable: the text is {self.text!r}, but must hold at least one character.")
        where = f"Syllable {self.text!r}"
        _check_times(where, self.start_s, self.end_s)
        if self.tone is not None and (isinstance(self.tone, bool) or self.tone not in TONES):
            raise SpecError(f"{where}: the tone is {self.tone!r}, but must be 1 to 5 (neutral), or None.")
        if not isinstance(self.stressed, bool):
            raise SpecError(f"{where}: stressed is {self.stressed!r}, but must be True or False.")

    @property
    def falling(self) -> bool:
        """Whether the syllable has the falling tone."""
        return self.tone == FALLING_TONE


@dataclass(frozen=True, slots=True)
class ProsodicWord:
    """A prosodic word: the unit of head motion.

    Parameters
    ----------
    text : str
        As written.
    start_s, end_s : float
        Seconds from the beginning of the sequence.
    P, A : float
        Pleasure and arousal of the word (lexical appraisal), each in [-1, 1].
    syllables : sequence of Syllable
        In order, inside the word; without any the word counts as one plain syllable.

    Raises
    ------
    SpecError
        If a value is malformed, or syllables overlap or leave the word.
    """

    text: str
    start_s: float
    end_s: float
    P: float
    A: float
    syllables: tuple[Syllable, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.text, str) or not self.text.strip():
            raise SpecError(f"Prosodic word: the text is {self.text!r}, but must hold at least one character.")
        where = f"Prosodic word {self.text!r}"
        _check_times(where, self.start_s, self.end_s)
        for name in ("P", "A"):
            value = getattr(self, name)
            if not _is_number(value) or not -1.0 <= value <= 1.0:
                raise SpecError(f"{where}: {name} is {value!r}, but must be a number from -1 to 1.")
        object.__setattr__(self, "syllables", tuple(self.syllables))
        _check_order(where, self.syllables)
        for syllable in self.syllables:
            if syllable.start_s < self.start_s - _SAME_TIME_S or syllable.end_s > self.end_s + _SAME_TIME_S:
                raise SpecError(
                    f"{where}: the syllable {syllable.text!r} lasts from {syllable.start_s:g} to {syllable.end_s:g} s, "
                    f"but must lie inside the word, {self.start_s:g} to {self.end_s:g} s."
                )


@dataclass(frozen=True, slots=True)
class Unit:
    """A stretch of frames with one cycle of motion: a word (with the short gap after it) or silence.

    Attributes
    ----------
    start, stop : int
        First frame, and the frame after the last.
    P, A : float
        Pleasure and arousal; 0 and -0.5 for silence.
    word : ProsodicWord or None
        The word; None for silence.
    """

    start: int
    stop: int
    P: float
    A: float
    word: ProsodicWord | None

    @property
    def frames(self) -> int:
        """Number of frames, T in Eq. 1; at least 1."""
        return self.stop - self.start


def evenly(parts: Sequence[tuple[str, int | None, bool]], start_s: float, end_s: float) -> tuple[Syllable, ...]:
    """Return syllables (text, tone, stressed) that share a stretch of time evenly."""
    edges = [start_s + (end_s - start_s) * k / len(parts) for k in range(len(parts))] + [end_s]
    return tuple(
        Syllable(text, edges[k], edges[k + 1], tone, stressed) for k, (text, tone, stressed) in enumerate(parts)
    )


def check_words(words: Iterable[ProsodicWord]) -> tuple[ProsodicWord, ...]:
    """Return the words as a tuple.

    Raises
    ------
    SpecError
        If an item is no prosodic word, or words overlap or are out of order.
    """
    found = tuple(words)
    for word in found:
        if not isinstance(word, ProsodicWord):
            raise SpecError(f"Head motion: {word!r} is not a prosodic word; give ProsodicWord objects.")
    _check_order("Head motion", found)
    return found


def first_frame(time_s: float, fps: float) -> int:
    """Return the number of the first frame at or after a time."""
    return math.ceil(time_s * fps - _SAME_TIME_S * fps)


def units(
    words: Iterable[ProsodicWord], *, fps: float, frames: int, min_silence_s: float = MIN_SILENCE_S
) -> tuple[Unit, ...]:
    """Divide a sequence into words and silences, so that every frame belongs to exactly one.

    Parameters
    ----------
    words : iterable of ProsodicWord
        In order, without overlap.
    fps : float
        Frames per second.
    frames : int
        Frames of the sequence.
    min_silence_s : float
        Pauses at least this long are silence, before, between and after the words. A shorter gap belongs to the word
        before it, the one before the first word to that word: the paper does not say, and a whole nod within a gap of
        two frames would look like a twitch.

    Returns
    -------
    tuple of Unit
        In order. Words and pauses too short to hold a frame are left out.

    Raises
    ------
    SpecError
        If words are malformed or end after the sequence.
    """
    spoken = check_words(words)
    if spoken and first_frame(spoken[-1].end_s, fps) > frames:
        raise SpecError(
            f"Head motion: the word {spoken[-1].text!r} ends at {spoken[-1].end_s:g} s, "
            f"but the sequence is over after {frames / fps:g} s; make it longer."
        )
    found: list[Unit] = []
    reached = 0
    for k, word in enumerate(spoken):
        start = first_frame(word.start_s, fps)
        previous_end_s = spoken[k - 1].end_s if k else 0.0
        if word.start_s - previous_end_s >= min_silence_s - _SAME_TIME_S:
            found.append(_silence(reached, start))
            reached = start
        following_s = spoken[k + 1].start_s if k + 1 < len(spoken) else frames / fps
        is_gap = following_s - word.end_s < min_silence_s - _SAME_TIME_S
        stop = min(frames, first_frame(following_s if is_gap else word.end_s, fps))
        found.append(Unit(reached, stop, word.P, word.A, word))
        reached = stop
    found.append(_silence(reached, frames))
    return tuple(unit for unit in found if unit.frames > 0)


def _silence(start: int, stop: int) -> Unit:
    return Unit(start, stop, SILENCE_P, SILENCE_A, None)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _check_times(where: str, start_s: float, end_s: float) -> None:
    for name, value in (("start_s", start_s), ("end_s", end_s)):
        if not _is_number(value):
            raise SpecError(f"{where}: {name} is {value!r}, but must be a number of seconds.")
    if start_s < 0.0:
        raise SpecError(f"{where}: it starts at {start_s:g} s, but times count from 0.")
    if end_s - start_s < _SAME_TIME_S:
        raise SpecError(f"{where}: it starts at {start_s:g} s and ends at {end_s:g} s, but must end after its start.")


def _check_order(where: str, parts: tuple[Syllable, ...] | tuple[ProsodicWord, ...]) -> None:
    ordered: tuple[Syllable | ProsodicWord, ...] = parts
    for before, after in pairwise(ordered):
        if after.start_s < before.end_s - _SAME_TIME_S:
            raise SpecError(
                f"{where}: {after.text!r} starts at {after.start_s:g} s, before {before.text!r} ends at "
                f"{before.end_s:g} s; they must be in order and not overlap."
            )
