"""Simulated raters: they answer the questionnaires as people with known perception and known noise would."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from evaluation.design.ordering import trial_order
from evaluation.errors import DataError
from evaluation.instruments.base import Item
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import RESPONSE_COLUMNS, input_pad
from evaluation.seeding import generator
from evaluation.study import StudySpec

RATER_SD: Mapping[str, float] = {"P": 0.20, "A": 0.32, "D": 0.30}
"""Standard deviation over raters of one face's ratings (Jia et al., 2013, section 2.4)."""

# How much the four items of a dimension disagree within one rater, in points of the nine-point scale; and how much
# raters differ in their opinion of one clip, in points of the five-point scale. Neither paper prints them; these are
# of the usual size.
_ITEM_SD = 0.6
_OPINION_SD = 0.8


def answer_pad12(pad: Sequence[float], *, rng: np.random.Generator) -> dict[str, int]:
    """Return one rater's answers to pad12 for a face.

    Parameters
    ----------
    pad : sequence of three float
        Pleasure, arousal and dominance that the face truly shows, each in [-1, 1].
    rng : numpy.random.Generator
        Source of the rater's noise.

    Returns
    -------
    dict of str to int
        Answer of each item, -4 to 4. The P, A and D scored from the answers of many raters have mean `pad` and standard
        deviation `RATER_SD`, except near the ends of the scale, where it cuts the noise off.

    Raises
    ------
    DataError
        If `pad` is not three numbers in [-1, 1].

    References
    ----------
    Jia et al. (2013), Eq. 13, turned round, with the noise of section 2.4.
    """
    if len(pad) != 3 or not all(-1 <= value <= 1 for value in pad):
        raise DataError(f"pad is {pad!r}, but must be three numbers from -1 to 1.")
    items = {item.id: item for item in PAD12.items}
    # Four items are summed and divided by 16, so their own noise and rounding (1/12) reach the score divided by 64.
    from_items = (_ITEM_SD**2 + 1 / 12) / 64
    answers = {}
    for score, value in zip(PAD12.scores, pad, strict=True):
        perceived = value + rng.normal(0, math.sqrt(RATER_SD[score.name] ** 2 - from_items))
        for item, weight in score.weights.items():
            answers[item] = _nearest(items[item], 4 * weight * perceived + rng.normal(0, _ITEM_SD))
    return {item: answers[item] for item in items}


def answer_mos5(quality: float, *, rng: np.random.Generator) -> dict[str, int]:
    """Return one rater's answer to mos5.

    Parameters
    ----------
    quality : float
        Mean opinion of the clip, 1 to 5.
    rng : numpy.random.Generator
        Source of the rater's noise (SD 0.8 before rounding).

    Returns
    -------
    dict of str to int
        The answer, 1 to 5.

    Raises
    ------
    DataError
        If `quality` is not a number from 1 to 5.

    References
    ----------
    The scale is that of Jia et al. (2013), section 5.4; the noise is an assumption of this module.
    """
    if not 1 <= quality <= 5:
        raise DataError(f"quality is {quality!r}, but must be a number from 1 to 5.")
    return {item.id: _nearest(item, quality + rng.normal(0, _OPINION_SD)) for item in MOS5.items}


def simulate_responses(
    spec: StudySpec, participants: int, *, seed: int, quality: Mapping[str, float] | None = None
) -> pd.DataFrame:
    """Return what a number of simulated participants answer in a study.

    Each participant sees the trials of `evaluation.design.ordering.trial_order`. A face shows its input PAD times the
    clip's intensity (1 if the clip has none); a clip without PAD is neutral.

    Parameters
    ----------
    spec : StudySpec
        A study whose instruments are among pad12 and mos5.
    participants : int
        How many; the first n of a larger number answer just the same.
    seed : int
        Seed of the raters' noise.
    quality : mapping of str to float, optional
        True mean opinion of each condition, 1 to 5; left out, from 2.5 for the first condition to 4 for the last.

    Returns
    -------
    pandas.DataFrame
        One row for each item, with the columns `evaluation.responses.RESPONSE_COLUMNS`.

    Raises
    ------
    DataError
        If the study uses another instrument.

    References
    ----------
    As `answer_pad12` and `answer_mos5`.
    """
    unknown = set(spec.instruments) - {PAD12.name, MOS5.name}
    if unknown:
        raise DataError(f"Simulated raters cannot answer {', '.join(sorted(unknown))}, only pad12 and mos5.")
    names = [condition.name for condition in spec.conditions]
    true_quality = quality or dict(zip(names, np.linspace(2.5, 4, len(names)).tolist(), strict=True))
    rows = []
    for index in range(participants):
        rng = generator(seed, "simulated rater", index)
        for trial, cell in enumerate(trial_order(spec, index), start=1):
            answers = {
                PAD12.name: answer_pad12(_shown_pad(spec, *cell), rng=rng),
                MOS5.name: answer_mos5(true_quality[cell.condition], rng=rng),
            }
            rows += [
                (index + 1, trial, cell.stimulus, cell.condition, name, item, raw)
                for name in spec.instruments
                for item, raw in answers[name].items()
            ]
    return pd.DataFrame(rows, columns=list(RESPONSE_COLUMNS))


def _shown_pad(spec: StudySpec, stimulus: str, condition: str) -> tuple[float, ...]:
    intensity = spec.clip_fields(stimulus, condition).get("intensity", 1.0)
    factor = float(intensity) if isinstance(intensity, (int, float)) else 1.0
    pad = input_pad(spec, stimulus, condition) or (0.0, 0.0, 0.0)
    return tuple(min(1.0, max(-1.0, value * factor)) for value in pad)


def _nearest(item: Item, value: float) -> int:
    return int(min(max(round(value), min(item.values)), max(item.values)))
