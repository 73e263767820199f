"""Who takes part, in which sittings, what each was shown and what each answered."""

from datetime import datetime

from sqlalchemy import ForeignKey, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from webapp.db import Base
from webapp.models.columns import Document, Key, Moment, UtcDateTime, now
from webapp.models.study import Stimulus, Study


class Participant(Base):
    """A rater enrolled in a study. `number` counts enrolments from 0 and fixes the order of the trials."""

    __tablename__ = "participant"
    __table_args__ = (UniqueConstraint("study_id", "number"),)

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id"))
    number: Mapped[int]
    token: Mapped[str] = mapped_column(String(43), unique=True)
    language: Mapped[str] = mapped_column(String(20))
    consented_at: Mapped[Moment] = mapped_column(default=now)
    completed_at: Mapped[datetime | None] = mapped_column(UtcDateTime())

    study: Mapped[Study] = relationship()
    trials: Mapped[list["Trial"]] = relationship(back_populates="participant", order_by="Trial.position")


class Visit(Base):
    """One sitting of a participant: from opening the browser to closing it."""

    __tablename__ = "visit"

    id: Mapped[Key]
    participant_id: Mapped[int] = mapped_column(ForeignKey("participant.id"), index=True)
    started_at: Mapped[Moment] = mapped_column(default=now)
    user_agent: Mapped[str] = mapped_column(String(400), default="")


class Trial(Base):
    """One stimulus shown once, with the study's instruments. `position` counts from 1."""

    __tablename__ = "trial"
    __table_args__ = (UniqueConstraint("participant_id", "position"),)

    id: Mapped[Key]
    participant_id: Mapped[int] = mapped_column(ForeignKey("participant.id"))
    position: Mapped[int]
    stimulus_id: Mapped[int] = mapped_column(ForeignKey("stimulus.id"), index=True)
    shown_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    answered_at: Mapped[datetime | None] = mapped_column(UtcDateTime())

    participant: Mapped[Participant] = relationship(back_populates="trials")
    stimulus: Mapped[Stimulus] = relationship()


class Response(Base):
    """The answers to one instrument in one trial. A changed answer is a new revision; the last one counts."""

    __tablename__ = "response"
    __table_args__ = (UniqueConstraint("trial_id", "instrument", "revision"),)

    id: Mapped[Key]
    trial_id: Mapped[int] = mapped_column(ForeignKey("trial.id"))
    visit_id: Mapped[int] = mapped_column(ForeignKey("visit.id"), index=True)
    instrument: Mapped[str] = mapped_column(String(80))
    revision: Mapped[int]
    answers: Mapped[Document]
    submitted_at: Mapped[Moment] = mapped_column(default=now)


class PlaybackEvent(Base):
    """What the video element did while a trial was on the screen.

    `page_ms` is the time since the page was opened, `media_s` the position in the clip.
    """

    __tablename__ = "playback_event"

    id: Mapped[Key]
    trial_id: Mapped[int] = mapped_column(ForeignKey("trial.id"), index=True)
    visit_id: Mapped[int] = mapped_column(ForeignKey("visit.id"), index=True)
    kind: Mapped[str] = mapped_column(String(20))
    page_ms: Mapped[int]
    media_s: Mapped[float]
