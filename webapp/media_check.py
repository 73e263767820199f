"""Whether a media file is what its name says, and how long it plays."""

import re
import subprocess
from pathlib import Path

import imageio_ffmpeg
from PIL import Image, UnidentifiedImageError

from webapp.models.study import MEDIA

_TIME = re.compile(rb"time=(\d+):(\d+):(\d+(?:\.\d+)?)")
_LONGEST_S = 600


class UnplayableError(Exception):
    """A file cannot be shown; the message says why."""


def duration_s(path: Path) -> float | None:
    """Return how many seconds a video or audio file plays, None for a picture.

    The file is read to its end, as a browser would.

    Raises
    ------
    UnplayableError
        If it is no picture, or has neither video nor sound that can be decoded.
    """
    if MEDIA[path.suffix.lower().removeprefix(".")] == "image":
        _check_picture(path)
        return None
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-nostdin", "-i", str(path.resolve())]
    try:
        done = subprocess.run(  # noqa: S603 - a fixed program, no shell
            [*command, "-f", "null", "-"], capture_output=True, timeout=_LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise UnplayableError(f"takes longer than {_LONGEST_S} s to read") from error
    # Players put up with a damaged end, so what can be decoded counts.
    times = _TIME.findall(done.stderr)
    if not times:
        raise UnplayableError("cannot be played")
    hours, minutes, seconds = times[-1]
    played = 3600 * int(hours) + 60 * int(minutes) + float(seconds)
    if not played:
        raise UnplayableError("is empty")
    return played


def _check_picture(path: Path) -> None:
    try:
        with Image.open(path) as picture:
            picture.load()
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        raise UnplayableError("is no picture that can be read") from error
