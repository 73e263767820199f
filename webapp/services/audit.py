"""The audit: one line for each act on a study and its data."""

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from webapp.models import AuditEntry, Study

PARTICIPANT = "participant"
"""Actor of what participants do themselves."""
COMMAND_LINE = "command line"
"""Actor of what is done by a command."""
SYSTEM = "padlab"
"""Actor of what happens by itself."""


def note(
    session: Session, study: Study, actor: str, action: str, *, participant: int | None = None, **details: Any
) -> None:
    """Write a line.

    Parameters
    ----------
    actor : str
        Name of the experimenter, "command line", `PARTICIPANT` or `SYSTEM`.
    action : str
        What was done, for instance "open" or "withdraw".
    participant : int, optional
        Number of the participant whom it concerns, as in `webapp.models.Participant.number`.
    **details
        More, as JSON values; nothing that tells who somebody is.
    """
    session.add(
        AuditEntry(study_id=study.id, actor=actor, action=action, participant=participant, details=dict(details))
    )


def entries(session: Session, study: Study) -> list[AuditEntry]:
    """List the lines of a study, the newest first."""
    query = select(AuditEntry).where(AuditEntry.study_id == study.id).order_by(AuditEntry.id.desc())
    return list(session.scalars(query))
