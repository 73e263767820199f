"""Lips that meet: subdivision and some morphs part them slightly where the mouth should be closed."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from synth.face.shading import smooth, vertex_normals

Floats = NDArray[np.float64]

CLOSED = (
    *("mouthPressLeft", "mouthPressRight", "mouthFrownLeft", "mouthFrownRight", "mouthSmileLeft", "mouthSmileRight"),
    *("mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight", "mouthLeft", "mouthRight"),
    *("cheekPuff", "mouthRollLower", "jawForward"),
)
"""Morphs that leave the mouth closed."""

_OVERLAP = 0.006
_REACH = 0.05
"""How far sealed lips sink into each other, and the widest gap that is closed; dm."""


def sealing(vertices: Floats, quads: NDArray[np.int64], lips: Floats, jaw_drop: Floats) -> Floats:
    """Return the displacements (N, 3) that let the lips touch.

    Parameters
    ----------
    vertices : (N, 3) float64
        The mesh with the mouth nearly closed; dm.
    quads : (Q, 4) int64
        Its faces.
    lips : (N,) float64
        How much a vertex belongs to the lips, 0 to 1.
    jaw_drop : (N,) float64
        How far ``jawOpen`` lowers each vertex: it tells the lower lip from the upper one.
    """
    normals = vertex_normals(vertices, quads)
    on_lips = lips > 0.3
    low_side = jaw_drop > 0.5 * jaw_drop[on_lips].max()
    upper = np.flatnonzero(on_lips & ~low_side & (normals[:, 1] < -0.15))
    lower = np.flatnonzero(on_lips & low_side & (normals[:, 1] > 0.15))
    shift = np.zeros(len(vertices))
    flat = vertices * (1.0, 0.5, 1.0)
    for own, other, sign in ((upper, lower, -1.0), (lower, upper, 1.0)):
        _, nearest = cKDTree(flat[other]).query(flat[own])
        gap = sign * (vertices[other[nearest], 1] - vertices[own, 1])
        shift[own] = sign * 0.5 * np.where(gap < _REACH, np.clip(gap + _OVERLAP, 0.0, _REACH), 0.0)
    spread = smooth(shift, quads, rounds=2)
    return np.column_stack([np.zeros_like(spread), spread, np.zeros_like(spread)])
