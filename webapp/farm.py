"""Background rendering on Dask: this machine's cores by default, any Dask scheduler by `PADLAB_SCHEDULER`.

Rendering is idempotent (a clip's name is the digest of all that it depends on) and its state is in the database, so a
lost worker, scheduler or web process loses nothing: what is unfinished is submitted again.
"""

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from distributed import Client, LocalCluster, as_completed

from synth.clip import ClipSpec, clip_digest, render_clip
from synth.errors import SynthError
from synth.face import assets
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import FarmError
from webapp.media import MediaStore
from webapp.models import ClipStatus
from webapp.services import clips, studies
from webapp.services.clips import Job, Progress

UNFINISHED = (ClipStatus.PENDING, ClipStatus.RENDERING)
POLL_SECONDS = 2.0
CONNECT_SECONDS = 15


@dataclass(frozen=True)
class Outcome:
    """What became of a job: the clip's size in bytes, or one sentence that says what went wrong."""

    digest: str
    size: int = 0
    error: str | None = None


def render_job(job: Job, media_url: str, face_dir: str) -> Outcome:
    """Render one clip into the media store unless it is there; runs on a worker, knows no database."""
    store = MediaStore(media_url)
    folder = Path(face_dir)

    def make(path: Path) -> dict[str, Any]:
        assets.fetch(folder)
        spec = ClipSpec.from_dict(job.spec)
        if clip_digest(spec, folder) != job.digest:
            raise SynthError(
                "The models, the face data or the renderer have changed since the study was applied; "
                "apply the study file under a new slug"
            )
        lineage: dict[str, Any] = render_clip(spec, path, folder)
        return lineage

    try:
        store.add(job.digest, make)
        return Outcome(job.digest, size=store.size(job.digest))
    except (SynthError, OSError) as error:
        return Outcome(job.digest, error=str(error))


class Farm:
    """A connection to workers; a context manager.

    Parameters
    ----------
    settings : Settings
        Names the scheduler; without one a ``LocalCluster`` is started and stopped with the context.
    workers : int, optional
        Worker processes of the ``LocalCluster`` (default: the number of cores).

    Raises
    ------
    FarmError
        If the scheduler does not answer.
    """

    def __init__(self, settings: Settings, *, workers: int | None = None) -> None:
        self._settings = settings
        self._workers = workers or os.cpu_count() or 1
        self._cluster: LocalCluster | None = None
        self._client: Client | None = None

    def __enter__(self) -> "Farm":
        try:
            if self._settings.scheduler is None:
                self._cluster = LocalCluster(
                    n_workers=self._workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                )
            self._client = Client(self._cluster or self._settings.scheduler, timeout=CONNECT_SECONDS)
        except (OSError, TimeoutError, RuntimeError) as error:
            self.__exit__()
            place = self._settings.scheduler or "on this machine"
            raise FarmError(
                f"The Dask scheduler {place} does not answer; start it or correct PADLAB_SCHEDULER"
            ) from error
        return self

    def __exit__(self, *_: object) -> None:
        for part in (self._client, self._cluster):
            if part is not None:
                with suppress(OSError, TimeoutError):
                    part.close()

    def render(self, jobs: Iterable[Job]) -> Iterator[Outcome]:
        """Render jobs on the workers and yield each outcome as it comes."""
        if self._client is None:
            raise FarmError("The farm is not open; use it in a with statement")
        place = (self._settings.media_url, str(self._settings.face_dir))
        digests = {self._client.submit(render_job, job, *place, key=f"clip-{job.digest}"): job.digest for job in jobs}
        for future in as_completed(list(digests)):
            error = future.exception()
            failed = Outcome(digests[future], error=f"The worker failed: {error}")
            yield future.result() if error is None else failed


def render_unfinished(
    database: Database,
    settings: Settings,
    *,
    slug: str | None = None,
    statuses: Iterable[ClipStatus] = UNFINISHED,
    workers: int | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[Outcome]:
    """Render what is unfinished, of one study or of all, and record each clip's state as it changes.

    Parameters
    ----------
    slug : str, optional
        Only this study's clips.
    statuses : iterable of ClipStatus
        Which clips to take; adding FAILED tries those again.
    workers : int, optional
        Worker processes of the local cluster.
    on_progress : callable, optional
        Called with (finished, all) jobs, first with (0, all).

    Returns
    -------
    list of Outcome
        One for each job, in the order in which they finished.
    """
    store = MediaStore(settings.media_url)
    with database.write() as session:
        clips.mark_pending(session, [digest for digest in clips.done(session) if not store.has(digest)])
        study = studies.find(session, slug) if slug else None
        jobs = clips.claim(session, study, statuses=statuses)
    outcomes: list[Outcome] = []

    def record(outcome: Outcome) -> None:
        with database.write() as session:
            if outcome.error is None:
                clips.mark_done(session, outcome.digest, outcome.size)
            else:
                clips.mark_failed(session, outcome.digest, outcome.error)
        outcomes.append(outcome)
        if on_progress is not None:
            on_progress(len(outcomes), len(jobs))

    if on_progress is not None:
        on_progress(0, len(jobs))
    missing = []
    for job in jobs:
        if store.has(job.digest):
            record(Outcome(job.digest, size=store.size(job.digest)))
        else:
            missing.append(job)
    if missing:
        with Farm(settings, workers=workers and min(workers, len(missing))) as farm:
            for outcome in farm.render(missing):
                record(outcome)
    return outcomes


def progress(database: Database, slug: str) -> Progress:
    """Return how many of a study's clips are in which state."""
    with database.read() as session:
        return clips.progress(session, studies.find(session, slug))


def watch(settings: Settings, stop: threading.Event | None = None) -> None:
    """Render whatever is or becomes pending until told to stop; the companion process of ``padlab serve``.

    The first look also takes clips that a process before this one left unfinished.
    """
    stop = stop or threading.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop.set())
    database = Database(settings.database_url)
    parent = os.getppid()
    statuses: tuple[ClipStatus, ...] = UNFINISHED
    # A server that was killed cannot say goodbye: its companion then has another parent, and ends by itself.
    while not stop.is_set() and os.getppid() == parent:
        try:
            render_unfinished(database, settings, statuses=statuses)
            statuses = (ClipStatus.PENDING,)
        except FarmError as error:
            logging.getLogger(__name__).warning("%s", error)
            statuses = UNFINISHED
        stop.wait(POLL_SECONDS)


if __name__ == "__main__":
    watch(Settings.from_env())
