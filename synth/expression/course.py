"""The course of an expression: from neutral to its apex, held there, and away again, as tracks of FAPs.

A track is an array (T, 68) of FAP values; the tracks of a clip are added together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, column

Floats = NDArray[np.float64]

BLINK_S = 0.32
"""Length of a blink: eyes close in its first third and open more slowly, as people's do."""

_CLOSING_SHARE = 0.35
_CLOSED_GAP = 1024.0  # FAPU: the whole iris diameter, shared by the upper and the lower lid
_BLINK_MARGIN_S = 0.2
_BLINK_EVERY_S = (2.5, 4.5)
_UPPER_LIDS = (column(19), column(20))
_LOWER_LIDS = (column(21), column(22))


@dataclass(frozen=True, kw_only=True)
class Course:
    """When the expression comes.

    Attributes
    ----------
    fps : int
        Frames per second.
    neutral_s, onset_s, hold_s : float
        Seconds of the neutral face, of the onset, and of the hold.
    offset_s : float
        Seconds from the end of the hold until the expression has gone; 0 if it stays.
    """

    fps: int
    neutral_s: float
    onset_s: float
    hold_s: float
    offset_s: float = 0.0

    def times(self) -> Floats:
        """Return the time of each frame in seconds, the first at 0: (T,), T at least 1."""
        total = self.hold_start + self.hold_s + self.offset_s
        return np.arange(max(1, round(total * self.fps))) / self.fps

    @property
    def hold_start(self) -> float:
        """Seconds until the expression is complete."""
        return self.neutral_s + self.onset_s


def minimum_jerk(progress: NDArray[np.floating] | Floats) -> Floats:
    """Return the smoothest way from 0 to 1: ``10 p^3 - 15 p^4 + 6 p^5``, with ``p`` cut to [0, 1].

    Source: Flash and Hogan 1985, The coordination of arm movements, for a movement from rest to rest.
    """
    p = np.clip(np.asarray(progress, dtype=np.float64), 0.0, 1.0)
    # Rounding may take the polynomial past 1 by a hair.
    return np.minimum(p**3 * (10.0 - 15.0 * p + 6.0 * p**2), 1.0)


def expression_track(apex: Floats, course: Course, *, rest: float = 0.0) -> Floats:
    """Return the FAPs (T, 68) that go from neutral to the apex (68,) by minimum jerk, stay, and go.

    Parameters
    ----------
    apex : (68,)
        FAP values at full expression.
    course : Course
        When it comes, and, if it has an offset, when it goes.
    rest : float
        Share of the expression, from 0 (neutral) to 1, that remains after the offset.

    Raises
    ------
    SpecError
        If ``rest`` is not in [0, 1].
    """
    if not 0.0 <= rest <= 1.0:
        raise SpecError(f"Expression: rest is {rest!r}, but must be a number from 0 to 1.")
    since = course.times() - course.neutral_s
    # Without an onset the expression is there at once.
    progress = since / course.onset_s if course.onset_s > 0.0 else (since >= 0.0).astype(np.float64)
    intensity = minimum_jerk(progress)
    if course.offset_s > 0.0:
        gone = (course.times() - course.hold_start - course.hold_s) / course.offset_s
        intensity = intensity - (1.0 - rest) * minimum_jerk(gone) * intensity
    return intensity[:, None] * apex


def blink_track(expression: Floats, course: Course, rng: np.random.Generator) -> Floats:
    """Return the FAPs (T, 68) that, added to the expression's, close both eyes at plausible times in the hold."""
    return closed_eyes(expression, course.times(), _blink_times(course, rng))


def closed_eyes(expression: Floats, times: Floats, starts: Sequence[float]) -> Floats:
    """Return the FAPs (T, 68) that, added to the expression's, close both eyes in blinks.

    Parameters
    ----------
    expression : (T, 68)
        FAP values, which say how far the lids must go.
    times : (T,)
        Time of each frame in seconds.
    starts : sequence of float
        When each blink begins; they do not overlap (`BLINK_S`).
    """
    track = np.zeros((len(expression), FAP_COUNT))
    for start in starts:
        closed = _lid_closure((times - start) / BLINK_S)
        for upper, lower in zip(_UPPER_LIDS, _LOWER_LIDS, strict=True):
            left_open = np.maximum(_CLOSED_GAP - expression[:, upper] - expression[:, lower], 0.0)
            track[:, upper] += closed * left_open
    return track


def _blink_times(course: Course, rng: np.random.Generator) -> list[float]:
    """Draw the starts of blinks: none before the expression is complete, none that the end would cut off."""
    first = course.hold_start + _BLINK_MARGIN_S
    last = course.hold_start + course.hold_s - _BLINK_MARGIN_S - BLINK_S
    if last < first:
        return []
    times = [float(rng.uniform(first, min(last, first + _BLINK_EVERY_S[0])))]
    while (following := times[-1] + float(rng.uniform(*_BLINK_EVERY_S))) <= last:
        times.append(following)
    return times


def _lid_closure(phase: Floats) -> Floats:
    """Return how far the lids are closed, 0 to 1, at a phase of the blink (0 its start, 1 its end)."""
    closing = minimum_jerk(phase / _CLOSING_SHARE)
    opening = minimum_jerk((phase - _CLOSING_SHARE) / (1.0 - _CLOSING_SHARE))
    return closing - opening
