"""Pleasure, arousal and dominance: the value object, and the fourteen emotion words of the papers."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Self

from synth.errors import SpecError

DIMENSIONS = ("P", "A", "D")


@dataclass(frozen=True, slots=True)
class PAD:
    """A point of Mehrabian's emotion space.

    Parameters
    ----------
    P, A, D : float
        Pleasure, arousal and dominance, each in [-1, 1]; (0, 0, 0) is neutral.

    Raises
    ------
    SpecError
        If a value is not a finite number in [-1, 1].
    """

    P: float = 0.0
    A: float = 0.0
    D: float = 0.0

    def __post_init__(self) -> None:
        for name in DIMENSIONS:
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not -1.0 <= value <= 1.0:
                raise SpecError(f"PAD: {name} is {value!r}, but must be a number from -1 to 1.")
            # Adding 0.0 turns -0.0 into 0.0, so that equal points are also written alike.
            object.__setattr__(self, name, float(value) + 0.0)

    @classmethod
    def parse(cls, values: object) -> Self:
        """Make a PAD of any three numbers, for instance of a list read from JSON."""
        if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
            raise SpecError(f"PAD: {values!r} is not a list of three numbers (pleasure, arousal, dominance).")
        numbers = list(values)
        if len(numbers) != len(DIMENSIONS):
            raise SpecError(f"PAD: {len(numbers)} values given, but three are needed: pleasure, arousal, dominance.")
        P, A, D = numbers
        return cls(P, A, D)

    def as_tuple(self) -> tuple[float, float, float]:
        """Return (P, A, D)."""
        return self.P, self.A, self.D

    def distance(self, other: Self) -> float:
        """Return the Euclidean distance to another point, from 0 to 2 sqrt(3)."""
        return math.dist(self.as_tuple(), other.as_tuple())


@cache
def emotion_words() -> Mapping[str, PAD]:
    """Return the fourteen emotion words and their input PAD (MTAP 2013, Table 8), in the table's order."""
    text = resources.files("synth.data").joinpath("pad_words.json").read_text(encoding="utf-8")
    words = json.loads(text)["norms"]["chinese"]["words"]
    return MappingProxyType({word: PAD.parse(values) for word, values in words.items()})


def nearest_word(pad: PAD) -> str:
    """Return the emotion word whose PAD is nearest (Euclidean); of two equally near the earlier in Table 8."""
    return min(emotion_words(), key=lambda word: emotion_words()[word].distance(pad))
