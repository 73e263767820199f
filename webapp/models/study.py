"""A study as it was applied, its conditions and stimuli, and the clips that show them."""

from datetime import datetime
from enum import StrEnum
from types import MappingProxyType

from sqlalchemy import JSON, ForeignKey, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from webapp.db import Base
from webapp.models.columns import Digest, Document, Key, Moment, Name, UtcDateTime, now

MEDIA = MappingProxyType(
    {
        **dict.fromkeys(("mp4", "webm"), "video"),
        **dict.fromkeys(("wav", "mp3", "ogg", "m4a"), "audio"),
        **dict.fromkeys(("png", "jpg", "jpeg", "webp", "gif"), "image"),
    }
)
"""What each kind of file is, by its suffix; others are not taken."""


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
    """A study file as applied: its text is kept, so that what was collected can always be read with it.

    `enrolled` counts those who ever enrolled, `next_slot` the places of the design that were given out.
    """

    __tablename__ = "study"

    id: Mapped[Key]
    slug: Mapped[Name] = mapped_column(unique=True)
    title: Mapped[str] = mapped_column(String(200))
    state: Mapped[str] = mapped_column(String(10), default=StudyState.DRAFT)
    text: Mapped[str] = mapped_column(Text())
    digest: Mapped[Digest]
    applied_at: Mapped[Moment] = mapped_column(default=now)
    enrolled: Mapped[int] = mapped_column(default=0)
    next_slot: Mapped[int] = mapped_column(default=0)

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
    """A clip by its identity: the digest of specification, models, face data and renderer version.

    A file of the experimenter's own is a clip too: its identity is the digest of its bytes, and its `spec` says from
    which file it came. `suffix` is that of the file in the media store.
    """

    __tablename__ = "clip"

    id: Mapped[Key]
    digest: Mapped[Digest] = mapped_column(unique=True)
    spec: Mapped[Document]
    status: Mapped[str] = mapped_column(String(10), default=ClipStatus.PENDING, index=True)
    error: Mapped[str | None] = mapped_column(Text())
    bytes: Mapped[int | None]
    suffix: Mapped[str] = mapped_column(String(5), default="mp4")
    duration_s: Mapped[float | None]
    created_at: Mapped[Moment] = mapped_column(default=now)
    claimed_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    finished_at: Mapped[datetime | None] = mapped_column(UtcDateTime())

    @property
    def medium(self) -> str:
        """What shows it: "video", "audio" or "image"."""
        return MEDIA[self.suffix]

    @property
    def is_still(self) -> bool:
        """Whether it has no beginning and no end."""
        return self.medium == "image"


class Stimulus(Base):
    """What a trial shows: one item of the study file in one condition, and the clip made for it.

    `words` are the prosodic words of its sentence, where the study asks about them.
    """

    __tablename__ = "stimulus"
    __table_args__ = (UniqueConstraint("study_id", "name", "condition_id"),)

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id", ondelete="CASCADE"))
    name: Mapped[Name]
    condition_id: Mapped[int] = mapped_column(ForeignKey("condition.id", ondelete="CASCADE"), index=True)
    clip_id: Mapped[int] = mapped_column(ForeignKey("clip.id"), index=True)
    words: Mapped[list[str] | None] = mapped_column(JSON(none_as_null=True))

    study: Mapped[Study] = relationship(back_populates="stimuli")
    condition: Mapped[Condition] = relationship()
    clip: Mapped[Clip] = relationship()
