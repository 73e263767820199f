"""Ratings of annotation rounds, read from the database as the arrays that the rounds are decided by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation.instruments import Instrument
from evaluation.study import Part, StudySpec
from webapp.models import AnnotationRound, Participant, ParticipantState, Response, RoundSample, Trial

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RoundRatings:
    """What was rated in one round.

    Attributes
    ----------
    samples : tuple of int
        Keys of the round's stimuli, in the order of its plan.
    new : int
        How many of them were not rated before.
    rows : tuple of (int, int)
        What each row of the ratings is: the sample's place in `samples`, and which of its words, from 1 (1 where there
        are no words).
    raters : tuple of int
        Keys of the participants, in the order of enrolment.
    dimensions : tuple of str
        What is rated.
    ratings : numpy.ndarray, shape (rows, raters, dimensions)
        The ratings; NaN where one is missing.
    """

    samples: tuple[int, ...]
    new: int
    rows: tuple[tuple[int, int], ...]
    raters: tuple[int, ...]
    dimensions: tuple[str, ...]
    ratings: FloatArray


def read(session: Session, spec: StudySpec, part: Part, rounds: Sequence[AnnotationRound]) -> list[RoundRatings]:
    """Return what was rated in each of some rounds; all have the same raters and dimensions.

    Raters are those who have a trial in one of the rounds; whoever withdrew with their answers has none.
    """
    names = [use.use for use in part.instruments]
    asked = [spec.instrument(name) for name in names]
    labels = part.annotation is not None and part.annotation.mode == "consensus"
    dimensions = tuple(dimension for instrument in asked for dimension in instrument.dimensions(labels=labels))
    keys = [found.id for found in rounds]
    raters = tuple(
        session.scalars(
            select(Participant.id)
            .where(Participant.id.in_(select(Trial.participant_id).where(Trial.round_id.in_(keys))))
            .order_by(Participant.number)
        )
    )
    return [_read_one(session, found, asked, dimensions, raters) for found in rounds]


def finished_raters(session: Session, found: AnnotationRound) -> int:
    """Return how many raters have answered all of a round's samples."""
    rows = session.execute(
        select(Trial.participant_id, Trial.answered_at)
        .join(Participant, Participant.id == Trial.participant_id)
        .where(
            Trial.round_id == found.id,
            Trial.kind == "rating",
            Participant.state != ParticipantState.WITHDRAWN,
        )
    ).all()
    busy = {participant for participant, answered in rows if answered is None}
    return len({participant for participant, _ in rows} - busy)


def _read_one(
    session: Session,
    found: AnnotationRound,
    asked: Sequence[Instrument],
    dimensions: tuple[str, ...],
    raters: tuple[int, ...],
) -> RoundRatings:
    samples = session.execute(
        select(RoundSample.stimulus_id, RoundSample.again)
        .where(RoundSample.round_id == found.id)
        .order_by(RoundSample.place)
    ).all()
    keys = tuple(key for key, _ in samples)
    place = {key: number for number, key in enumerate(keys)}
    column = {rater: number for number, rater in enumerate(raters)}
    by_name = {instrument.name: instrument for instrument in asked}
    rows = session.execute(
        select(Trial.stimulus_id, Trial.participant_id, Response.instrument, Response.answers)
        .join(Response, Response.trial_id == Trial.id)
        .where(
            Trial.round_id == found.id,
            Trial.kind == "rating",
            Response.instrument.in_(list(by_name)),
        )
        .order_by(Response.revision)
    )
    # Later revisions come later and replace the earlier ones.
    latest = {(stimulus, rater, name): answers for stimulus, rater, name, answers in rows if stimulus is not None}
    known: dict[tuple[int, int], dict[tuple[int, str], float]] = {}
    for (stimulus, rater, name), answers in latest.items():
        for word, named in _values(by_name[name], answers).items():
            values = known.setdefault((place[stimulus], word), {})
            values.update({(column[rater], dim): value for dim, value in named.items() if dim in dimensions})
    rated = {number for number, _ in known}
    unrated = [(number, 1) for number in range(len(keys)) if number not in rated]
    order = tuple(sorted([*known, *unrated]))
    ratings = np.full((len(order), len(raters), len(dimensions)), np.nan)
    for row, where in enumerate(order):
        for (rater, dimension), value in known.get(where, {}).items():
            ratings[row, rater, dimensions.index(dimension)] = value
    new = sum(not again for _, again in samples)
    return RoundRatings(keys, new, order, raters, dimensions, ratings)


def _values(instrument: Instrument, answers: Mapping[str, object]) -> dict[int, dict[str, float]]:
    """Return what an instrument's answers say of each word, or under 1 of the sample as a whole."""
    by_word: dict[int, dict[str, int]] = {}
    for item, answer in answers.items():
        name, _, number = (item, "", "1") if instrument.per == "trial" else item.rpartition("-")
        if isinstance(answer, int):
            by_word.setdefault(int(number), {})[name] = answer
    if not instrument.scores:
        return {word: {name: float(answer) for name, answer in own.items()} for word, own in by_word.items()}
    # What else the instrument asks, a reason say, is not needed for its scores.
    return {word: instrument.partial_scores(own) for word, own in by_word.items()}
