"""What was done to a study and its data, by whom and when; lines are added, never changed."""

from sqlalchemy import ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from webapp.db import Base
from webapp.models.columns import Document, Key, Moment, now


class AuditEntry(Base):
    """One act. `participant` is a number, not a key: the line outlives whom it tells of."""

    __tablename__ = "audit_entry"

    id: Mapped[Key]
    at: Mapped[Moment] = mapped_column(default=now)
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id"), index=True)
    actor: Mapped[str] = mapped_column(String(80))
    action: Mapped[str] = mapped_column(String(40))
    participant: Mapped[int | None]
    details: Mapped[Document]
