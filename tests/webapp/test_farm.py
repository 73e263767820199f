import dataclasses
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from distributed import LocalCluster
from sqlalchemy import select, update

from evaluation.study import StudySpec
from webapp import farm
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import FarmError
from webapp.media import MediaStore
from webapp.models import Clip, ClipStatus
from webapp.services import studies


def _states(database: Database) -> list[str]:
    with database.read() as session:
        return list(session.scalars(select(Clip.status)))


def _set_all(database: Database, status: ClipStatus, *, minutes_ago: float = 0) -> None:
    claimed = datetime.now(UTC) - timedelta(minutes=minutes_ago)
    with database.write() as session:
        session.execute(update(Clip).values(status=status, claimed_at=claimed))


def _fail(*_: object, **__: object) -> None:
    raise AssertionError("a cluster was started although there was nothing to render")


def test_clips_that_are_there_are_not_rendered_again(
    mini: str, database: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    _set_all(database, ClipStatus.RENDERING)
    monkeypatch.setattr(farm, "LocalCluster", _fail)
    assert farm.render_unfinished(database, settings, slug=mini) == []
    outcomes = farm.render_unfinished(database, settings, slug=mini, insist=True)
    assert len(outcomes) == 4
    assert _states(database) == ["done"] * 4


def test_lost_files_are_rendered_again_on_any_scheduler(
    mini: str, database: Database, settings: Settings, tmp_path: Path
) -> None:
    """The store was emptied: the same bytes come back, from workers of a cluster that somebody else runs."""
    with database.read() as session:
        digests = list(session.scalars(select(Clip.digest)))
    before = MediaStore(settings.media_url)
    elsewhere = dataclasses.replace(settings, media_url=str(tmp_path / "empty"))
    seen: list[tuple[int, int]] = []
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        remote = dataclasses.replace(elsewhere, scheduler=cluster.scheduler_address)
        assert farm.requeue_lost(database, remote) == 4
        farm.render_unfinished(database, remote, on_progress=lambda done, total: seen.append((done, total)))
    assert seen == [(k, 4) for k in range(5)]
    after = MediaStore(elsewhere.media_url)
    assert [after.read(digest) for digest in digests] == [before.read(digest) for digest in digests]
    assert after.lineage(digests[0])["spec"]["pad"] == before.lineage(digests[0])["spec"]["pad"]


def test_a_clip_that_cannot_be_made_says_why(
    database: Database, settings: Settings, pytestconfig: pytest.Config, tmp_path: Path
) -> None:
    source = (pytestconfig.rootpath / "tests" / "data" / "mini.yaml").read_text(encoding="utf-8")
    source = source.replace("width: 96", "width: 98")
    with database.write() as session:
        studies.apply(session, StudySpec.from_yaml(source), source, settings)
        first = session.scalars(select(Clip)).first()
        assert first is not None
        first.digest = "0" * 64
    outcomes = farm.render_unfinished(database, settings)
    failed = [outcome for outcome in outcomes if outcome.error]
    assert [outcome.digest for outcome in failed] == ["0" * 64]
    assert "have changed since the study was applied" in str(failed[0].error)
    assert sorted(_states(database)) == ["done", "done", "done", "failed"]


def test_a_scheduler_that_does_not_answer_gives_one_sentence(
    mini: str, database: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(farm, "CONNECT_SECONDS", 1)
    gone = dataclasses.replace(settings, scheduler="tcp://127.0.0.1:9", media_url=str(tmp_path / "empty"))
    farm.requeue_lost(database, gone)
    with pytest.raises(FarmError, match="PADLAB_SCHEDULER"):
        farm.render_unfinished(database, gone)
    assert _states(database) == ["pending"] * 4


def test_the_watcher_picks_up_what_is_left_over(mini: str, database: Database, settings: Settings) -> None:
    _set_all(database, ClipStatus.RENDERING, minutes_ago=10)
    stop = threading.Event()
    watcher = threading.Thread(target=farm.watch, args=(settings, stop))
    watcher.start()
    try:
        for _ in range(100):
            if _states(database) == ["done"] * 4:
                break
            stop.wait(0.1)
    finally:
        stop.set()
        watcher.join(20)
    assert _states(database) == ["done"] * 4


def test_being_told_to_stop_gives_the_rest_back(
    mini: str, database: Database, settings: Settings, tmp_path: Path
) -> None:
    empty = dataclasses.replace(settings, media_url=str(tmp_path / "empty"))
    farm.requeue_lost(database, empty)
    stop = threading.Event()
    farm.render_unfinished(
        database, empty, workers=1, stop=stop, on_progress=lambda done, _: stop.set() if done == 1 else None
    )
    states = _states(database)
    assert "rendering" not in states
    assert "pending" in states
    assert "done" in states


def test_a_fault_does_not_end_the_watcher(
    mini: str, database: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    _set_all(database, ClipStatus.PENDING)
    monkeypatch.setattr(farm, "POLL_SECONDS", 0.05)
    faults = iter([RuntimeError("the database is away"), RuntimeError("still away")])
    real = farm.requeue_lost

    def away(*arguments: Database | Settings) -> int:
        fault = next(faults, None)
        if fault is not None:
            raise fault
        return real(database, settings)

    monkeypatch.setattr(farm, "requeue_lost", away)
    stop = threading.Event()
    watcher = threading.Thread(target=farm.watch, args=(settings, stop))
    watcher.start()
    for _ in range(100):
        if _states(database) == ["done"] * 4:
            break
        stop.wait(0.1)
    stop.set()
    watcher.join(20)
    assert _states(database) == ["done"] * 4
