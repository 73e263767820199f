"""From one word's motion to the next: the paper's moving average, and a glide that is smoother to look at."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray
from scipy import ndimage

from synth.errors import SpecError
from synth.expression.course import minimum_jerk

Floats = NDArray[np.float64]


def moving_average(angles: npt.ArrayLike, boundaries: Iterable[int], *, window: int) -> Floats:
    """Return angles with a moving average at boundaries, and only there (MTAP 2013, section 5.4).

    Parameters
    ----------
    angles : array_like, shape (T, ...)
        Angles of each frame.
    boundaries : iterable of int
        Frames that begin something new.
    window : int
        Frames of the average, an odd number; 1 leaves all as it is. The frames that change are those whose window
        reaches across a boundary, so a jump becomes ``window`` equal steps.

    Raises
    ------
    SpecError
        If the window is not odd and positive.
    """
    if isinstance(window, bool) or not isinstance(window, int) or window < 1 or window % 2 == 0:
        raise SpecError(f"Head motion: the window is {window!r}, but must be an odd number of frames, 1 or more.")
    sequence = np.array(angles, dtype=np.float64)
    half = window // 2
    # Beyond the ends the first and last frame are taken to go on.
    averages = ndimage.uniform_filter1d(sequence, window, axis=0, mode="nearest")
    for boundary in boundaries:
        near = slice(max(0, boundary - half), boundary + half)
        sequence[near] = averages[near]
    return sequence


def glide(cycles: Sequence[Callable[[int, int], Floats]], edges: Sequence[int], *, width: float) -> Floats:
    """Return angles that pass from each unit's cycle to the next by minimum jerk.

    Around a boundary both cycles are carried on, and the weight of the second grows from 0 to 1 as the smoothest
    movement does. So neither a speed nor an acceleration jumps.

    Parameters
    ----------
    cycles : sequence of callable
        For each unit a function that returns its angles (stop - start, 3) from a first frame to, but without, a last,
        also outside of the unit.
    edges : sequence of int
        First frame of each unit, and at the end the number of frames: one more than there are cycles.
    width : float
        Frames that a passage takes, its middle at the boundary; less where a unit on one side is shorter, so that
        passages do not meet.

    Returns
    -------
    (T, 3) float64
        The angles.
    """
    angles = np.concatenate([cycle(*stretch) for cycle, stretch in zip(cycles, pairwise(edges), strict=True)])
    for k in range(1, len(cycles)):
        boundary = edges[k]
        half = 0.5 * min(width, boundary - edges[k - 1], edges[k + 1] - boundary)
        reach = int(half)
        first, stop = boundary - reach, boundary + reach
        if reach:
            progress = (np.arange(first, stop) - (boundary - 0.5)) / (2.0 * half) + 0.5
            rise = minimum_jerk(progress)[:, None]
            angles[first:stop] = (1.0 - rise) * cycles[k - 1](first, stop) + rise * cycles[k](first, stop)
    return angles
