"""What the paper prints about head motion: Tables 1 to 4 of MTAP 2013, and the sentence of its Table 2."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.head.annotation import SyllableText
from synth.head.words import ProsodicWord, evenly

Floats = NDArray[np.float64]

AXES = ("pitch", "yaw", "roll")
"""Order of the axes everywhere; positive is down, to the subject's left, to the subject's right (FAP 48, 49, 50)."""

FPS = 25
"""Frame rate of the paper's recording."""

SYLLABLE_TYPES = ("stressed", "falling", "first", "other")
"""Where a peak may lie, in the order in which they are told apart (MTAP 2013, section 3.2)."""


@dataclass(frozen=True, eq=False)
class RotationStatistics:
    """The rows of MTAP 2013, Table 3: three values each, for pitch, yaw and roll, in degrees.

    Attributes
    ----------
    angle_range, angle_sd : (3,) float64
        Range and standard deviation of the angle over frames.
    amp_mean, amp_sd : (3,) float64
        Of Amp, the distance between peak and valley in a prosodic word.
    avg_mean, avg_sd : (3,) float64
        Of Avg, the mean angle in a prosodic word.

    Raises
    ------
    SpecError
        If a row is not three finite numbers, or a range, an amplitude or a deviation is negative.
    """

    angle_range: Floats
    angle_sd: Floats
    amp_mean: Floats
    amp_sd: Floats
    avg_mean: Floats
    avg_sd: Floats

    def __post_init__(self) -> None:
        for name, low in (
            ("angle_range", 0.0),
            ("angle_sd", 0.0),
            ("amp_mean", 0.0),
            ("amp_sd", 0.0),
            ("avg_mean", -np.inf),
            ("avg_sd", 0.0),
        ):
            row = np.array(getattr(self, name), dtype=np.float64)
            if row.shape != (3,) or not np.isfinite(row).all() or (row < low).any():
                raise SpecError(
                    f"Head motion: {name} is {row.tolist()}, but must be three finite numbers (pitch, yaw, roll)"
                    f"{' of at least 0' if low == 0.0 else ''}."
                )
            row.flags.writeable = False
            object.__setattr__(self, name, row)


@cache
def printed() -> Mapping[str, Any]:
    """Return ``head_motion.json``: what the paper prints and what padlab assumes beside it."""
    text = resources.files("synth.data").joinpath("head_motion.json").read_text(encoding="utf-8")
    return MappingProxyType(json.loads(text))


@cache
def published_statistics() -> RotationStatistics:
    """Return MTAP 2013, Table 3."""
    return RotationStatistics(**{name: np.array(row) for name, row in printed()["rotation"].items()})


@cache
def published_counts() -> Mapping[tuple[float, float], int]:
    """Return MTAP 2013, Table 1: number of prosodic words by (P, A)."""
    rows = printed()["words_by_pa"]
    return MappingProxyType({(float(row["P"]), float(row["A"])): row["words"] for row in rows})


@cache
def published_peaks() -> Mapping[str, int]:
    """Return MTAP 2013, Table 4: number of pitch peaks by `SYLLABLE_TYPES`."""
    return MappingProxyType({name: printed()["peaks_by_syllable"][name] for name in SYLLABLE_TYPES})


def example_sentence(*, syllable_s: float | None = None, start_s: float = 0.4) -> tuple[ProsodicWord, ...]:
    """Return the sentence of MTAP 2013, Table 2, as it might be timed.

    The words and their (P, A) are the paper's. Times are not printed: every syllable lasts the paper's mean of 7.36
    frames, and a comma is a pause of 0.4 s.

    Parameters
    ----------
    syllable_s : float, optional
        Seconds of a syllable.
    start_s : float
        When the first word starts.
    """
    table = printed()
    each_s = table["syllable_frames"] / FPS if syllable_s is None else syllable_s
    words: list[ProsodicWord] = []
    now_s = start_s
    for clause in table["example"]["clauses"]:
        for row in clause:
            parts = [SyllableText.parse(written) for written in row["syllables"].split()]
            end_s = now_s + each_s * len(parts)
            syllables = evenly([(part.text, part.tone, part.stressed) for part in parts], now_s, end_s)
            words.append(ProsodicWord(row["text"], now_s, end_s, row["P"], row["A"], syllables))
            now_s = end_s
        now_s += table["example"]["pause_s"]
    return tuple(words)
