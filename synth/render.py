"""Rendering: frames of a face, without a display.

Only this module, `synth.canvas` and `synth.baseline` know pyrender and OpenGL.
"""

import contextlib
import ctypes
import functools
import importlib
import itertools
import os
import queue
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType, TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synth.canvas import Canvas
from synth.errors import RenderError, SpecError
from synth.face.mesh import FaceModel
from synth.face.motion import Motion
from synth.face.rig import Rig

RENDERER_VERSION = "2"
"""Part of a clip's identity; raise it when pictures change."""

MIN_SIZE, MAX_SIZE = 16, 4096

LANES = 2
"""Graphics contexts of a process: they draw a film's frames in turn, so that no core waits for the other's."""

_FILM = 8
"""Different frames from which on a second context is worth its start."""

_ADVICE = {
    "egl": "run `apt-get install --reinstall libegl1 libgl1 libgl1-mesa-dri`",
    "osmesa": "run `apt-get install libosmesa6`, or unset PYOPENGL_PLATFORM",
}
_INSTALL = "apt-get install libegl1 libgl1 libgl1-mesa-dri"
_FIELD_OF_VIEW = np.radians(20.0)


@dataclass(frozen=True)
class StageTimes:
    """Seconds that the stages of one frame took, one after the other.

    Attributes
    ----------
    pose : float
        From morph weights to vertices.
    upload : float
        Vertices to the graphics context, and finding out what changes in the picture.
    draw : float
        Drawing, four samples a pixel, and averaging the samples.
    readback : float
        Reading the picture.
    """

    pose: float
    upload: float
    draw: float
    readback: float


class Renderer:
    """Draw one face at one size; a context manager.

    All renderers of a process share its OpenGL contexts and may be used from several threads. Only what has changed
    since the last frame is drawn again; the result is the same, bit by bit, as if all had been.

    Parameters
    ----------
    rig : Rig
        The figure.
    width, height : int
        Size of the frames in pixels, each from 16 to 4096.

    Raises
    ------
    RenderError
        If OpenGL cannot start on this machine.
    SpecError
        If the size is out of range.
    """

    def __init__(self, rig: Rig, *, width: int = 720, height: int = 576) -> None:
        for name, size in (("width", width), ("height", height)):
            if not MIN_SIZE <= size <= MAX_SIZE:
                raise SpecError(f"The frame's {name} is {size}; it must be from {MIN_SIZE} to {MAX_SIZE} pixels.")
        self.width, self.height = width, height
        self._rig = rig
        self._free: list[weakref.finalize[..., Renderer]] = []
        self._closed = False
        self._canvases: dict[int, Canvas] = {}
        with self._open(0):
            pass

    def frame(self, motion: Motion, frame: int = 0) -> NDArray[np.uint8]:
        """Draw one frame of a motion.

        Returns
        -------
        (height, width, 3) uint8
            The picture, sRGB, top row first.

        Raises
        ------
        RenderError
            If the renderer is closed, or OpenGL fails.
        """
        pose = self._pose(motion, frame)
        with self._open(0) as canvas:
            return canvas.picture(pose)

    def frames(self, motion: Motion) -> Iterator[NDArray[np.uint8]]:
        """Draw all frames of a motion, one after the other; a pose that does not change is drawn once.

        While one frame is rasterised the next one is posed, and while the caller has one the next ones are rasterised.
        At most three frames for each of the `LANES` are on their way.
        """
        starts = np.flatnonzero(motion.changes()).tolist()
        lanes = LANES if len(starts) >= _FILM and many_contexts() else 1
        work = [_Lane(self._drawn(motion, starts[lane::lanes], lane)) for lane in range(lanes)]
        try:
            for k, (start, end) in enumerate(itertools.pairwise([*starts, len(motion)])):
                picture = work[k % lanes].next()
                yield picture
                for _ in range(start + 1, end):
                    yield picture.copy()
        finally:
            for lane in work:
                lane.stop()

    def _drawn(self, motion: Motion, frames: list[int], lane: int) -> Iterator[NDArray[np.uint8]]:
        """Draw some frames of a motion in one context; each is posed while the one before is rasterised."""
        pose = self._pose(motion, frames[0]) if frames else None
        for following in [*frames[1:], None]:
            if pose is None:
                return
            after = None if following is None else self._pose(motion, following)
            with self._open(lane) as canvas:
                picture = canvas.picture(pose, after)
            yield picture
            pose = after

    def timed_frame(self, motion: Motion, frame: int = 0) -> tuple[NDArray[np.uint8], StageTimes]:
        """Draw one frame as `frame` does, waiting for the end of each stage, and say how long they took."""
        times = [time.perf_counter()]
        pose = self._pose(motion, frame)
        times.append(time.perf_counter())
        with self._open(0) as canvas:
            for step in (functools.partial(canvas.upload, pose), canvas.draw):
                step()
                canvas.finish()
                times.append(time.perf_counter())
            picture = canvas.picture(pose)
        times.append(time.perf_counter())
        return picture, StageTimes(*np.diff(times).tolist())

    def close(self) -> None:
        """Free what the graphics contexts hold for this renderer; a second call does nothing."""
        self._closed = True
        for free in self._free:
            free()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _pose(self, motion: Motion, frame: int) -> NDArray[np.float32]:
        with np.errstate(over="ignore", invalid="ignore"):
            pose = np.hstack(self._rig.pose(motion, frame)).astype(np.float32)
        if not np.isfinite(pose).all():
            raise SpecError(f"Motion: frame {frame} takes the figure beyond all bounds; weights are usually 0 to 1.")
        return pose

    @contextmanager
    def _open(self, lane: int) -> Iterator[Canvas]:
        """Lend the canvas of a lane to this thread alone; it is made when it is first needed."""
        with current_graphics(lane) as graphics:
            if self._closed:
                raise RenderError("The renderer is closed; make a new one.")
            if lane not in self._canvases:
                at, field_of_view = camera(self._rig.face, self.width, self.height)
                self._canvases[lane] = canvas = Canvas(
                    *(graphics.gl, graphics.pyrender, self._rig),
                    camera_at=at,
                    field_of_view=field_of_view,
                    width=self.width,
                    height=self.height,
                )
                # Also at the interpreter's end, while OpenGL still works.
                self._free.append(weakref.finalize(self, _delete, canvas, lane))
            yield self._canvases[lane]


class _Lane:
    """A thread that draws ahead, a little."""

    def __init__(self, pictures: Iterator[NDArray[np.uint8]]) -> None:
        self._ready: queue.Queue[NDArray[np.uint8] | BaseException] = queue.Queue(maxsize=1)
        self._stopped = False
        self._thread = threading.Thread(target=self._run, args=(pictures,), name="padlab-lane", daemon=True)
        self._thread.start()

    def _run(self, pictures: Iterator[NDArray[np.uint8]]) -> None:
        try:
            for picture in pictures:
                self._ready.put(picture)
                if self._stopped:
                    return
        except BaseException as error:
            self._ready.put(error)

    def next(self) -> NDArray[np.uint8]:
        """Return the next picture, or raise what went wrong."""
        found = self._ready.get()
        if isinstance(found, BaseException):
            raise found
        return found

    def stop(self) -> None:
        """End the thread, whatever it still has."""
        self._stopped = True
        while self._thread.is_alive():
            with contextlib.suppress(queue.Empty):
                self._ready.get_nowait()
            self._thread.join(timeout=0.01)


_unused: tuple[list[Canvas], ...] = tuple([] for _ in range(LANES))
"""Canvases of renderers that are gone, by lane: freed when nobody draws there."""


def _delete(canvas: Canvas, lane: int) -> None:
    _unused[lane].append(canvas)
    # The collector may free a renderer in the midst of another one's drawing; that one then frees the canvas.
    with current_graphics(lane):
        pass


def camera(face: FaceModel, width: int, height: int) -> tuple[NDArray[np.float64], float]:
    """Frame head and shoulders as in a video call; return the camera's position and its vertical field of view."""
    eye_line = float(face.eye_centres[:, 1].mean())
    head_height = float(face.pivots["head-2"][1] - face.pivots["jaw"][1])
    shown = head_height * max(1.62, 1.15 * height / width)
    centre = eye_line - 0.085 * shown
    distance = shown / (2 * np.tan(_FIELD_OF_VIEW / 2))
    return np.array([0.0, centre, distance + 1.0]), float(_FIELD_OF_VIEW)


_locks = tuple(threading.RLock() for _ in range(LANES))


@contextmanager
def current_graphics(lane: int = 0) -> Iterator["_Graphics"]:
    """Make one of the process's graphics contexts current in this thread, and let it go afterwards."""
    with _locks[lane]:
        graphics = _graphics(lane)
        try:
            graphics.platform.make_current()
            graphics.users += 1
            try:
                yield graphics
            finally:
                graphics.users -= 1
                if not graphics.users:
                    while _unused[lane]:
                        _unused[lane].pop().delete()
                    graphics.release()
        except graphics.failures as error:
            what = getattr(error, "description", None) or getattr(error, "err", None) or type(error).__name__
            if isinstance(what, bytes):
                what = what.decode("ascii", "replace")
            raise RenderError(f"OpenGL failed while drawing ({what}).") from error


@functools.cache
def _graphics(_lane: int) -> "_Graphics":
    with _starting:
        return _Graphics()


_starting = threading.Lock()


def many_contexts() -> bool:
    """Tell whether this machine's way to OpenGL is known to bear several contexts in one process."""
    return _choose_platform() == "egl"


def _loads(*libraries: str) -> bool:
    try:
        for name in libraries:
            ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return False
    return True


def _choose_platform() -> str:
    """Name the way to OpenGL without a display: EGL, else OSMesa."""
    chosen = os.environ.get("PYOPENGL_PLATFORM", "")
    if chosen in {"egl", "osmesa"}:
        return chosen
    if _loads("libGL.so.1", "libEGL.so.1"):
        return "egl"
    if _loads("libOSMesa.so.8") or _loads("libOSMesa.so.6"):
        return "osmesa"
    raise RenderError(f"There is no OpenGL for rendering without a display on this machine; run `{_INSTALL}`.")


class _Graphics:
    """One of the process's OpenGL contexts, and pyrender on it."""

    def __init__(self) -> None:
        self.users = 0
        name = _choose_platform()
        os.environ["PYOPENGL_PLATFORM"] = name
        # pyrender's viewer would load pyglet, which wants a display; pyrender 0.1.45 still says np.infty.
        viewer = ModuleType("pyrender.viewer")
        vars(viewer)["Viewer"] = None
        sys.modules.setdefault("pyrender.viewer", viewer)
        if not hasattr(np, "infty"):
            vars(np)["infty"] = np.inf
        try:
            self._start(name)
        except Exception as error:
            raise RenderError(
                f"OpenGL could not start by {name.upper()} ({type(error).__name__}: {error}); {_ADVICE[name]}."
            ) from error

    def _start(self, name: str) -> None:
        self.pyrender = importlib.import_module("pyrender")
        self.gl = importlib.import_module("OpenGL.GL")
        self._egl = importlib.import_module("OpenGL.EGL") if name == "egl" else None
        self.failures = importlib.import_module("OpenGL.error").Error
        platform = importlib.import_module(f"pyrender.platforms.{name}")
        make = platform.EGLPlatform if name == "egl" else platform.OSMesaPlatform
        self.platform: Any = make(MIN_SIZE, MIN_SIZE)
        self.platform.init_context()

    def release(self) -> None:
        """Let the context go, so that another thread may take it."""
        egl = self._egl
        if egl is not None:
            egl.eglMakeCurrent(self.platform._egl_display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
