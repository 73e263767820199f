"""The seam between what is said and what says it."""

from typing import Protocol

from synth.speech.spoken import Speech
from synth.text.sentence import Sentence


class Voice(Protocol):
    """What speaks a sentence: a synthesiser, or anything else that knows when each phone is heard.

    Attributes
    ----------
    name : str
        Which voice it is, for the lineage.
    version : str
        Version of the program and data behind it.
    """

    @property
    def name(self) -> str: ...  # noqa: D102 - described by the class

    @property
    def version(self) -> str: ...  # noqa: D102 - described by the class

    def speak(self, sentence: Sentence) -> Speech:
        """Speak a sentence; equal sentences give equal speech.

        Raises
        ------
        SpeechError
            If it cannot be spoken.
        """
        ...
