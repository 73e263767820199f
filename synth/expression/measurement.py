"""Measuring expressions on feature points of pictures: FAPs (MTAP 2013, 4.2) and ACII 2007's PEPs (Table 3).

Points have the names of MPEG-4's feature points. Coordinates are x to the right of the picture, which is the subject's
left in a picture that is not mirrored, and y up; the unit is any. Both pictures must show the face from the front.

Before anything is measured, the neutral face is turned until its eyes are level, and the expressive one is laid over it
by the similarity (shift, turn in the picture, scale) that brings the points together which expressions hardly move: the
corners of the eyes and the bone and base of the nose; without corners of the eyes, the pupils and those of the nose.
Nods and turns out of the picture's plane stay in and look like expressions.

Where the point is missing that a length or a movement is defined by, the nearest one stands in: the folds of the lids
(3.13, 3.14, 3.9, 3.10) for their edges (3.1 to 3.4) and back, the outer upper lip (8.1) for the inner one (2.2), and
the outer lips' movements for the inner lips' and back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.pep import MTAP, peps
from synth.fap.table import FAP_COUNT, column, faps
from synth.fap.units import ANGLE_UNIT, STEPS

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

HUMAN_EYEBALL = 0.19
"""Radius of the eyeball as a share of ES: about 12 mm of 63 mm in adults."""

MAX_COORDINATE = 1e6
"""Largest amount of a coordinate."""

MEASURED_FAPS = tuple(sorted({fap for pep in peps(MTAP) for fap in pep.faps} | {15}))
"""The 37 FAPs of MTAP 2013, Table 5, and of ACII's the one more that a picture from the front shows (FAP 15)."""

ACII_CODES = ("1.1L", "1.1R", "1.2L", "1.2R", "1.3L", "1.3R", "2.1L", "2.1R", "3.1", "3.2", "3.4", "4.1")
"""The twelve of ACII's eighteen PEPs that its Table 3 measures, in order."""

ACII_POINTS = (
    *("4.1", "4.2", "4.3", "4.4", "4.5", "4.6", "3.9", "3.10", "3.13", "3.14"),
    *("8.1", "8.2", "8.3", "8.4", "2.1", "3.5", "3.6", "9.15"),
)
"""The 18 points of ACII 2007, Figure 4."""

_EYE_CORNERS = ("3.7", "3.11", "3.8", "3.12")
_NOSE = ("9.6", "9.7", "9.12", "9.13", "9.14", "9.15")
_PUPILS = ("3.5", "3.6")

_STAND_INS = MappingProxyType(
    {
        **{"3.1": "3.13", "3.2": "3.14", "3.3": "3.9", "3.4": "3.10"},
        **{"3.13": "3.1", "3.14": "3.2", "3.9": "3.3", "3.10": "3.4"},
        **{"2.2": "8.1", "2.3": "8.2", "2.4": "8.3", "2.5": "8.4"},
        **{"2.6": "8.5", "2.7": "8.6", "2.8": "8.7", "2.9": "8.8"},
        **{"8.1": "2.2", "8.2": "2.3", "8.3": "2.4", "8.4": "2.5"},
        **{"8.5": "2.6", "8.6": "2.7", "8.7": "2.8", "8.8": "2.9"},
    }
)
"""The nearest point, which is taken where one is missing."""

_LENGTHS = MappingProxyType(
    {
        "IRISD": ("3.1", "3.2", "3.3", "3.4"),
        "ES": _PUPILS,
        "ENS": (*_PUPILS, "9.15"),
        "MNS": ("9.15", "2.2"),
        "MW": ("8.3", "8.4"),
    }
)
"""The points that each unit of length is measured between."""

_GAZE = (23, 24, 25, 26)
_ALWAYS = (*_PUPILS, "9.15")
"""Points without which nothing is level, aligned or scaled."""


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Feature points of N expressions, each in a neutral and in an expressive picture of the same person.

    Attributes
    ----------
    points : tuple of K str
        Names such as "4.1".
    neutral, apex : (N, K, 2) float64
        Coordinates: x to the right of the picture (the subject's left), y up.

    Raises
    ------
    SpecError
        If shapes do not match, a name comes twice, or a coordinate is not a number or beyond `MAX_COORDINATE`.
    """

    points: tuple[str, ...]
    neutral: Floats
    apex: Floats

    def __post_init__(self) -> None:
        if len(set(self.points)) != len(self.points):
            twice = next(name for k, name in enumerate(self.points) if name in self.points[:k])
            raise SpecError(f"Landmarks: the point {twice} comes twice.")
        for name in ("neutral", "apex"):
            array = np.asarray(getattr(self, name), dtype=np.float64)
            if array.ndim != 3 or array.shape[1:] != (len(self.points), 2) or len(array) != len(self.neutral):
                raise SpecError(
                    f"Landmarks: the {name} points have shape {array.shape}, but must be "
                    f"({len(self.neutral)}, {len(self.points)}, 2)."
                )
            if not (np.abs(array) <= MAX_COORDINATE).all():
                row, point, _ = np.argwhere(~(np.abs(array) <= MAX_COORDINATE))[0]
                raise SpecError(
                    f"Landmarks: the {name} point {self.points[point]} in row {row} must have numbers from "
                    f"-{MAX_COORDINATE:g} to {MAX_COORDINATE:g}."
                )
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.neutral)


def measurable_faps(points: tuple[str, ...] | frozenset[str]) -> tuple[int, ...]:
    """Return which of `MEASURED_FAPS` can be measured on these points.

    Raises
    ------
    SpecError
        If a point is missing without which no unit of length is known; the message names it.
    """
    given = frozenset(points)
    for needed in (*_ALWAYS, *(name for names in _LENGTHS.values() for name in names)):
        if not _has(given, needed):
            stand_in = f" or {_STAND_INS[needed]}" if needed in _STAND_INS else ""
            raise SpecError(f"Landmarks: the point {needed}{stand_in} is missing, which the units of length need.")
    return tuple(fap for fap in MEASURED_FAPS if all(_has(given, point) for point in faps()[fap].points))


def aligned(landmarks: Landmarks) -> Landmarks:
    """Return the points with level eyes and without the head's motion between the pictures.

    Raises
    ------
    SpecError
        If points are missing, or lie all in one place.
    """
    measurable_faps(landmarks.points)
    number = {name: k for k, name in enumerate(landmarks.points)}
    corners = all(name in number for name in _EYE_CORNERS)
    left, right = (("3.7", "3.11"), ("3.8", "3.12")) if corners else (("3.5",), ("3.6",))
    still = [number[n] for n in (*(_EYE_CORNERS if corners else _PUPILS), *_NOSE) if n in number]
    neutral, apex = _complex(landmarks.neutral), _complex(landmarks.apex)
    across = neutral[:, [number[n] for n in left]].mean(axis=1) - neutral[:, [number[n] for n in right]].mean(axis=1)
    neutral = neutral * _unit(across, "the eyes").conj()[:, None]
    target, source = neutral[:, still], apex[:, still]
    centre_target, centre_source = target.mean(axis=1, keepdims=True), source.mean(axis=1, keepdims=True)
    spread = (np.abs(source - centre_source) ** 2).sum(axis=1)
    if not (spread > 0.0).all():
        raise SpecError(f"Landmarks: eyes and nose of the expressive face in row {np.argmin(spread)} are one point.")
    # The least squares similarity: a complex factor turns and scales at once, and never mirrors.
    factor = ((source - centre_source).conj() * (target - centre_target)).sum(axis=1) / spread
    apex = (apex - centre_source) * factor[:, None] + centre_target
    return Landmarks(landmarks.points, _real(neutral), _real(apex))


def face_units(landmarks: Landmarks) -> Mapping[str, Floats]:
    """Return the units of length (N,) of the neutral faces, in their pictures' unit: IRISD, ES, ENS, MNS, MW.

    The whole lengths, of which one step of a FAP is the 1024th; see `synth.fap.units`. The eyes must be level.

    Raises
    ------
    SpecError
        If points are missing, or a length is not greater than 0, which points that are swapped make it.
    """
    measurable_faps(landmarks.points)
    place = _Places(landmarks.points, landmarks.neutral)
    lengths = {
        "IRISD": 0.5 * (place.y("3.1") + place.y("3.2") - place.y("3.3") - place.y("3.4")),
        "ES": place.x("3.5") - place.x("3.6"),
        "ENS": 0.5 * (place.y("3.5") + place.y("3.6")) - place.y("9.15"),
        "MNS": place.y("9.15") - place.y("2.2"),
        "MW": place.x("8.3") - place.x("8.4"),
    }
    for name, length in lengths.items():
        if not (length > 0.0).all():
            row = int(np.argmax(~(length > 0.0)))
            raise SpecError(
                f"Landmarks: {name} of the neutral face in row {row} is {length[row]:g}, but must be greater than 0; "
                f"check the points {', '.join(_LENGTHS[name])}, and whether x goes to the subject's left and y up."
            )
    return lengths


def measure_faps(landmarks: Landmarks, *, eyeball: float = HUMAN_EYEBALL) -> Floats:
    """Return the FAPs (N, 68), in FAPU, that lead from the neutral to the expressive faces (MTAP 2013, 4.2).

    A FAP is the displacement of its point along its axis. FAPs 23 to 26 are approximate: a pupil's displacement is
    taken for the turn of a ball of radius ``eyeball`` from straight ahead, ``yaw = asin(dx / (r cos pitch))``,
    ``pitch = asin(-dy / r)``. FAP 3, which goes one way, is cut at 0. FAPs that the points do not tell are 0; see
    `measurable_faps`.

    Parameters
    ----------
    landmarks : Landmarks
        The points, not aligned.
    eyeball : float
        Radius of the eyeballs as a share of ES.

    Raises
    ------
    SpecError
        If points that the units of length need are missing or misplaced, or ``eyeball`` is not from 0.05 to 0.5.
    """
    if not 0.05 <= eyeball <= 0.5:
        raise SpecError(f"Landmarks: the eyeball's radius is {eyeball!r} of ES, but must be from 0.05 to 0.5.")
    level = aligned(landmarks)
    lengths = face_units(level)
    moved = _Places(level.points, level.apex - level.neutral)
    values = np.zeros((len(level), FAP_COUNT))
    for number in measurable_faps(level.points):
        fap = faps()[number]
        if fap.unit is None or fap.direction is None or number in _GAZE:
            continue
        along = fap.direction[0] * moved.x(fap.points[0]) + fap.direction[1] * moved.y(fap.points[0])
        steps = along / lengths[fap.unit] * STEPS
        values[:, column(number)] = steps if fap.two_way else np.maximum(steps, 0.0)
    radius = eyeball * lengths["ES"]
    for yaw, pitch, pupil in ((23, 25, "3.5"), (24, 26, "3.6")):
        down = np.arcsin(np.clip(-moved.y(pupil) / radius, -1.0, 1.0))
        left = np.arcsin(np.clip(moved.x(pupil) / (radius * np.maximum(np.cos(down), 1e-9)), -1.0, 1.0))
        values[:, column(yaw)], values[:, column(pitch)] = left / ANGLE_UNIT, down / ANGLE_UNIT
    return values + 0.0


def acii_movements(landmarks: Landmarks) -> Floats:
    """Return the movements (N, 12) that ACII 2007, Table 3, measures, in FAPU; signs are those of the PEPs (Table 1).

    The table's differences of a picture to the neutral one: heights of the brows (ENS), their inner ends towards each
    other (ES), the angle of their ends (AU), the opening of the lids (IRISD), the opening of the lips (MNS), the height
    of the mouth's corners above its middle (MNS), its width (MW) and the chin's way down (MNS). What is measured are
    the paper's 18 points, where they are there; units and alignment use more, if there are more. The table's absolute
    values are read so that the signs of Table 1 come out.

    Raises
    ------
    SpecError
        If a point is missing; the message names it.
    """
    given = frozenset(landmarks.points)
    for name in ACII_POINTS:
        if not _has(given, name):
            raise SpecError(f"Landmarks: the point {name} is missing, which the PEPs of ACII 2007 need.")
    level = aligned(landmarks)
    lengths = face_units(level)
    units = ("ENS", "ENS", "ES", "ES", "AU", "AU", "IRISD", "IRISD", "MNS", "MNS", "MW", "MNS")
    before, after = (_acii_places(_Places(level.points, places)) for places in (level.neutral, level.apex))
    scale = np.stack(
        [np.full(len(level), ANGLE_UNIT) if unit == "AU" else lengths[unit] / STEPS for unit in units], axis=1
    )
    result: Floats = (after - before) / scale
    return result + 0.0


def scaled(movements: NDArray[np.floating] | Floats) -> Floats:
    """Scale each column of (N, K) linearly into [-1, 1]: by its largest value above 0, and by its largest below.

    A side that no sample takes stays at 0.
    """
    array = np.asarray(movements, dtype=np.float64)
    above = np.maximum(array, 0.0).max(axis=0, initial=0.0)
    below = np.maximum(-array, 0.0).max(axis=0, initial=0.0)
    size = np.where(array > 0.0, above, below)
    result: Floats = np.divide(array, size, out=np.zeros_like(array), where=size > 0.0)
    return result + 0.0


def _acii_places(at: "_Places") -> Floats:
    """Return the quantities (N, 12) whose differences are the movements, in the order of `ACII_CODES`."""
    middle = 0.5 * (at.y("8.1") + at.y("8.2"))
    return np.stack(
        [
            at.y("4.3"),
            at.y("4.4"),
            -at.x("4.1"),
            at.x("4.2"),
            np.arctan2(at.y("4.1") - at.y("4.5"), np.abs(at.x("4.1") - at.x("4.5"))),
            np.arctan2(at.y("4.2") - at.y("4.6"), np.abs(at.x("4.2") - at.x("4.6"))),
            at.y("3.13") - at.y("3.9"),
            at.y("3.14") - at.y("3.10"),
            at.y("8.1") - at.y("8.2"),
            0.5 * (at.y("8.3") + at.y("8.4")) - middle,
            at.x("8.3") - at.x("8.4"),
            -at.y("2.1"),
        ],
        axis=1,
    )


class _Places:
    """Coordinates of points by name; a missing point's are those of its stand-in."""

    def __init__(self, points: tuple[str, ...], places: Floats) -> None:
        self._number = {name: k for k, name in enumerate(points)}
        self._places = places

    def x(self, name: str) -> Floats:
        """Return x of a point in each picture (N,)."""
        return self._places[:, self._row(name), 0]

    def y(self, name: str) -> Floats:
        """Return y of a point in each picture (N,)."""
        return self._places[:, self._row(name), 1]

    def _row(self, name: str) -> int:
        return self._number[name] if name in self._number else self._number[_STAND_INS[name]]


def _has(points: frozenset[str], name: str) -> bool:
    return name in points or _STAND_INS.get(name) in points


def _complex(places: Floats) -> Complex:
    result: Complex = places[..., 0] + 1j * places[..., 1]
    return result


def _real(places: Complex) -> Floats:
    return np.stack([places.real, places.imag], axis=-1)


def _unit(vectors: Complex, what: str) -> Complex:
    lengths = np.abs(vectors)
    if not (lengths > 0.0).all():
        raise SpecError(f"Landmarks: {what} of the neutral face in row {int(np.argmin(lengths))} are in one place.")
    result: Complex = vectors / lengths
    return result
