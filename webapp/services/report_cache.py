"""Reports that were made before and are still true."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from weakref import WeakKeyDictionary

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation.report.full import FullReport
from webapp.models import AuditEntry, Response, Study

REPORTS = 16
"""Reports that are kept at most."""

ROWS = 2_000_000
"""Rows of scores that the kept reports have at most together; the newest is kept even if it has more."""


class ReportCache:
    """Reports of this process by what they were made from; the one that was used longest ago leaves first."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, FullReport] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], FullReport]) -> FullReport:
        """Return the report that is kept under a key, or make it; whoever asks meanwhile waits for it."""
        with self._lock:
            found = self._kept.pop(key, None)
            if found is None:
                found = make()
            self._kept[key] = found
            while len(self._kept) > 1 and (len(self._kept) > REPORTS or self._rows() > ROWS):
                self._kept.popitem(last=False)
            return found

    def _rows(self) -> int:
        return sum(len(full.report.scores) for full in self._kept.values())


_CACHES: WeakKeyDictionary[object, ReportCache] = WeakKeyDictionary()


def of(session: Session) -> ReportCache:
    """Return the cache of a session's database."""
    return _CACHES.setdefault(session.get_bind(), ReportCache())


def state(session: Session, study: Study) -> tuple[Hashable, ...]:
    """Return what changes whenever a report of the study would: answers are added, and every other act is audited."""
    return (
        study.id,
        study.digest,
        session.scalar(select(func.max(Response.id))),
        session.scalar(select(func.max(AuditEntry.id)).where(AuditEntry.study_id == study.id)),
    )
