"""The feature points (FDP) of MPEG-4 on the face's mesh.

A point is a vertex of MakeHuman's base mesh, given by its number in ``base.obj``, so it is the same place on every
identity. The points were found on the mesh's own loops: the inner lip contour is the loop along which the lips touch,
the outer one the loop on the edge of the red; the lid points lie on the loop of the lid's front edge, above and below
the pupil; the brow points on the ridge that the brow morphs move most. The mesh is symmetric to the last digit, and so
is this table. Points on pupils, teeth and tongue are taken from the pieces that are drawn. Of the 84 points only 11.5,
the top of the hair, is not known before the hair is dressed: `synth.face.rig.Rig.feature_points` adds it.
"""

from collections.abc import Iterable
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.face.eyes import pupil_points
from synth.face.mesh import FaceModel
from synth.face.mouth import teeth_points, tongue

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

PAIRS = (
    ("2.4", "2.5", 7192, 432),  # inner lip corner
    ("2.6", "2.7", 11964, 5362),  # inner upper lip, half-way to the corner
    ("2.8", "2.9", 7236, 481),  # inner lower lip, half-way to the corner
    ("2.11", "2.12", 11823, 5213),  # corner of the chin
    ("2.13", "2.14", 7459, 739),  # corner of the jaw bone
    ("3.1", "3.2", 6785, 1),  # upper lid's edge
    ("3.3", "3.4", 6828, 44),  # lower lid's edge
    ("3.7", "3.12", 6805, 21),  # outer corner of the eye
    ("3.11", "3.8", 6850, 66),  # inner corner of the eye
    ("3.9", "3.10", 6862, 78),  # below the lower lid
    ("3.13", "3.14", 6930, 152),  # fold of the upper lid
    ("4.1", "4.2", 6983, 208),  # inner end of the brow
    ("4.3", "4.4", 6981, 206),  # top of the brow
    ("4.5", "4.6", 7024, 255),  # outer end of the brow
    ("5.1", "5.2", 11935, 5331),  # centre of the cheek
    ("5.3", "5.4", 6968, 192),  # cheek bone
    ("6.3", "6.4", 13519, 13419),  # border of the tongue
    ("8.3", "8.4", 7162, 402),  # outer lip corner
    ("8.5", "8.6", 11956, 5354),  # outer upper lip, half-way to the corner
    ("8.7", "8.8", 7235, 480),  # outer lower lip, half-way to the corner
    ("8.10", "8.9", 7215, 456),  # Cupid's bow
    ("9.1", "9.2", 7098, 336),  # side of the nostril
    ("9.5", "9.4", 7121, 360),  # lower edge of the nostril
    ("9.7", "9.6", 6895, 111),  # upper edge of the nose bone
    ("9.13", "9.14", 6975, 199),  # lower edge of the nose bone
    ("10.1", "10.2", 12012, 5413),  # top of the ear
    ("10.3", "10.4", 12018, 5419),  # back of the ear
    ("10.5", "10.6", 12329, 5732),  # bottom of the lobe
    ("10.7", "10.8", 12349, 5752),  # lobe meets the face
    ("10.9", "10.10", 12336, 5739),  # ear meets the face above
    ("11.3", "11.2", 7669, 973),  # hairline at the temple
)
"""Points of the subject's left and right half: left name, right name, left vertex, right vertex."""

MIDDLE = MappingProxyType(
    {
        "2.1": 5211,  # bottom of the chin
        "2.2": 474,  # inner upper lip
        "2.3": 493,  # inner lower lip
        "2.10": 733,  # boss of the chin
        "6.1": 13381,  # tip of the tongue
        "6.2": 13398,  # body of the tongue
        "8.1": 455,  # outer upper lip
        "8.2": 492,  # outer lower lip
        "9.3": 297,  # tip of the nose
        "9.12": 5063,  # lower edge of the nose bone
        "9.15": 5072,  # where the nose meets the upper lip
        "11.1": 983,  # hairline above the forehead
        "11.4": 881,  # crown
        "11.6": 962,  # back of the skull
    }
)
"""Points on the middle line: name, vertex."""

VERTICES = MappingProxyType(
    {**MIDDLE, **{left: at for left, _, at, _ in PAIRS}, **{right: at for _, right, _, at in PAIRS}}
)
"""All points that are vertices of skin or tongue: name, number in ``base.obj``."""

PUPILS = ("3.5", "3.6")
"""Points 3.5 and 3.6, left and right: the middles of the pupils."""

SPINE = "7.1"
"""Point 7.1, the top of the spine, about which the head turns."""

TONGUE_START = 13380
"""Number in ``base.obj`` of the tongue's first vertex."""

HAIR_TOP, SKULL_TOP = "11.5", "11.4"
"""Point 11.5, the top of the hair, and the point below it."""


def skin_rows(face: FaceModel, names: Iterable[str]) -> Indices:
    """Return the rows of ``face.vertices`` of feature points on the skin.

    Parameters
    ----------
    face : FaceModel
        Any identity.
    names : iterable of str
        Names such as "8.4"; not the points of tongue, teeth, pupils and spine.

    Returns
    -------
    (N,) int64
        Rows, in the order of the names.

    Raises
    ------
    SpecError
        If a point is unknown or not on the skin.
    """
    wanted = list(names)
    for name in wanted:
        if name not in VERTICES:
            raise SpecError(f"Feature point {name!r} is not a vertex of the mesh; those are {', '.join(VERTICES)}.")
    numbers = np.array([VERTICES[name] for name in wanted], dtype=np.int64)
    rows = np.searchsorted(face.base_index, numbers)
    for name, number, row in zip(wanted, numbers, rows, strict=True):
        if row == len(face.base_index) or face.base_index[row] != number:
            raise SpecError(f"Feature point {name} (vertex {number}) is not on the skin of this face.")
    return rows.astype(np.int64)


def feature_points(face: FaceModel) -> dict[str, Floats]:
    """Return the neutral position of every feature point but 11.5.

    Returns
    -------
    dict of str to (3,) float64
        Positions in dm; x to the subject's left, y up, z forward.
    """
    inside = [name for name in VERTICES if name.startswith("6.")]
    skin = [name for name in VERTICES if name not in inside]
    points = dict(zip(skin, face.vertices[skin_rows(face, skin)], strict=True))
    body = tongue(face).vertices
    points.update({name: body[VERTICES[name] - TONGUE_START] for name in inside})
    points.update(zip(PUPILS, pupil_points(face), strict=True))
    points.update(teeth_points(face))
    points[SPINE] = face.pivots["head"]
    return points
