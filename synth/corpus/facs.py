"""Displays of the face in the Facial Action Coding System (FACS): formulas of action units, and what they move.

A formula joins action units (AU) with ``+``: ``1+2+5B+26``. A unit may have a side (``L``, ``R``) before its number and
an intensity behind it: a letter from ``A`` (trace) to ``E`` (maximum), two letters for either or between (``12C/D``),
or ``*`` for any. ``25|26|27`` is one of these; what stands in parentheses, ``(+54+64)``, may be absent. Blanks mean
nothing.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, column, faps

Floats = NDArray[np.float64]

_UNIT = re.compile(r"(?P<side>[LR]?)(?P<number>[0-9]{1,2})(?P<level>\*|[A-E](?:/[A-E])?|)")
_WHAT_A_UNIT_IS = (
    "a unit is a number with an optional side (L or R) before it and an optional intensity (A to E, such as C/D for a "
    "range, or *) behind it, for instance R12C"
)
_MARKED = ("D", "E")
"""The range of a unit that is written without an intensity."""


@dataclass(frozen=True, slots=True)
class ActionUnit:
    """One action unit of a formula.

    Attributes
    ----------
    number : int
        Number in FACS.
    side : str
        "L" or "R" for the subject's left or right half of the face alone, "" for both.
    low, high : float
        Smallest and largest intensity that the formula allows, 0 to 1; see `intensities`.
    """

    number: int
    side: str
    low: float
    high: float


Choice = tuple[ActionUnit, ...]
"""Units of which one is shown."""

Levels = tuple[tuple[ActionUnit, float], ...]
"""Units with the intensities at which they are shown."""


@dataclass(frozen=True, slots=True)
class Display:
    """What a formula says.

    Attributes
    ----------
    formula : str
        The formula itself.
    required : tuple of Choice
        One unit of each choice is shown.
    optional : tuple of tuples of Choice
        Groups that are shown, or not, as a whole.
    """

    formula: str
    required: tuple[Choice, ...]
    optional: tuple[tuple[Choice, ...], ...]

    def draw(self, rng: np.random.Generator) -> Levels:
        """Draw one way to show it: alternatives are equally likely, so is an optional group's presence.

        Intensities are uniform between the unit's limits.
        """
        shown = [group for group in self.optional if rng.random() < 0.5]
        choices = self.required + tuple(choice for group in shown for choice in group)
        units = [choice[rng.integers(len(choice))] for choice in choices]
        return tuple((unit, float(rng.uniform(unit.low, unit.high))) for unit in units)

    def typical(self) -> Floats:
        """Return its FAPs (68,) in FAPU: the mean over alternatives, without options, at the middle intensities."""
        total = np.zeros(FAP_COUNT)
        for choice in self.required:
            for unit in choice:
                total += unit_faps(unit, 0.5 * (unit.low + unit.high)) / len(choice)
        return total


@cache
def parse(formula: str) -> Display:
    """Read a formula.

    Raises
    ------
    SpecError
        If it is malformed, or names a unit that `units` does not have.
    """
    text = re.sub(r"\s+", "", formula)
    pieces = re.findall(r"\([^()]*\)|[^()]+", text)
    if "".join(pieces) != text:
        raise SpecError(f"FACS display {formula!r}: parentheses do not match; groups are (…), none in another.")
    required: list[Choice] = []
    optional: list[tuple[Choice, ...]] = []
    for k, piece in enumerate(pieces):
        if piece.startswith("("):
            optional.append(_sum(piece[1:-1].removeprefix("+"), formula))
        else:
            # A plus may or may not stand between a group and what is beside it.
            body = piece.removeprefix("+") if k > 0 else piece
            body = body.removesuffix("+") if k + 1 < len(pieces) else body
            required += _sum(body, formula) if body or len(pieces) == 1 else ()
    if not pieces:
        raise SpecError(f"FACS display {formula!r} is empty; write action units, for instance 6+12C.")
    return Display(formula, tuple(required), tuple(optional))


def faps_of(levels: Iterable[tuple[ActionUnit, float]]) -> Floats:
    """Return the FAPs (68,) in FAPU of units at given intensities: their contributions add."""
    total = np.zeros(FAP_COUNT)
    for unit, level in levels:
        total += unit_faps(unit, level)
    return total


def unit_faps(unit: ActionUnit, level: float) -> Floats:
    """Return the FAPs (68,) in FAPU of one unit at an intensity, 0 to 1; slightly more scales on.

    Of a one-sided unit, FAPs on the middle line go half the way.
    """
    return units()[unit.number] * level * _half(unit.side)


@cache
def units() -> Mapping[int, Floats]:
    """Return the FAPs (68,) in FAPU of each action unit at intensity E, both sides."""
    found = {}
    for row in _data()["units"]:
        profile = np.zeros(FAP_COUNT)
        for number, value in row["faps"].items():
            fap = faps()[int(number)]
            profile[[column(fap.fap), column(fap.mirror or fap.fap)]] = value
        profile.flags.writeable = False
        found[int(row["au"])] = profile
    return MappingProxyType(found)


@cache
def intensities() -> Mapping[str, float]:
    """Return the intensities A to E as numbers from 0 to 1: padlab's own reading of FACS' five grades."""
    return MappingProxyType({letter: float(value) for letter, value in _data()["intensities"].items()})


@dataclass(frozen=True, slots=True)
class EmotionDisplays:
    """How an emotion is shown.

    Attributes
    ----------
    prototypes, variants : tuple of Display
        Major and minor ways to show it.
    source : str
        Where the formulas are from.
    verified : bool
        Whether a source was at hand for all of them; false if some are only recalled.
    """

    prototypes: tuple[Display, ...]
    variants: tuple[Display, ...]
    source: str
    verified: bool

    @property
    def all(self) -> tuple[Display, ...]:
        """Prototypes, then variants."""
        return self.prototypes + self.variants


@cache
def emotion_displays() -> Mapping[str, EmotionDisplays]:
    """Return the displays of surprise, fear, happy, sad, anger, disgust and contempt."""
    data = _data()
    return MappingProxyType(
        {
            emotion: EmotionDisplays(
                prototypes=tuple(map(parse, row["prototypes"])),
                variants=tuple(map(parse, (*row["variants"], *_lacking(row)))),
                source=data["sources"][row["source"]],
                verified=row["source"] not in {"recalled", "contempt"},
            )
            for emotion, row in data["emotions"].items()
        }
    )


def _lacking(row: Mapping[str, Any]) -> list[str]:
    """Return the prototypes without one of the units that variants may lack, each once and none a prototype."""
    found: dict[str, None] = {}
    for formula in row["prototypes"]:
        terms = formula.split("+")
        for absent in row.get("may_lack_one_of", ()):
            rest = [term for term in terms if term.rstrip("*") != str(absent)]
            if len(rest) < len(terms):
                found["+".join(rest)] = None
    return [formula for formula in found if formula not in row["prototypes"]]


def _sum(text: str, formula: str) -> tuple[Choice, ...]:
    return tuple(tuple(_unit(term, formula) for term in choice.split("|")) for choice in text.split("+"))


def _unit(term: str, formula: str) -> ActionUnit:
    match = _UNIT.fullmatch(term)
    if match is None:
        raise SpecError(f"FACS display {formula!r}: {term!r} is no action unit; {_WHAT_A_UNIT_IS}.")
    number = int(match["number"])
    if number not in units():
        known = ", ".join(map(str, units()))
        raise SpecError(f"FACS display {formula!r}: there is no profile of action unit {number}; there are {known}.")
    grade = intensities()
    if match["level"] == "*":
        low, high = min(grade.values()), max(grade.values())
    else:
        letters = match["level"].split("/") if match["level"] else _MARKED
        low, high = grade[letters[0]], grade[letters[-1]]
    if low > high:
        raise SpecError(f"FACS display {formula!r}: the range of {term!r} goes down; write the smaller letter first.")
    return ActionUnit(number, match["side"], low, high)


@cache
def _half(side: str) -> Floats:
    """Return the share (68,) of each FAP that a side of the face takes part in."""
    share = np.ones(FAP_COUNT)
    if side:
        for fap in faps().values():
            # Of two mirror images, the standard numbers the left one first.
            if fap.mirror is None:
                share[column(fap.fap)] = 0.5
            elif (fap.fap < fap.mirror) != (side == "L"):
                share[column(fap.fap)] = 0.0
    share.flags.writeable = False
    return share


@cache
def _data() -> dict[str, Any]:
    text = resources.files("synth.data").joinpath("facs.json").read_text(encoding="utf-8")
    result: dict[str, Any] = json.loads(text)
    return result
