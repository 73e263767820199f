"""Many simulated raters at once."""

import heapq
import threading
import time
from collections.abc import Callable, Sequence

from webapp.bots.browser import BotError, NoEntryError
from webapp.bots.visit import POLL_S, Standing, Visit

AT_ONCE = 8
PATIENCE_S = 60.0
_REPORT_S = 0.25
# Rendering begins with starting its workers, and a long clip takes its time.
_FOR_CLIPS = 10


class Crowd:
    """Raters who go through a study, a few at a time.

    Whoever has to wait (for the other raters of a round, for a place, for clips) makes room for another, so that a
    round gets all the raters it needs, however many work at once.

    Parameters
    ----------
    visits : sequence of Visit
        The raters. They enrol one after the other in this order, so that the same rater gets the same place each time.
    at_once : int
        How many work at once.
    patience_s : float
        Seconds in which somebody must get on, else those who wait give up; ten times as long for clips.
    """

    def __init__(self, visits: Sequence[Visit], *, at_once: int = AT_ONCE, patience_s: float = PATIENCE_S) -> None:
        self._visits = visits
        self._at_once = at_once
        self._patience_s = patience_s
        self._changed = threading.Condition()
        self._waiting: list[tuple[float, int]] = []
        self._last_progress = time.monotonic()
        self._fault: Exception | None = None

    def run(self, report: Callable[[Sequence[Visit]], None]) -> float:
        """Let all raters go as far as they can.

        Parameters
        ----------
        report : callable
            Called with the raters now and then.

        Returns
        -------
        float
            Seconds that it took.

        Raises
        ------
        NoEntryError
            If nobody can take part.
        """
        began = time.monotonic()
        for visit in self._visits:
            try:
                visit.enrol()
            except BotError as error:
                if isinstance(error, NoEntryError) and visit is self._visits[0]:
                    raise
                visit.fail(str(error))
            report(self._visits)
        self._note_progress()
        self._waiting = [(0.0, place) for place, visit in enumerate(self._visits) if not visit.ended]
        workers = [
            threading.Thread(target=self._work, daemon=True) for _ in range(min(self._at_once, len(self._waiting)))
        ]
        for worker in workers:
            worker.start()
        for worker in workers:
            while worker.is_alive():
                worker.join(_REPORT_S)
                report(self._visits)
        if self._fault is not None:
            raise self._fault
        return time.monotonic() - began

    def _work(self) -> None:
        while (visit := self._next()) is not None:
            try:
                self._accompany(visit)
            except BotError as error:
                visit.fail(str(error))
            except Exception as error:
                # A fault of padlab's own is told by the command, in its thread.
                self._fault = error
                visit.fail("a fault")
            with self._changed:
                if not visit.ended:
                    heapq.heappush(self._waiting, (time.monotonic() + POLL_S, visit.number - 1))
                self._changed.notify_all()

    def _accompany(self, visit: Visit) -> None:
        """Stay with a rater until they have to wait or are through."""
        before = (visit.standing, visit.progress)
        # Told before the look: whoever finishes meanwhile may have opened a place.
        nobody_else = self._all_full()
        while visit.go_on():
            self._note_progress()
        if visit.ended or (visit.standing, visit.progress) != before:
            self._note_progress()
        elif visit.standing == Standing.FULL and nobody_else:
            visit.fail("all places in the study are taken")
        else:
            patience_s = self._patience_s * (_FOR_CLIPS if visit.standing == Standing.RENDERING else 1)
            if time.monotonic() - self._last_progress > patience_s:
                visit.give_up(patience_s)

    def _next(self) -> Visit | None:
        """Return the rater whose turn it is, None when all are through."""
        with self._changed:
            while not all(visit.ended for visit in self._visits):
                pause = self._waiting[0][0] - time.monotonic() if self._waiting else None
                if pause is not None and pause <= 0:
                    return self._visits[heapq.heappop(self._waiting)[1]]
                self._changed.wait(pause)
            return None

    def _note_progress(self) -> None:
        self._last_progress = time.monotonic()

    def _all_full(self) -> bool:
        return all(visit.ended or visit.standing == Standing.FULL for visit in self._visits)
