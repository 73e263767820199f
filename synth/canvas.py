"""The canvas: what a renderer holds in the graphics context, and the part of its picture that has to be drawn anew."""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from synth.face.rig import Rig

BACKGROUND = (0.800, 0.815, 0.830)
"""Neutral backdrop, sRGB."""

Box = tuple[int, int, int, int]
"""Part of a picture: left, lower, right and upper border; pixels from the lower left corner."""

_NOTHING: Box = (0, 0, 0, 0)
_MARGIN = 2
"""Pixels round a moved vertex that may change with it: rounding, and the width of a pixel."""

_TEXELS = 1.25
"""Texels of the painting for each pixel, in one direction, that are neither blurred nor full of steps."""
_FACING = 0.7
"""Depth of the unit normal from which on a place faces the camera."""

_SHADERS = Path(__file__).parent / "shaders"
# Where pyrender puts the attributes that we give it, in its own words.
_LOCATIONS = {"NORMAL_LOC": 1, "TEXCOORD_0_LOC": 2, "TEXCOORD_1_LOC": 3, "COLOR_0_LOC": 4}


class Canvas:
    """One picture that follows a figure's vertices. Its methods need the graphics context to be current.

    Parameters
    ----------
    gl, pyrender : module
        OpenGL's functions and pyrender, with a context at work.
    rig : Rig
        The figure.
    camera_at : (3,) float64
        Where the camera stands, looking along -z; dm.
    field_of_view : float
        Its vertical field of view in radians.
    width, height : int
        Size in pixels.
    """

    def __init__(
        self,
        gl: Any,
        pyrender: Any,
        rig: Rig,
        *,
        camera_at: NDArray[np.float64],
        field_of_view: float,
        width: int,
        height: int,
    ) -> None:
        self._gl = gl
        self._size = width, height
        # What shows the painting comes first, so that each of the two programs draws one run of triangles.
        painted = rig.paint[rig.triangles, 3].max(axis=1) > 0
        pixels = height / (2 * float(np.tan(field_of_view / 2)) * (camera_at[2] - float(rig.rest[:, 2].max())))
        triangles = np.concatenate([rig.triangles[painted], rig.triangles[~painted]])
        scene = _scene(gl, pyrender, rig, triangles, _suited(rig, pixels))
        pose = np.eye(4)
        pose[:3, 3] = camera_at
        scene.add(pyrender.PerspectiveCamera(yfov=field_of_view, znear=1.0, zfar=100.0), pose=pose)

        # pyrender makes buffers, texture, frame buffers with four samples a pixel, and programs.
        self._surface = pyrender.Renderer(width, height)
        self._surface._program_cache.shader_dir = str(_SHADERS)
        self._surface._configure_main_framebuffer()
        self._surface._update_context(scene, pyrender.RenderFlags.OFFSCREEN)
        view, projection = self._surface._get_camera_matrices(scene)
        self._camera = (projection @ view).astype(np.float32)
        count = int(np.count_nonzero(painted))
        self._runs = (
            (self._program("painted"), 0, 3 * count),
            (self._program("plain"), 3 * count * np.dtype(np.uint32).itemsize, 3 * (len(painted) - count)),
        )
        (mesh,) = scene.meshes
        (self._primitive,) = mesh.primitives
        self._texture = self._primitive.material.baseColorTexture

        # All attributes side by side, as pyrender's vertex buffer has them.
        self._vertices = np.hstack([rig.rest, rig.rest, rig.uv, rig.gloss, rig.paint]).astype(np.float32)
        self._beside = _beside(rig.triangles, len(rig.rest))
        self._picture = np.empty((height, width, 3), dtype=np.uint8)
        self._shown: NDArray[np.float32] | None = None
        self._uploaded: NDArray[np.float32] | None = None
        self._undrawn = self._unread = _NOTHING

    def picture(self, pose: NDArray[np.float32], following: NDArray[np.float32] | None = None) -> NDArray[np.uint8]:
        """Return the picture of a pose, which is drawn now unless it is the one last shown; begin the following one.

        Whatever can be done before the drawing has ended or after the next one has begun, is.
        """
        if self._shown is not pose:
            self.show(pose)
        box = self._changed(following) if following is not None else _NOTHING
        self.read()
        if following is not None:
            self.upload(following, box)
            self.draw()
        return self._picture[::-1].copy()

    def show(self, pose: NDArray[np.float32]) -> None:
        """Begin to draw a pose, positions and normals side by side (N, 6)."""
        self.upload(pose)
        self.draw()

    def upload(self, pose: NDArray[np.float32], box: Box | None = None) -> None:
        """Write new vertices into the mesh's buffer; ``box`` is where they change the picture, if known."""
        gl = self._gl
        self._undrawn = self._changed(pose) if box is None else box
        # Whatever fails from here on, the next pose is drawn completely.
        self._shown, self._uploaded = None, pose
        self._vertices[:, :6] = pose
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._primitive._buffers[0])
        gl.glBufferSubData(gl.GL_ARRAY_BUFFER, 0, self._vertices.nbytes, self._vertices)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, 0)

    def draw(self) -> None:
        """Draw what is new, and average its samples."""
        gl, surface = self._gl, self._surface
        left, low, right, high = self._undrawn
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, surface._main_fb_ms)
        gl.glViewport(0, 0, *self._size)
        gl.glEnable(gl.GL_SCISSOR_TEST)
        gl.glScissor(left, low, right - left, high - low)
        for switch in (gl.GL_DEPTH_TEST, gl.GL_CULL_FACE, gl.GL_MULTISAMPLE):
            gl.glEnable(switch)
        gl.glDisable(gl.GL_BLEND)
        gl.glClearColor(*BACKGROUND, 1.0)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        self._texture._bind()
        self._primitive._bind()
        for program, start, count in self._runs:
            gl.glUseProgram(program)
            gl.glDrawElements(gl.GL_TRIANGLES, count, gl.GL_UNSIGNED_INT, ctypes.c_void_p(start))
        self._primitive._unbind()
        self._texture._unbind()
        gl.glDisable(gl.GL_SCISSOR_TEST)
        if self._undrawn != _NOTHING:
            gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, surface._main_fb_ms)
            gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, surface._main_fb)
            gl.glBlitFramebuffer(*self._undrawn, *self._undrawn, gl.GL_COLOR_BUFFER_BIT, gl.GL_NEAREST)
        gl.glFlush()
        self._unread = _union(self._unread, self._undrawn)
        self._shown = self._uploaded

    def read(self) -> None:
        """Wait for the drawing's end and take over what is new into the picture."""
        if self._unread == _NOTHING:
            return
        gl = self._gl
        left, low, right, high = self._unread
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._surface._main_fb)
        gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
        pixels = gl.glReadPixels(left, low, right - left, high - low, gl.GL_RGB, gl.GL_UNSIGNED_BYTE)
        self._picture[low:high, left:right] = np.frombuffer(pixels, np.uint8).reshape(high - low, right - left, 3)
        self._unread = _NOTHING

    def finish(self) -> None:
        """Wait until all is drawn."""
        self._gl.glFinish()

    def delete(self) -> None:
        """Free what the graphics context holds."""
        self._surface.delete()

    def _program(self, name: str) -> int:
        """Compile the two shaders of a name and tell them the camera; return the program's number."""
        gl = self._gl
        defines = {**_LOCATIONS, "LIGHTING": (_SHADERS / "lighting.glsl").read_text(encoding="utf-8")}
        program = self._surface._program_cache.get_program(f"{name}.vert", f"{name}.frag", defines=defines)
        program._add_to_context()
        number = int(program._program_id)
        gl.glUseProgram(number)
        gl.glUniformMatrix4fv(gl.glGetUniformLocation(number, "camera"), 1, gl.GL_TRUE, self._camera)
        return number

    def _changed(self, pose: NDArray[np.float32]) -> Box:
        """Return the part of the picture in which a pose differs from the one that is shown."""
        if self._shown is None:
            return (0, 0, *self._size)
        rows = np.flatnonzero(self._beside @ (pose != self._shown).any(axis=1))
        if not len(rows):
            return _NOTHING
        columns = [np.concatenate([self._shown[rows, k], pose[rows, k]]) for k in range(3)]
        x, y, w = (
            row[0] * columns[0] + row[1] * columns[1] + row[2] * columns[2] + row[3] for row in self._camera[[0, 1, 3]]
        )
        if w.min() <= 0.0:
            # What passes behind the camera has no place in the picture.
            return (0, 0, *self._size)
        box = []
        for places, size in ((x / w, self._size[0]), (y / w, self._size[1])):
            ends = 0.5 * size * (np.array([places.min(), places.max()]) + 1)
            box.append(np.clip([np.floor(ends[0]) - _MARGIN, np.ceil(ends[1]) + _MARGIN], 0, size).astype(int).tolist())
        (left, right), (low, high) = box
        return (left, low, right, high) if left < right and low < high else _NOTHING


def _scene(gl: Any, pyrender: Any, rig: Rig, triangles: NDArray[np.uint32], painting: NDArray[np.uint8]) -> Any:
    """Return pyrender's scene with the figure in it."""
    clamp = gl.GL_CLAMP_TO_EDGE
    # Without a pyramid, since looking for the right level of it costs a tenth of the drawing.
    sampler = pyrender.Sampler(minFilter=gl.GL_LINEAR, wrapS=clamp, wrapT=clamp)
    texture = pyrender.Texture(source=painting, source_channels="RGB", sampler=sampler)
    primitive = pyrender.Primitive(
        positions=rig.rest,
        normals=rig.rest,
        texcoord_0=rig.uv,
        texcoord_1=rig.gloss,
        color_0=rig.paint,
        indices=triangles,
        material=pyrender.MetallicRoughnessMaterial(baseColorTexture=texture),
    )
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh([primitive]))
    return scene


def _suited(rig: Rig, pixels: float) -> NDArray[np.uint8]:
    """Return the painting, halved until it has about one texel for each of ``pixels`` pixels a dm on the face."""
    painting = rig.texture
    corners = rig.triangles[rig.paint[rig.triangles, 3].min(axis=1) > 0]
    a, b, c = (rig.rest[corners[:, k]].astype(np.float64) for k in range(3))
    across = np.cross(b - a, c - a)
    area = np.linalg.norm(across, axis=1)
    (ux, uy), (vx, vy) = ((rig.uv[corners[:, k]] - rig.uv[corners[:, 0]]).T.astype(np.float64) for k in (1, 2))
    texels = np.abs(ux * vy - uy * vx) * painting.shape[0] * painting.shape[1]
    facing = across[:, 2] > _FACING * area
    density = float(np.sqrt(np.median(texels[facing] / area[facing]))) / pixels
    for _ in range(max(0, round(np.log2(density / _TEXELS)))):
        height, width, colours = painting.shape
        quarters = painting.reshape(height // 2, 2, width // 2, 2, colours).sum(axis=(1, 3), dtype=np.uint16)
        painting = ((quarters + 2) // 4).astype(np.uint8)
    return painting


def _beside(triangles: NDArray[np.uint32], n: int) -> sparse.csr_array:
    """Return a matrix (n, n) that is not 0 where two vertices share a triangle, or are the same one of a triangle."""
    own = triangles[:, [0, 0, 0, 1, 1, 1, 2, 2, 2]].ravel()
    other = triangles[:, [0, 1, 2, 0, 1, 2, 0, 1, 2]].ravel()
    return sparse.csr_array((np.ones(len(own), np.float32), (own, other)), shape=(n, n))


def _union(one: Box, other: Box) -> Box:
    if _NOTHING in (one, other):
        return other if one == _NOTHING else one
    return min(one[0], other[0]), min(one[1], other[1]), max(one[2], other[2]), max(one[3], other[3])
