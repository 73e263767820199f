"""Wrapping: where each place of the template lies on the painting, and where hair and clothes begin there.

Places depend on the template only, so that a painting fits the mesh of each identity. The painting goes round the
whole head: the middle of the face is its middle, and it is cut open along the middle of the nape.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.face.look import Knots, Neckline

Floats = NDArray[np.float64]

_HEAD_AXIS, _NECK_AXIS = 0.4, 0.15
"""Depth in dm of the vertical axis that the painting is wrapped round, in the head and in the neck."""
_DOME_HEIGHT, _DOME_RADIUS = 7.4, 1.1
"""Above this height, in dm, places count by elevation: a dome would squeeze the crown into a few rows."""
LOWEST, HIGHEST = 4.35, 9.50
CROWN = 9.17
"""Height in dm just above the crown; over it the painting shows loose hair at each angle."""
_LOOSE_HAIR = (CROWN + 0.02, HIGHEST - 0.02)
_CHEST_SLOPE, _SHOULDER_SLOPE = 0.75, 1.3
"""Below the jaw the lines of equal height lie round the neck as the edge of a top does: lower on the chest than on the
nape, and lower the further they are from the neck. A cone and a plane show no waves on large triangles."""
_NECK_RADIUS = 0.5
"""Radius of the neck, dm."""
_WAIST_OF_NECK = (6.3, 5.7)
"""Heights in dm between which the head's way of counting gives way to the neck's."""
MIDDLE = 1e-6
"""How far from the middle plane a place still counts as on it, dm."""
_RADIUS = 0.85
"""About how many dm one radian is on the head."""


def wrap(template: Floats) -> tuple[Floats, Floats]:
    """Return where places on the template lie on the painting.

    Parameters
    ----------
    template : (N, 3)
        Positions on the template, dm.

    Returns
    -------
    angle : (N,) float64
        Angle from the middle of the face, rad, from 0 to pi; left and right are alike.
    height : (N,) float64
        Height, dm; on the dome of the head an arc's length, below the jaw height above a sloping plane.
    """
    x, y, z = np.abs(template[:, 0]), template[:, 1], template[:, 2]
    below_jaw = step(_WAIST_OF_NECK[0] - y, 0.0, _WAIST_OF_NECK[0] - _WAIST_OF_NECK[1])
    back = z - (_HEAD_AXIS + (_NECK_AXIS - _HEAD_AXIS) * below_jaw)
    elevation = np.arctan2(np.maximum(y - _DOME_HEIGHT, 0.0), np.hypot(x, back))
    height = np.minimum(y, _DOME_HEIGHT) + _DOME_RADIUS * elevation
    spread = np.hypot(x, z - _NECK_AXIS) - _NECK_RADIUS
    collar = _CHEST_SLOPE * (z - _NECK_AXIS) - _SHOULDER_SLOPE * spread
    return np.arctan2(x, back), height + collar * below_jaw


def place(template: Floats) -> Floats:
    """Return texture coordinates (N, 2) of places on the template; the face gets more of the width than the back.

    The middle of the nape lies on the painting's right border; `mirrored` takes it to the left one.
    """
    angle, height = wrap(template)
    half = angle / np.pi
    side = np.where(template[:, 0] > -MIDDLE, 1.0, -1.0)
    across = 0.5 + 0.5 * side * half * (1.5 - 0.5 * half)
    return np.column_stack([across, (height - LOWEST) / (HIGHEST - LOWEST)])


def mirrored(uv: Floats) -> Floats:
    """Return the texture coordinates (N, 2) of the same places on the other side of the head."""
    return np.column_stack([1.0 - uv[:, 0], uv[:, 1]])


def canvas(width: int, height: int) -> tuple[Floats, Floats]:
    """Return angle and height at each pixel (height, width) of the painting, top row first: `place` backwards.

    Angles are negative on the subject's right.
    """
    across = 2 * (np.arange(width) + 0.5) / width - 1
    angle = np.sign(across) * np.pi * (1.5 - np.sqrt(2.25 - 2 * np.abs(across)))
    rows = HIGHEST - (np.arange(height) + 0.5) / height * (HIGHEST - LOWEST)
    angles, heights = np.meshgrid(angle, rows)
    return angles, heights


def place_strand(across: Floats, along: Floats) -> Floats:
    """Return texture coordinates (N, 2) within the painted hair: across the strands 0 to 1, along them 0 to 1."""
    lowest, highest = ((height - LOWEST) / (HIGHEST - LOWEST) for height in _LOOSE_HAIR)
    return np.column_stack([across, highest + (lowest - highest) * along])


def above_hairline(hairline: Knots, angle: ArrayLike, height: ArrayLike) -> Floats:
    """Return how far places lie inside the hair, in dm; negative on bare skin.

    Parameters
    ----------
    hairline : tuple of (float, float)
        See `synth.face.look.Hairstyle`.
    angle, height : array_like
        See `wrap`; left and right are alike.
    """
    at = np.stack(np.broadcast_arrays(np.abs(angle) * _RADIUS, height), axis=-1).astype(np.float64)
    line = _rounded(np.array(hairline)) * (_RADIUS, 1.0)
    # Past the borders of the half head, and then round the crown.
    line = np.vstack([line[0] - (1.0, 0.0), line, (4.0, line[-1, 1])])
    distance = np.full(at.shape[:-1], np.inf)
    inside = np.zeros(at.shape[:-1], dtype=bool)
    for start, end in pairwise(line):
        edge, arm = end - start, at - start
        share = np.clip(arm @ edge / (edge @ edge), 0, 1)
        distance = np.minimum(distance, np.hypot(*np.moveaxis(arm - share[..., None] * edge, -1, 0)))
        # Each edge below a place takes it across the line once more.
        spans = (start[0] <= at[..., 0]) != (end[0] <= at[..., 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = start[1] + arm[..., 0] * edge[1] / edge[0]
        inside ^= spans & (crossing < at[..., 1])
    return np.where(inside, distance, -distance)


def below_neckline(neckline: Neckline, angle: ArrayLike, height: ArrayLike) -> Floats:
    """Return how far places lie under the top, in dm; negative on bare skin."""
    aside = np.clip(np.abs(angle) / neckline.width, 0, 1)
    share = 1 - aside if neckline.pointed else 0.5 + 0.5 * np.cos(np.pi * aside)
    depth: Floats = neckline.height - neckline.drop * share - np.asarray(height)
    return depth


def step(x: Floats, low: float, high: float) -> Floats:
    """Return a smooth rise from 0 at ``low`` to 1 at ``high``."""
    t: Floats = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def _rounded(knots: Floats) -> Floats:
    """Cut the corners off a line of knots twice (Chaikin 1974); its ends stay."""
    for _ in range(2):
        cut = np.stack([0.75 * knots[:-1] + 0.25 * knots[1:], 0.25 * knots[:-1] + 0.75 * knots[1:]], axis=1)
        knots = np.vstack([knots[:1], cut.reshape(-1, 2), knots[-1:]])
    return knots
