import threading
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import func, select, text

from webapp.config import Settings
from webapp.db import Base, Database
from webapp.errors import DatabaseError
from webapp.models import Experimenter


def _experimenter(name: str) -> Experimenter:
    return Experimenter(name=name, password_hash="-", role="admin")


@pytest.mark.every_database
def test_migrations_make_exactly_the_tables_of_the_models(database: Database) -> None:
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
    assert database.current() == database.head()
    database.require_current()


@pytest.mark.every_database
def test_a_write_is_kept_whole_or_not_at_all(database: Database) -> None:
    with database.write() as session:
        session.add(_experimenter("kept"))
    with pytest.raises(RuntimeError), database.write() as session:
        session.add(_experimenter("lost"))
        session.flush()
        raise RuntimeError
    with database.read() as session:
        assert session.scalars(select(Experimenter.name)).all() == ["kept"]


@pytest.mark.every_database
def test_many_writers_at_once_lose_nothing(database: Database) -> None:
    def write(k: int) -> None:
        for n in range(5):
            with database.write() as session:
                session.add(_experimenter(f"{k}-{n}"))

    threads = [threading.Thread(target=write, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        assert session.scalar(select(func.count(Experimenter.id))) == 40


def test_sqlite_is_durable_and_checks_references(database: Database) -> None:
    with database.read() as session:
        pragmas = {
            name: session.execute(text(f"PRAGMA {name}")).scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys")
        }
    assert pragmas == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}


def test_an_empty_database_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match=r"is empty.*padlab db upgrade"):
        Database(f"sqlite:///{tmp_path / 'new.sqlite'}").require_current()


def test_a_file_that_is_no_database_gives_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "padlab.sqlite"
    path.write_text("this is a shopping list, not a database " * 40)
    for use in ("current", "upgrade"):
        with pytest.raises(DatabaseError, match=r"not a database.*PADLAB_DATABASE_URL"):
            getattr(Database(f"sqlite:///{path}"), use)()


def test_a_missing_folder_gives_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="folder"):
        Database(f"sqlite:///{tmp_path / 'nowhere' / 'padlab.sqlite'}")


def test_a_server_that_does_not_answer_gives_one_sentence_without_the_password() -> None:
    with pytest.raises(DatabaseError, match="cannot be used") as error:
        Database("postgresql+psycopg://lab:geheim@127.0.0.1:1/padlab").current()
    assert "geheim" not in str(error.value)


@pytest.mark.every_database
def test_a_database_of_another_version_gives_one_sentence(database: Database) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'fromthefuture'"))
    with pytest.raises(DatabaseError, match="another version of padlab"):
        database.upgrade()


@pytest.mark.every_database
def test_two_upgrades_at_once_make_one_schema(settings: Settings) -> None:
    made: list[str] = []
    threads = [
        threading.Thread(target=lambda: made.append(Database(settings.database_url).upgrade())) for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert made == [Database.head()] * 3


def test_a_fault_while_reading_gives_one_sentence(database: Database) -> None:
    with pytest.raises(DatabaseError, match="no such table"), database.read() as session:
        session.execute(text("SELECT * FROM nowhere"))
