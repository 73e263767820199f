"""Rounds of annotation: which samples were rated in which."""

from datetime import datetime

from sqlalchemy import ForeignKey, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from webapp.db import Base
from webapp.models.columns import Key, Moment, Name, UtcDateTime, now
from webapp.models.study import Stimulus


class AnnotationRound(Base):
    """A round of a part that is annotated in rounds; `number` counts from 0, and `final` ends the part."""

    __tablename__ = "annotation_round"
    __table_args__ = (UniqueConstraint("study_id", "part", "number"),)

    id: Mapped[Key]
    study_id: Mapped[int] = mapped_column(ForeignKey("study.id"))
    part: Mapped[Name]
    number: Mapped[int]
    opened_at: Mapped[Moment] = mapped_column(default=now)
    completed_at: Mapped[datetime | None] = mapped_column(UtcDateTime())
    final: Mapped[bool] = mapped_column(default=False)

    samples: Mapped[list["RoundSample"]] = relationship(order_by="RoundSample.place")


class RoundSample(Base):
    """A stimulus that is rated in a round; `again` if it was rated in an earlier one."""

    __tablename__ = "round_sample"

    round_id: Mapped[int] = mapped_column(ForeignKey("annotation_round.id"), primary_key=True)
    stimulus_id: Mapped[int] = mapped_column(ForeignKey("stimulus.id"), primary_key=True, index=True)
    place: Mapped[int]
    again: Mapped[bool]

    stimulus: Mapped[Stimulus] = relationship()
