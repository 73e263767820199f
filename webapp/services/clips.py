"""Clips: which ones are still to be rendered, and how far rendering is."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from webapp.models import Clip, ClipStatus, Stimulus, Study
from webapp.models.columns import now


@dataclass(frozen=True)
class Progress:
    """How many clips are in which state."""

    pending: int = 0
    rendering: int = 0
    done: int = 0
    failed: int = 0

    @property
    def total(self) -> int:
        """All clips."""
        return self.pending + self.rendering + self.done + self.failed

    @property
    def unfinished(self) -> int:
        """Clips that are waiting or being rendered."""
        return self.pending + self.rendering

    @property
    def percent(self) -> int:
        """Share of clips that are done, 0 to 100, rounded down so that 100 means all."""
        return 100 * self.done // self.total if self.total else 100

    def to_dict(self) -> dict[str, int]:
        """Return the four counts by name."""
        return asdict(self)


@dataclass(frozen=True)
class Job:
    """A clip to be rendered."""

    digest: str
    spec: dict[str, Any]


def progress(session: Session, study: Study) -> Progress:
    """Count the clips of a study by state."""
    rows = session.execute(
        select(Clip.status, func.count(Clip.id.distinct()))
        .join(Stimulus, Stimulus.clip_id == Clip.id)
        .where(Stimulus.study_id == study.id)
        .group_by(Clip.status)
    )
    return Progress(**{str(status): count for status, count in rows})


def failures(session: Session, study: Study) -> list[tuple[str, str, str]]:
    """List (stimulus, condition, what went wrong) of a study's failed clips."""
    rows = session.scalars(
        select(Stimulus).join(Clip).where(Stimulus.study_id == study.id, Clip.status == ClipStatus.FAILED)
    )
    return [(stimulus.name, stimulus.condition.name, stimulus.clip.error or "") for stimulus in rows]


def claim(session: Session, study: Study | None = None, *, statuses: Iterable[ClipStatus]) -> list[Job]:
    """Mark the clips that are in one of `statuses` as being rendered, and return them as jobs.

    Rendering is idempotent, so a clip that was left "rendering" by a process that died may be claimed again.
    """
    query = select(Clip).where(Clip.status.in_(list(statuses))).order_by(Clip.id)
    if study is not None:
        query = query.where(Clip.id.in_(select(Stimulus.clip_id).where(Stimulus.study_id == study.id)))
    clips = session.scalars(query.with_for_update(skip_locked=True)).all()
    for clip in clips:
        clip.status = ClipStatus.RENDERING
        clip.error = None
    return [Job(clip.digest, clip.spec) for clip in clips]


def mark_done(session: Session, digest: str, size: int) -> None:
    """Record that a clip is in the media store, with its size in bytes."""
    session.execute(
        update(Clip)
        .where(Clip.digest == digest)
        .values(status=ClipStatus.DONE, bytes=size, error=None, finished_at=now())
    )


def mark_failed(session: Session, digest: str, error: str) -> None:
    """Record why a clip could not be rendered."""
    session.execute(
        update(Clip).where(Clip.digest == digest).values(status=ClipStatus.FAILED, error=error, finished_at=now())
    )


def done(session: Session) -> list[str]:
    """List the digests of all clips that are recorded as done."""
    return list(session.scalars(select(Clip.digest).where(Clip.status == ClipStatus.DONE)))


def mark_pending(session: Session, digests: Iterable[str]) -> None:
    """Put clips back in the queue, for instance because their files are gone."""
    session.execute(update(Clip).where(Clip.digest.in_(list(digests))).values(status=ClipStatus.PENDING))
