"""Statistics of an annotated recording: MTAP 2013, Tables 1, 3 and 4 and Figure 6, and the fit of Eq. 2."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.head.amplitude import AmplitudeModel, AmplitudeSample
from synth.head.features import extreme_distance, extreme_points, frame_statistics, word_features
from synth.head.published import AXES, FPS, SYLLABLE_TYPES, RotationStatistics
from synth.head.words import MIN_SILENCE_S, ProsodicWord, Unit, check_words, first_frame, units

Floats = NDArray[np.float64]
PA = tuple[float, float]


@dataclass(frozen=True, eq=False)
class RecordingStatistics:
    """What an annotated recording says.

    Attributes
    ----------
    fps : float
        Frames per second.
    frames, words, syllables : int
        How many there are.
    counts : mapping of (P, A) to int
        Table 1: number of prosodic words, in ascending order.
    rotation : RotationStatistics
        Table 3; standard deviations with n - 1.
    mean_amp : mapping of (P, A) to (3,) float64
        Figure 6: mean Amp of pitch, yaw and roll; (0, -0.5) is silence between words, if there is any.
    peaks : mapping of str to int
        Table 4: words by the kind of syllable (`SYLLABLE_TYPES`) in which the peak of pitch lies.
    correlations : (3, 3) float64
        Pearson's correlation between the axes over frames; nan where an axis does not move.
    extreme_points : int
        Extreme points of pitch, at least one standard deviation from its mean.
    extreme_distance : float or None
        Their mean distance in frames.
    model : AmplitudeModel or None
        Eq. 2 fitted to words and silences.
    model_fault : str
        Why there is none.
    """

    fps: float
    frames: int
    words: int
    syllables: int
    counts: Mapping[PA, int]
    rotation: RotationStatistics
    mean_amp: Mapping[PA, Floats]
    peaks: Mapping[str, int]
    correlations: Floats
    extreme_points: int
    extreme_distance: float | None
    model: AmplitudeModel | None
    model_fault: str

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain JSON values."""
        table = self.rotation
        names = ("angle_range", "angle_sd", "amp_mean", "amp_sd", "avg_mean", "avg_sd")
        percent = percentages(tuple(self.counts.values()))
        return {
            "fps": self.fps,
            "frames": self.frames,
            "words": self.words,
            "syllables": self.syllables,
            "words_by_pa": [
                {"P": P, "A": A, "words": n, "percent": share}
                for ((P, A), n), share in zip(self.counts.items(), percent, strict=True)
            ],
            "rotation": {name: dict(zip(AXES, getattr(table, name).tolist(), strict=True)) for name in names},
            "mean_amp": [
                {"P": P, "A": A, **dict(zip(AXES, row.tolist(), strict=True))} for (P, A), row in self.mean_amp.items()
            ],
            "peaks_by_syllable": dict(self.peaks),
            "correlations": [[None if np.isnan(r) else float(r) for r in row] for row in self.correlations],
            "extreme_points": self.extreme_points,
            "extreme_distance_frames": self.extreme_distance,
            "coefficients": None if self.model is None else self.model.coefficients.tolist(),
            "coefficients_fault": self.model_fault or None,
        }


def percentages(counts: Sequence[int]) -> list[float]:
    """Return the share of each count in percent, to one decimal as the paper prints it; all 0 if there are none."""
    total = sum(counts)
    return [round(100.0 * count / total, 1) if total else 0.0 for count in counts]


def recording_statistics(
    angles: npt.ArrayLike,
    words: Iterable[ProsodicWord],
    *,
    fps: float = FPS,
    first: int = 0,
    min_silence_s: float = MIN_SILENCE_S,
) -> RecordingStatistics:
    """Return the statistics of a recording.

    Parameters
    ----------
    angles : array_like, shape (T, 3)
        Pitch, yaw and roll in degrees; positive is down, to the subject's left, to the subject's right.
    words : iterable of ProsodicWord
        The annotation, at least two words.
    fps : float
        Frames per second.
    first : int
        Number of the first frame of ``angles``, if the words' times count from an earlier one.
    min_silence_s : float
        Shortest pause between words that is silence.

    Raises
    ------
    SpecError
        If the angles or words are malformed, or a word holds no frame or leaves the recording.
    """
    spoken = check_words(words)
    if len(spoken) < 2:
        raise SpecError(f"Recording: {len(spoken)} annotated word is too few; statistics need at least 2.")
    sequence = np.asarray(angles, dtype=np.float64)
    over_frames = frame_statistics(sequence)
    if sequence.ndim != 2:
        raise SpecError("Recording: there is one axis only; give pitch, yaw and roll, shape (T, 3).")
    bounds = _bounds(spoken, len(sequence), fps=fps, first=first)
    features = word_features(sequence, bounds)
    sample = amplitude_sample(sequence, spoken, fps=fps, first=first, min_silence_s=min_silence_s)
    pairs = list(zip(sample.P.tolist(), sample.A.tolist(), strict=True))
    model, fault = _fit(sample)
    kinds = Counter(
        syllable_type(word, int(frame) + first, fps=fps)
        for word, frame in zip(spoken, features.peak_frame[:, 0], strict=True)
    )
    return RecordingStatistics(
        fps=fps,
        frames=len(sequence),
        words=len(spoken),
        syllables=sum(len(word.syllables) for word in spoken),
        counts=dict(sorted(Counter((word.P + 0.0, word.A + 0.0) for word in spoken).items())),
        rotation=RotationStatistics(
            angle_range=over_frames.range,
            angle_sd=over_frames.sd,
            amp_mean=features.amp.mean(axis=0),
            amp_sd=features.amp.std(axis=0, ddof=1),
            avg_mean=features.avg.mean(axis=0),
            avg_sd=features.avg.std(axis=0, ddof=1),
        ),
        mean_amp={
            pair: sample.amplitudes[[other == pair for other in pairs]].mean(axis=0) for pair in sorted(set(pairs))
        },
        peaks={name: kinds[name] for name in SYLLABLE_TYPES},
        correlations=_correlations(sequence, over_frames.range > 0.0),
        extreme_points=len(extreme_points(sequence[:, 0])),
        extreme_distance=extreme_distance(sequence[:, 0]),
        model=model,
        model_fault=fault,
    )


def amplitude_sample(
    angles: npt.ArrayLike,
    words: Iterable[ProsodicWord],
    *,
    fps: float = FPS,
    first: int = 0,
    min_silence_s: float = MIN_SILENCE_S,
) -> AmplitudeSample:
    """Return P, A and Amp of the words and of the silences between them, for `AmplitudeModel.fit`.

    Parameters and errors are those of `recording_statistics`.
    """
    spoken = check_words(words)
    sequence = np.asarray(angles, dtype=np.float64)
    bounds = _bounds(spoken, len(sequence), fps=fps, first=first)
    silences = _silences(spoken, fps=fps, min_silence_s=min_silence_s)
    inner = [[unit.start - first, unit.stop - first] for unit in silences]
    P = np.array([*(word.P for word in spoken), *(unit.P for unit in silences)]) + 0.0
    A = np.array([*(word.A for word in spoken), *(unit.A for unit in silences)]) + 0.0
    return AmplitudeSample(
        P=P,
        A=A,
        amplitudes=word_features(sequence, [*bounds, *inner]).amp,
        spoken=np.arange(len(P)) < len(spoken),
    )


def syllable_type(word: ProsodicWord, frame: int, *, fps: float) -> str:
    """Return in what kind of syllable a frame lies: "stressed", "falling", "first" or "other".

    The kinds exclude each other in this order (MTAP 2013, section 3.2). A frame outside of all syllables is "other".

    Parameters
    ----------
    word : ProsodicWord
        The word; without syllables it counts as one plain syllable.
    frame : int
        Frame, counted as the word's times are.
    fps : float
        Frames per second.
    """
    if not word.syllables:
        return "first"
    for k, syllable in enumerate(word.syllables):
        if first_frame(syllable.start_s, fps) <= frame < first_frame(syllable.end_s, fps):
            if syllable.stressed:
                return "stressed"
            if syllable.falling:
                return "falling"
            return "first" if k == 0 else "other"
    return "other"


def _bounds(words: tuple[ProsodicWord, ...], frames: int, *, fps: float, first: int) -> list[list[int]]:
    bounds = []
    for word in words:
        start, stop = first_frame(word.start_s, fps), first_frame(word.end_s, fps)
        if not first <= start < stop <= first + frames:
            raise SpecError(
                f"Recording: the word {word.text!r} goes from frame {start} to {stop}, but must hold a frame and lie "
                f"within the angles, frames {first} to {first + frames}."
            )
        bounds.append([start - first, stop - first])
    return bounds


def _silences(words: tuple[ProsodicWord, ...], *, fps: float, min_silence_s: float) -> list[Unit]:
    """Return the silences between words; what comes before the first and after the last is no pause in speech."""
    divided = units(words, fps=fps, frames=first_frame(words[-1].end_s, fps), min_silence_s=min_silence_s)
    return [unit for k, unit in enumerate(divided) if unit.word is None and k > 0]


def _fit(sample: AmplitudeSample) -> tuple[AmplitudeModel | None, str]:
    try:
        return AmplitudeModel.fit(sample.P, sample.A, sample.amplitudes), ""
    except SpecError as error:
        return None, str(error)


def _correlations(angles: Floats, moves: NDArray[np.bool_]) -> Floats:
    """Return Pearson's correlations, nan for an axis that does not move."""
    correlations = np.full((3, 3), np.nan)
    moving = np.flatnonzero(moves)
    if len(moving):
        correlations[np.ix_(moving, moving)] = np.corrcoef(angles[:, moving].T)
    return correlations
