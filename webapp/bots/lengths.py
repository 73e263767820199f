"""How long clips are."""

import re
import subprocess
import tempfile
from threading import Lock

import imageio_ffmpeg

from webapp.bots.browser import BotError, Browser
from webapp.bots.known import Known
from webapp.bots.page import ShownClip

_DURATION = re.compile(r"Duration: (\d+):(\d\d):(\d\d(?:\.\d+)?)")


class ClipLengths:
    """Lengths of clips: those that the database knows, else measured once in the file that the site sends."""

    def __init__(self, known: Known) -> None:
        self._known = known
        self._measured: dict[str, float] = {}
        self._lock = Lock()

    def __call__(self, browser: Browser, clip: ShownClip) -> float:
        """Return a clip's length in seconds.

        Raises
        ------
        BotError
            If the clip cannot be played.
        """
        length = self._known.truth(clip.digest).duration_s
        if length is not None:
            return length
        with self._lock:
            if clip.digest not in self._measured:
                self._measured[clip.digest] = _measure(browser.fetch(clip.address), clip.address)
            return self._measured[clip.digest]


def _measure(content: bytes, name: str) -> float:
    with tempfile.NamedTemporaryFile() as file:
        file.write(content)
        file.flush()
        # Without an output ffmpeg ends with an error, after it has told what the file is.
        told = subprocess.run(  # noqa: S603  (a fixed program, no shell)
            [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", file.name], capture_output=True, check=False
        ).stderr.decode(errors="replace")
    found = _DURATION.search(told)
    if found is None:
        raise BotError(f"{name} is no clip that can be played")
    return 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3])
