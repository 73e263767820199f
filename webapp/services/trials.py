"""Trials: which comes next, check and record the answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session, joinedload, selectinload
from sqlalchemy.sql.base import ExecutableOption

from evaluation import playback as watching
from evaluation.playback import PlayEvent
from evaluation.study import StudySpec
from webapp.errors import ConflictError, NotFoundError
from webapp.models import (
    Participant,
    ParticipantState,
    PlaybackEvent,
    Response,
    Stimulus,
    Study,
    Trial,
    TrialStimulus,
)
from webapp.models.columns import now
from webapp.services import enrolment, layout, places, rounds, studies
from webapp.services.asking import Submission

MAX_PLAYBACK_EVENTS = 500
_SLACK_S = 0.5


@dataclass(frozen=True)
class Playback:
    """An event of a player: what happened, and to which of the trial's clips, counted from 1."""

    event: PlayEvent
    place: int = 1


class NotWatchedError(ConflictError):
    """A clip was not played as far as the study demands; the answers may be sent again when it was."""

    def __init__(self, share: float, demanded: float) -> None:
        super().__init__("Please watch the clip to its end before you answer")
        self.share = share
        self.demanded = demanded


def current(session: Session, participant: Participant) -> Trial | None:
    """Return the first trial without an answer, None when all are answered."""
    return session.scalar(
        select(Trial)
        .where(Trial.participant_id == participant.id, Trial.answered_at.is_(None))
        .order_by(Trial.position)
        .limit(1)
        .options(*_shown())
    )


def at(session: Session, participant: Participant, position: int) -> Trial:
    """Return a participant's trial; NotFoundError if there is none at this position."""
    trial = session.scalar(
        select(Trial).where(Trial.participant_id == participant.id, Trial.position == position).options(*_shown())
    )
    if trial is None:
        raise NotFoundError(f"There is no trial {position}")
    return trial


def _shown() -> tuple[ExecutableOption, ...]:
    clips = joinedload(Trial.stimulus).joinedload(Stimulus.clip)
    others = selectinload(Trial.beside).joinedload(TrialStimulus.stimulus).joinedload(Stimulus.clip)
    return clips, others


def count(session: Session, participant: Participant) -> int:
    """Return how many trials have been laid out for a participant so far."""
    return session.scalar(select(func.count(Trial.id)).where(Trial.participant_id == participant.id)) or 0


class Place(NamedTuple):
    """Where a trial stands in its sitting: which it is, from 1, of how many."""

    number: int
    total: int


def place(session: Session, participant: Participant, trial: Trial) -> Place:
    """Return where a trial stands in its part, or in its round of annotation."""
    query = select(func.count(Trial.id), func.count(Trial.id).filter(Trial.position <= trial.position)).where(
        Trial.participant_id == participant.id,
        Trial.part == trial.part,
        Trial.round_id.is_not_distinct_from(trial.round_id),
    )
    total, number = session.execute(query).one()
    return Place(number, total)


def answered(session: Session, participant: Participant) -> int:
    """Return how many trials a participant has answered."""
    return session.scalar(select(func.count(Trial.answered_at)).where(Trial.participant_id == participant.id)) or 0


def remaining(session: Session, participant: Participant, part: str) -> int:
    """Return how many trials of a part a participant has still to answer, of those laid out."""
    query = select(func.count(Trial.id)).where(
        Trial.participant_id == participant.id, Trial.part == part, Trial.answered_at.is_(None)
    )
    return session.scalar(query) or 0


def mark_shown(session: Session, trial_id: int) -> None:
    """Record when a trial was first on the screen, which is a sign of life, too."""
    owner = session.scalar(select(Trial.participant_id).where(Trial.id == trial_id))
    if owner is None:
        # They withdrew in another tab, and the trial is gone.
        return
    # The participant before the trial, as everywhere: whoever answers at this moment waits, or is waited for.
    participant = enrolment.locked(session, owner)
    session.execute(update(Trial).where(Trial.id == trial_id, Trial.shown_at.is_(None)).values(shown_at=now()))
    if participant.state == ParticipantState.ACTIVE:
        places.sign_of_life(participant, studies.spec_of(session.get_one(Study, participant.study_id)))


def record(
    session: Session,
    participant: Participant,
    position: int,
    submissions: Mapping[str, Submission],
    *,
    visit_id: int,
    playback: Sequence[Playback] = (),
) -> Trial | None:
    """Store a trial's answers; the transaction is durable when the caller's block ends.

    Sending the same answers again changes nothing. Different answers to an answered trial become a new revision.

    Parameters
    ----------
    position : int
        Which of the participant's trials, from 1.
    submissions : mapping
        As `webapp.services.asking.read_form` returns them.
    visit_id : int
        The participant's sitting.
    playback : sequence of Playback
        What the players did while the page was open.

    Returns
    -------
    Trial or None
        The next trial without an answer.

    Raises
    ------
    NotFoundError
        If the participant has no such trial.
    ConflictError
        If an earlier trial is still without an answer, or the participant has withdrawn.
    NotWatchedError
        If the study demands that more of a clip is watched first.
    """
    # Whoever sends the same trial twice at once, from two tabs, waits here, and then finds the first answer stored.
    participant = enrolment.locked(session, participant.id)
    if participant.state == ParticipantState.WITHDRAWN:
        raise ConflictError("You have withdrawn from this study; nothing more is stored")
    trial = at(session, participant, position)
    # What this session had read before it waited is out of date.
    session.refresh(trial)
    study = session.get_one(Study, participant.study_id)
    spec = studies.spec_of(study)
    if participant.opens_at is not None and participant.opens_at > now() and trial.answered_at is None:
        raise ConflictError("This part of the study is not open yet")
    first_open = current(session, participant)
    if trial.answered_at is None and first_open is not None and first_open.position != position:
        raise ConflictError(f"Trial {first_open.position} comes before trial {position}")
    latest = _latest(session, trial)
    # What had an answer and is left out now has been taken back.
    taken_back = {
        name: Submission({}, one.display or {}, {}) for name, one in latest.items() if name not in submissions
    }
    submissions = {**submissions, **taken_back}
    changed = {name: own for name, own in submissions.items() if _differs(latest.get(name), own)}
    if trial.answered_at is None:
        _check_watched(spec, trial, playback)
    _store(session, trial, changed, latest, visit_id)
    if (changed or trial.answered_at is None) and spec.collect.playback:
        _store_playback(session, trial, playback, visit_id)
    if trial.answered_at is None:
        trial.answered_at = now()
        places.sign_of_life(participant, spec)
        if participant.state == ParticipantState.LAPSED:
            session.refresh(study, with_for_update=True)
            places.return_to(session, study, participant)
        session.flush()
    following = current(session, participant)
    if following is None and participant.completed_at is None:
        rounds.answered(session, study, spec, participant, trial)
        if layout.lay_out(session, study, spec, participant):
            following = current(session, participant)
    return following


def _check_watched(spec: StudySpec, trial: Trial, playback: Sequence[Playback]) -> None:
    """Hold the page's log, and the server's own clock, against what the study demands."""
    demanded = spec.part(trial.part).watched
    shares = []
    for place, stimulus in enumerate(trial.stimuli, start=1):
        if stimulus.clip.is_still:
            continue
        events = [own.event for own in playback if own.place == place]
        seen = watching.summarise(events, duration_s=stimulus.clip.duration_s)
        shares.append(seen.share or 0.0)
        lasted = (now() - trial.shown_at).total_seconds() if trial.shown_at is not None else 0.0
        if stimulus.clip.duration_s is not None and lasted + _SLACK_S < demanded * stimulus.clip.duration_s:
            shares[-1] = min(shares[-1], lasted / stimulus.clip.duration_s)
    least = min(shares, default=None)
    trial.watched = least if spec.collect.playback else None
    if least is not None and least < demanded:
        raise NotWatchedError(least, demanded)


def _store(
    session: Session,
    trial: Trial,
    changed: Mapping[str, Submission],
    latest: Mapping[str, Response],
    visit_id: int,
) -> None:
    for name, own in changed.items():
        session.add(
            Response(
                trial_id=trial.id,
                visit_id=visit_id,
                instrument=name,
                revision=latest[name].revision + 1 if name in latest else 1,
                answers=_plain(own.answers),
                raw=_plain(own.raw),
                display=dict(own.display),
            )
        )


def _store_playback(session: Session, trial: Trial, playback: Sequence[Playback], visit_id: int) -> None:
    session.add_all(
        PlaybackEvent(
            trial_id=trial.id,
            visit_id=visit_id,
            place=own.place,
            kind=own.event.kind,
            page_ms=int(own.event.page_ms),
            media_s=own.event.media_s,
            value=own.event.value,
        )
        for own in playback[:MAX_PLAYBACK_EVENTS]
    )


def _latest(session: Session, trial: Trial) -> dict[str, Response]:
    rows = session.scalars(select(Response).where(Response.trial_id == trial.id).order_by(Response.revision))
    return {response.instrument: response for response in rows}


def _differs(response: Response | None, own: Submission) -> bool:
    return response is None or response.answers != _plain(own.answers)


def _plain(answers: Mapping[str, object]) -> dict[str, object]:
    """Return answers as they come back from JSON."""
    return {item: list(answer) if isinstance(answer, tuple) else answer for item, answer in answers.items()}
