"""The stage: figures and renderers that are kept for the next film, for dressing a figure takes a while."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.face.assets import asset_digest
from synth.face.deformation import solve
from synth.face.identity import DEFAULT_IDENTITY, IDENTITIES
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import Renderer
from synth.video import VideoWriter

Floats = NDArray[np.float64]


class Stage:
    """One identity, ready to be filmed.

    Parameters
    ----------
    face_dir : Path
        Folder of the compiled face data.
    identity : str
        Whose face.

    Raises
    ------
    SpecError
        If there is no such identity.
    AssetError
        If the face data are missing or damaged.
    """

    def __init__(self, face_dir: Path, identity: str = DEFAULT_IDENTITY) -> None:
        if identity not in IDENTITIES:
            raise SpecError(f"There is no identity {identity!r}; there are: {', '.join(sorted(IDENTITIES))}.")
        # The digest of the face data is a key of both caches, so that new data are noticed.
        self._key = face_dir, asset_digest(face_dir), identity

    @property
    def rig(self) -> Rig:
        """The figure."""
        return _rig(*self._key)

    def move(self, values: NDArray[np.floating] | Floats) -> Motion:
        """Return the motion that FAP values (T, 68) ask of the figure."""
        return solve(values, self.rig)

    def pictures(
        self, values: NDArray[np.floating] | Floats, *, width: int, height: int
    ) -> Iterator[NDArray[np.uint8]]:
        """Draw each frame of FAP values (T, 68): pictures (height, width, 3) uint8, sRGB.

        Raises
        ------
        SpecError
            If an argument is not valid.
        RenderError
            If OpenGL does not start, or fails.
        """
        renderer = _renderer(*self._key, width, height)
        if len(values):
            yield from renderer.frames(self.move(values))

    def film(
        self,
        values: NDArray[np.floating] | Floats,
        out: Path,
        *,
        fps: int,
        width: int,
        height: int,
        audio: Path | None = None,
        on_progress: Callable[[int, int], None] | None = None,
    ) -> None:
        """Write FAP values (T, 68) as an MP4 file, frame after frame, with the sound of a WAV file.

        Raises
        ------
        SpecError
            If an argument is not valid.
        RenderError, VideoError
            If OpenGL does not start, or the file cannot be written.
        """
        tell = on_progress or (lambda _finished, _all: None)
        with VideoWriter(out, width, height, fps=fps, audio=audio) as video:
            tell(0, len(values))
            for count, picture in enumerate(self.pictures(values, width=width, height=height), start=1):
                video.write(picture)
                tell(count, len(values))


@lru_cache(maxsize=2)
def _rig(face_dir: Path, _assets: str, identity: str) -> Rig:
    return Rig(load_face(face_dir, identity))


@lru_cache(maxsize=2)
def _renderer(face_dir: Path, assets: str, identity: str, width: int, height: int) -> Renderer:
    return Renderer(_rig(face_dir, assets, identity), width=width, height=height)
