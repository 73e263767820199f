"""Clips: which ones are still to be rendered, and how far rendering is."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import timedelta
from typing import Any

from sqlalchemy import ColumnElement, and_, func, or_, select, update
from sqlalchemy.orm import Session

from webapp.models import Clip, ClipStatus, Stimulus, Study
from webapp.models.columns import now

CLAIM_MINUTES = 5


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


def unfinished(session: Session) -> bool:
    """Tell whether a clip waits, or was claimed by somebody who has not been heard of since."""
    query = select(Clip.id).where(_unclaimed(), Clip.id.in_(select(Stimulus.clip_id))).limit(1)
    return session.scalar(query) is not None


def claim(session: Session, study: Study | None = None, *, insist: bool = False) -> list[Job]:
    """Mark the clips that are still to be made as being rendered, and return them as jobs.

    Parameters
    ----------
    study : Study, optional
        Only the clips of this study.
    insist : bool
        Also take what failed before, and what somebody else may be rendering just now.

    Returns
    -------
    list of Job
        Clips that wait, and those that somebody claimed longer than `CLAIM_MINUTES` ago: rendering is idempotent, so
        a clip that two make does no harm.
    """
    wanted = Clip.status != ClipStatus.DONE if insist else _unclaimed()
    shown = select(Stimulus.clip_id)
    if study is not None:
        shown = shown.where(Stimulus.study_id == study.id)
    query = select(Clip).where(wanted, Clip.id.in_(shown)).order_by(Clip.id)
    clips = session.scalars(query.with_for_update(skip_locked=True)).all()
    for clip in clips:
        clip.status = ClipStatus.RENDERING
        clip.claimed_at = now()
        clip.error = None
    return [Job(clip.digest, clip.spec) for clip in clips]


def renew(session: Session, digests: Iterable[str]) -> None:
    """Say that claimed clips are still being worked on."""
    _update(session, digests, ClipStatus.RENDERING, claimed_at=now())


def give_back(session: Session, digests: Iterable[str]) -> None:
    """Put claimed clips that will not be made now back in the queue."""
    _update(session, digests, ClipStatus.RENDERING, status=ClipStatus.PENDING, claimed_at=None)


def requeue(session: Session, digests: Iterable[str]) -> None:
    """Put finished clips whose files are gone back in the queue."""
    _update(session, digests, ClipStatus.DONE, status=ClipStatus.PENDING, claimed_at=None)


def _unclaimed() -> ColumnElement[bool]:
    given_up = now() - timedelta(minutes=CLAIM_MINUTES)
    abandoned = and_(Clip.status == ClipStatus.RENDERING, Clip.claimed_at < given_up)
    return or_(Clip.status == ClipStatus.PENDING, abandoned)


def _update(session: Session, digests: Iterable[str], was: ClipStatus, **values: Any) -> None:
    # One row at a time: a list of thousands would pass the number of variables that SQLite takes.
    for digest in digests:
        session.execute(update(Clip).where(Clip.digest == digest, Clip.status == was).values(**values))


def mark_done(session: Session, digest: str, size: int, duration_s: float | None = None) -> None:
    """Record that a clip is in the media store, with its size in bytes and its length in seconds."""
    session.execute(
        update(Clip)
        .where(Clip.digest == digest)
        .values(status=ClipStatus.DONE, bytes=size, duration_s=duration_s, error=None, finished_at=now())
    )


def mark_failed(session: Session, digest: str, error: str) -> None:
    """Record why a clip could not be rendered, unless somebody else has rendered it meanwhile."""
    session.execute(
        update(Clip)
        .where(Clip.digest == digest, Clip.status != ClipStatus.DONE)
        .values(status=ClipStatus.FAILED, error=error, finished_at=now())
    )


def done(session: Session) -> list[tuple[str, str]]:
    """List digest and suffix of all clips that are recorded as done."""
    found = select(Clip.digest, Clip.suffix).where(Clip.status == ClipStatus.DONE)
    return [(digest, suffix) for digest, suffix in session.execute(found)]
