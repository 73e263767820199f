"""Features of head motion: peaks, valleys, Amp and Avg of words, extreme points and their distance (MTAP 2013, 3.1)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray
from scipy import signal

from synth.errors import SpecError

Floats = NDArray[np.float64]
Frames = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class WordFeatures:
    """Features of W stretches of a trajectory; the arrays are (W,), or (W, 3) if it has three axes.

    Attributes
    ----------
    peak, valley : float64
        Greatest and smallest angle; the peak of pitch is the lowest position of the head.
    amp : float64
        Distance between peak and valley.
    avg : float64
        Mean angle.
    peak_frame, valley_frame : int64
        The frame of the peak and of the valley, the first of several.
    """

    peak: Floats
    valley: Floats
    amp: Floats
    avg: Floats
    peak_frame: Frames
    valley_frame: Frames


@dataclass(frozen=True, eq=False)
class FrameStatistics:
    """Statistics over the frames of a trajectory; the arrays are (), or (3,) if it has three axes.

    Attributes
    ----------
    mean, sd, range : float64
        Mean, standard deviation (n - 1) and distance from the smallest to the greatest angle.
    """

    mean: Floats
    sd: Floats
    range: Floats


def word_features(angles: npt.ArrayLike, bounds: npt.ArrayLike) -> WordFeatures:
    """Return the features of each word.

    Parameters
    ----------
    angles : array_like, shape (T,) or (T, 3)
        The trajectory.
    bounds : array_like of int, shape (W, 2)
        Of each word its first frame, and the frame after its last.

    Raises
    ------
    SpecError
        If an array is malformed, or a word holds no frame or leaves the trajectory.
    """
    sequence = _trajectory(angles)
    edges = np.asarray(bounds)
    if edges.ndim != 2 or edges.shape[1] != 2 or not len(edges) or not np.issubdtype(edges.dtype, np.integer):
        raise SpecError(
            f"Head motion: the bounds of words have shape {edges.shape} and type {edges.dtype}, but must be whole "
            f"numbers (words, 2), at least one row."
        )
    for row, (start, stop) in enumerate(edges.tolist()):
        if not 0 <= start < stop <= len(sequence):
            raise SpecError(
                f"Head motion: word {row} goes from frame {start} to {stop}, but must hold a frame and lie within "
                f"0 to {len(sequence)}."
            )
    words = [sequence[start:stop] for start, stop in edges.tolist()]
    peak_frame = np.array([word.argmax(axis=0) + start for word, start in zip(words, edges[:, 0], strict=True)])
    valley_frame = np.array([word.argmin(axis=0) + start for word, start in zip(words, edges[:, 0], strict=True)])
    peak = np.array([word.max(axis=0) for word in words])
    valley = np.array([word.min(axis=0) for word in words])
    return WordFeatures(
        peak=peak,
        valley=valley,
        amp=peak - valley,
        avg=np.array([word.mean(axis=0) for word in words]),
        peak_frame=peak_frame.astype(np.int64),
        valley_frame=valley_frame.astype(np.int64),
    )


def frame_statistics(angles: npt.ArrayLike) -> FrameStatistics:
    """Return mean, standard deviation and range over all frames, at least two, of a trajectory (T,) or (T, 3).

    Raises
    ------
    SpecError
        If the trajectory is malformed or has one frame only.
    """
    sequence = _trajectory(angles)
    if len(sequence) < 2:
        raise SpecError("Head motion: one frame has no standard deviation; give at least two.")
    return FrameStatistics(
        mean=np.asarray(sequence.mean(axis=0)),
        sd=np.asarray(sequence.std(axis=0, ddof=1)),
        range=np.asarray(np.ptp(sequence, axis=0)),
    )


def extreme_points(angle: npt.ArrayLike, *, deviations: float = 1.0) -> Frames:
    """Return the frames of local extrema that lie at least so many standard deviations from the mean.

    Parameters
    ----------
    angle : array_like, shape (T,)
        One axis of a trajectory. Of an extremum that lasts several frames the middle one counts; the first and the
        last frame are none.
    deviations : float
        1 in the paper, "to avoid the abrupt shake with small amplitude".

    Returns
    -------
    (N,) int64
        Frames in order.

    Raises
    ------
    SpecError
        If the trajectory is malformed or `deviations` negative.
    """
    sequence = _trajectory(angle)
    if sequence.ndim != 1:
        raise SpecError("Head motion: extreme points are those of one axis; give a trajectory of shape (T,).")
    if not 0.0 <= deviations < np.inf:
        raise SpecError(f"Head motion: deviations is {deviations!r}, but must be a number, 0 or more.")
    found = np.sort(np.concatenate([signal.find_peaks(sequence)[0], signal.find_peaks(-sequence)[0]]))
    far = np.abs(sequence - sequence.mean()) >= deviations * sequence.std()
    return np.asarray(found[far[found]], dtype=np.int64)


def extreme_distance(angle: npt.ArrayLike, *, deviations: float = 1.0) -> float | None:
    """Return the mean distance between neighbouring extreme points in frames; None if there are fewer than two.

    The paper takes this distance as the period of the motion. For a sinusoid, whose peaks and valleys all count, it is
    half of what is commonly called its period.

    Raises
    ------
    SpecError
        As `extreme_points`.
    """
    found = extreme_points(angle, deviations=deviations)
    return float(np.diff(found).mean()) if len(found) > 1 else None


def _trajectory(angles: npt.ArrayLike) -> Floats:
    sequence = np.asarray(angles, dtype=np.float64)
    if sequence.ndim not in {1, 2} or (sequence.ndim == 2 and sequence.shape[1] != 3) or not len(sequence):
        raise SpecError(
            f"Head motion: the trajectory has shape {sequence.shape}, but must be (T,) or (T, 3), at least one frame."
        )
    if not np.isfinite(sequence).all():
        frame = int(np.argwhere(~np.isfinite(sequence))[0][0])
        raise SpecError(f"Head motion: an angle of frame {frame} is not a finite number.")
    return sequence
