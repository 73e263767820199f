"""What a sentence is for: its communicative goal, which gives dominance (MTAP 2013, section 5.4)."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

from synth.errors import SpecError
from synth.text.scanning import normal
from synth.text.segmentation import simplified
from synth.text.sentence import LANGUAGES

_SENTENCE = re.compile(r"[^.!?…。\n]+(?:\.(?=\w)[^.!?…。\n]+)*[.!?…。\n]*")
_CLAUSE = re.compile(r"[,;:、，；：—–()]")
_WORD = re.compile(r"[^\W_]+(?:['-][^\W_]+)*")

_STRUCK = " □ "

DECLARATIVE = "declarative"
"""The goal of a sentence without a cue."""

NEUTRAL = "neutral"
"""The goal of a text in which nothing is said."""


@dataclass(frozen=True, slots=True)
class _Statement:
    """A sentence as cues are looked for in it: words with a blank at each side; Chinese without blanks."""

    whole: str
    clauses: tuple[str, ...]
    final: str


@cache
def goals() -> Mapping[str, float]:
    """Return D of each communicative goal, in the order in which they are looked for.

    Returns
    -------
    mapping of str to float
        1 for confirmation and imperative, 0.5 for explanation and declarative, 0 for neutral, -0.5 for suggestion,
        thanks and request, -1 for apology, imploring and interrogative.
    """
    return MappingProxyType({goal: float(D) for goal, D in _document()["D"].items()})


def goal_of(text: str, lang: str) -> tuple[str, float]:
    """Return the communicative goal of a text and its dominance.

    The goals are looked for in the order of `goals`, over all sentences of the text; the first with a cue is taken.
    Without a cue the text is declarative, and neutral if it has no words.

    Parameters
    ----------
    text : str
        One or more sentences.
    lang : {"en", "zh"}
        Their language.

    Returns
    -------
    goal : str
        One of `goals`.
    D : float
        Its dominance.

    Raises
    ------
    SpecError
        If the language is another.
    """
    if lang not in LANGUAGES:
        raise SpecError(f"Goal: the language {lang!r} is not known; it must be one of {', '.join(LANGUAGES)}.")
    statements = list(_statements(text, lang))
    if not statements:
        return NEUTRAL, goals()[NEUTRAL]
    cues = _document()["cues"][lang]
    for goal, D in goals().items():
        if any(_has_cue(one, cues.get(goal, {}), lang) for one in statements):
            return goal, D
    return DECLARATIVE, goals()[DECLARATIVE]


def _statements(text: str, lang: str) -> Iterator[_Statement]:
    plain = normal(text).casefold()
    if lang == "zh":
        plain = simplified(plain)
    for found in _SENTENCE.finditer(plain):
        clauses = tuple(words for part in _CLAUSE.split(found[0]) if (words := _words(part, lang)))
        if clauses:
            yield _Statement(_joined(clauses, lang), clauses, "?" if "?" in found[0] else "")


def _words(part: str, lang: str) -> str:
    if lang == "en":
        return "".join(f" {word}" for word in _WORD.findall(part)) + " " if _WORD.search(part) else ""
    return "".join(_WORD.findall(part))


def _joined(clauses: tuple[str, ...], lang: str) -> str:
    return "".join(clauses).replace("  ", " ") if lang == "en" else "\n".join(clauses)


def _has_cue(statement: _Statement, cues: Mapping[str, list[str]], lang: str) -> bool:
    clauses, whole = list(statement.clauses), statement.whole
    for words in (_words(exception, lang) for exception in cues.get("except", ())):
        # A mark stays, so that what follows an exception doesn't become the beginning of the clause.
        clauses = [clause.replace(words, _STRUCK) for clause in clauses]
        whole = whole.replace(words, _STRUCK)
    tests: dict[str, Callable[[str], bool]] = {
        "anywhere": lambda cue: cue in whole,
        "start": whole.startswith,
        "clause_start": lambda cue: any(clause.startswith(cue) for clause in clauses),
        "clause": lambda cue: clauses[0] == cue,
        "later": lambda cue: any(clause.startswith(cue) for clause in clauses[1:]),
        "end": whole.endswith,
    }
    if statement.final and statement.final in cues.get("final", ()):
        return True
    return any(test(_words(cue, lang)) for kind, test in tests.items() for cue in cues.get(kind, ()))


@cache
def _document() -> Mapping[str, Any]:
    source = resources.files("synth").joinpath("data", "goals.json")
    return MappingProxyType(dict(json.loads(source.read_text(encoding="utf-8"))))
