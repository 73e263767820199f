"""Every revision, up and down, with rows in every table."""

import json
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import pytest
from alembic import command
from alembic.operations import Operations
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, select, text
from sqlalchemy.exc import IntegrityError

from webapp.config import Settings
from webapp.db import Database, _alembic_config
from webapp.models import Clip, Participant, PlaybackEvent, Response, Stimulus, Study, Trial
from webapp.services import enrolment, studies, trials
from webapp.services.asking import Submission

pytestmark = pytest.mark.every_database

FIRST = "05b9b014921c"
THEN = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
_MOMENT = "2026-01-02 03:04:05.000000"
Row = dict[str, Any]


def _first_rows(study_text: str) -> dict[str, list[Row]]:
    """Two studies as the first revision held them: one with people in it, one without."""
    return {
        "experimenter": [{"id": 1, "name": "wu", "password_hash": "-", "role": "admin", "created_at": _MOMENT}],
        "clip": [
            _clip(1, status="done", bytes=1234, finished_at=_MOMENT),
            _clip(2, status="failed", error="no face"),
        ],
        "study": [
            _study(1, "mini", study_text, state="open"),
            _study(2, "empty", study_text.replace("slug: mini", "slug: empty"), state="draft"),
        ],
        "condition": [
            {"id": 1, "study_id": 1, "name": "subtle", "position": 0},
            {"id": 2, "study_id": 1, "name": "full", "position": 1},
            {"id": 3, "study_id": 2, "name": "subtle", "position": 0},
        ],
        "participant": [
            _participant(1, number=0, completed_at=_MOMENT),
            _participant(2, number=1),
            _participant(3, number=2),
        ],
        "stimulus": [
            {"id": 1, "study_id": 1, "name": "happy", "condition_id": 1, "clip_id": 1},
            {"id": 2, "study_id": 1, "name": "happy", "condition_id": 2, "clip_id": 2},
            {"id": 3, "study_id": 1, "name": "angry", "condition_id": 1, "clip_id": 1},
            {"id": 4, "study_id": 1, "name": "angry", "condition_id": 2, "clip_id": 1},
            {"id": 5, "study_id": 2, "name": "happy", "condition_id": 3, "clip_id": 1},
        ],
        "visit": [
            {"id": 1, "participant_id": 1, "started_at": _MOMENT, "user_agent": "Firefox"},
            {"id": 2, "participant_id": 2, "started_at": _MOMENT, "user_agent": ""},
        ],
        "trial": [
            _trial(1, 1, 1, 1, answered=True),
            _trial(2, 1, 2, 2, answered=True),
            _trial(3, 2, 1, 2, answered=True),
            _trial(4, 2, 2, 1),
            _trial(5, 3, 1, 1),
        ],
        "playback_event": [
            {"id": 1, "trial_id": 1, "visit_id": 1, "kind": "ended", "page_ms": 900, "media_s": 0.6},
        ],
        "response": [
            _response(1, trial=1, visit=1, value=4),
            _response(2, trial=1, visit=1, value=2, revision=2),
            _response(3, trial=2, visit=1, value=5),
            _response(4, trial=3, visit=2, value=1),
        ],
    }


def _clip(key: int, **fields: Any) -> Row:
    spec = json.dumps({"pad": [0.5, 0.0, -0.5], "text": "你好"})
    empty: Row = {"error": None, "bytes": None, "claimed_at": None, "finished_at": None}
    return {**empty, "id": key, "digest": f"{key:064}", "spec": spec, "created_at": _MOMENT, **fields}


def _study(key: int, slug: str, content: str, *, state: str) -> Row:
    digest = f"{key:064}"
    return {
        "id": key,
        "slug": slug,
        "title": "两张脸",
        "state": state,
        "text": content,
        "digest": digest,
        "applied_at": _MOMENT,
    }


def _participant(key: int, *, number: int, completed_at: str | None = None) -> Row:
    return {
        "id": key,
        "study_id": 1,
        "number": number,
        "token": f"token-{key}",
        "language": "zh",
        "consented_at": _MOMENT,
        "completed_at": completed_at,
    }


def _trial(key: int, participant: int, position: int, stimulus: int, *, answered: bool = False) -> Row:
    return {
        "id": key,
        "participant_id": participant,
        "position": position,
        "stimulus_id": stimulus,
        "shown_at": _MOMENT if answered else None,
        "answered_at": _MOMENT if answered else None,
    }


def _response(key: int, *, trial: int, visit: int, value: int, revision: int = 1) -> Row:
    return {
        "id": key,
        "trial_id": trial,
        "visit_id": visit,
        "instrument": "mos5",
        "revision": revision,
        "answers": json.dumps({"mos": value}),
        "submitted_at": _MOMENT,
    }


@pytest.fixture
def empty(settings: Settings) -> Database:
    return Database(settings.database_url)


@pytest.fixture
def source(pytestconfig: pytest.Config) -> str:
    return (pytestconfig.rootpath / "tests" / "data" / "mini.yaml").read_text(encoding="utf-8")


def _up(database: Database, revision: str) -> None:
    with database._migration() as config:
        command.upgrade(config, revision)


def _fill(database: Database, rows: dict[str, list[Row]]) -> None:
    """Fill tables through plain SQL, since the models know only the newest schema."""
    with database.write() as session:
        for table, own in rows.items():
            for row in own:
                places = ", ".join(f"CAST(:{name} AS JSON)" if _is_json(database, name) else f":{name}" for name in row)
                statement = f'INSERT INTO "{table}" ({", ".join(row)}) VALUES ({places})'
                session.execute(text(statement), row)
            if database.engine.dialect.name == "postgresql":
                session.execute(text(f"SELECT setval(pg_get_serial_sequence('{table}', 'id'), 1000)"))


def _is_json(database: Database, column: str) -> bool:
    return column in ("spec", "answers") and database.engine.dialect.name == "postgresql"


def _read(database: Database, columns: dict[str, list[Row]]) -> dict[str, list[Row]]:
    """Read the columns that these rows have, in the same plain form."""
    found: dict[str, list[Row]] = {}
    with database.read() as session:
        for table, rows in columns.items():
            names = ", ".join(f'"{name}"' for name in rows[0])
            query = text(f'SELECT {names} FROM "{table}" ORDER BY id')
            found[table] = [
                {name: _plain(value) for name, value in row.items()} for row in session.execute(query).mappings()
            ]
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, datetime):
        return value.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")
    if isinstance(value, (dict, list)):
        return json.dumps(value)
    return value


@pytest.fixture
def first(empty: Database, source: str) -> Database:
    """A database of the first revision with rows in each of its tables."""
    _up(empty, FIRST)
    rows = _first_rows(source)
    with empty.engine.connect() as connection:
        assert set(inspect(connection).get_table_names()) == {*rows, "alembic_version"}
    _fill(empty, rows)
    return empty


def test_there_is_one_line_of_revisions() -> None:
    scripts = ScriptDirectory.from_config(_alembic_config())
    assert len(scripts.get_heads()) == 1
    assert scripts.get_bases() == [FIRST]


def test_going_up_keeps_every_row_and_gives_the_new_columns_their_values(first: Database, source: str) -> None:
    first.upgrade()
    first.require_current()
    assert _read(first, _first_rows(source)) == _first_rows(source)
    with first.read() as session:
        people = session.scalars(select(Participant).order_by(Participant.id)).all()
        assert [(one.slot, one.state, one.part) for one in people] == [
            (0, "completed", 1),
            (1, "active", 0),
            (2, "active", 0),
        ]
        assert {(one.panel, one.panel_id, one.code, one.withdrawn_at, one.opens_at) for one in people} == {(None,) * 5}
        assert people[0].completed_at == THEN
        counters = [(study.enrolled, study.next_slot) for study in session.scalars(select(Study).order_by(Study.id))]
        assert counters == [(3, 3), (0, 0)]
        everyone = session.scalars(select(Trial).order_by(Trial.id)).all()
        assert {(one.part, one.kind, one.instrument, one.round_id, one.watched) for one in everyone} == {
            ("main", "rating", None, None, None)
        }
        assert [(clip.suffix, clip.duration_s) for clip in session.scalars(select(Clip))] == [("mp4", None)] * 2
        assert session.scalars(select(Stimulus.words)).all() == [None] * 5
        assert [(one.place, one.value) for one in session.scalars(select(PlaybackEvent))] == [(1, None)]
        assert {(one.raw, one.display) for one in session.scalars(select(Response))} == {(None, None)}


def test_who_was_in_the_middle_goes_on_after_going_up(first: Database) -> None:
    first.upgrade()
    with first.write() as session:
        session.execute(text("UPDATE study SET text = replace(text, '[pad12, mos5]', '[mos5]')"))
    with first.write() as session:
        person = enrolment.find(session, "mini", "token-2")
        current = trials.current(session, person)
        assert current is not None
        assert current.position == 2
        sent = {"mos5": Submission({"mos": 3}, {}, {"mos": 3})}
        assert trials.record(session, person, 2, sent, visit_id=2) is None
        assert person.state == "completed"
    with first.write() as session:
        enrolled = enrolment.enrol(session, "mini", language="en")
        assert (enrolled.number, enrolled.slot) == (3, 3)
        line = next(line for line in studies.overviews(session) if line.slug == "mini")
        assert (line.participants, line.completed, line.responses) == (4, 2, 4)


def test_references_are_enforced_after_going_up_and_down(first: Database) -> None:
    def broken() -> list[str]:
        statements = {
            "trial": "UPDATE trial SET participant_id = 99 WHERE id = 1",
            "stimulus": "UPDATE trial SET stimulus_id = 99 WHERE id = 1",
            "response": "UPDATE response SET trial_id = 99 WHERE id = 1",
            "parent": "DELETE FROM participant WHERE id = 1",
            "unique": "UPDATE participant SET number = 1 WHERE id = 1",
            "position": "UPDATE trial SET position = 2 WHERE id = 1",
            "revision": "UPDATE response SET revision = 1 WHERE id = 2",
        }
        refused = []
        for name, statement in statements.items():
            try:
                with first.write() as session:
                    session.execute(text(statement))
            except IntegrityError:
                refused.append(name)
        return refused

    everything = ["trial", "stimulus", "response", "parent", "unique", "position", "revision"]
    assert broken() == everything
    first.upgrade()
    assert broken() == everything
    with first.write() as session:
        session.execute(text("DELETE FROM study WHERE slug = 'empty'"))
    with first.read() as session:
        assert session.scalars(text("SELECT id FROM stimulus ORDER BY id")).all() == [1, 2, 3, 4]
        assert session.scalars(text("SELECT id FROM condition ORDER BY id")).all() == [1, 2]
    first.downgrade(FIRST)
    assert broken() == everything


def _new_rows() -> dict[str, list[Row]]:
    """What only the newest schema has room for, beside the rows of the first."""
    return {
        "annotation_round": [
            {"id": 1, "study_id": 1, "part": "main", "number": 0, "opened_at": _MOMENT, "final": True},
        ],
        "audit_entry": [
            {"id": 1, "study_id": 1, "at": _MOMENT, "actor": "wu", "action": "open", "details": "{}"},
        ],
    }


def _use_the_new_schema(database: Database) -> None:
    statements = (
        "INSERT INTO round_sample (round_id, stimulus_id, place, again) VALUES (1, 1, 0, :no)",
        "INSERT INTO free_slot (study_id, slot) VALUES (1, 7)",
        "INSERT INTO decision (participant_id, gate, reason, made_at) VALUES (2, 'used', 'too fast', :at)",
        "INSERT INTO trial (id, participant_id, position, part, kind, instrument) "
        "VALUES (50, 2, 3, 'main', 'after', 'mos5')",
        "INSERT INTO trial (id, participant_id, position, part, kind, stimulus_id, repeats, answered_at) "
        "VALUES (51, 2, 4, 'main', 'repeat', 1, 1, :at)",
        "INSERT INTO trial_stimulus (trial_id, place, stimulus_id) VALUES (1, 2, 2)",
        "INSERT INTO trial_stimulus (trial_id, place, stimulus_id) VALUES (51, 2, 2)",
        "INSERT INTO response (id, trial_id, visit_id, instrument, revision, answers, raw, display, submitted_at) "
        "VALUES (50, 51, 2, 'mos5', 1, '{}', '{}', '{}', :at)",
        "INSERT INTO playback_event (id, trial_id, visit_id, place, kind, page_ms, media_s, value) "
        "VALUES (50, 51, 2, 2, 'ratechange', 5, 0.1, 2.0)",
        "UPDATE trial SET round_id = 1, watched = 0.5 WHERE id = 2",
        "UPDATE participant SET panel = 'prolific', panel_id = 'abc', slot = 9, state = 'lapsed' WHERE id = 3",
        "UPDATE clip SET suffix = 'png', duration_s = 1.5 WHERE id = 2",
    )
    with database.write() as session:
        for statement in statements:
            session.execute(text(statement), {"no": False, "at": _MOMENT} if ":" in statement else {})


def test_going_down_keeps_what_the_first_schema_has_room_for(first: Database, source: str) -> None:
    first.upgrade()
    rows = _new_rows()
    _fill_new(first, rows)
    _use_the_new_schema(first)
    first.downgrade(FIRST)
    assert first.current() == FIRST
    assert _read(first, _first_rows(source)) == _first_rows(source)
    with first.engine.connect() as connection:
        tables = {
            table: {column["name"] for column in inspect(connection).get_columns(table)}
            for table in inspect(connection).get_table_names()
            if table != "alembic_version"
        }
    assert tables == {table: set(own[0]) for table, own in _first_rows(source).items()}
    first.upgrade()
    first.require_current()
    assert _read(first, _first_rows(source)) == _first_rows(source)


def _fill_new(database: Database, rows: dict[str, list[Row]]) -> None:
    with database.write() as session:
        for table, own in rows.items():
            for row in own:
                statement = f"INSERT INTO {table} ({', '.join(row)}) VALUES ({', '.join(f':{name}' for name in row)})"
                session.execute(text(statement), row)


@pytest.mark.parametrize("fill", [True, False])
def test_every_revision_goes_down_to_nothing_and_up_again(empty: Database, source: str, fill: bool) -> None:
    scripts = ScriptDirectory.from_config(_alembic_config())
    revisions = [script.revision for script in scripts.walk_revisions()][::-1]
    for place, revision in enumerate(revisions):
        _up(empty, revision)
        if place == 0 and fill:
            _fill(empty, _first_rows(source))
    for revision in [*revisions[-2::-1], "base"]:
        empty.downgrade(revision)
        assert empty.current() == (None if revision == "base" else revision)
    with empty.engine.connect() as connection:
        assert inspect(connection).get_table_names() == ["alembic_version"]
    empty.upgrade()
    empty.require_current()


def test_a_migration_that_fails_leaves_everything_as_it_was(
    first: Database, source: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    original: Callable[..., Any] = Operations.create_index

    def fails(self: Operations, name: Any, *arguments: Any, **options: Any) -> Any:
        if name == "ix_participant_slot":
            raise RuntimeError("the power is out")
        return original(self, name, *arguments, **options)

    monkeypatch.setattr(Operations, "create_index", fails)
    with pytest.raises(RuntimeError, match="power"):
        first.upgrade()
    assert first.current() == FIRST
    assert _read(first, _first_rows(source)) == _first_rows(source)
    with first.engine.connect() as connection:
        assert "free_slot" not in inspect(connection).get_table_names()
