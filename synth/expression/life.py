"""Small life: blinks and shifts of gaze, which a face has while it rests and while it speaks.

Each is a track (T, 68) of FAP values to be added to the expression's, and each has its own part of the randomness, so
that one can be switched off and the other stays as it was.
"""

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.course import BLINK_S, closed_eyes, minimum_jerk
from synth.fap.table import FAP_COUNT, check_sequence, column
from synth.fap.units import ANGLE_UNIT

Floats = NDArray[np.float64]

BLINKS_PER_MINUTE = 17.0
"""Mean rate of people at rest (Bentivoglio et al. 1997, Analysis of blink rate patterns in normal subjects)."""

_CALM_S = 0.9
"""Least time from the beginning of one blink to that of the next."""
_INTERVAL_SHAPE = 2.0
"""Shape of the gamma distribution of what comes on top: skewed to the right, as people's intervals are."""
_FASTEST = 60.0 / _CALM_S

GAZE_DEGREES = (1.0, 3.0)
"""Least and largest angle of a shift of gaze."""

_FLATNESS = 0.5
"""Height of the ellipse in which shifts lie, as a share of its width: eyes shift more to the sides."""
_SACCADE_S, _SACCADE_S_PER_DEGREE = 0.021, 0.0022
"""Duration of a saccade (the main sequence: Carpenter 1988, Movements of the Eyes)."""
_AHEAD_S, _ASIDE_S = (0.8, 3.0), (0.25, 0.9)
"""Shortest and longest look ahead and aside."""
_YAW, _PITCH = (column(23), column(24)), (column(25), column(26))


def life_track(
    expression: NDArray[np.floating] | Floats,
    *,
    fps: int,
    rng: np.random.Generator,
    blinks: bool = True,
    gaze: bool = True,
    rate: float = BLINKS_PER_MINUTE,
) -> Floats:
    """Return the FAPs (T, 68) of small life, to be added to an expression's.

    Parameters
    ----------
    expression : (T, 68)
        FAP values of the face, which say how far the lids must go.
    fps : int
        Frames per second.
    rng : numpy.random.Generator
        Decides when and where; its first two children are used, so a fresh one of the same seed gives the same life.
    blinks, gaze : bool
        Whether there are any. Neither changes the other; without both the face is still.
    rate : float
        Blinks in a minute, on average.

    Raises
    ------
    SpecError
        If ``expression`` is not a finite (T, 68) array, ``fps`` is less than 1, or people cannot blink so often.
    """
    face = check_sequence(expression)
    if fps < 1:
        raise SpecError(f"Life: {fps} frames per second asked, but there must be at least 1.")
    if not 0.0 < rate < _FASTEST:
        raise SpecError(f"Life: {rate!r} blinks in a minute asked, but there must be more than 0 and less than 66.")
    of_blinks, of_gaze = rng.spawn(2)
    times = np.arange(len(face)) / fps
    track = np.zeros((len(face), FAP_COUNT))
    if blinks:
        track += closed_eyes(face, times, blink_starts(len(face) / fps, rate=rate, rng=of_blinks))
    if gaze:
        track += gaze_shifts(times, rng=of_gaze)
    return track


def blink_starts(duration_s: float, *, rate: float = BLINKS_PER_MINUTE, rng: np.random.Generator) -> list[float]:
    """Draw when blinks begin: none in less than `_CALM_S` after another, none that the end would cut off."""
    on_top = 60.0 / rate - _CALM_S
    # Time begins anywhere between two blinks.
    start = float(rng.uniform(0.0, 1.0)) * (_CALM_S + float(rng.gamma(_INTERVAL_SHAPE, on_top / _INTERVAL_SHAPE)))
    starts = []
    while start + BLINK_S <= duration_s:
        starts.append(start)
        start += _CALM_S + float(rng.gamma(_INTERVAL_SHAPE, on_top / _INTERVAL_SHAPE))
    return starts


def gaze_shifts(times: Floats, *, rng: np.random.Generator) -> Floats:
    """Return the FAPs (T, 68) of eyes that look ahead, aside by one to three degrees, and ahead again.

    A shift takes 21 ms and 2.2 ms for each degree, by minimum jerk, so that its peak speed grows with its size (the
    main sequence). Both eyes turn alike.

    Parameters
    ----------
    times : (T,)
        Time of each frame in seconds, ascending.
    rng : numpy.random.Generator
        Decides when and where.
    """
    track = np.zeros((len(times), FAP_COUNT))
    end = float(times[-1]) if len(times) else 0.0
    # The first look ahead has begun before the beginning.
    start = float(rng.uniform(0.3, _AHEAD_S[1]))
    while start < end:
        size, angle, aside = rng.uniform(*GAZE_DEGREES), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(*_ASIDE_S)
        way = np.array([np.cos(angle), _FLATNESS * np.sin(angle)])
        yaw, pitch = np.radians(size) * way / np.linalg.norm(way) / ANGLE_UNIT
        lasts = _SACCADE_S + _SACCADE_S_PER_DEGREE * size
        share = minimum_jerk((times - start) / lasts) - minimum_jerk((times - start - aside) / lasts)
        track[:, _YAW] += yaw * share[:, None]
        track[:, _PITCH] += pitch * share[:, None]
        start += float(aside + lasts + rng.uniform(*_AHEAD_S))
    return track
