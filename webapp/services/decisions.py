"""An experimenter's own word on a participant, beside the rules of screening."""

from types import MappingProxyType

from sqlalchemy import select
from sqlalchemy.orm import Session

from webapp.errors import ConflictError
from webapp.models import Decision, Participant, Study
from webapp.models.columns import now
from webapp.services import audit, enrolment

GATES = MappingProxyType(
    {
        "accepted": "neither paid nor used",
        "used": "paid, but not used in the analysis",
    }
)
"""What can be decided: which gate is closed. Decisions exclude; they do not undo what a rule of the study file says."""
REASON_LENGTH = 400


def of(session: Session, participant: Participant) -> Decision | None:
    """Return the decision on a participant, None if there is none."""
    return session.get(Decision, participant.id)


def of_study(session: Session, study: Study) -> dict[int, Decision]:
    """Return the decisions of a study by the participants' numbers (from 0)."""
    rows = session.execute(select(Participant.number, Decision).join(Decision).where(Participant.study_id == study.id))
    return dict(rows.all())


def decide(session: Session, participant: Participant, gate: str, reason: str, *, actor: str) -> None:
    """Set the decision on a participant; an empty gate takes it back.

    Raises
    ------
    ConflictError
        If the gate is none of `GATES`, or the reason is missing or too long.
    """
    # Two decisions at once, or one during a withdrawal, come one after the other.
    participant = enrolment.locked(session, participant.id)
    study = session.get_one(Study, participant.study_id)
    found = of(session, participant)
    if not gate:
        if found is not None:
            session.delete(found)
            audit.note(session, study, actor, "take back decision", participant=participant.number)
        return
    if gate not in GATES:
        raise ConflictError(f"There is no decision '{gate}'; there are: {', '.join(GATES)}")
    if not 0 < len(reason) <= REASON_LENGTH:
        raise ConflictError(f"A decision takes a reason of 1 to {REASON_LENGTH} characters")
    if found is None:
        found = Decision(participant_id=participant.id, gate=gate, reason=reason)
        session.add(found)
    found.gate, found.reason, found.made_at = gate, reason, now()
    audit.note(session, study, actor, "decide", participant=participant.number, gate=gate)
