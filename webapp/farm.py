"""Background rendering on Dask: this machine's cores by default, any Dask scheduler by `PADLAB_SCHEDULER`.

Rendering is idempotent (a clip's name is the digest of all that it depends on) and its state is in the database, so a
lost worker, scheduler or web process loses nothing: what is unfinished is submitted again.
"""

import hashlib
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from distributed import Client, KilledWorker, LocalCluster, wait

from synth.clip import clip_digest, render_clip
from synth.clip_spec import ClipSpec
from synth.errors import SynthError
from synth.face import assets
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import FarmError
from webapp.media import MediaStore
from webapp.services import clips, studies
from webapp.services.clips import Job, Progress

POLL_SECONDS = 2.0
MAX_PAUSE_SECONDS = 60.0
STOP_LATENCY_SECONDS = 0.5
CONNECT_SECONDS = 15


@dataclass(frozen=True)
class Outcome:
    """What became of a job: the clip's size in bytes and its length, or one sentence that says what went wrong."""

    digest: str
    size: int = 0
    duration_s: float | None = None
    error: str | None = None


def render_job(job: Job, media_url: str, face_dir: str, models_dir: str) -> Outcome:
    """Render one clip into the media store unless it is there; runs on a worker, knows no database."""
    store = MediaStore(media_url)
    folder, models = Path(face_dir), Path(models_dir)

    def make(path: Path) -> dict[str, Any]:
        if "file" in job.spec:
            raise SynthError(f"The file {job.spec['file']} is gone from the media store; apply its study file again")
        assets.fetch(folder)
        spec = ClipSpec.from_dict(job.spec)
        if clip_digest(spec, folder, models) != job.digest:
            raise SynthError(
                "The models, the face data or the renderer have changed since the study was applied; "
                "apply the study file under a new slug"
            )
        lineage: dict[str, Any] = render_clip(spec, path, folder, models)
        return lineage

    try:
        store.add(job.digest, make)
        return _stored(store, job.digest)
    except (SynthError, OSError) as error:
        return Outcome(job.digest, error=str(error))


def _stored(store: MediaStore, digest: str) -> Outcome:
    return Outcome(digest, size=store.size(digest), duration_s=store.lineage(digest).get("duration_s"))


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
                    # Any free port, for this machine only: nobody looks at the dashboard.
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
            self._client = Client(self._cluster or self._settings.scheduler, timeout=CONNECT_SECONDS)
        except (OSError, TimeoutError, RuntimeError) as error:
            self.__exit__()
            place = self._settings.scheduler or "on this machine"
            raise FarmError(
                f"The Dask scheduler {place} does not answer; start it or correct PADLAB_SCHEDULER"
            ) from error
        except BaseException:
            # Interrupted while the workers were starting: they must not be left behind.
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for part in (self._client, self._cluster):
            if part is not None:
                with suppress(OSError, TimeoutError):
                    part.close()

    def render(self, jobs: Iterable[Job], stop: threading.Event | None = None) -> Iterator[Outcome]:
        """Render jobs on the workers and yield each outcome as it comes; ends early when `stop` is set."""
        if self._client is None:
            raise FarmError("The farm is not open; use it in a with statement")
        place = (self._settings.media_url, str(self._settings.face_dir), str(self._settings.models_dir))
        home = hashlib.sha256("|".join(place).encode()).hexdigest()[:12]
        digests = {
            self._client.submit(render_job, job, *place, key=f"clip-{job.digest}-{home}"): job.digest for job in jobs
        }
        waiting = set(digests)
        while waiting and not (stop and stop.is_set()):
            # Short waits, so that being told to stop does not have to wait for a clip.
            with suppress(TimeoutError):
                wait(waiting, timeout=STOP_LATENCY_SECONDS, return_when="FIRST_COMPLETED")
            for future in [future for future in waiting if future.done()]:
                waiting.remove(future)
                yield _outcome(future, digests[future])


def _outcome(future: Any, digest: str) -> Outcome:
    if future.cancelled():
        return Outcome(digest, error="The rendering was cancelled; render the clips again")
    error = future.exception()
    if isinstance(error, KilledWorker):
        return Outcome(
            digest, error="The rendering process was ended again and again, perhaps for lack of memory; try --workers 1"
        )
    if error is None:
        outcome: Outcome = future.result()
        return outcome
    return Outcome(digest, error=f"The worker failed ({error})")


def requeue_lost(database: Database, settings: Settings) -> int:
    """Queue again the finished clips whose files are gone, and return how many there were."""
    store = MediaStore(settings.media_url)
    with database.read() as session:
        recorded = clips.done(session)
    lost = [digest for digest, suffix in recorded if not store.has(digest, suffix)]
    if lost:
        with database.write() as session:
            clips.requeue(session, lost)
    return len(lost)


def render_unfinished(
    database: Database,
    settings: Settings,
    *,
    slug: str | None = None,
    insist: bool = False,
    workers: int | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    stop: threading.Event | None = None,
) -> list[Outcome]:
    """Render what is unfinished, of one study or of all, and record each clip's state as it changes.

    Parameters
    ----------
    slug : str, optional
        Only this study's clips.
    insist : bool
        Also take what failed before, and what somebody else may be rendering just now.
    workers : int, optional
        Worker processes of the local cluster.
    on_progress : callable, optional
        Called with (finished, all) jobs, first with (0, all).
    stop : threading.Event, optional
        When set, ends early; what is not finished goes back into the queue.

    Returns
    -------
    list of Outcome
        One for each job that was finished, in the order in which they finished.

    Raises
    ------
    FarmError
        If there are no workers.
    """
    with database.write() as session:
        study = studies.find(session, slug) if slug else None
        jobs = clips.claim(session, study, insist=insist)
    if on_progress is not None:
        on_progress(0, len(jobs))
    outcomes: list[Outcome] = []
    open_digests = {job.digest for job in jobs}
    try:
        for outcome in _outcomes(jobs, settings, workers=workers, stop=stop):
            open_digests.discard(outcome.digest)
            with database.write() as session:
                if outcome.error is None:
                    clips.mark_done(session, outcome.digest, outcome.size, outcome.duration_s)
                else:
                    clips.mark_failed(session, outcome.digest, outcome.error)
                clips.renew(session, open_digests)
            outcomes.append(outcome)
            if on_progress is not None:
                on_progress(len(outcomes), len(jobs))
    finally:
        # Interrupted, or without workers: nobody is working on these any more.
        if open_digests:
            with database.write() as session:
                clips.give_back(session, open_digests)
    return outcomes


def _outcomes(
    jobs: list[Job], settings: Settings, *, workers: int | None, stop: threading.Event | None
) -> Iterator[Outcome]:
    """Yield at once what is in the store already; open a farm only for the rest."""
    store = MediaStore(settings.media_url)
    missing = []
    for job in jobs:
        if store.has(job.digest):
            yield _stored(store, job.digest)
        else:
            missing.append(job)
    if not missing:
        return
    # Dressing another face takes a worker longer than drawing a short clip: one after the other.
    missing.sort(key=lambda job: str(job.spec.get("identity")))
    with Farm(settings, workers=min(workers or os.cpu_count() or 1, len(missing))) as farm:
        for outcome in farm.render(missing, stop):
            if outcome.error is None and not store.has(outcome.digest):
                yield Outcome(
                    outcome.digest,
                    error="The workers write to another media store than the server's; give both one PADLAB_MEDIA_URL",
                )
            else:
                yield outcome


def progress(database: Database, slug: str) -> Progress:
    """Return how many of a study's clips are in which state."""
    with database.read() as session:
        return clips.progress(session, studies.find(session, slug))


def watch(settings: Settings, stop: threading.Event | None = None, *, parent: int | None = None) -> None:
    """Render whatever is or becomes pending until told to stop; the work of the server's companion process.

    A database or a scheduler that is away for a while does not end it, but is asked again later.

    Parameters
    ----------
    stop : threading.Event, optional
        Set to end it; in the main thread, SIGTERM and SIGINT end it too.
    parent : int, optional
        Process of the server. One that was killed cannot say goodbye: its companion ends when it has another parent.
    """
    stop = stop or threading.Event()
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop.set())
    pause = POLL_SECONDS
    database = Database(settings.database_url)
    checked_files = False
    while not stop.is_set() and parent in {None, os.getppid()}:
        try:
            if not checked_files:
                requeue_lost(database, settings)
                checked_files = True
            with database.read() as session:
                something = clips.unfinished(session)
            if something:
                render_unfinished(database, settings, stop=stop)
            pause = POLL_SECONDS
        except Exception:
            logging.getLogger(__name__).exception("Rendering in the background failed; trying again in %.0f s", pause)
            pause = min(2 * pause, MAX_PAUSE_SECONDS)
        stop.wait(pause)
    database.dispose()
