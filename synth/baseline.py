"""The straightforward way to film a figure with pyrender, for comparison: a new mesh for each frame, stock shaders."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from synth.canvas import BACKGROUND
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import camera, current_graphics

_LIGHTS = ((0.4286, 0.4682, 0.7726), (-0.7428, 0.1094, 0.6605), (-0.4391, 0.5269, -0.7278))
"""Directions towards key, fill and rim light."""


def naive_frames(rig: Rig, motion: Motion, *, width: int, height: int) -> Iterator[NDArray[np.uint8]]:
    """Draw all frames of a motion as pyrender's documentation shows it.

    Mesh, poses, picture size, multisampling and the number of lights are those of `synth.render.Renderer`; the material
    is pyrender's own, so that the pictures are alike, not equal.

    Yields
    ------
    (height, width, 3) uint8
        The pictures, sRGB, top row first.
    """
    with current_graphics() as graphics:
        pyrender = graphics.pyrender
        scene = pyrender.Scene(bg_color=(*BACKGROUND, 1.0), ambient_light=(0.3, 0.3, 0.3))
        at, field_of_view = camera(rig.face, width, height)
        scene.add(pyrender.PerspectiveCamera(yfov=field_of_view, znear=1.0, zfar=100.0), pose=_placed(np.eye(3), at))
        for towards in _LIGHTS:
            scene.add(pyrender.DirectionalLight(intensity=2.0), pose=_placed(_facing(np.array(towards)), np.zeros(3)))
        texture = pyrender.Texture(source=rig.texture, source_channels="RGB")
        material = pyrender.MetallicRoughnessMaterial(
            baseColorTexture=texture, metallicFactor=0.0, roughnessFactor=0.6, doubleSided=False
        )
        surface = pyrender.Renderer(width, height)
    colours = np.sqrt(rig.paint[:, :3]) + rig.paint[:, 3:]
    node = None
    try:
        for frame in range(len(motion)):
            positions, normals = rig.pose(motion, frame)
            with current_graphics():
                if node is not None:
                    scene.remove_node(node)
                primitive = pyrender.Primitive(
                    positions=positions,
                    normals=normals,
                    texcoord_0=rig.uv,
                    color_0=np.column_stack([colours, np.ones(len(colours))]),
                    indices=rig.triangles,
                    material=material,
                )
                node = scene.add(pyrender.Mesh([primitive]))
                picture, _depths = surface.render(scene, pyrender.RenderFlags.OFFSCREEN)
            yield np.ascontiguousarray(picture)
    finally:
        with current_graphics():
            surface.delete()


def _placed(rotation: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, at
    return pose


def _facing(towards: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a rotation whose z axis points to the light: pyrender's lights shine along -z."""
    aside = np.cross([0.0, 1.0, 0.0], towards)
    aside /= np.linalg.norm(aside)
    return np.column_stack([aside, np.cross(towards, aside), towards])
