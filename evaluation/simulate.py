"""Simulated raters: they answer the questionnaires as people with known perception and known noise would."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from evaluation.annotation.rounds import SHARE, IntArray, Round, annotate, combine, times_rated
from evaluation.design.layout import plan_part
from evaluation.design.plan import PlannedTrial, TrialKind
from evaluation.errors import DataError
from evaluation.instruments import Answer
from evaluation.instruments.display import arrange, keyed
from evaluation.known_answers import accepted
from evaluation.responses import DIMENSIONS, OPTIONAL_COLUMNS, RESPONSE_COLUMNS, input_pad, statistical
from evaluation.seeding import bit_generator, generator
from evaluation.simulated_answers import PERCEPTION_SD, RATER_SD, answer_instrument, answer_mos5, answer_pad12
from evaluation.statistics.agreement.annotation import AnnotationAgreement, annotation_agreement
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.matrices import finite_array
from evaluation.study import Cell, Part, StudySpec
from evaluation.study_parts import InstrumentUse

__all__ = [
    "PAD_SPREAD",
    "RATER_SD",
    "IncrementalAnnotation",
    "SimulatedTrial",
    "annotate_incrementally",
    "annotate_pad",
    "answer_instrument",
    "answer_mos5",
    "answer_pad12",
    "simulate_responses",
    "simulate_trials",
]

PAD_SPREAD: Mapping[str, float] = {"P": 0.485, "A": 0.310, "D": 0.238}
"""Standard deviation over faces of their true PAD that the printed agreement implies; see `annotate_pad`."""

_NEUTRAL = (0.0, 0.0, 0.0)
_INDIFFERENT = 3.0


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
    noise = np.array([PERCEPTION_SD[dimension] for dimension in DIMENSIONS])
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


@dataclass(frozen=True, kw_only=True)
class SimulatedTrial:
    """What a simulated participant answers in one trial.

    Attributes
    ----------
    participant, trial : int
        Number of the participant, and place of the trial over all parts, both from 1.
    part : str
        Name of the part.
    kind : str
        One of `evaluation.design.plan.KINDS`.
    cells : tuple of Cell
        What the trial shows.
    raw, keyed : dict
        The answers by instrument and item, as they stand on the page and as if no poles had changed sides. Items have
        the ids of the page, ``P-3`` if there is one for each clip or word.
    """

    participant: int
    trial: int
    part: str
    kind: TrialKind
    cells: tuple[Cell, ...]
    raw: Mapping[str, Mapping[str, Answer]]
    keyed: Mapping[str, Mapping[str, Answer]]


def simulate_trials(
    spec: StudySpec, participants: int, *, seed: int, quality: Mapping[str, float] | None = None
) -> Iterator[SimulatedTrial]:
    """Yield all trials of simulated participants, also those that do not count; parameters as `simulate_responses`.

    Raises
    ------
    DataError
        If a part is annotated in rounds: what comes in a round depends on the answers of all raters.
    EvaluationError
        If words are asked about that the study file does not name.
    """
    for part in spec.all_parts:
        if part.annotation is not None:
            raise DataError(f"Part {part.name} is annotated in rounds, which cannot be simulated beforehand.")
    names = [condition.name for condition in spec.conditions]
    true_quality = quality or dict(zip(names, np.linspace(2.5, 4, len(names)).tolist(), strict=True))
    for index in range(participants):
        rng = generator(seed, "simulated rater", index)
        position = 0
        for part in spec.all_parts:
            for planned in plan_part(spec, part.name, index):
                position += 1
                yield _simulated(spec, part, planned, (index, position), true_quality, rng=rng)


def simulate_responses(
    spec: StudySpec, participants: int, *, seed: int, quality: Mapping[str, float] | None = None
) -> pd.DataFrame:
    """Return what a number of simulated participants answer in a study.

    Each participant sees the trials of `evaluation.design.layout.plan_part`. A face shows its input PAD times the
    clip's intensity (1 if the clip has none); a clip without PAD is neutral.

    Parameters
    ----------
    spec : StudySpec
        A study without annotation in rounds.
    participants : int
        How many; the first n of a larger number answer just the same.
    seed : int
        Seed of the raters' noise.
    quality : mapping of str to float, optional
        True mean opinion of each condition, 1 to 5; left out, from 2.5 for the first condition to 4 for the last.

    Returns
    -------
    pandas.DataFrame
        One row for each item of the trials that count, with the columns `evaluation.responses.RESPONSE_COLUMNS`, with
        ``keyed`` if an instrument's poles change sides, and ``clip`` if trials show several clips. Answers about clips
        together, free texts, choices of several options and answers about words are no part of such a table;
        `simulate_trials` has them.

    Raises
    ------
    DataError
        As `simulate_trials`.

    References
    ----------
    As `answer_instrument`.
    """
    rows = [
        row
        for trial in simulate_trials(spec, participants, seed=seed, quality=quality)
        if trial.kind == "rating"
        for row in _rows(spec, trial)
    ]
    frame = pd.DataFrame(rows, columns=[*RESPONSE_COLUMNS, *OPTIONAL_COLUMNS])
    needed = {
        "keyed": any(use.flip for part in spec.all_parts for use in part.instruments),
        "clip": any(part.presentation.together != "single" for part in spec.all_parts),
    }
    return frame.drop(columns=[column for column, is_needed in needed.items() if not is_needed])


def _simulated(
    spec: StudySpec,
    part: Part,
    planned: PlannedTrial,
    place: tuple[int, int],
    quality: Mapping[str, float],
    *,
    rng: np.random.Generator,
) -> SimulatedTrial:
    index, position = place
    pads = [_shown_pad(spec, *cell) for cell in planned.cells] or [_NEUTRAL]
    qualities = [quality[cell.condition] for cell in planned.cells] or [_INDIFFERENT]
    words = spec.stimulus(planned.cells[0].stimulus).words if planned.cells else ()
    told = accepted(part, planned.kind, planned.check) if planned.kind == "instructed" else {}
    uses = {use.use: use for use in part.instruments}
    raw, true = {}, {}
    for name in planned.instruments:
        use = uses.get(name, InstrumentUse(use=name))
        instrument = spec.instrument(name).expanded(clips=max(1, len(planned.cells)), words=words)
        answers = answer_instrument(instrument, pads, qualities, rng=rng)
        for item in answers:
            answers[item] = next(iter(told.get(f"{name}.{item}", ())), answers[item])
        # The page of this very trial, as it is laid out for real participants.
        bits = bit_generator(spec.seed, spec.slug, "display", name, index, position)
        display = arrange(instrument, shuffle=use.shuffle, flip=use.flip, bits=bits)
        raw[name], true[name] = keyed(instrument, display, answers), answers
    return SimulatedTrial(
        participant=index + 1,
        trial=position,
        part=part.name,
        kind=planned.kind,
        cells=planned.cells,
        raw=raw,
        keyed=true,
    )


def _rows(spec: StudySpec, trial: SimulatedTrial) -> Iterator[tuple[object, ...]]:
    for name, answers in trial.raw.items():
        instrument = spec.instrument(name)
        if instrument.per == "trial" and len(trial.cells) > 1:
            continue
        for clip, cell in enumerate(trial.cells, start=1):
            for item in statistical(instrument):
                on_page = item.id if instrument.per == "trial" else f"{item.id}-{clip}"
                if on_page in answers:
                    about = (trial.participant, trial.trial, cell.stimulus, cell.condition, name, item.id)
                    yield (*about, answers[on_page], trial.keyed[name][on_page], clip)


def _shown_pad(spec: StudySpec, stimulus: str, condition: str) -> tuple[float, ...]:
    intensity = spec.clip_fields(stimulus, condition).get("intensity", 1.0)
    factor = float(intensity) if isinstance(intensity, (int, float)) else 1.0
    pad = input_pad(spec, stimulus, condition) or _NEUTRAL
    return tuple(min(1.0, max(-1.0, value * factor)) for value in pad)
