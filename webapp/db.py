"""The door to the database: SQLite or PostgreSQL, one transaction for each use."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util.exc import CommandError
from sqlalchemy import Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.orm import DeclarativeBase, Session
from sqlalchemy.schema import MetaData

from webapp.errors import DatabaseError
from webapp.resources import resource_dir

BUSY_SECONDS = 30
UPGRADE_LOCK = 0x9AD1AB


class Base(DeclarativeBase):
    """Base of all models, with constraint names that migrations can rely on."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


class Database:
    """An engine and the two ways to use it, ``read()`` and ``write()``.

    Parameters
    ----------
    url : str
        SQLAlchemy URL (see `webapp.config.Settings`).
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.engine = _engine(url)
        # The option travels with the connection to the "begin" event below.
        self._writing = self.engine.execution_options(padlab_write=True)
        # A report asks several questions, and all answers are to be of one moment; so they are on SQLite anyway.
        one_moment = {} if self.engine.dialect.name == "sqlite" else {"isolation_level": "REPEATABLE READ"}
        self._reading = self.engine.execution_options(**one_moment)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Open a session for reading; nothing is committed."""
        with _one_sentence(self.url), Session(self._reading, autoflush=False) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """Open a session whose transaction is committed, and durable, when the block ends without an error."""
        with (
            _one_sentence(self.url),
            Session(self._writing, expire_on_commit=False) as session,
            session.begin(),
        ):
            yield session

    def upgrade(self) -> str:
        """Bring the schema to the newest revision and return that revision."""
        with _one_sentence(self.url), self._migration() as config:
            try:
                command.upgrade(config, "head")
            except CommandError as error:
                raise self._newer(str(error)) from error
        return self.head()

    def downgrade(self, revision: str) -> None:
        """Bring the schema back to an earlier revision; what that has no room for is lost."""
        with _one_sentence(self.url), self._migration() as config:
            command.downgrade(config, revision)

    @contextmanager
    def _migration(self) -> Iterator[Config]:
        """Hand a connection to Alembic, in one transaction that ends with every reference whole."""
        config = _alembic_config()
        with self._writing.connect() as connection:
            sqlite = connection.dialect.name == "sqlite"
            if sqlite:
                # SQLite changes a table by making it anew; the old one's end must not count as that of its rows. The
                # switch has no effect inside a transaction, so it comes before the first one.
                connection.connection.cursor().execute("PRAGMA foreign_keys=OFF")
            try:
                with connection.begin():
                    if not sqlite:
                        # Two that start at once must not both make the tables; the lock ends with the transaction.
                        connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": UPGRADE_LOCK})
                    config.attributes["connection"] = connection
                    yield config
                    if sqlite and connection.exec_driver_sql("PRAGMA foreign_key_check").first() is not None:
                        raise DatabaseError(
                            f"The database {_shown(self.url)} has rows that refer to nothing, and stays as it was; "
                            "restore it from a backup"
                        )
            finally:
                if sqlite:
                    connection.connection.cursor().execute("PRAGMA foreign_keys=ON")

    def _newer(self, reason: str) -> DatabaseError:
        return DatabaseError(
            f"The database {_shown(self.url)} was made by another version of padlab ({reason}); "
            "use that version, or another database"
        )

    def current(self) -> str | None:
        """Return the revision that the database has, None for an empty one."""
        with _one_sentence(self.url), self.engine.connect() as connection:
            return MigrationContext.configure(connection).get_current_revision()

    @staticmethod
    def head() -> str:
        """Return the newest revision that the code knows."""
        return ScriptDirectory.from_config(_alembic_config()).get_current_head() or ""

    def require_current(self) -> None:
        """Refuse to work on a schema that is not the code's.

        Raises
        ------
        DatabaseError
            If the database cannot be opened, or its revision is not the newest.
        """
        current = self.current()
        if current is not None and current not in _known_revisions():
            raise self._newer(f"schema revision {current}")
        if current != self.head():
            have = "is empty" if current is None else f"has schema revision {current}"
            raise DatabaseError(
                f"The database {_shown(self.url)} {have}, but this padlab needs {self.head()}; run `padlab db upgrade`"
            )

    def dispose(self) -> None:
        """Close all pooled connections, for instance before a fork."""
        self.engine.dispose()


def _known_revisions() -> set[str]:
    scripts = ScriptDirectory.from_config(_alembic_config())
    return {script.revision for script in scripts.walk_revisions()}


def _shown(url: str) -> str:
    return make_url(url).render_as_string(hide_password=True)


@contextmanager
def _one_sentence(url: str) -> Iterator[None]:
    try:
        yield
    except IntegrityError:
        # Not a fault of the database, but of whoever wrote to it.
        raise
    except DBAPIError as error:
        reason = str(error.orig).strip().splitlines()[0]
        raise DatabaseError(
            f"The database {_shown(url)} cannot be used ({reason}); check PADLAB_DATABASE_URL or PADLAB_HOME"
        ) from error


def _alembic_config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(resource_dir("migrations")).replace("%", "%%"))
    return config


def _engine(url: str) -> Engine:
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        return create_engine(url, pool_pre_ping=True)
    if parsed.database and not Path(parsed.database).parent.is_dir():
        raise DatabaseError(
            f"The folder of the database {_shown(url)} does not exist; make it, or correct PADLAB_DATABASE_URL"
        )
    engine = create_engine(url, connect_args={"timeout": BUSY_SECONDS, "isolation_level": None})
    event.listen(engine, "connect", _on_sqlite_connect)
    event.listen(engine, "begin", _on_sqlite_begin)
    return engine


def _on_sqlite_connect(connection: Any, _record: object) -> None:
    cursor = connection.cursor()
    # WAL lets readers go on while one writes; FULL makes a committed answer survive a power cut.
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", f"busy_timeout={BUSY_SECONDS * 1000}"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _on_sqlite_begin(connection: Connection) -> None:
    # A transaction that upgrades from reading to writing can fail at once; one that means to write says so first.
    writing = connection.get_execution_options().get("padlab_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")
