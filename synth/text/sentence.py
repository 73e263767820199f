"""What is known of a sentence before it is spoken: prosodic words, their syllables and appraisal, and its purpose."""

from dataclasses import dataclass
from typing import Any

from synth.errors import SpecError
from synth.pad import PAD

LANGUAGES = ("en", "zh")

LONGEST_TEXT = 2000
"""Characters of the longest text that is analysed and spoken."""


@dataclass(frozen=True, slots=True)
class TextSyllable:
    """A syllable of a prosodic word.

    Parameters
    ----------
    text : str
        As written (a Chinese character, the letters or phonemes of an English syllable).
    tone : int, optional
        1 to 5 (neutral) in Mandarin; None in English.
    stress : bool
        Whether the head's peak is wanted here: in English the primary stress of the content word, in Chinese words of
        degree such as 最, 極, 很 (MTAP 2013, section 3.2).
    """

    text: str
    tone: int | None = None
    stress: bool = False


@dataclass(frozen=True, slots=True)
class TextWord:
    """A prosodic word.

    Parameters
    ----------
    text : str
        As written, without punctuation around it.
    start, end : int
        Where it stands in the text: ``sentence.text[start:end]`` holds it.
    syllables : tuple of TextSyllable
        At least one.
    P : float
        Pleasure: 1 commendatory, -1 derogatory, 0 neutral (MTAP 2013, section 2.2).
    A : float
        Arousal: 1 superlative or high degree, 0.5 comparative or key fact, 0 neutral.
    """

    text: str
    start: int
    end: int
    syllables: tuple[TextSyllable, ...]
    P: float = 0.0
    A: float = 0.0

    def __post_init__(self) -> None:
        if not self.text.strip() or not self.syllables or not 0 <= self.start < self.end:
            raise SpecError(f"Prosodic word {self.text!r}: it needs text, a place in the sentence and a syllable.")
        for name in ("P", "A"):
            if not -1.0 <= getattr(self, name) <= 1.0:
                raise SpecError(
                    f"Prosodic word {self.text!r}: {name} is {getattr(self, name)!r}; it goes from -1 to 1."
                )


@dataclass(frozen=True, slots=True)
class Sentence:
    """An analysed sentence.

    Parameters
    ----------
    text : str
        The text as given.
    lang : {"en", "zh"}
        Its language.
    words : tuple of TextWord
        Prosodic words in order; empty if nothing in the text is spoken.
    goal : str
        Communicative goal, for instance "declarative"; see `synth.text.intent`.
    D : float
        Dominance of the goal: 1, 0.5, 0, -0.5 or -1 (MTAP 2013, section 5.4).
    """

    text: str
    lang: str
    words: tuple[TextWord, ...]
    goal: str = "neutral"
    D: float = 0.0

    @property
    def prominent(self) -> TextWord | None:
        """The semantically prominent word: that with the largest length of (P, A), of several the first."""
        return max(self.words, key=lambda word: word.P**2 + word.A**2, default=None)

    @property
    def target(self) -> PAD:
        """The target PAD: P and A of the prominent word with the sentence's D (MTAP 2013, section 5.4)."""
        word = self.prominent
        return PAD(0.0 if word is None else word.P, 0.0 if word is None else word.A, self.D)

    def to_dict(self) -> dict[str, Any]:
        """Return the sentence as ``padlab text --json`` prints it."""
        return {
            "text": self.text,
            "lang": self.lang,
            "words": [
                {
                    "text": word.text,
                    "P": word.P,
                    "A": word.A,
                    "start": word.start,
                    "end": word.end,
                    "syllables": [{"text": one.text, "tone": one.tone, "stress": one.stress} for one in word.syllables],
                }
                for word in self.words
            ],
            "goal": self.goal,
            "D": self.D,
            "target": list(self.target.as_tuple()),
        }
