"""Brows that keep their thickness: hairs are rooted in thick skin that slides as a whole."""

import numpy as np
from numpy.typing import NDArray

from synth.face.mesh import FaceModel
from synth.face.wrapping import step, wrap

Floats = NDArray[np.float64]

_MORPHS = ("browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight")
_BAND, _BORDER = 0.050, 0.150
"""Half-height of the band that slides as a whole, and where its influence ends; dm."""
_WIDTH_ANGLE, _WIDTH_HEIGHT = 0.07, 0.030
"""Reach of the mean that the band's motion is taken from: radians along the brow, dm across it."""


def carry_brows(face: FaceModel, template: Floats, morphs: Floats) -> None:
    """Let the brow morphs move each brow as its middle line moves, in place: unmended they squeeze it to a thread.

    Parameters
    ----------
    face : FaceModel
        Names the morphs.
    template : (N, 3) float64
        Places on the base mesh, see `FaceModel.template`.
    morphs : (52, N, 3) float64
        Displacements of the skin's vertices; changed.
    """
    angle, height = wrap(template)
    # The line of the brows: an arch from beside the nose to above the outer corner of the eye.
    from_line = height - np.interp(angle, [0.13, 0.30, 0.42, 0.58, 0.70], [7.51, 7.545, 7.54, 7.50, 7.46])
    ends = np.interp(angle, [0.04, 0.12, 0.62, 0.80], [0.0, 1.0, 1.0, 0.0])
    near = (np.abs(from_line) < _BORDER) & (ends > 0) & (template[:, 2] > 0)
    for side in (template[:, 0] > 0, template[:, 0] < 0):
        rows = np.flatnonzero(near & side)
        weight = np.exp(
            -(((angle[rows, None] - angle[rows]) / _WIDTH_ANGLE) ** 2) - (from_line[rows] / _WIDTH_HEIGHT) ** 2
        )
        weight /= weight.sum(axis=1, keepdims=True)
        share = (ends[rows] * step(_BORDER - np.abs(from_line[rows]), 0.0, _BORDER - _BAND))[:, None]
        for name in _MORPHS:
            morph = morphs[face.morph_names.index(name)]
            morph[rows] += share * (weight @ morph[rows] - morph[rows])
