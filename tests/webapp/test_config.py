from pathlib import Path

import pytest

from webapp.config import Settings
from webapp.errors import ConfigError


def test_defaults_are_inside_the_home(tmp_path: Path) -> None:
    settings = Settings.from_env({"PADLAB_HOME": str(tmp_path / "new")})
    assert settings.home == tmp_path / "new"
    assert settings.database_url == f"sqlite:///{tmp_path / 'new' / 'padlab.sqlite'}"
    assert settings.media_url == str(tmp_path / "new" / "media")
    assert settings.face_dir == tmp_path / "new" / "face"
    assert settings.models_dir == tmp_path / "new" / "models"
    assert settings.scheduler is None


def test_trained_models_may_be_kept_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "me"))
    places = {
        "": tmp_path / "models",
        "shared": tmp_path / "shared",
        "../shared": tmp_path.parent / "shared",
        "~/sets": tmp_path / "me" / "sets",
    }
    for value, place in places.items():
        settings = Settings.from_env({"PADLAB_HOME": str(tmp_path), "PADLAB_MODELS_DIR": value})
        assert settings.models_dir == place
        # Reading the settings makes no folder: only training does.
        assert not place.exists()


def test_the_secret_key_is_made_once_and_kept_private(tmp_path: Path) -> None:
    first = Settings.from_env({"PADLAB_HOME": str(tmp_path)}).secret_key
    assert Settings.from_env({"PADLAB_HOME": str(tmp_path)}).secret_key == first
    assert len(first) == 64
    assert (tmp_path / "secret_key").stat().st_mode & 0o077 == 0
    assert [path.name for path in tmp_path.iterdir()] == ["secret_key"]


def test_postgresql_gets_the_driver_that_is_installed(tmp_path: Path) -> None:
    settings = Settings.from_env(
        {"PADLAB_HOME": str(tmp_path), "PADLAB_DATABASE_URL": "postgresql://lab:secret@host/padlab"}
    )
    assert settings.database_url == "postgresql+psycopg://lab:secret@host/padlab"


@pytest.mark.parametrize(
    ("variable", "value", "hint"),
    [
        ("PADLAB_DATABASE_URL", "nonsense", "sqlite:////path"),
        ("PADLAB_DATABASE_URL", "mysql://host/padlab", "'mysql'"),
        ("PADLAB_DATABASE_URL", "sqlite://", "must outlive"),
        ("PADLAB_SCHEDULER", "cluster:8786", "tcp://host:8786"),
        ("PADLAB_SECRET_KEY", "secret", "at least 32"),
        ("PADLAB_HOME", "/dev/null/home", "a folder you may write to"),
    ],
)
def test_wrong_values_name_the_variable_and_what_it_takes(tmp_path: Path, variable: str, value: str, hint: str) -> None:
    with pytest.raises(ConfigError) as error:
        Settings.from_env({"PADLAB_HOME": str(tmp_path), variable: value})
    assert variable in str(error.value)
    assert hint in str(error.value)


def test_a_damaged_secret_key_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "secret_key").write_text("short")
    with pytest.raises(ConfigError, match="remove it"):
        Settings.from_env({"PADLAB_HOME": str(tmp_path)})
