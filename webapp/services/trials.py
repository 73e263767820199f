"""Trials: what a participant sees next, and the one place where answers are written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session, joinedload

from evaluation import instruments
from evaluation.errors import AnswerError
from evaluation.study import StudySpec
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, PlaybackEvent, Response, Stimulus, Trial
from webapp.models.columns import now

PLAYBACK_KINDS = frozenset({"play", "pause", "ended", "seeked", "stalled", "waiting", "error"})
MAX_PLAYBACK_EVENTS = 200


@dataclass(frozen=True)
class Playback:
    """An event of the video element: what happened, ms since the page was opened, s into the clip."""

    kind: str
    page_ms: int
    media_s: float


class AnswersRefusedError(ConflictError):
    """Some answers are missing or out of range; `problems` maps field names to what is wrong."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__("Some questions have no answer yet")
        self.problems = dict(problems)


def field_name(instrument: str, item: str) -> str:
    """Return the form field of an instrument's item."""
    return f"{instrument}.{item}"


def current(session: Session, participant: Participant) -> Trial | None:
    """Return the first trial without an answer, None when all are answered."""
    return session.scalar(
        select(Trial)
        .where(Trial.participant_id == participant.id, Trial.answered_at.is_(None))
        .order_by(Trial.position)
        .limit(1)
        .options(joinedload(Trial.stimulus).joinedload(Stimulus.clip))
    )


def count(session: Session, participant: Participant) -> int:
    """Return how many trials a participant has in all."""
    return session.scalar(select(func.count(Trial.id)).where(Trial.participant_id == participant.id)) or 0


def mark_shown(session: Session, trial_id: int) -> None:
    """Record when a trial was first on the screen."""
    session.execute(update(Trial).where(Trial.id == trial_id, Trial.shown_at.is_(None)).values(shown_at=now()))


def validate(spec: StudySpec, form: Mapping[str, str]) -> dict[str, dict[str, int]]:
    """Check a trial's form.

    Parameters
    ----------
    spec : StudySpec
        The study file.
    form : mapping
        Field name (see `field_name`) to the value as sent.

    Returns
    -------
    dict
        Instrument name to item to value.

    Raises
    ------
    AnswersRefusedError
        With one entry for each item that is missing or out of range.
    """
    answers: dict[str, dict[str, int]] = {}
    problems: dict[str, str] = {}
    for name in spec.instruments:
        instrument = instruments.get(name)
        for item in instrument.items:
            field = field_name(name, item.id)
            try:
                answers.setdefault(name, {})[item.id] = instrument.validate_item(item, form.get(field))
            except AnswerError as error:
                problems[field] = str(error)
    if problems:
        raise AnswersRefusedError(problems)
    return answers


def record(
    session: Session,
    participant: Participant,
    position: int,
    answers: Mapping[str, Mapping[str, int]],
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
    answers : mapping
        As returned by `validate`.

    Returns
    -------
    Trial or None
        The next trial without an answer.

    Raises
    ------
    NotFoundError
        If the participant has no such trial.
    ConflictError
        If an earlier trial is still without an answer.
    """
    # Whoever sends the same trial twice at once waits here, and then finds the first answer stored.
    trial = session.scalar(
        select(Trial).where(Trial.participant_id == participant.id, Trial.position == position).with_for_update()
    )
    if trial is None:
        raise NotFoundError(f"There is no trial {position}")
    first_open = current(session, participant)
    if trial.answered_at is None and first_open is not None and first_open.position != position:
        raise ConflictError(f"Trial {first_open.position} comes before trial {position}")
    latest = _latest(session, trial)
    changed = {name: dict(values) for name, values in answers.items() if _differs(latest.get(name), values)}
    for name, values in changed.items():
        revision = latest[name].revision + 1 if name in latest else 1
        session.add(Response(trial_id=trial.id, visit_id=visit_id, instrument=name, revision=revision, answers=values))
    if changed:
        session.add_all(
            PlaybackEvent(
                trial_id=trial.id, visit_id=visit_id, kind=event.kind, page_ms=event.page_ms, media_s=event.media_s
            )
            for event in playback[:MAX_PLAYBACK_EVENTS]
        )
    if trial.answered_at is None:
        trial.answered_at = now()
        session.flush()
    following = current(session, participant)
    if following is None and participant.completed_at is None:
        session.get_one(Participant, participant.id).completed_at = now()
    return following


def _latest(session: Session, trial: Trial) -> dict[str, Response]:
    rows = session.scalars(select(Response).where(Response.trial_id == trial.id).order_by(Response.revision))
    return {response.instrument: response for response in rows}


def _differs(response: Response | None, values: Mapping[str, int]) -> bool:
    return response is None or response.answers != dict(values)
