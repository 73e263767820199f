"""Places in a study's design: who gets which, and when one is given to another.

Balance rests on this: a design is balanced over its consecutive places, and a place counts only when its holder has
completed the study. Whoever lapses or withdraws gives their place back, and the next who enrols gets it first.
"""

from datetime import datetime, timedelta

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from evaluation.study import StudySpec
from webapp.models import FreeSlot, Participant, ParticipantState, Study
from webapp.models.columns import now
from webapp.services import audit

LAPSED_AT_ONCE = 20
"""How many lapsed participants one enrolment looks after; the others wait for the next."""


def take(session: Session, study: Study, *, first: int = 0, capacity: int | None) -> int | None:
    """Return a place for somebody who enrols, None if there is none now; the caller holds the study's lock.

    Parameters
    ----------
    first : int
        The first place that still has something to do: those before it are not given out again.
    capacity : int or None
        How many places there are; None for any number.
    """
    release_lapsed(session, study)
    free = select(FreeSlot.slot).where(FreeSlot.study_id == study.id, FreeSlot.slot >= first)
    slot = session.scalar(free.order_by(FreeSlot.slot).limit(1))
    if slot is not None:
        _remove(session, study.id, slot)
        return slot
    slot = max(first, study.next_slot)
    if capacity is not None and slot >= capacity:
        return None
    study.next_slot = slot + 1
    return slot


def give_back(session: Session, participant: Participant) -> None:
    """Free a participant's place, unless somebody else has it too."""
    others = select(Participant.id).where(
        Participant.study_id == participant.study_id,
        Participant.slot == participant.slot,
        Participant.id != participant.id,
        Participant.state.in_([ParticipantState.ACTIVE, ParticipantState.COMPLETED]),
    )
    taken = session.scalar(others.limit(1)) is not None
    known = session.get(FreeSlot, (participant.study_id, participant.slot)) is not None
    if not taken and not known:
        session.add(FreeSlot(study_id=participant.study_id, slot=participant.slot))
        session.flush()


def release_lapsed(session: Session, study: Study, *, at: datetime | None = None) -> int:
    """Give back the places of those who have given no sign for too long; return how many.

    Nothing of theirs is lost: who comes back goes on where they stopped (see `return_to`).
    """
    moment = at or now()
    query = (
        select(Participant)
        .where(
            Participant.study_id == study.id,
            Participant.state == ParticipantState.ACTIVE,
            Participant.due_at < moment,
        )
        .order_by(Participant.due_at)
        .limit(LAPSED_AT_ONCE)
        # Whoever is answering at this moment has not lapsed.
        .with_for_update(skip_locked=True)
    )
    lapsed = session.scalars(query).all()
    for participant in lapsed:
        participant.state = ParticipantState.LAPSED
        session.flush()
        give_back(session, participant)
        audit.note(session, study, audit.SYSTEM, "lapse", participant=participant.number, slot=participant.slot)
    return len(lapsed)


def return_to(session: Session, study: Study, participant: Participant) -> None:
    """Take a lapsed participant back who has come again; the caller holds the study's lock.

    They keep their trials. If their place was given to another meanwhile, the design has one participant too many,
    which costs balance but no answers.
    """
    given_away = session.get(FreeSlot, (participant.study_id, participant.slot)) is None
    _remove(session, participant.study_id, participant.slot)
    participant.state = ParticipantState.ACTIVE
    audit.note(session, study, audit.PARTICIPANT, "return", participant=participant.number, place_given_away=given_away)


def sign_of_life(participant: Participant, spec: StudySpec, *, waiting: bool = False) -> None:
    """Set when a participant's place lapses: never while they wait for others, else after the study's hours."""
    if waiting:
        participant.due_at = None
        return
    begins = max(participant.opens_at, now()) if participant.opens_at is not None else now()
    participant.due_at = begins + timedelta(hours=spec.lapse_hours)


def _remove(session: Session, study_id: int, slot: int) -> None:
    session.execute(delete(FreeSlot).where(FreeSlot.study_id == study_id, FreeSlot.slot == slot))
