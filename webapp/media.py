"""The media store: rendered clips and files of one's own, by digest, in a folder or at any fsspec URL."""

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import fsspec

from webapp.errors import ConfigError

CLIP = "mp4"
"""Suffix of rendered clips."""

_DIGEST = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"[a-z0-9]{1,5}")


class MediaStore:
    """A content-addressed store of clips (MP4), other media files, and the lineage of each (JSON).

    Parameters
    ----------
    url : str
        Folder, or URL of a file system that fsspec knows (``s3://…``, ``gcs://…``, ``memory://…``).

    Raises
    ------
    ConfigError
        If the place cannot be opened.
    """

    def __init__(self, url: str) -> None:
        try:
            self._fs, root = fsspec.core.url_to_fs(url)
            self._root = str(root).rstrip("/")
            self._fs.makedirs(self._root, exist_ok=True)
        except (OSError, ValueError, ImportError) as error:
            raise ConfigError(
                f"PADLAB_MEDIA_URL={url} cannot be used ({error}); it takes a folder you may write to or an fsspec URL"
            ) from error
        self._local = "file" in (self._fs.protocol if isinstance(self._fs.protocol, tuple) else (self._fs.protocol,))

    def has(self, digest: str, suffix: str = CLIP) -> bool:
        """Tell whether the clip is there, whole: the lineage is written last."""
        return bool(self._fs.exists(self._path(digest, "json")) and self._fs.exists(self._path(digest, suffix)))

    def size(self, digest: str, suffix: str = CLIP) -> int:
        """Return the size of the clip in bytes."""
        return int(self._fs.size(self._path(digest, suffix)))

    def local_path(self, digest: str, suffix: str = CLIP) -> Path | None:
        """Return the clip's file when the store is a folder of this machine, otherwise None."""
        return Path(self._path(digest, suffix)) if self._local else None

    def read(self, digest: str, suffix: str = CLIP) -> bytes:
        """Return the clip.

        Raises
        ------
        FileNotFoundError
            If the store does not hold it.
        """
        return bytes(self._fs.cat_file(self._path(digest, suffix)))

    def lineage(self, digest: str) -> dict[str, Any]:
        """Return how the clip was made (the sidecar).

        Raises
        ------
        FileNotFoundError
            If the store does not hold it.
        """
        sidecar: dict[str, Any] = json.loads(self._fs.cat_file(self._path(digest, "json")))
        return sidecar

    def add(self, digest: str, make: Callable[[Path], dict[str, Any]], suffix: str = CLIP) -> bool:
        """Make a clip unless it is there already.

        Parameters
        ----------
        digest : str
            The clip's identity, 64 hexadecimal digits.
        make : callable
            Writes the file to the path it is given and returns the lineage.
        suffix : str
            Kind of the file.

        Returns
        -------
        bool
            Whether the clip had to be made.
        """
        if self.has(digest, suffix):
            return False
        with tempfile.TemporaryDirectory(prefix="padlab-") as folder:
            draft = Path(folder) / f"clip.{suffix}"
            sidecar = make(draft)
            self._put(draft, self._path(digest, suffix))
            draft.with_suffix(".json").write_text(json.dumps(sidecar, ensure_ascii=False, indent=1), encoding="utf-8")
            self._put(draft.with_suffix(".json"), self._path(digest, "json"))
        return True

    def add_file(self, source: Path) -> str:
        """Put a file of one's own into the store and return its digest, that of its bytes.

        Raises
        ------
        OSError
            If the file cannot be read.
        """
        with source.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()

        def copy(path: Path) -> dict[str, Any]:
            shutil.copyfile(source, path)
            return {"digest": digest, "file": source.name, "bytes": path.stat().st_size}

        self.add(digest, copy, source.suffix.lower().removeprefix("."))
        return digest

    def _path(self, digest: str, suffix: str) -> str:
        if not _DIGEST.fullmatch(digest) or not _SUFFIX.fullmatch(suffix):
            raise FileNotFoundError(digest)
        return f"{self._root}/{digest[:2]}/{digest}.{suffix}"

    def _put(self, source: Path, target: str) -> None:
        self._fs.makedirs(self._fs._parent(target), exist_ok=True)
        if not self._local:
            self._fs.put_file(str(source), target)
            return
        # In a folder, a reader must never meet half a clip: the copy gets its name when it is complete.
        draft = Path(f"{target}.{source.parent.name}")
        try:
            shutil.copyfile(source, draft)
            draft.replace(target)
        finally:
            with suppress(FileNotFoundError):
                draft.unlink()
