"""A study as it was applied, its conditions and stimuli, and the clips that show them."""

from datetime import datetime
from enum import StrEnum

from sqlalchemy import ForeignKey, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from webapp.db import Base
from webapp.models.columns import Digest, Document, Key, Moment, Name, UtcDateTime, now


class StudyState(StrEnum):
    """Whether participants may enter."""

    DRAFT = "draft"
    OPEN = "open"
    CLOSED = "closed"


class ClipStatus(StrEnum):
    """How far the rendering of a clip is."""

    PENDING = "pending"
    RENDERING = "rendering"
    DONE = "done"
    FAILED = "failed"


class Study(Base):
    """A study file as applied: its text is kept, so that what was collected can always be read with it."""

    __tablename__ = "study"

    id: Mapped[Key]
    slug: Mapped[Name] = mapped_column(unique=True)
    title: Mapped[str] = mapped_column(String(200))
    state: Mapped[str] = mapped_column(String(10), default=StudyState.DRAFT)
    text: Mapped[str] = mapped_column(Text())
    digest: Mapped[Digest]
    applied_at: Mapped[Moment] = mapped_column(default=now)

    conditions: Mapped[list["Condition"]] = relationship(
        back_populates="study", order_by="Condition.position", cascade="all, delete-orphan"
    )
    stimuli: Mapped[list["Stimulus"]] = relationship(
        back_populates="study", order_by="Stimulus.id", cascade="all, delete-orphan"
    )


class Condition(Base):
    """An experimental condition (the papers' "group")."""

    __tablename__ = "condition"
    __table_args__ = (UniqueConstraint("study_id", "name"),)

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id", ondelete="CASCADE"))
    name: Mapped[Name]
    position: Mapped[int]

    study: Mapped[Study] = relationship(back_populates="conditions")


class Clip(Base):
    """A clip by its identity: the digest of specification, models, face data and renderer version."""

    __tablename__ = "clip"

    id: Mapped[Key]
    digest: Mapped[Digest] = mapped_column(unique=True)
    spec: Mapped[Document]
    status: Mapped[str] = mapped_column(String(10), default=ClipStatus.PENDING, index=True)
    error: Mapped[str | None] = mapped_column(Text())
    bytes: Mapped[int | None]
    created_at: Mapped[Moment] = mapped_column(default=now)
    claimed_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    finished_at: Mapped[datetime | None] = mapped_column(UtcDateTime())


class Stimulus(Base):
    """What a trial shows: one item of the study file in one condition, and the clip made for it."""

    __tablename__ = "stimulus"
    __table_args__ = (UniqueConstraint("study_id", "name", "condition_id"),)

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id", ondelete="CASCADE"))
    name: Mapped[Name]
    condition_id: Mapped[int] = mapped_column(ForeignKey("condition.id", ondelete="CASCADE"), index=True)
    clip_id: Mapped[int] = mapped_column(ForeignKey("clip.id"), index=True)

    study: Mapped[Study] = relationship(back_populates="stimuli")
    condition: Mapped[Condition] = relationship()
    clip: Mapped[Clip] = relationship()
