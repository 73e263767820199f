"""What each piece of a prosodic word contributes to its appraisal, before negation and degree act on it."""

from dataclasses import dataclass
from enum import Enum

KEY_FACT = 0.5
"""A of a comparative and of a key fact (MTAP 2013, section 2.2)."""

HIGH = 1.0
"""A of a superlative and of a high degree (MTAP 2013, section 2.2)."""


class Role(Enum):
    """What a piece does to the pieces after it."""

    PLAIN = "plain"
    NEGATION = "negation"
    PROHIBITION = "prohibition"
    LESSER = "lesser"
    DEGREE = "degree"


@dataclass(frozen=True, slots=True)
class Mark:
    """A piece of a prosodic word.

    Parameters
    ----------
    text : str
        Lower case or simplified.
    word : int
        Index of its prosodic word.
    clause : int
        Number of its clause; a scope ends with its clause.
    role : Role
        What it does to the pieces after it.
    P : int
        1, -1 or 0 by itself.
    A : float
        1, 0.5 or 0 by itself.
    graded : bool
        Whether a word of degree before it can act on it.
    particle : bool
        Whether it stands between a word of degree and the next prosodic word without weight (的, 了).
    """

    text: str
    word: int
    clause: int
    role: Role = Role.PLAIN
    P: int = 0
    A: float = 0.0
    graded: bool = False
    particle: bool = False
