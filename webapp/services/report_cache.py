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

ROWS = 4_000_000
"""Rows of answers and scores that the kept reports have at most together; the newest is kept even if it has more."""


class ReportCache:
    """Reports of this process by what they were made from; the one that was used longest ago leaves first."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, FullReport] = OrderedDict()
        self._making: dict[Hashable, Lock] = {}
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], FullReport]) -> FullReport:
        """Return the report that is kept under a key, or make it; whoever asks for it meanwhile waits."""
        with self._lock:
            making = self._making.setdefault(key, Lock())
        try:
            with making:
                found = self._taken(key)
                if found is None:
                    found = make()
                self._keep(key, found)
        finally:
            with self._lock:
                self._making.pop(key, None)
        return found

    def _taken(self, key: Hashable) -> FullReport | None:
        with self._lock:
            return self._kept.get(key)

    def _keep(self, key: Hashable, found: FullReport) -> None:
        with self._lock:
            self._kept[key] = found
            self._kept.move_to_end(key)
            while len(self._kept) > 1 and (len(self._kept) > REPORTS or self._rows() > ROWS):
                self._kept.popitem(last=False)

    def _rows(self) -> int:
        reports = [full.report for full in self._kept.values()]
        both = [*reports, *(one.used for one in reports if one.used is not None)]
        return sum(len(one.scores) + len(one.answers) for one in both)


_CACHES: WeakKeyDictionary[object, ReportCache] = WeakKeyDictionary()


def of(session: Session) -> ReportCache:
    """Return the cache of a session's database."""
    return _CACHES.setdefault(session.get_bind(), ReportCache())


def state(session: Session, study: Study) -> tuple[Hashable, ...]:
    """Return what changes whenever a report of the study would: answers are added, and every other act is audited.

    Both are counted over all studies. Their largest keys alone would not do: SQLite gives the keys of erased answers
    anew, and on PostgreSQL an answer may be committed after another with a higher key.
    """
    answers = session.execute(select(func.count(Response.id), func.max(Response.id))).one()
    acts = session.execute(select(func.count(AuditEntry.id), func.max(AuditEntry.id))).one()
    return (study.id, study.digest, *answers, *acts)
