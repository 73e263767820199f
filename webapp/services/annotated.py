"""What an annotation in rounds has come to: the value of each sample, and each rater's."""

from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from evaluation.annotation.agreement import RoundAgreement, round_agreement
from evaluation.annotation.consensus import consensus
from evaluation.annotation.rounds import Round, combine, combine_fresh
from evaluation.study import Part, StudySpec
from webapp.models import Study
from webapp.services import round_ratings, rounds
from webapp.services.round_ratings import FloatArray, RoundRatings


@dataclass(frozen=True, eq=False)
class Annotated:
    """What an annotated part has come to so far.

    Attributes
    ----------
    stimuli : tuple of (int, int)
        Key of the stimulus of each row, and which of its words, from 1.
    raters : tuple of int
        Keys of the participants; none when each round has raters of its own.
    dimensions : tuple of str
        What is rated.
    ratings : numpy.ndarray, shape (rows, raters, dimensions)
        In a fixed panel each rater's mean over rounds, in a consensus what each said last; NaN where one is missing.
    values : numpy.ndarray, shape (rows, dimensions)
        The annotation: the mean over raters, or the value on which they agree; NaN where there is none.
    """

    stimuli: tuple[tuple[int, int], ...]
    raters: tuple[int, ...]
    dimensions: tuple[str, ...]
    ratings: FloatArray
    values: FloatArray

    def agreement(self) -> RoundAgreement | None:
        """Return how well the raters agree over all rounds; None when each round has raters of its own."""
        return round_agreement(self.ratings, dimensions=self.dimensions) if self.raters else None


def annotated(session: Session, study: Study, spec: StudySpec, part: Part) -> Annotated | None:
    """Return what an annotated part has come to so far, None before its first answer."""
    annotation = part.annotation
    found = rounds.of_part(session, study, part)
    rated = round_ratings.read(session, spec, part, found)
    if annotation is None or not rated or not rated[0].raters:
        return None
    if annotation.mode == "consensus":
        return _last_words(rated, [one.completed_at is not None for one in found], annotation.agree)
    known = sorted({key for one in rated for key in _rated(one)})
    if not known:
        return None
    place = {key: number for number, key in enumerate(known)}
    finished = []
    for one in rated:
        rows = [row for row, key in enumerate(one.samples) if key in place]
        samples = np.array([place[one.samples[row]] for row in rows], dtype=np.intp)
        finished.append(Round(samples=samples, new=0, ratings=one.ratings[rows]))
    stimuli = tuple((key, 1) for key in known)
    if annotation.panel == "fresh":
        values = combine_fresh(finished, len(known))
        return Annotated(stimuli, (), rated[0].dimensions, np.empty((len(known), 0, values.shape[1])), values)
    ratings = combine(finished, len(known))
    number = (~np.isnan(ratings)).sum(axis=1)
    return Annotated(stimuli, rated[0].raters, rated[0].dimensions, ratings, np.nansum(ratings, axis=1) / number)


def _rated(one: RoundRatings) -> set[int]:
    """Return the stimuli of a round that somebody has rated on every dimension."""
    there = np.flatnonzero((~np.isnan(one.ratings)).any(axis=1).sum(axis=1) == len(one.dimensions))
    return {one.samples[one.rows[row][0]] for row in there}


def _last_words(rated: list[RoundRatings], complete: list[bool], agree: int) -> Annotated:
    """Return each row's ratings of its last complete round: an open discussion does not undo what was agreed on."""
    latest: dict[tuple[int, int], FloatArray] = {}
    for one, is_complete in zip(rated, complete, strict=True):
        for (place, word), ratings in zip(one.rows, one.ratings, strict=True):
            if not np.isnan(ratings).all() and (is_complete or (one.samples[place], word) not in latest):
                latest[one.samples[place], word] = ratings
    raters, dimensions = rated[0].raters, rated[0].dimensions
    ratings = np.array(list(latest.values())).reshape(len(latest), len(raters), len(dimensions))
    if latest and len(raters) >= agree:
        values = consensus(ratings, agree=agree, items=dimensions).values.astype(float)
    else:
        values = np.full((len(latest), len(dimensions)), np.nan)
    return Annotated(tuple(latest), raters, dimensions, ratings, values)
