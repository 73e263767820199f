from pathlib import Path
from typing import Any

import pytest

from webapp.errors import ConfigError
from webapp.media import MediaStore

DIGEST = "ab" * 32


def _make(path: Path) -> dict[str, Any]:
    path.write_bytes(b"clip")
    return {"text": "你好"}


@pytest.mark.parametrize("kind", ["folder", "memory"])
def test_a_clip_is_made_once_and_read_back(tmp_path: Path, kind: str) -> None:
    store = MediaStore(str(tmp_path / "media") if kind == "folder" else f"memory://{tmp_path.name}")
    assert not store.has(DIGEST)
    assert store.add(DIGEST, _make)
    assert not store.add(DIGEST, lambda path: pytest.fail("made twice"))
    assert store.has(DIGEST)
    assert store.read(DIGEST) == b"clip"
    assert store.size(DIGEST) == 4
    assert store.lineage(DIGEST) == {"text": "你好"}
    assert (store.local_path(DIGEST) is not None) == (kind == "folder")


def test_a_failure_leaves_nothing_behind(tmp_path: Path) -> None:
    store = MediaStore(str(tmp_path))

    def fail(path: Path) -> dict[str, Any]:
        path.write_bytes(b"half a cl")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        store.add(DIGEST, fail)
    assert not store.has(DIGEST)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_only_digests_are_names(tmp_path: Path) -> None:
    store = MediaStore(str(tmp_path))
    (tmp_path / "secret.mp4").write_bytes(b"x")
    for name in ("../secret", "secret", "AB" * 32, "ab" * 31):
        with pytest.raises(FileNotFoundError):
            store.read(name)


def test_a_place_that_cannot_be_used_gives_one_sentence() -> None:
    with pytest.raises(ConfigError, match="PADLAB_MEDIA_URL=/dev/null/media"):
        MediaStore("/dev/null/media")
    with pytest.raises(ConfigError, match="fsspec"):
        MediaStore("nosuchprotocol://bucket")
