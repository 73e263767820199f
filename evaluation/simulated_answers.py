"""How simulated raters answer an instrument: as people with known perception and known noise would."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from evaluation.errors import DataError
from evaluation.instruments import Answer, ChoiceItem, Instrument, Item, TextItem
from evaluation.instruments.emotion14 import EMOTION14
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12
from evaluation.instruments.paired import PAIRED
from evaluation.statistics.arrays import FloatArray
from evaluation.study import load_bundled

DIMENSIONS = ("P", "A", "D")

RATER_SD: Mapping[str, float] = {"P": 0.20, "A": 0.32, "D": 0.30}
"""Standard deviation over raters of one face's ratings (Jia et al., 2013, section 2.4)."""

PERCEPTION_SD: Mapping[str, float] = {"P": 0.187, "A": 0.316, "D": 0.290}
"""Noise of a direct rating before it is rounded to five points; `evaluation.simulate.annotate_pad` says whence."""

# How much the four items of a dimension disagree within one rater, in points of the nine-point scale; and how much
# raters differ in their opinion of one clip, in points of the five-point scale. Neither paper prints them; these are
# of the usual size.
_ITEM_SD = 0.6
_OPINION_SD = 0.8
_MARKED = 0.3
_PLACED = re.compile(r"(.+)-([1-9][0-9]*)")


@dataclass(frozen=True)
class _Perceived:
    """What a rater sees in one clip: pleasure, arousal and dominance, and quality from -1 (bad) to 1 (excellent)."""

    pad: Mapping[str, float]
    quality: float


def answer_instrument(
    instrument: Instrument, pad: npt.ArrayLike, quality: float | Sequence[float], *, rng: np.random.Generator
) -> dict[str, Answer]:
    """Return one rater's answers to any instrument, keyed: as if no poles had changed sides.

    Parameters
    ----------
    instrument : Instrument
        A bundled or own one, as one trial asks it: with the items of each clip or word (``P-3``) if it has such.
    pad : array_like, shape (3,) or (clips, 3)
        Pleasure, arousal and dominance that the clip, or each clip, truly shows, in [-1, 1].
    quality : float or sequence of float
        Mean opinion of the clip, or of each, 1 to 5.
    rng : numpy.random.Generator
        Source of the rater's noise.

    Returns
    -------
    dict of str to answer
        An answer to each item that needs one, and to those that may be left out but for free texts; in the order of
        the items. `Instrument.validate` takes them.

    Raises
    ------
    DataError
        If `pad` or `quality` is out of range.

    Notes
    -----
    pad12 and mos5 are answered by `answer_pad12` and `answer_mos5`. Items called P, A or D are rated directly, as
    `evaluation.simulate.annotate_pad` describes; emotion14 gets the word whose PAD in Jia et al. (2013), Table 8, is
    nearest to what the rater perceives; paired the clip that the rater finds better. Other items with numbers follow
    the quality, reversed if the instrument's scores subtract them; other choices are drawn at random. Words are all
    perceived alike, as the first clip.
    """
    pads = np.atleast_2d(np.asarray(pad, dtype=float))
    qualities = np.atleast_1d(np.asarray(quality, dtype=float))
    if pads.ndim != 2 or pads.shape[1] != len(DIMENSIONS) or not (np.abs(pads) <= 1).all() or not len(pads):
        raise DataError(f"pad is {pad!r}, but must be three numbers from -1 to 1, for each clip.")
    if qualities.ndim != 1 or not qualities.size or not ((qualities >= 1) & (qualities <= 5)).all():
        raise DataError(f"quality is {quality!r}, but must be a number from 1 to 5, for each clip.")
    ids = [item.id for item in instrument.items]
    if instrument.name == PAD12.name and ids == [item.id for item in PAD12.items]:
        return dict(answer_pad12(pads[0].tolist(), rng=rng))
    if instrument.name == MOS5.name and ids == [item.id for item in MOS5.items]:
        return dict(answer_mos5(float(qualities[0]), rng=rng))
    number = max(len(pads), len(qualities))
    clips = [_perceive(pads[min(k, len(pads) - 1)], qualities[min(k, len(qualities) - 1)], rng) for k in range(number)]
    answers = {item.id: _answer(instrument, item, clips, rng) for item in instrument.items}
    return {item: answer for item, answer in answers.items() if answer is not None}


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


def _perceive(pad: FloatArray, quality: float, rng: np.random.Generator) -> _Perceived:
    noise = dict(zip(DIMENSIONS, rng.standard_normal(len(DIMENSIONS)).tolist(), strict=True))
    seen = {name: value + PERCEPTION_SD[name] * noise[name] for name, value in zip(DIMENSIONS, pad, strict=True)}
    return _Perceived(seen, (float(quality) + rng.normal(0, _OPINION_SD) - 3) / 2)


def _answer(instrument: Instrument, item: Item, clips: Sequence[_Perceived], rng: np.random.Generator) -> Answer | None:
    placed = _PLACED.fullmatch(item.id)
    place = int(placed[2]) if placed else 1
    clip = clips[min(place, len(clips)) - 1] if len(clips) > 1 else clips[0]
    if isinstance(item, TextItem):
        return "A simulated answer"[: item.max_length] if item.required else None
    if isinstance(item, ChoiceItem):
        return _choice(instrument, item, clips, clip, rng)
    return _number(instrument, item, placed[1] if placed else item.id, clip, rng)


def _choice(
    instrument: Instrument, item: ChoiceItem, clips: Sequence[_Perceived], clip: _Perceived, rng: np.random.Generator
) -> Answer:
    if item.multiple:
        marked = [value for value in sorted(item.values) if rng.random() < _MARKED]
        return tuple(marked or [item.values[int(rng.integers(len(item.values)))]])
    if instrument.name == PAIRED.name and len(clips) > 1:
        return item.values[0] if clips[0].quality >= clips[1].quality else item.values[1]
    if instrument.name == EMOTION14.name:
        words = _word_pads()
        return min(item.options, key=lambda option: _distance(words.get(option.label["en"]), clip)).value
    return item.values[int(rng.integers(len(item.values)))]


def _number(instrument: Instrument, item: Item, name: str, clip: _Perceived, rng: np.random.Generator) -> int:
    if name in clip.pad:
        position = clip.pad[name]
    else:
        weights = [score.weights[item.id] for score in instrument.scores if item.id in score.weights]
        sign = -1 if weights and weights[0] < 0 else 1
        position = sign * clip.quality + rng.normal(0, _ITEM_SD / 4)
    low, high = min(item.values), max(item.values)
    wanted = (low + high) / 2 + position * (high - low) / 2
    return min(item.values, key=lambda value: abs(value - wanted))


@cache
def _word_pads() -> Mapping[str, tuple[float, ...]]:
    """Return the PAD of emotion14's words: those of MTAP 2013, Table 8, which the study of that name shows."""
    found = {}
    for stimulus in load_bundled("mtap-2013-reverse-pad").stimuli:
        pad = stimulus.clip.get("pad")
        if isinstance(pad, list):
            found[stimulus.label["en"]] = tuple(float(value) for value in pad if isinstance(value, int | float))
    return found


def _distance(pad: tuple[float, ...] | None, clip: _Perceived) -> float:
    return math.inf if pad is None else math.dist(pad, tuple(clip.pad.values()))


def _nearest(item: Item, value: float) -> int:
    return int(min(max(round(value), min(item.values)), max(item.values)))
