"""Simulated raters: they answer the questionnaires as people with known perception and known noise would."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.annotation.rounds import SHARE, IntArray, Round, annotate, combine, times_rated
from evaluation.design.ordering import trial_order
from evaluation.errors import DataError
from evaluation.instruments.base import Item
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import DIMENSIONS, RESPONSE_COLUMNS, input_pad
from evaluation.seeding import generator
from evaluation.statistics.agreement import AnnotationAgreement, annotation_agreement
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array
from evaluation.study import StudySpec

RATER_SD: Mapping[str, float] = {"P": 0.20, "A": 0.32, "D": 0.30}
"""Standard deviation over raters of one face's ratings (Jia et al., 2013, section 2.4)."""

PAD_SPREAD: Mapping[str, float] = {"P": 0.485, "A": 0.310, "D": 0.238}
"""Standard deviation over faces of their true PAD that the printed agreement implies; see `annotate_pad`."""

# Noise of a direct rating before it is rounded to five points; `annotate_pad` says where it comes from.
_PERCEPTION_SD: Mapping[str, float] = {"P": 0.187, "A": 0.316, "D": 0.290}

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


def annotate_pad(pad: npt.ArrayLike, *, raters: int = 5, rng: np.random.Generator) -> FloatArray:
    """Return the direct five-point ratings that simulated annotators give to faces.

    Parameters
    ----------
    pad : array_like, shape (n, 3)
        True pleasure, arousal and dominance of each face, each in [-1, 1].
    raters : int
        Number of annotators, at least 1.
    rng : numpy.random.Generator
        Source of their noise.

    Returns
    -------
    numpy.ndarray, shape (n, raters, 3)
        Ratings, each -1, -0.5, 0, 0.5 or 1.

    Raises
    ------
    DataError
        If `pad` is no table of three columns from -1 to 1, or `raters` is not positive.

    Notes
    -----
    An annotator perceives the true value plus normal noise, independent between annotators, faces and dimensions, and
    gives the nearest of the five points. Two printed numbers for each dimension, the mean over faces of the standard
    deviation (n - 1) over five annotators and the mean pairwise correlation, determine two unknown ones: the SD of the
    noise (P 0.187, A 0.316, D 0.290) and, for normally distributed true values around 0, cut off at -1 and 1, their SD
    (`PAD_SPREAD`). The expectations are sums over all ways in which five annotators can fall on five points, integrated
    over the true values, and the two equations were solved for the two unknowns. On such faces the simulated ratings
    have the printed agreement; on others the SD differs by how near their values are to the five points, and the
    correlation by their spread.

    References
    ----------
    Jia et al. (2013), section 2.4: SD 0.20, 0.32, 0.30 and r 0.80, 0.44, 0.35 for P, A and D.
    """
    true = finite_array(pad, axes=("faces", "dimensions"), name="pad")
    if true.shape[1] != len(DIMENSIONS) or (np.abs(true) > 1).any():
        raise DataError("pad must have three columns, P, A and D, with values from -1 to 1.")
    if raters < 1:
        raise DataError(f"raters is {raters}, but must be at least 1.")
    noise = np.array([_PERCEPTION_SD[dimension] for dimension in DIMENSIONS])
    perceived = true[:, None, :] + noise * rng.standard_normal((len(true), raters, len(DIMENSIONS)))
    # Adding 0.0 turns -0.0 into 0.0.
    ratings: FloatArray = np.clip(np.round(2 * perceived), -2, 2) / 2 + 0.0
    return ratings


@dataclass(frozen=True, kw_only=True, eq=False)
class IncrementalAnnotation:
    """What incremental annotation came to.

    Attributes
    ----------
    pad : numpy.ndarray, shape (n, 3)
        Mean ratings of each face, over annotators and rounds.
    ratings : numpy.ndarray, shape (n, raters, 3)
        Each annotator's mean over rounds.
    times : numpy.ndarray of int, shape (n,)
        In how many rounds each face was rated.
    rounds : tuple of Round
        What was rated in each round, and how.
    agreement : AnnotationAgreement
        Agreement of `ratings`.
    """

    pad: FloatArray
    ratings: FloatArray
    times: IntArray
    rounds: tuple[Round, ...]
    agreement: AnnotationAgreement


def annotate_incrementally(
    pad: npt.ArrayLike,
    *,
    raters: int = 5,
    sets: int = 5,
    share: float = SHARE,
    rule: str = "mean",
    rng: np.random.Generator,
) -> IncrementalAnnotation:
    """Annotate faces in rounds with simulated annotators, as `evaluation.annotation.rounds.annotate` describes.

    Parameters
    ----------
    pad : array_like, shape (n, 3)
        True PAD of each face, each value in [-1, 1].
    raters : int
        Number of annotators, at least 2.
    sets, share, rule
        As in `evaluation.annotation.rounds.annotate`; the defaults are the paper's.
    rng : numpy.random.Generator
        Source of the division into sets and of the annotators' noise.

    Returns
    -------
    IncrementalAnnotation
        Mean ratings, the rounds and the agreement.

    Raises
    ------
    DataError
        As `annotate_pad` and `evaluation.annotation.rounds.annotate`.
    InsufficientDataError
        If there are fewer than three faces or two annotators.

    Notes
    -----
    The noise is that of one round (`annotate_pad`); the mean over rounds of what was rated again lowers the SD over
    annotators by about a tenth.

    References
    ----------
    Jia et al. (2013), section 2.4.
    """
    true = finite_array(pad, axes=("faces", "dimensions"), name="pad")
    rounds = annotate(
        len(true),
        lambda samples: annotate_pad(true[samples], raters=raters, rng=rng),
        sets=sets,
        share=share,
        rule=rule,
        rng=rng,
    )
    ratings = combine(rounds, len(true))
    return IncrementalAnnotation(
        pad=ratings.mean(axis=1),
        ratings=ratings,
        times=times_rated(rounds, len(true)),
        rounds=rounds,
        agreement=annotation_agreement(ratings, dimensions=DIMENSIONS),
    )


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
