"""Synthetic head motion: one cycle of a sinusoid in each prosodic word and each silence (MTAP 2013, section 3.3).

Angles are in degrees, in the order pitch, yaw, roll; positive is down, to the subject's left, to the subject's right,
as FAP 48, 49 and 50 have it. This is also the paper's sign of pitch: it calls the lowest position of the head the
peak, and Eq. 1 is greatest there. (So the mean Avg of -5.09 degrees says that its speaker held her head raised.)
"""

from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, column
from synth.head.amplitude import AmplitudeModel, default_model
from synth.head.published import AXES, FPS, RotationStatistics, published_statistics
from synth.head.smoothing import glide, moving_average
from synth.head.words import MIN_SILENCE_S, ProsodicWord, Unit, check_words, first_frame, units

Floats = NDArray[np.float64]

KINDS = ("prosodic", "random", "static")
"""Kinds of head motion: by text, the random baseline of MTAP 2013, Table 9, and none."""

HEAD_FAPS = (48, 49, 50)
"""The parameters of pitch, yaw and roll."""

TRANSITIONS = {"average": 0.2, "glide": 0.5}
"""How one unit passes into the next, and in how many seconds: the paper's moving average of five frames at 25 per
second, and a smoother way of padlab's own."""

_EYE_YAW_FAPS = (23, 24)
_EYE_PITCH_FAPS = (25, 26)
_FAP_PER_DEGREE = np.pi / 180.0 * 1e5  # the unit of angles, AU, is 1e-5 rad


@dataclass(frozen=True, slots=True)
class UnitMotion:
    """How one word or silence moves: the lineage of its frames.

    Attributes
    ----------
    text : str
        The word; empty for silence.
    start, stop : int
        First frame, and the frame after the last.
    P, A : float
        Pleasure and arousal.
    rule : str
        What placed the peak of pitch: "stressed", "falling" or "first" syllable, "silence", "random".
    amp, avg : tuple of float
        Amplitude and average position in degrees: pitch, yaw, roll.
    peak : tuple of int
        Frame of the peak of each axis, counted from 0 in the whole sequence.
    """

    text: str
    start: int
    stop: int
    P: float
    A: float
    rule: str
    amp: tuple[float, float, float]
    avg: tuple[float, float, float]
    peak: tuple[int, int, int]

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as plain JSON values."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


@dataclass(frozen=True, eq=False)
class HeadMotion:
    """A head's motion.

    Attributes
    ----------
    kind : {"prosodic", "random", "static"}
        How it was made.
    fps : float
        Frames per second.
    angles : (T, 3) float64
        Pitch, yaw and roll in degrees.
    units : tuple of UnitMotion
        Words and silences in order; empty for a static head.
    """

    kind: str
    fps: float
    angles: Floats
    units: tuple[UnitMotion, ...]

    @property
    def largest_speed(self) -> Floats:
        """Largest change of each angle from one frame to the next, in degrees per second: (3,)."""
        if len(self.angles) < 2:
            return np.zeros(3)
        return np.asarray(np.abs(np.diff(self.angles, axis=0)).max(axis=0) * self.fps, dtype=np.float64)

    def lineage(self) -> list[dict[str, Any]]:
        """Return the units as plain JSON values."""
        return [unit.to_dict() for unit in self.units]


def sinusoid(t: npt.ArrayLike, period: int, peak: int, *, amp: float, avg: float) -> Floats:
    """Return ``y_t = Amp/2 sin(2 pi/T (t - t_peak) + pi/2) + Avg`` (MTAP 2013, Eq. 1).

    Parameters
    ----------
    t : array_like
        Frames, counted from 1; those of a word are 1 to T.
    period : int
        T, frames of the word, at least 1.
    peak : int
        t_peak, counted from 1.
    amp, avg : float
        Distance from valley to peak, and mean.

    Returns
    -------
    float64 array of the shape of t
        The angles, ``Avg + Amp/2`` at the peak.

    Raises
    ------
    SpecError
        If the period is not positive.
    """
    if not period >= 1:
        raise SpecError(f"Head motion: the period is {period!r}, but must be a number of frames, 1 or more.")
    phase = 2.0 * np.pi / period * (np.asarray(t, dtype=np.float64) - peak)
    return np.asarray(0.5 * amp * np.sin(phase + 0.5 * np.pi) + avg, dtype=np.float64)


def head_motion(
    words: Iterable[ProsodicWord],
    *,
    rng: np.random.Generator,
    kind: str = "prosodic",
    fps: float = FPS,
    duration_s: float | None = None,
    model: AmplitudeModel | None = None,
    statistics: RotationStatistics | None = None,
    placed_axes: Collection[str] = ("pitch",),
    transition: str = "average",
    transition_s: float | None = None,
    min_silence_s: float = MIN_SILENCE_S,
    max_speed: float | None = None,
) -> HeadMotion:
    """Make the head's motion for a sequence of prosodic words.

    Each word and each silence has one cycle of Eq. 1 on each axis. The prosodic kind takes Amp from Eq. 2 and draws
    Avg from a normal distribution with mean and SD of Table 3; the peak lies in the middle of the first stressed
    syllable, else of the first syllable with falling tone, else of the first syllable; in silence in its middle.
    The random kind (Table 9, note a) draws Amp and Avg evenly from mean - SD to mean + SD of Table 3 and the peak
    evenly from the frames of the unit, and knows nothing of the text but the boundaries. The static head stays at 0.

    Parameters
    ----------
    words : iterable of ProsodicWord
        In order, without overlap.
    rng : numpy.random.Generator
        What is drawn comes from here.
    kind : {"prosodic", "random", "static"}
        How the head moves.
    fps : float
        Frames per second.
    duration_s : float, optional
        Length of the sequence; by default it ends with the last word.
    model : AmplitudeModel, optional
        Eq. 2; by default fitted to the paper's printed statistics.
    statistics : RotationStatistics, optional
        By default Table 3.
    placed_axes : collection of str
        Axes whose peak the rules place; on the others it is drawn evenly from the frames of the unit. The rules stem
        from nods, and one phase for all three axes would make them move as one (correlations near 0.4, where the paper
        finds less than 0.3): by default, pitch only.
    transition : {"average", "glide"}
        How a unit passes into the next: the paper's moving average, which turns a jump into a straight ramp, or a
        passage by minimum jerk between the two cycles carried on, without corners.
    transition_s : float, optional
        Seconds of the passage, by default 0.2 for the average (rounded to an odd number of frames) and 0.5 for the
        glide; 0 for none.
    min_silence_s : float
        Shortest pause that is silence; shorter gaps belong to the word before.
    max_speed : float, optional
        Degrees per second that Eq. 1 may reach, ``pi Amp fps / T``; Amp is lowered to it in short units. By default no
        limit, as in the paper, whose words last 1.2 seconds.

    Raises
    ------
    SpecError
        If an argument is malformed, or a word ends after the sequence.
    """
    spoken = check_words(words)
    if kind not in KINDS:
        raise SpecError(f"Head motion: there is no kind {kind!r}; there are {', '.join(KINDS)}.")
    # The bounds keep a slip of the unit (milliseconds) from asking for hours of memory.
    _check_number("fps", fps, 1.0, 1000.0)
    _check_number("duration_s", duration_s, 0.0, 86400.0)
    if transition not in TRANSITIONS:
        raise SpecError(f"Head motion: there is no transition {transition!r}; there are {', '.join(TRANSITIONS)}.")
    _check_number("transition_s", transition_s, 0.0, 10.0)
    _check_number("min_silence_s", min_silence_s, 0.0, 10.0)
    _check_number("max_speed", max_speed, 1.0, 10000.0)
    unknown = [axis for axis in placed_axes if axis not in AXES]
    if unknown:
        raise SpecError(f"Head motion: there is no axis {unknown[0]!r}; the axes are {', '.join(AXES)}.")
    if duration_s is None:
        if not spoken:
            raise SpecError("Head motion: there are no words; give at least one, or duration_s.")
        duration_s = spoken[-1].end_s
    frames = max(1, first_frame(duration_s, fps))
    if kind == "static":
        return HeadMotion(kind=kind, fps=fps, angles=np.zeros((frames, 3)), units=())
    table = statistics or published_statistics()
    stretches = units(spoken, fps=fps, frames=frames, min_silence_s=min_silence_s)
    if kind == "random":
        moves = [_random_motion(unit, table, rng) for unit in stretches]
    else:
        chosen = model or default_model()
        amps = chosen.predict([unit.P for unit in stretches], [unit.A for unit in stretches])
        placed = np.array([axis in placed_axes for axis in AXES])
        moves = [
            _prosodic_motion(unit, amp, table, rng, peak=_placed_peak(unit, fps), placed=placed)
            for unit, amp in zip(stretches, amps, strict=True)
        ]
    if max_speed is not None:
        moves = [_slowed(move, max_speed * (move.stop - move.start) / (np.pi * fps)) for move in moves]
    width = fps * (TRANSITIONS[transition] if transition_s is None else transition_s)
    angles = _joined(moves, transition=transition, width=width)
    return HeadMotion(kind=kind, fps=fps, angles=angles, units=tuple(moves))


def head_track(angles: npt.ArrayLike, *, keep_gaze: bool = False) -> Floats:
    """Return FAPs (T, 68) that turn the head by angles (T, 3) in degrees.

    Parameters
    ----------
    angles : array_like, shape (T, 3)
        Pitch, yaw and roll.
    keep_gaze : bool
        Whether the eyes turn back as far as the head turns, so that they stay on the camera, as those of the paper's
        speaker did. Otherwise nothing else moves.

    Raises
    ------
    SpecError
        If the angles have another shape or are not finite.
    """
    sequence = np.asarray(angles, dtype=np.float64)
    if sequence.ndim != 2 or sequence.shape[1] != 3:
        raise SpecError(f"Head motion: the angles have shape {sequence.shape}, but must be (frames, 3).")
    if not np.isfinite(sequence).all():
        raise SpecError("Head motion: an angle is not a finite number.")
    steps = sequence * _FAP_PER_DEGREE
    track = np.zeros((len(sequence), FAP_COUNT))
    track[:, [column(fap) for fap in HEAD_FAPS]] = steps
    if keep_gaze:
        track[:, [column(fap) for fap in _EYE_YAW_FAPS]] = -steps[:, [1, 1]]
        track[:, [column(fap) for fap in _EYE_PITCH_FAPS]] = -steps[:, [0, 0]]
    return track + 0.0


def _prosodic_motion(
    unit: Unit,
    amp: Floats,
    table: RotationStatistics,
    rng: np.random.Generator,
    *,
    peak: tuple[str, int],
    placed: NDArray[np.bool_],
) -> UnitMotion:
    avg = rng.normal(table.avg_mean, table.avg_sd)
    drawn = rng.integers(unit.start, unit.stop, size=3)
    rule, at = peak
    return _unit_motion(unit, rule, amp, avg, np.where(placed, at, drawn))


def _random_motion(unit: Unit, table: RotationStatistics, rng: np.random.Generator) -> UnitMotion:
    amp = rng.uniform(np.maximum(table.amp_mean - table.amp_sd, 0.0), table.amp_mean + table.amp_sd)
    avg = rng.uniform(table.avg_mean - table.avg_sd, table.avg_mean + table.avg_sd)
    return _unit_motion(unit, "random", amp, avg, rng.integers(unit.start, unit.stop, size=3))


def _placed_peak(unit: Unit, fps: float) -> tuple[str, int]:
    """Return the rule that places the peak, and the peak's frame."""
    if unit.word is None:
        return "silence", (unit.start + unit.stop - 1) // 2
    syllables = unit.word.syllables
    rule, start_s, end_s = "first", unit.word.start_s, unit.word.end_s
    if syllables:
        stressed = [syllable for syllable in syllables if syllable.stressed]
        falling = [syllable for syllable in syllables if syllable.falling]
        rule = "stressed" if stressed else "falling" if falling else "first"
        chosen = (stressed or falling or list(syllables))[0]
        start_s, end_s = chosen.start_s, chosen.end_s
    first, stop = first_frame(start_s, fps), first_frame(end_s, fps)
    return rule, min(max((first + stop - 1) // 2, unit.start), unit.stop - 1)


def _unit_motion(unit: Unit, rule: str, amp: Floats, avg: Floats, peak: NDArray[np.int64]) -> UnitMotion:
    return UnitMotion(
        text="" if unit.word is None else unit.word.text,
        start=unit.start,
        stop=unit.stop,
        P=unit.P,
        A=unit.A,
        rule=rule,
        amp=_three(amp),
        avg=_three(avg),
        peak=(int(peak[0]), int(peak[1]), int(peak[2])),
    )


def _slowed(move: UnitMotion, largest_amp: float) -> UnitMotion:
    amp = _three(np.minimum(move.amp, largest_amp))
    return UnitMotion(
        move.text, move.start, move.stop, move.P, move.A, move.rule, amp=amp, avg=move.avg, peak=move.peak
    )


def _joined(moves: list[UnitMotion], *, transition: str, width: float) -> Floats:
    if transition == "glide":
        edges = [*(move.start for move in moves), moves[-1].stop]
        return glide([partial(_cycle, move) for move in moves], edges, width=width)
    raw = np.concatenate([_cycle(move, move.start, move.stop) for move in moves])
    return moving_average(raw, [move.start for move in moves[1:]], window=2 * max(0, round((width - 1.0) / 2.0)) + 1)


def _cycle(move: UnitMotion, first: int, stop: int) -> Floats:
    """Return the unit's angles in frames ``first`` to ``stop``, carried on where these lie outside of it."""
    t = np.arange(first, stop) - move.start + 1
    axes = zip(move.peak, move.amp, move.avg, strict=True)
    return np.stack(
        [sinusoid(t, move.stop - move.start, peak - move.start + 1, amp=amp, avg=avg) for peak, amp, avg in axes],
        axis=1,
    )


def _three(values: Floats) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _check_number(name: str, value: float | None, low: float, high: float) -> None:
    if value is not None and (isinstance(value, bool) or not low <= value <= high):
        raise SpecError(f"Head motion: {name} is {value!r}, but must be a number from {low:g} to {high:g}.")
