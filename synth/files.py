"""Text files that are read, and files that appear complete or not at all."""

import contextlib
import secrets
from pathlib import Path

from synth.errors import SpecError, VideoError


def read_text(path: Path, right: str) -> str:
    """Return the text of a file in UTF-8, without a byte order mark.

    Parameters
    ----------
    path : Path
        The file.
    right : str
        What would be right if it is not UTF-8, for the message.

    Raises
    ------
    SpecError
        If it is not UTF-8; the message names the file and the line.
    OSError
        If it cannot be read.
    """
    content = path.read_bytes()
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecError(f"{path}, line {line}: is not UTF-8 text; {right}.") from None


def shown(text: str) -> str:
    """Return a piece of a file for a message: quoted, and not longer than a line bears."""
    return repr(text if len(text) <= 24 else text[:24] + "…")


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
