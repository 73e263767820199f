"""Participants: enrol, come back, begin a sitting."""

import re
import secrets
from collections.abc import Mapping
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation.study import StudySpec
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, ParticipantState, Study, StudyState, Trial, Visit
from webapp.services import layout, places, rounds, studies

USER_AGENT_LENGTH = 400
_PANEL_SIGNS = re.compile(r"[A-Za-z0-9_.@-]{1,100}")


class FullError(ConflictError):
    """All places in a study are taken at the moment."""

    def __init__(self) -> None:
        super().__init__("All places in this study are taken at the moment; please try again later")


class TrialLine(NamedTuple):
    """How far a participant is in one part."""

    part: str
    laid_out: int
    answered: int
    last_answer: datetime | None


class Panel(NamedTuple):
    """Whom a panel says that somebody is.

    Attributes
    ----------
    name : str
        "prolific", "mturk" or "sona".
    id : str
        The person's identifier there.
    session : str
        The sitting's identifier there, if there is one.
    """

    name: str
    id: str
    session: str


# Which parameters of the address each panel sends: the person's, and the sitting's.
_PANELS = {
    "prolific": ("PROLIFIC_PID", "SESSION_ID"),
    "mturk": ("workerId", "assignmentId"),
    "sona": ("survey_code", ""),
}


def panel_of(parameters: Mapping[str, str]) -> Panel | None:
    """Return whom a panel says that somebody is, from the parameters of the address; None if there are none."""
    for name, (person, sitting) in _PANELS.items():
        found = parameters.get(person, "")
        if _PANEL_SIGNS.fullmatch(found):
            session = parameters.get(sitting, "") if sitting else ""
            return Panel(name, found, session if _PANEL_SIGNS.fullmatch(session) else "")
    return None


def new_token() -> str:
    """Return a new secret by which a participant is recognised."""
    return secrets.token_urlsafe(24)


def enrol(
    session: Session, slug: str, *, language: str, token: str | None = None, panel: Panel | None = None
) -> Participant:
    """Enrol a person who consented, and lay out the trials that come first.

    Parameters
    ----------
    language : str
        The language the person reads, as in the study file.
    token : str, optional
        The person's secret (see `new_token`). Enrolling again with the same one changes nothing: whoever presses the
        button twice is one participant.
    panel : Panel, optional
        Whom a panel says that this is. A person comes into a study once. Who comes again in the same sitting of the
        panel goes on; a person's identifier alone opens nothing, since others may know it.

    Raises
    ------
    NotFoundError
        If there is no such study.
    ConflictError
        If the study is not open, or the panel's person takes part already.
    FullError
        If the study has no place now.
    """
    # The row lock makes enrolment numbers gapless on PostgreSQL; SQLite has one writer at a time anyway.
    query = select(Study).where(Study.slug == slug)
    study = session.scalar(query.with_for_update().execution_options(populate_existing=True))
    if study is None:
        study = studies.find(session, slug)
    token = token or new_token()
    enrolled = session.scalar(select(Participant).where(Participant.study_id == study.id, Participant.token == token))
    if enrolled is not None:
        return enrolled
    if panel is not None:
        known = find_by_panel(session, study, panel)
        if known is not None and panel.session and panel.session == known.panel_session:
            return known
        if known is not None:
            raise ConflictError("You take part in this study already; please go on with your personal link")
    if study.state != StudyState.OPEN:
        raise ConflictError(f"The study '{slug}' is not open")
    spec = studies.spec_of(study)
    first, capacity = rounds.first_place(session, study, spec), _capacity(session, study, spec)
    slot = places.take(session, study, first=first, capacity=capacity)
    if slot is None:
        raise FullError
    participant = Participant(study=study, number=study.enrolled, slot=slot, token=token, language=language, part=0)
    if panel is not None and spec.collect.panel_id:
        participant.panel, participant.panel_id, participant.panel_session = panel
    study.enrolled += 1
    session.add(participant)
    session.flush()
    places.sign_of_life(participant, spec)
    layout.lay_out(session, study, spec, participant)
    session.flush()
    return participant


def _capacity(session: Session, study: Study, spec: StudySpec) -> int | None:
    limits = [rounds.capacity(session, study, spec), spec.quota]
    return min((limit for limit in limits if limit is not None), default=None)


def find(session: Session, slug: str, token: str) -> Participant:
    """Return the participant of a study with this token.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    participant = session.scalar(
        select(Participant)
        .join(Study)
        .where(Study.slug == slug, Participant.token == token, Participant.state != ParticipantState.WITHDRAWN)
    )
    if participant is None:
        raise NotFoundError(f"Nobody with this link takes part in the study '{slug}'")
    return participant


def find_by_panel(session: Session, study: Study, panel: Panel) -> Participant | None:
    """Return the participant whom a panel names, None if there is none."""
    return session.scalar(
        select(Participant).where(
            Participant.study_id == study.id, Participant.panel == panel.name, Participant.panel_id == panel.id
        )
    )


def find_by_number(session: Session, slug: str, number: int) -> Participant:
    """Return the participant of a study with this number, from 0.

    Raises
    ------
    NotFoundError
        If there is no such study or participant.
    """
    study = studies.find(session, slug)
    participant = session.scalar(
        select(Participant).where(Participant.study_id == study.id, Participant.number == number)
    )
    if participant is None:
        raise NotFoundError(f"There is no participant {number + 1} in the study '{slug}'; there are {study.enrolled}")
    return participant


def come_back(session: Session, participant_id: int) -> Participant:
    """Take note that a participant is there: whoever lapsed is back, and what has opened meanwhile is laid out.

    Changes nothing for those who have trials to answer and have not lapsed.
    """
    participant = locked(session, participant_id)
    study = session.get_one(Study, participant.study_id)
    spec = studies.spec_of(study)
    if participant.state == ParticipantState.LAPSED:
        session.refresh(study, with_for_update=True)
        places.return_to(session, study, participant)
        places.sign_of_life(participant, spec)
    if participant.state == ParticipantState.ACTIVE and not _has_open_trial(session, participant):
        layout.lay_out(session, study, spec, participant)
    session.flush()
    return participant


def locked(session: Session, participant_id: int) -> Participant:
    """Return a participant whom nobody else changes until this transaction ends."""
    query = select(Participant).where(Participant.id == participant_id)
    return session.scalars(query.with_for_update().execution_options(populate_existing=True)).one()


def _has_open_trial(session: Session, participant: Participant) -> bool:
    query = select(Trial.id).where(Trial.participant_id == participant.id, Trial.answered_at.is_(None)).limit(1)
    return session.scalar(query) is not None


def trial_lines(session: Session, participant: Participant) -> list[TrialLine]:
    """Return how far a participant is in each part."""
    rows = session.execute(
        select(Trial.part, func.count(Trial.id), func.count(Trial.answered_at), func.max(Trial.answered_at))
        .where(Trial.participant_id == participant.id)
        .group_by(Trial.part)
        .order_by(func.min(Trial.position))
    )
    return [TrialLine(*row) for row in rows]


def begin_visit(session: Session, participant: Participant, *, user_agent: str) -> Visit:
    """Begin a sitting; the kind of browser is kept only if the study collects it.

    Raises
    ------
    ConflictError
        If the participant has withdrawn: nothing of theirs may come after that.
    """
    participant = locked(session, participant.id)
    if participant.state == ParticipantState.WITHDRAWN:
        raise ConflictError("You have withdrawn from this study; nothing more is stored")
    spec = studies.spec_of(session.get_one(Study, participant.study_id))
    kept = user_agent[:USER_AGENT_LENGTH] if spec.collect.user_agent else ""
    visit = Visit(participant_id=participant.id, user_agent=kept)
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
