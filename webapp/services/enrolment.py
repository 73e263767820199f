"""Participants: enrol, come back, begin a sitting."""

import secrets

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation.design.ordering import trial_order
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, Stimulus, Study, StudyState, Trial, Visit
from webapp.services import studies

USER_AGENT_LENGTH = 400


def new_token() -> str:
    """Return a new secret by which a participant is recognised."""
    return secrets.token_urlsafe(24)


def enrol(session: Session, slug: str, *, language: str, token: str | None = None) -> Participant:
    """Enrol a person who consented, and lay out all trials in the order that the study file and its seed fix.

    Parameters
    ----------
    language : str
        The language the person reads, as in the study file.
    token : str, optional
        The person's secret (see `new_token`). Enrolling again with the same one changes nothing: whoever presses the
        button twice is one participant.

    Raises
    ------
    NotFoundError
        If there is no such study.
    ConflictError
        If the study is not open.
    """
    # The row lock makes enrolment numbers gapless on PostgreSQL; SQLite has one writer at a time anyway.
    study = session.scalar(select(Study).where(Study.slug == slug).with_for_update())
    if study is None:
        study = studies.find(session, slug)
    token = token or new_token()
    enrolled = session.scalar(select(Participant).where(Participant.study_id == study.id, Participant.token == token))
    if enrolled is not None:
        return enrolled
    if study.state != StudyState.OPEN:
        raise ConflictError(f"The study '{slug}' is not open")
    number = session.scalar(select(func.count(Participant.id)).where(Participant.study_id == study.id)) or 0
    participant = Participant(study=study, number=number, token=token, language=language)
    by_cell = {
        (stimulus.name, stimulus.condition.name): stimulus
        for stimulus in session.scalars(select(Stimulus).where(Stimulus.study_id == study.id))
    }
    order = trial_order(studies.spec_of(study), number)
    participant.trials = [Trial(position=k, stimulus=by_cell[cell]) for k, cell in enumerate(order, start=1)]
    session.add(participant)
    session.flush()
    return participant


def find(session: Session, slug: str, token: str) -> Participant:
    """Return the participant of a study with this token.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    participant = session.scalar(select(Participant).join(Study).where(Study.slug == slug, Participant.token == token))
    if participant is None:
        raise NotFoundError(f"Nobody with this link takes part in the study '{slug}'")
    return participant


def begin_visit(session: Session, participant: Participant, *, user_agent: str) -> Visit:
    """Begin a sitting."""
    visit = Visit(participant_id=participant.id, user_agent=user_agent[:USER_AGENT_LENGTH])
    session.add(visit)
    session.flush()
    return visit


def participants(session: Session, slug: str) -> list[tuple[Participant, int]]:
    """List the participants of a study in the order of enrolment, each with the number of answered trials."""
    answered = (
        select(Trial.participant_id, func.count(Trial.answered_at).label("answered"))
        .group_by(Trial.participant_id)
        .subquery()
    )
    rows = session.execute(
        select(Participant, answered.c.answered)
        .join(Study)
        .outerjoin(answered, answered.c.participant_id == Participant.id)
        .where(Study.slug == slug)
        .order_by(Participant.number)
    )
    return [(participant, count or 0) for participant, count in rows]
