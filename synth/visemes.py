"""Visemes: what the mouth does for each phone, and how phones in a row share it (coarticulation).

Each viseme is a target for the FAPs of the mouth. Phones pull at each articulator (jaw, lip opening, width, protrusion,
tongue) by dominance functions (Cohen and Massaro 1993, Modeling coarticulation in synthetic visual speech), so that a
vowel rounds the lips while the consonants before it are still spoken. Lips that must meet do meet, in a frame.
"""

import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.course import minimum_jerk
from synth.fap.table import FAP_COUNT, column, faps
from synth.speech.spoken import SILENCE, Phone

Floats = NDArray[np.float64]

SILENT, OPEN = "sil", "open"
"""The visemes of silence and of phones that nothing is known of."""

HAND_OVER_S = 0.3
"""How long the mouth takes from an expression to speech, and back."""

SHORT_PAUSE_S = 0.5
"""In a shorter pause the mouth remains with speech."""

_ROUNDING = 0.7
"""Share of a rounded vowel's width and protrusion that a consonant just before it takes on."""
_ROUNDED = ("width", "protrusion")

# A long phone counts fully but for this long at its ends, where its neighbours begin to pull. A pause shorter than
# this does not close the mouth all the way, and before and after all phones it is closed.
_EDGE_S = 0.06
_FULL_PAUSE_S = 0.25
_AROUND_S = 1.0

# What counts where no phone does, so that the mouth comes to rest.
_REST_DOMINANCE = 0.02

# A held articulator stays for the middle of its phone and moves there and away in so many seconds.
_HELD_EDGE_S = 0.035
_HELD_RAMP_S = 0.08
_FIRM = 1e-6

_BLOCK = 250
"""Frames computed at once."""

_IGNORED = {"Mn", "Lm", "Sk", "Nd", "No", "Po", "Pd", "Ps", "Pe", "Zs"}
_BASE_LETTER = re.compile(r"LETTER (?:SMALL CAPITAL )?([A-Z])\b")


@dataclass(frozen=True, eq=False)
class Viseme:
    """A viseme.

    Attributes
    ----------
    name : str
        For instance "PP".
    mpeg4 : int
        Number of the viseme of MPEG-4 (FAP 1) that it is or comes nearest to, 0 to 14.
    target : (68,) float64
        FAP values in FAPU; 0 outside of the mouth.
    dominance : dict of str to float
        How much it counts for each articulator, at least 0.
    held : frozenset of str
        Articulators that reach the target at the viseme's centre, whatever the neighbours want.
    rounded : bool
        Whether the lips are rounded.
    """

    name: str
    mpeg4: int
    target: Floats
    dominance: Mapping[str, float]
    held: frozenset[str]
    rounded: bool


@dataclass(frozen=True)
class Articulator:
    """A part of the mouth that moves on its own.

    Attributes
    ----------
    name : str
        "jaw", "opening", "width", "protrusion" or "tongue".
    faps : tuple of int
        What it moves.
    before_s, after_s : float
        How far before and after a phone its viseme counts, in seconds.
    """

    name: str
    faps: tuple[int, ...]
    before_s: float
    after_s: float


@dataclass(frozen=True, eq=False)
class _Target:
    """A viseme on the time line: where it is to be reached, and how long it lasts on either side."""

    viseme: Viseme
    values: Floats
    centre_s: float
    half_s: float
    strength: float


@cache
def visemes() -> Mapping[str, Viseme]:
    """Return the visemes by name: the 14 of MPEG-4, silence, and padlab's own variants of them."""
    rows = _data()["visemes"]
    return MappingProxyType(
        {
            row["name"]: Viseme(
                name=row["name"],
                mpeg4=row["mpeg4"],
                target=_filled({int(fap): float(value) for fap, value in row["faps"].items()}),
                dominance=MappingProxyType(row["dominance"]),
                held=frozenset(row["held"]),
                rounded=row.get("rounded", False),
            )
            for row in rows
        }
    )


@cache
def articulators() -> tuple[Articulator, ...]:
    """Return the articulators; together they move the FAPs of the mouth (3 to 18, 43 to 47, 51 to 60)."""
    return tuple(Articulator(row["name"], tuple(row["faps"]), *row["reach_s"]) for row in _data()["articulators"])


def visemes_of(symbol: str) -> tuple[str, ...]:
    """Return the names of the visemes that a phone goes through.

    Parameters
    ----------
    symbol : str
        IPA: a consonant, a vowel, or several at once ("tʃ", "aɪ", "iou"). Stress, tone, length and other marks that
        the mouth does not show may be there. A letter that is in no table counts as the Latin letter that it was made
        of, and as a mouth a little open if there is none.

    Returns
    -------
    tuple of str
        One or more, none twice in a row.
    """
    return _read(symbol)[0]


def unknown_symbols(phones: Sequence[Phone]) -> tuple[str, ...]:
    """Return the symbols of phones of which a part is in no table, in order, each once."""
    return tuple(dict.fromkeys(phone.symbol for phone in phones if _read(phone.symbol)[1]))


def viseme_track(phones: Sequence[Phone], *, fps: int, frames: int) -> Floats:
    """Return what the mouth does while phones are spoken.

    Each articulator is at the mean of the visemes' targets, weighted by their dominance: full within the phone, and
    smoothly less before and after. Where a viseme holds an articulator (lips of /p b m f v/, tongue of /θ ð/), the
    target is reached in the frame nearest to its centre. Every value lies between targets, so none leaves its range.

    Parameters
    ----------
    phones : sequence of Phone
        In order of time.
    fps : int
        Frames per second; frame k is at ``k / fps`` seconds.
    frames : int
        How many.

    Returns
    -------
    (T, 68) float64
        FAP values in FAPU.

    Raises
    ------
    SpecError
        If ``fps`` is less than 1, ``frames`` less than 0, or the phones are not in order.
    """
    _check(phones, fps, frames)
    targets = _targets(phones)
    held = _held_centres(targets, fps)
    centres = np.array([one.centre_s for one in targets])
    reach = _AROUND_S + max(one.half_s for one in targets)
    track = np.zeros((frames, FAP_COUNT))
    for start in range(0, frames, _BLOCK):
        times = np.arange(start, min(start + _BLOCK, frames)) / fps
        near = np.flatnonzero((centres > times[0] - reach) & (centres < times[-1] + reach))
        for articulator in articulators():
            columns = [column(fap) for fap in articulator.faps]
            track[start : start + len(times), columns] = _articulate(
                times, [targets[k] for k in near], held[near], articulator, columns
            )
    return track


def speaking_track(phones: Sequence[Phone], *, fps: int, frames: int) -> Floats:
    """Return how much the mouth belongs to speech, (T,) from 0 to 1: 1 while phones sound and in short pauses.

    It goes from one to the other by minimum jerk within `HAND_OVER_S` before and after.

    Raises
    ------
    SpecError
        As in `viseme_track`.
    """
    _check(phones, fps, frames)
    times = np.arange(frames) / fps
    spoken: list[tuple[float, float]] = []
    for phone in phones:
        if phone.symbol != SILENCE:
            joined = spoken and phone.start_s - spoken[-1][1] < SHORT_PAUSE_S
            start = spoken.pop()[0] if joined else phone.start_s
            spoken.append((start, phone.end_s))
    track = np.zeros(frames)
    for start, end in spoken:
        away = np.maximum(np.maximum(start - times, times - end), 0.0)
        track = np.maximum(track, minimum_jerk(1.0 - away / HAND_OVER_S))
    return track


def _check(phones: Sequence[Phone], fps: int, frames: int) -> None:
    if fps < 1 or frames < 0:
        raise SpecError(f"Visemes: {fps} frames per second and {frames} frames asked; at least 1 and 0 are possible.")
    if any(later.start_s < earlier.start_s for earlier, later in pairwise(phones)):
        raise SpecError("Visemes: the phones must be in order of their times.")


def _articulate(
    times: Floats, targets: Sequence[_Target], held_s: Floats, articulator: Articulator, columns: list[int]
) -> Floats:
    """Return what one articulator does at the times (T,): (T, K) for its K columns."""
    if not targets:
        return np.zeros((len(times), len(columns)))
    values = np.array([one.values[columns] for one in targets])
    half = np.array([one.half_s for one in targets])
    strength = np.array([one.strength * one.viseme.dominance[articulator.name] for one in targets])
    since = times[:, None] - np.array([one.centre_s for one in targets])
    core = np.maximum(half - _EDGE_S, 0.0)
    reach = np.where(since < 0.0, articulator.before_s, articulator.after_s) + np.minimum(half, _EDGE_S)
    dominance = strength * _fall(np.maximum(np.abs(since) - core, 0.0) / reach)
    track: Floats = (dominance @ values) / (dominance.sum(axis=1, keepdims=True) + _REST_DOMINANCE)
    firm = np.array([articulator.name in one.viseme.held for one in targets])
    if not firm.any():
        return track
    away = np.abs(times[:, None] - held_s[firm]) - np.maximum(half[firm] - _HELD_EDGE_S, 0.0)
    grip = minimum_jerk(1.0 - np.maximum(away, 0.0) / _HELD_RAMP_S)
    # The weight has no bound at the centre, so that the mean is the target there, and of several each has its own.
    weight = grip / (1.0 - grip + _FIRM)
    firmly: Floats = (track + weight @ values[firm]) / (1.0 + weight.sum(axis=1, keepdims=True))
    return firmly


def _fall(distance: Floats) -> Floats:
    """Return dominance at a distance in reaches: 1 at 0, 0 from 1 on, twice differentiable (Wendland 1995)."""
    near = np.maximum(1.0 - distance, 0.0)
    fallen: Floats = near**4 * (4.0 * distance + 1.0)
    return fallen


def _targets(phones: Sequence[Phone]) -> list[_Target]:
    """Put the visemes of the phones on the time line, with silence before and after."""
    spoken: list[tuple[Viseme, float, float]] = []
    for phone in phones:
        names = visemes_of(phone.symbol)
        length = (phone.end_s - phone.start_s) / len(names)
        spoken += [(visemes()[name], phone.start_s + k * length, length) for k, name in enumerate(names)]
    end = max((phone.end_s for phone in phones), default=0.0)
    start = phones[0].start_s if phones else 0.0
    rest = visemes()[SILENT]
    spoken = [(rest, start - _AROUND_S, _AROUND_S), *spoken, (rest, end, _AROUND_S)]
    following = [one for one, _, _ in spoken[1:]] + [rest]
    return [
        _Target(
            viseme=viseme,
            values=_rounded(viseme, after) if after.rounded and not viseme.rounded else viseme.target,
            centre_s=begin + 0.5 * length,
            half_s=0.5 * length,
            strength=min(1.0, length / _FULL_PAUSE_S) if viseme is rest else 1.0,
        )
        for (viseme, begin, length), after in zip(spoken, following, strict=True)
    ]


def _rounded(viseme: Viseme, vowel: Viseme) -> Floats:
    """Return the target of a consonant that is spoken with the lips of the rounded vowel after it."""
    if viseme.name == SILENT or viseme.mpeg4 >= _FIRST_VOWEL:
        return viseme.target
    values = viseme.target.copy()
    for articulator in articulators():
        if articulator.name in _ROUNDED:
            for index in (column(fap) for fap in articulator.faps):
                # What a consonant holds, it needs: the lower lip of /f/ stays on the teeth.
                if articulator.name not in viseme.held or values[index] == 0.0:
                    values[index] += _ROUNDING * (vowel.target[index] - values[index])
    return values


def _held_centres(targets: Sequence[_Target], fps: int) -> Floats:
    """Return the time (N,) of the frame nearest to each target's centre.

    Of two visemes that hold something and fall on one frame, the later one takes the next frame, if that is not more
    than one frame from its centre.
    """
    nearest = np.floor(np.array([one.centre_s for one in targets]) * fps + 0.5)
    last = -np.inf
    for k, one in enumerate(targets):
        if one.viseme.held:
            if nearest[k] <= last and last + 1.0 - one.centre_s * fps <= 1.0:
                nearest[k] = last + 1.0
            last = nearest[k]
    frames: Floats = nearest / fps
    return frames


@cache
def _read(symbol: str) -> tuple[tuple[str, ...], bool]:
    """Return the visemes of a symbol, and whether a part of it is unknown."""
    if symbol == SILENCE:
        return (SILENT,), False
    text = "".join(char for char in unicodedata.normalize("NFC", symbol) if char not in "ˈˌ͜͡")
    table, names, unknown, place = _table(), list[str](), False, 0
    while place < len(text):
        length = next((n for n in (3, 2, 1) if text[place : place + n] in table), 0)
        part = text[place : place + max(length, 1)]
        place += len(part)
        if length:
            # An h after a consonant is its breath, and the mouth is already at the vowel.
            if not (part == "h" and names and visemes()[names[-1]].mpeg4 < _FIRST_VOWEL):
                names.append(table[part])
        elif unicodedata.category(part) not in _IGNORED:
            letter = _BASE_LETTER.search(unicodedata.name(part, ""))
            likeness = table.get(letter.group(1).lower()) if letter else None
            names.append(likeness or OPEN)
            unknown = unknown or likeness is None
    if not names:
        return (OPEN,), True
    return tuple(name for k, name in enumerate(names) if k == 0 or name != names[k - 1]), unknown


_FIRST_VOWEL = 10
"""Number of the first vowel among the visemes of MPEG-4."""


@cache
def _table() -> Mapping[str, str]:
    rows: Mapping[str, str] = _data()["phones"]
    return {unicodedata.normalize("NFC", phone): name for name, text in rows.items() for phone in text.split()}


@cache
def _data() -> Mapping[str, Any]:
    data: Mapping[str, Any] = json.loads(
        resources.files("synth.data").joinpath("visemes.json").read_text(encoding="utf-8")
    )
    return data


def _filled(values: Mapping[int, float]) -> Floats:
    """Return the (68,) FAPs of a viseme: a value holds for the other side and the other lip line, too."""
    target = np.zeros(FAP_COUNT)
    for spread in (True, False):
        for fap, value in values.items():
            twin = faps()[fap].twin if spread else None
            for one in (fap, twin):
                if one is not None:
                    target[[column(one), column(faps()[one].mirror or one)]] = value
    return target
