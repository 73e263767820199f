"""Speech as all that follows it needs it: phones and words on the time line, and the sound."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Samples = NDArray[np.int16]

SILENCE = "_"
"""Symbol of a phone that is a pause."""


@dataclass(frozen=True, slots=True)
class Phone:
    """A phone.

    Parameters
    ----------
    symbol : str
        IPA without stress and tone marks, for instance "p", "uː", "tʃ", "ɕ", "y"; `SILENCE` for a pause.
    start_s, end_s : float
        Seconds from the beginning of the speech.
    word : int, optional
        Number of the prosodic word of the sentence that it belongs to, from 0; None for pauses between words.
    stress : bool
        Whether it belongs to a syllable with primary stress (English).
    """

    symbol: str
    start_s: float
    end_s: float
    word: int | None = None
    stress: bool = False

    def __post_init__(self) -> None:
        if not self.symbol or not 0.0 <= self.start_s < self.end_s:
            raise SpecError(f"Phone {self.symbol!r}: it lasts from {self.start_s!r} to {self.end_s!r} s.")


@dataclass(frozen=True, slots=True)
class Span:
    """From when to when a word or syllable is spoken, in seconds."""

    start_s: float
    end_s: float


@dataclass(frozen=True, eq=False)
class Speech:
    """A spoken sentence.

    Attributes
    ----------
    phones : tuple of Phone
        In order, without gaps or overlap, from 0 to the end.
    words : tuple of Span
        When each prosodic word of the sentence is spoken, in its order.
    syllables : tuple of tuple of Span
        When the syllables of each word are spoken, as many as the sentence's word has.
    samples : (N,) int16
        The sound, one channel; empty if there is none (a recording without sound, a mute voice).
    rate : int
        Samples in a second.
    voice : str
        What spoke, with its version, for the lineage.
    """

    phones: tuple[Phone, ...]
    words: tuple[Span, ...]
    syllables: tuple[tuple[Span, ...], ...]
    samples: Samples
    rate: int
    voice: str

    @property
    def duration_s(self) -> float:
        """Seconds to the end of the last phone."""
        return self.phones[-1].end_s if self.phones else 0.0
