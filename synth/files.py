"""Files that appear complete or not at all."""

import contextlib
import secrets
from pathlib import Path

from synth.errors import VideoError


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file under another name beside its own, then give it its name; text is written as UTF-8.

    Parameters
    ----------
    path : Path
        The file; an older one of that name is replaced. Its folder must exist.
    content : bytes or str
        All of it.

    Raises
    ------
    VideoError
        If it cannot be written; then nothing is left behind, and an older file is untouched.
    """
    partial = partial_name(path)
    try:
        partial.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        partial.replace(path)
    except OSError as error:
        raise VideoError(f"The file {path} could not be written: {error.strerror or error}.") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)


def partial_name(path: Path) -> Path:
    """Return a name of its own beside ``path`` for what is not complete yet."""
    return path.with_name(f".{secrets.token_hex(8)}.part")
