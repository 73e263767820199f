"""Annotation in rounds: which round is open, when it is complete, and what comes next.

A round is opened and completed under the study's lock, and what it holds is stored: advancing twice, at once or after a
lost connection, is the same as advancing once.
"""

from dataclasses import asdict, dataclass

import numpy as np
from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from evaluation.annotation.agreement import round_agreement
from evaluation.annotation.consensus import consensus
from evaluation.annotation.progress import first_sets, next_round
from evaluation.annotation.rounds import Round
from evaluation.seeding import bit_generator
from evaluation.study import Part, StudySpec
from webapp.errors import ConflictError
from webapp.models import (
    AnnotationRound,
    Condition,
    Participant,
    ParticipantState,
    RoundSample,
    Stimulus,
    Study,
    Trial,
)
from webapp.models.columns import now
from webapp.services import audit, places, round_ratings, studies
from webapp.services.round_ratings import RoundRatings

MOST_DISCUSSIONS = 10
"""Rounds after which a consensus ends that its study file leaves open: some raters never agree."""


@dataclass(frozen=True)
class RoundOverview:
    """A round in one line.

    Attributes
    ----------
    index : int
        Number of the round, from 1.
    samples, reannotated : int
        How many samples it holds, and how many of them were rated in an earlier round.
    raters, finished : int
        How many raters it needs, and how many have rated all of it.
    complete : bool
        Whether it is closed.
    sd, pairwise_r : dict
        Mean standard deviation over raters, and mean pairwise Pearson correlation, of each dimension; None where there
        is none yet.
    largest_p : dict
        The largest p value of the pairs.
    agreed : float or None
        Share of the answers on which enough raters agree (consensus).
    """

    part: str
    index: int
    samples: int
    reannotated: int
    raters: int
    finished: int
    complete: bool
    sd: dict[str, float | None]
    pairwise_r: dict[str, float | None]
    largest_p: dict[str, float | None]
    agreed: float | None

    def to_dict(self) -> dict[str, object]:
        """Return the fields as plain JSON values."""
        return asdict(self)


def annotated_parts(spec: StudySpec) -> tuple[Part, ...]:
    """Return the parts that are annotated in rounds."""
    return tuple(part for part in spec.all_parts if part.annotation is not None)


def current(session: Session, study: Study, spec: StudySpec, part: Part) -> AnnotationRound:
    """Return the last round of a part; the first is opened when somebody needs it."""
    found = _last(session, study, part)
    if found is not None:
        return found
    session.refresh(study, with_for_update=True)
    return _last(session, study, part) or _open_next(session, study, spec, part, [])[0]


def takes_part(part: Part, participant: Participant, found: AnnotationRound) -> bool:
    """Tell whether a participant rates in a round: always in a fixed panel, else by their place in the design."""
    annotation = part.annotation
    return annotation is None or annotation.panel == "fixed" or participant.slot // annotation.raters == found.number


def capacity(session: Session, study: Study, spec: StudySpec) -> int | None:
    """Return how many places the study's rounds have by now, None if it has no rounds."""
    limits = []
    for part in annotated_parts(spec):
        if part.annotation is None:
            continue
        last = _last(session, study, part)
        opened = 1 if last is None or part.annotation.panel == "fixed" else last.number + 1
        limits.append(part.annotation.raters * opened)
    return min(limits, default=None)


def first_place(session: Session, study: Study, spec: StudySpec) -> int:
    """Return the first place of the design for which there is still something to rate.

    Places of a fixed panel that is through, and those of the earlier rounds of fresh panels, are not filled again:
    whoever got one would have nothing to do. As long as one annotated part goes on, its places are filled.
    """
    firsts = []
    for part in annotated_parts(spec):
        last = _last(session, study, part)
        if part.annotation is None or last is None:
            return 0
        over = last.number if part.annotation.panel == "fresh" else 0
        firsts.append(part.annotation.raters * (over + last.final))
    return min(firsts, default=0)


def answered(session: Session, study: Study, spec: StudySpec, participant: Participant, trial: Trial) -> None:
    """Complete a round and open the next when a participant's last answer completes it, if that goes by itself."""
    part = spec.part(trial.part)
    if trial.round_id is None or part.annotation is None or part.annotation.advance != "automatic":
        return
    session.flush()
    session.refresh(study, with_for_update=True)
    _advance(session, study, spec, part, actor=audit.SYSTEM)


def advance(session: Session, slug: str, *, actor: str) -> list[str]:
    """Complete the open round of each annotated part if all its raters are through, and open what comes next.

    Returns
    -------
    list of str
        One sentence for each part. Advancing again before the next round is complete changes nothing.

    Raises
    ------
    NotFoundError
        If there is no such study.
    ConflictError
        If no part of the study is annotated in rounds.
    """
    study = studies.find(session, slug)
    session.refresh(study, with_for_update=True)
    spec = studies.spec_of(study)
    parts = annotated_parts(spec)
    if not parts:
        raise ConflictError(f"The study '{slug}' has no part with `annotation`, so it has no rounds")
    return [_advance(session, study, spec, part, actor=actor) for part in parts]


def _advance(session: Session, study: Study, spec: StudySpec, part: Part, *, actor: str) -> str:
    """Advance one part; the caller holds the study's lock."""
    found = of_part(session, study, part)
    if not found:
        return f"{part.name}: no round is open yet; the first opens when somebody enrols."
    last = found[-1]
    needed = part.annotation.raters if part.annotation is not None else 0
    if last.completed_at is None:
        done = round_ratings.finished_raters(session, last)
        if done < needed:
            return f"{part.name}: round {last.number + 1} is not complete; {done} of {needed} raters have finished it."
        last.completed_at = now()
    elif last.final:
        return f"{part.name}: all {len(found)} rounds are complete."
    opened, samples = _open_next(session, study, spec, part, found)
    if opened is last:
        last.final = True
        audit.note(session, study, actor, "end rounds", part=part.name, rounds=len(found))
        return f"{part.name}: round {last.number + 1} was the last; the annotation is complete."
    _expect(session, study, spec, part)
    audit.note(session, study, actor, "open round", part=part.name, round=opened.number + 1, samples=samples)
    return f"{part.name}: round {opened.number + 1} is open, with {samples} samples."


def _expect(session: Session, study: Study, spec: StudySpec, part: Part) -> None:
    """Let the places lapse again of those who waited for a round that is open now."""
    waiting = select(Participant).where(
        Participant.study_id == study.id,
        Participant.state == ParticipantState.ACTIVE,
        Participant.due_at.is_(None),
        Participant.part == spec.all_parts.index(part),
    )
    # Whoever is answering or coming back at this moment gets a new time by that.
    for participant in session.scalars(waiting.with_for_update(skip_locked=True)):
        places.sign_of_life(participant, spec)


def _open_next(
    session: Session, study: Study, spec: StudySpec, part: Part, found: list[AnnotationRound]
) -> tuple[AnnotationRound, int]:
    """Open the round after those there are; return it (the last one if none follows) and its number of samples."""
    samples, new = _plan(session, study, spec, part, found)
    if not samples:
        return found[-1], 0
    opened = AnnotationRound(study_id=study.id, part=part.name, number=len(found))
    session.add(opened)
    session.flush()
    rows = [
        {"round_id": opened.id, "stimulus_id": key, "place": place, "again": place >= new}
        for place, key in enumerate(samples)
    ]
    session.execute(insert(RoundSample), rows)
    return opened, len(samples)


def _plan(
    session: Session, study: Study, spec: StudySpec, part: Part, found: list[AnnotationRound]
) -> tuple[list[int], int]:
    """Return the stimuli of the next round, and how many of them are new."""
    annotation = part.annotation
    if annotation is None:
        return [], 0
    every = _stimuli(session, study, spec, part)
    rated = round_ratings.read(session, spec, part, found)
    if annotation.mode == "consensus":
        if not found:
            return every, len(every)
        if len(found) >= (annotation.stop.rounds or MOST_DISCUSSIONS):
            return [], 0
        return _disputed(rated[-1], annotation.agree), 0
    place = {key: number for number, key in enumerate(every)}
    finished = [
        Round(samples=np.array([place[key] for key in one.samples], dtype=np.intp), new=one.new, ratings=one.ratings)
        for one in rated
    ]
    bits = bit_generator(spec.seed, spec.slug, "sets", part.name)
    plan = next_round(first_sets(len(every), annotation, bits=bits), finished, annotation)
    if plan is None:
        return [], 0
    return [every[sample] for sample in plan.samples], plan.new


def _stimuli(session: Session, study: Study, spec: StudySpec, part: Part) -> list[int]:
    """Return the keys of a part's stimuli in the order of the study file."""
    rows = session.execute(
        select(Stimulus.name, Condition.name, Stimulus.id)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .where(Stimulus.study_id == study.id)
    )
    by_cell = {(stimulus, condition): key for stimulus, condition, key in rows}
    return [by_cell[cell] for cell in spec.cells(part.name)]


def _disputed(rated: RoundRatings, agree: int) -> list[int]:
    """Return the samples of a round on which too few raters agree, in its order."""
    found = consensus(rated.ratings, agree=agree, items=rated.dimensions)
    places = {rated.rows[row][0] for row in found.disputed}
    return [key for place, key in enumerate(rated.samples) if place in places]


def overview(session: Session, slug: str) -> list[RoundOverview]:
    """Return each round of a study with its agreement figures.

    Raises
    ------
    NotFoundError
        If there is no such study.
    ConflictError
        If no part of the study is annotated in rounds.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    parts = annotated_parts(spec)
    if not parts:
        raise ConflictError(f"The study '{slug}' has no part with `annotation`, so it has no rounds")
    return [line for part in parts for line in _overview(session, study, spec, part)]


def _overview(session: Session, study: Study, spec: StudySpec, part: Part) -> list[RoundOverview]:
    annotation = part.annotation
    if annotation is None:
        return []
    found = of_part(session, study, part)
    asked = [spec.instrument(use.use) for use in part.instruments]
    numbers = {name for instrument in asked for name in instrument.dimensions(labels=False)}
    lines = []
    for own, rated in zip(found, round_ratings.read(session, spec, part, found), strict=True):
        agreement = round_agreement(rated.ratings, dimensions=rated.dimensions)
        lines.append(
            RoundOverview(
                part=part.name,
                index=own.number + 1,
                samples=len(rated.samples),
                reannotated=len(rated.samples) - rated.new,
                raters=annotation.raters,
                finished=round_ratings.finished_raters(session, own),
                complete=own.completed_at is not None,
                sd={one.dimension: one.sd for one in agreement.dimensions if one.dimension in numbers},
                pairwise_r={one.dimension: one.pairwise_r for one in agreement.dimensions if one.dimension in numbers},
                largest_p={one.dimension: one.largest_p for one in agreement.dimensions if one.dimension in numbers},
                agreed=_agreed(rated, annotation.agree) if annotation.mode == "consensus" else None,
            )
        )
    return lines


def _agreed(rated: RoundRatings, agree: int) -> float | None:
    if rated.ratings.shape[0] == 0 or rated.ratings.shape[1] < agree:
        return None
    return consensus(rated.ratings, agree=agree, items=rated.dimensions).share


def _last(session: Session, study: Study, part: Part) -> AnnotationRound | None:
    return session.scalar(
        select(AnnotationRound)
        .where(AnnotationRound.study_id == study.id, AnnotationRound.part == part.name)
        .order_by(AnnotationRound.number.desc())
        .limit(1)
    )


def of_part(session: Session, study: Study, part: Part) -> list[AnnotationRound]:
    """Return the rounds of a part that have been opened, in their order."""
    query = select(AnnotationRound).where(AnnotationRound.study_id == study.id, AnnotationRound.part == part.name)
    return list(session.scalars(query.order_by(AnnotationRound.number)))
