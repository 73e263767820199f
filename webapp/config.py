"""Settings: read once from the environment, validated at start, frozen afterwards."""

import os
import secrets
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

from webapp.errors import ConfigError

DATABASES = ("sqlite", "postgresql")
SECRET_LENGTH = 32


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All that padlab takes from its environment.

    Attributes
    ----------
    home : Path
        Folder of all local state (``PADLAB_HOME``, default ``instance/`` in the current folder).
    database_url : str
        SQLAlchemy URL of SQLite or PostgreSQL (``PADLAB_DATABASE_URL``, default ``padlab.sqlite`` in `home`).
    media_url : str
        Folder or fsspec URL of the media store (``PADLAB_MEDIA_URL``, default ``media/`` in `home`).
    scheduler : str or None
        Address of a Dask scheduler (``PADLAB_SCHEDULER``); None starts a ``LocalCluster`` when there is work.
    face_dir : Path
        Folder of the compiled face data (``PADLAB_FACE_DIR``, default ``face/`` in `home`).
    models_dir : Path
        Folder of the sets of models made by ``padlab train`` (``PADLAB_MODELS_DIR``, default ``models/`` in `home`).
    secret_key : str
        Signs cookies (``PADLAB_SECRET_KEY``; by default made once and kept in `home`).
    """

    home: Path
    database_url: str = field(repr=False)
    media_url: str
    scheduler: str | None
    face_dir: Path
    models_dir: Path
    secret_key: str = field(repr=False)

    @classmethod
    def from_env(cls, environ: Mapping[str, str] | None = None) -> "Settings":
        """Read and validate the settings; creates the home folder.

        Raises
        ------
        ConfigError
            If a variable has a value that cannot be used; the message names the variable and what it takes.
        """
        env = os.environ if environ is None else environ
        home = Path(env.get("PADLAB_HOME") or "instance").expanduser().resolve()
        try:
            home.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(
                f"PADLAB_HOME={home} cannot be used as a folder ({error.strerror}); name a folder you may write to"
            ) from error
        return cls(
            home=home,
            database_url=_database_url(env.get("PADLAB_DATABASE_URL") or f"sqlite:///{home / 'padlab.sqlite'}"),
            media_url=env.get("PADLAB_MEDIA_URL") or str(home / "media"),
            scheduler=_scheduler(env.get("PADLAB_SCHEDULER") or None),
            face_dir=Path(env.get("PADLAB_FACE_DIR") or home / "face").expanduser().resolve(),
            models_dir=Path(env.get("PADLAB_MODELS_DIR") or home / "models").expanduser().resolve(),
            secret_key=_given_secret(env.get("PADLAB_SECRET_KEY") or "") or _kept_secret(home / "secret_key"),
        )


def _database_url(text: str) -> str:
    takes = "PADLAB_DATABASE_URL takes sqlite:////path/to/file.sqlite or postgresql://user:password@host/database"
    try:
        url = make_url(text)
    except ArgumentError as error:
        raise ConfigError(f"PADLAB_DATABASE_URL is not a database URL; {takes}") from error
    if url.get_backend_name() not in DATABASES:
        raise ConfigError(f"PADLAB_DATABASE_URL names the database '{url.get_backend_name()}'; {takes}")
    if url.get_backend_name() == "postgresql":
        url = url.set(drivername="postgresql+psycopg")
    elif not url.database or url.database == ":memory:":
        raise ConfigError(f"PADLAB_DATABASE_URL names no file, and answers must outlive the process; {takes}")
    return url.render_as_string(hide_password=False)


def _scheduler(address: str | None) -> str | None:
    if address is not None and not address.startswith(("tcp://", "tls://", "ucx://", "ws://", "wss://")):
        raise ConfigError(
            f"PADLAB_SCHEDULER={address} is not the address of a Dask scheduler; it takes one such as tcp://host:8786"
        )
    return address


def _given_secret(key: str) -> str:
    if key and len(key) < SECRET_LENGTH:
        raise ConfigError(
            f"PADLAB_SECRET_KEY has {len(key)} characters, which can be guessed; "
            f"it takes at least {SECRET_LENGTH} random ones"
        )
    return key


def _kept_secret(path: Path) -> str:
    """Make the key that signs cookies once; whoever comes first makes it, all others read it."""
    if not path.exists():
        draft = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
        try:
            draft.touch(mode=0o600)
            draft.write_text(secrets.token_hex(32), encoding="ascii")
            # A hard link appears whole or not at all, and never replaces the key of a process that was faster.
            with suppress(FileExistsError):
                path.hardlink_to(draft)
        except OSError as error:
            raise ConfigError(f"{path} cannot be written ({error.strerror}); make PADLAB_HOME writable") from error
        finally:
            draft.unlink(missing_ok=True)
    key = path.read_text(encoding="ascii", errors="replace").strip()
    if len(key) < SECRET_LENGTH:
        raise ConfigError(f"{path} holds no usable key; remove it so that a new one is made (everybody logs in again)")
    return key
