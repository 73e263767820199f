"""Who takes part, in which sittings, what each was shown and what each answered."""

from datetime import datetime
from enum import StrEnum
from typing import Any

from sqlalchemy import JSON, ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from webapp.db import Base
from webapp.models.columns import Document, Key, Moment, Name, UtcDateTime, now
from webapp.models.study import Stimulus, Study


class ParticipantState(StrEnum):
    """How far somebody is: `lapsed` gave no sign for too long, so that their place may be given to another."""

    ACTIVE = "active"
    COMPLETED = "completed"
    LAPSED = "lapsed"
    WITHDRAWN = "withdrawn"


class Participant(Base):
    """A rater enrolled in a study.

    `number` counts enrolments from 0. `slot` is the place in the study's design, which fixes what is shown and in which
    order; a place that lapsed is given to the next who enrols. `part` counts the parts that are behind the participant.
    """

    __tablename__ = "participant"
    __table_args__ = (
        UniqueConstraint("study_id", "number"),
        UniqueConstraint("study_id", "panel", "panel_id"),
        Index("ix_participant_due", "study_id", "state", "due_at"),
        Index("ix_participant_slot", "study_id", "slot"),
    )

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id"))
    number: Mapped[int]
    slot: Mapped[int]
    state: Mapped[str] = mapped_column(String(10), default=ParticipantState.ACTIVE)
    token: Mapped[str] = mapped_column(String(43), unique=True)
    language: Mapped[str] = mapped_column(String(20))
    panel: Mapped[str | None] = mapped_column(String(20))
    panel_id: Mapped[str | None] = mapped_column(String(100))
    panel_session: Mapped[str | None] = mapped_column(String(200))
    code: Mapped[str | None] = mapped_column(String(40))
    part: Mapped[int] = mapped_column(default=0)
    consented_at: Mapped[Moment] = mapped_column(default=now)
    opens_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    due_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    completed_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    withdrawn_at: Mapped[datetime | None] = mapped_column(UtcDateTime())

    study: Mapped[Study] = relationship()
    trials: Mapped[list["Trial"]] = relationship(back_populates="participant", order_by="Trial.position")


class FreeSlot(Base):
    """A place in a study's design that its holder gave up, for the next who enrols."""

    __tablename__ = "free_slot"

    study_id: Mapped[int] = mapped_column(ForeignKey("study.id"), primary_key=True)
    slot: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)


class Decision(Base):
    """An experimenter's own word on a participant, beside the rules: not paid, or paid but not used."""

    __tablename__ = "decision"

    participant_id: Mapped[int] = mapped_column(ForeignKey("participant.id"), primary_key=True)
    gate: Mapped[str] = mapped_column(String(10))
    reason: Mapped[str] = mapped_column(String(400))
    made_at: Mapped[Moment] = mapped_column(default=now)


class Visit(Base):
    """One sitting of a participant: from opening the browser to closing it."""

    __tablename__ = "visit"

    id: Mapped[Key]
    participant_id: Mapped[int] = mapped_column(ForeignKey("participant.id"), index=True)
    started_at: Mapped[Moment] = mapped_column(default=now)
    user_agent: Mapped[str] = mapped_column(String(400), default="")


class Trial(Base):
    """One page of a participant: what is shown, and which of the study's questions are asked.

    `position` counts from 1 over all parts. `kind` is one of `evaluation.design.plan.KINDS`. `check_place` is the place
    in the part's training, gold or instructed; `repeats` the position of the trial that this one repeats. Trials of the
    kinds "before" and "after" have the name of their one `instrument` and no stimulus.
    """

    __tablename__ = "trial"
    __table_args__ = (UniqueConstraint("participant_id", "position"),)

    id: Mapped[Key]
    participant_id: Mapped[int] = mapped_column(ForeignKey("participant.id"))
    position: Mapped[int]
    part: Mapped[Name]
    kind: Mapped[str] = mapped_column(String(10))
    stimulus_id: Mapped[int | None] = mapped_column(ForeignKey("stimulus.id"), index=True)
    instrument: Mapped[str | None] = mapped_column(String(80))
    check_place: Mapped[int | None]
    repeats: Mapped[int | None]
    round_id: Mapped[int | None] = mapped_column(ForeignKey("annotation_round.id"), index=True)
    shown_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    answered_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    watched: Mapped[float | None]

    participant: Mapped[Participant] = relationship(back_populates="trials")
    stimulus: Mapped[Stimulus | None] = relationship()
    beside: Mapped[list["TrialStimulus"]] = relationship(order_by="TrialStimulus.place")

    @property
    def stimuli(self) -> list[Stimulus]:
        """All that the page shows, in its order."""
        return [] if self.stimulus is None else [self.stimulus, *(other.stimulus for other in self.beside)]


class TrialStimulus(Base):
    """What a trial shows beside its first stimulus; `place` counts from 2."""

    __tablename__ = "trial_stimulus"

    trial_id: Mapped[int] = mapped_column(ForeignKey("trial.id"), primary_key=True)
    place: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    stimulus_id: Mapped[int] = mapped_column(ForeignKey("stimulus.id"), index=True)

    stimulus: Mapped[Stimulus] = relationship()


class Response(Base):
    """The answers to one instrument in one trial. A changed answer is a new revision; the last one counts.

    `answers` are keyed: as if no pole had changed sides. `raw` are the answers as they stood on the page, and `display`
    the order of its items and those whose poles were exchanged; both are empty for answers from before they were kept.
    """

    __tablename__ = "response"
    __table_args__ = (UniqueConstraint("trial_id", "instrument", "revision"),)

    id: Mapped[Key]
    trial_id: Mapped[int] = mapped_column(ForeignKey("trial.id"))
    visit_id: Mapped[int] = mapped_column(ForeignKey("visit.id"), index=True)
    instrument: Mapped[str] = mapped_column(String(80))
    revision: Mapped[int]
    answers: Mapped[Document]
    raw: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    display: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    submitted_at: Mapped[Moment] = mapped_column(default=now)


class PlaybackEvent(Base):
    """What a player did while a trial was on the screen.

    `place` tells which of the trial's clips, from 1; `page_ms` is the time since the page was opened, `media_s` the
    position in the clip; `value` the new rate, the frames dropped so far, or the clip's duration.
    """

    __tablename__ = "playback_event"

    id: Mapped[Key]
    trial_id: Mapped[int] = mapped_column(ForeignKey("trial.id"), index=True)
    visit_id: Mapped[int] = mapped_column(ForeignKey("visit.id"), index=True)
    place: Mapped[int] = mapped_column(default=1)
    kind: Mapped[str] = mapped_column(String(20))
    page_ms: Mapped[int]
    media_s: Mapped[float]
    value: Mapped[float | None]
