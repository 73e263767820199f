"""The straightforward way to film a figure with pyrender, for comparison: a new mesh for each frame, stock shaders."""

from collections.abc import Iterator
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.canvas import BACKGROUND
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import camera, current_graphics

_LIGHTS = ((0.4286, 0.4682, 0.7726), (-0.7428, 0.1094, 0.6605), (-0.4391, 0.5269, -0.7278))
"""Directions towards key, fill and rim light."""


class NaiveRenderer:
    """Draw a figure as pyrender's documentation shows it; a context manager.

    Mesh, poses, picture size, multisampling and the number of lights are those of `synth.render.Renderer`; the material
    is pyrender's own, so that the pictures are alike, not equal.

    Parameters
    ----------
    rig : Rig
        The figure.
    width, height : int
        Size of the frames in pixels.
    """

    def __init__(self, rig: Rig, *, width: int, height: int) -> None:
        self._rig = rig
        self._colours = np.column_stack([np.sqrt(rig.paint[:, :3]) + rig.paint[:, 3:], np.ones(len(rig.paint))])
        with current_graphics() as graphics:
            self._pyrender = pyrender = graphics.pyrender
            self._scene = pyrender.Scene(bg_color=(*BACKGROUND, 1.0), ambient_light=(0.3, 0.3, 0.3))
            at, field_of_view = camera(rig.face, width, height)
            lens = pyrender.PerspectiveCamera(yfov=field_of_view, znear=1.0, zfar=100.0)
            self._scene.add(lens, pose=_placed(np.eye(3), at))
            for towards in _LIGHTS:
                light = pyrender.DirectionalLight(intensity=2.0)
                self._scene.add(light, pose=_placed(_facing(np.array(towards)), np.zeros(3)))
            texture = pyrender.Texture(source=rig.texture, source_channels="RGB")
            self._material = pyrender.MetallicRoughnessMaterial(
                baseColorTexture=texture, metallicFactor=0.0, roughnessFactor=0.6, doubleSided=False
            )
            self._surface = pyrender.Renderer(width, height)

    def frames(self, motion: Motion) -> Iterator[NDArray[np.uint8]]:
        """Draw all frames of a motion, each with a new mesh: (height, width, 3) uint8, sRGB, top row first."""
        for frame in range(len(motion)):
            positions, normals = self._rig.pose(motion, frame)
            with current_graphics():
                primitive = self._pyrender.Primitive(
                    positions=positions,
                    normals=normals,
                    texcoord_0=self._rig.uv,
                    color_0=self._colours,
                    indices=self._rig.triangles,
                    material=self._material,
                )
                node = self._scene.add(self._pyrender.Mesh([primitive]))
                picture, _depths = self._surface.render(self._scene, self._pyrender.RenderFlags.OFFSCREEN)
                self._scene.remove_node(node)
            yield np.ascontiguousarray(picture)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with current_graphics():
            self._surface.delete()


def _placed(rotation: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, at
    return pose


def _facing(towards: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a rotation whose z axis points to the light: pyrender's lights shine along -z."""
    aside = np.cross([0.0, 1.0, 0.0], towards)
    aside /= np.linalg.norm(aside)
    return np.column_stack([aside, np.cross(towards, aside), towards])
