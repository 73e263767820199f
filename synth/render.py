"""Rendering: frames of a face, without a display. The only module that knows pyrender and OpenGL."""

import ctypes
import functools
import importlib
import os
import sys
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import RenderError, SpecError
from synth.face.mesh import FaceModel
from synth.face.motion import Motion
from synth.face.rig import Rig

RENDERER_VERSION = "1"
"""Part of a clip's identity; raise it when pictures change."""

BACKGROUND = (0.800, 0.815, 0.830)
"""Neutral backdrop, sRGB."""

MIN_SIZE, MAX_SIZE = 16, 4096

_ADVICE = {
    "egl": "run `apt-get install --reinstall libegl1 libgl1 libgl1-mesa-dri`",
    "osmesa": "run `apt-get install libosmesa6`, or unset PYOPENGL_PLATFORM",
}
_INSTALL = "apt-get install libegl1 libgl1 libgl1-mesa-dri"
_FIELD_OF_VIEW = np.radians(20.0)


class Renderer:
    """Draw one face at one size; a context manager.

    All renderers of a process share one OpenGL context and may be used from several threads.

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
        with _current() as gl:
            self._drawing = gl.drawing(width, height)
            # Also at the interpreter's end, while OpenGL still works.
            self._free = weakref.finalize(self, _delete, self._drawing)
            self._mesh = gl.mesh(self._rig)
            self._scene = gl.scene(self._mesh, *_camera(rig.face, width, height))
            positions, normals = rig.pose(Motion.of())
            self._vertices = gl.vertices(self._rig, positions, normals)
            # The first drawing creates the buffers that later frames write to.
            gl.draw(self._drawing, self._scene)

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
        if self._mesh is None:
            raise RenderError("The renderer is closed; make a new one.")
        positions, normals = self._rig.pose(motion, frame)
        with _current() as gl:
            # Inside the lock: clips of several threads may share this renderer.
            self._vertices[:, 0:3] = positions
            self._vertices[:, 3:6] = normals
            gl.upload(self._mesh, self._vertices)
            return gl.draw(self._drawing, self._scene)

    def frames(self, motion: Motion) -> Iterator[NDArray[np.uint8]]:
        """Draw all frames of a motion, one after the other; a pose that does not change is drawn once."""
        picture: NDArray[np.uint8] | None = None
        for frame, changed in enumerate(motion.changes()):
            if picture is None or changed:
                picture = self.frame(motion, frame)
            yield picture

    def close(self) -> None:
        """Free what the graphics context holds for this renderer; a second call does nothing."""
        self._free()
        self._mesh = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _delete(drawing: Any) -> None:
    with _current():
        drawing.delete()


def _camera(face: FaceModel, width: int, height: int) -> tuple[NDArray[np.float64], float]:
    """Frame head and shoulders as in a video call; return the camera's position and its vertical field of view."""
    eye_line = float(face.eye_centres[:, 1].mean())
    head_height = float(face.pivots["head-2"][1] - face.pivots["jaw"][1])
    shown = head_height * max(1.62, 1.15 * height / width)
    centre = eye_line - 0.085 * shown
    distance = shown / (2 * np.tan(_FIELD_OF_VIEW / 2))
    return np.array([0.0, centre, distance + 1.0]), float(_FIELD_OF_VIEW)


_lock = threading.RLock()


@contextmanager
def _current() -> Iterator["_Graphics"]:
    """Make the process's graphics context current in this thread, and let it go afterwards."""
    with _lock:
        graphics = _graphics()
        try:
            graphics.platform.make_current()
            graphics.users += 1
            try:
                yield graphics
            finally:
                graphics.users -= 1
                # The collector may free a renderer in the midst of another one's drawing, which must keep the context.
                if not graphics.users:
                    graphics.release()
        except graphics.failures as error:
            what = str(error).strip().splitlines()
            raise RenderError(f"OpenGL failed while drawing ({what[0] if what else type(error).__name__}).") from error


@functools.cache
def _graphics() -> "_Graphics":
    return _Graphics()


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
    """The process's OpenGL context, and pyrender on it."""

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
        self._pyrender = importlib.import_module("pyrender")
        self._gl = importlib.import_module("OpenGL.GL")
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

    def drawing(self, width: int, height: int) -> Any:
        """Make a frame buffer with its own programs, which read this package's shaders."""
        drawing = self._pyrender.Renderer(width, height)
        # pyrender would also read the depths back, which takes longer than drawing.
        drawing._read_main_framebuffer = functools.partial(self._read_colours, drawing)
        drawing._program_cache.shader_dir = str(Path(__file__).parent / "shaders")
        return drawing

    def _read_colours(self, drawing: Any, scene: Any, flags: int) -> NDArray[np.uint8]:
        """Resolve the multisampled picture and read it, top row first."""
        gl = self._gl
        width, height = drawing._main_fb_dims
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, drawing._main_fb_ms)
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, drawing._main_fb)
        gl.glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, drawing._main_fb)
        gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
        pixels = gl.glReadPixels(0, 0, width, height, gl.GL_RGB, gl.GL_UNSIGNED_BYTE)
        return np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, 3)[::-1].copy()

    def vertices(self, rig: Rig, positions: NDArray[Any], normals: NDArray[Any]) -> NDArray[np.float32]:
        """Lay all attributes side by side, as pyrender's vertex buffer has them."""
        return np.hstack([positions, normals, rig.uv, rig.gloss, rig.paint]).astype(np.float32)

    def mesh(self, rig: Rig) -> Any:
        clamp = self._gl.GL_CLAMP_TO_EDGE
        # One level of the picture's pyramid instead of a blend of two: a good deal faster in software.
        sampler = self._pyrender.Sampler(minFilter=self._gl.GL_LINEAR_MIPMAP_NEAREST, wrapS=clamp, wrapT=clamp)
        texture = self._pyrender.Texture(source=rig.texture, source_channels="RGB", sampler=sampler)
        material = self._pyrender.MetallicRoughnessMaterial(baseColorTexture=texture, doubleSided=False)
        primitive = self._pyrender.Primitive(
            positions=rig.rest,
            normals=rig.rest,
            texcoord_0=rig.uv,
            texcoord_1=rig.gloss,
            color_0=rig.paint,
            indices=rig.triangles,
            material=material,
        )
        return self._pyrender.Mesh([primitive])

    def scene(self, mesh: Any, camera_at: NDArray[np.float64], field_of_view: float) -> Any:
        scene = self._pyrender.Scene(bg_color=(*BACKGROUND, 1.0))
        scene.add(mesh)
        pose = np.eye(4)
        pose[:3, 3] = camera_at
        scene.add(self._pyrender.PerspectiveCamera(yfov=field_of_view, znear=1.0, zfar=100.0), pose=pose)
        return scene

    def upload(self, mesh: Any, vertices: NDArray[np.float32]) -> None:
        """Write new vertices into the mesh's existing buffer."""
        buffer = mesh.primitives[0]._buffers[0]
        self._gl.glBindBuffer(self._gl.GL_ARRAY_BUFFER, buffer)
        self._gl.glBufferSubData(self._gl.GL_ARRAY_BUFFER, 0, vertices.nbytes, vertices)
        self._gl.glBindBuffer(self._gl.GL_ARRAY_BUFFER, 0)

    def draw(self, drawing: Any, scene: Any) -> NDArray[np.uint8]:
        """Draw and read the colours back."""
        flags = self._pyrender.RenderFlags.OFFSCREEN
        frame: NDArray[np.uint8] = drawing.render(scene, flags)
        return frame
