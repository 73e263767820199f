"""Hair: a chin-length bob with a middle parting, as one sheet over the scalp."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter

from synth.face.eyes import grid_quads
from synth.face.mesh import FaceModel
from synth.face.painting import place_strand
from synth.face.surface import Surface

Floats = NDArray[np.float64]

_COLUMNS, _DOME_ROWS, _FALL_ROWS = 65, 14, 10
_BINS, _LOWEST = 72, -0.55
"""Size of the grid of directions, and its lowest elevation in radians: below the ears."""
_GAP_AT_FACE, _GAP = 0.02, 0.055
"""How far the sheet lies above the scalp at its front edge and elsewhere; dm."""


def bob(face: FaceModel, skin: Surface) -> list[Surface]:
    """Return the outer and the dark inner side of a bob over a skin whose scalp is already thickened."""
    outside = _sheet(face, skin)
    matt = np.broadcast_to((0.0, 1.0), outside.gloss.shape)
    inside = replace(outside, name="hair-inside", quads=outside.quads[:, ::-1], shade=0.3 * outside.shade, gloss=matt)
    return [outside, inside]


def _sheet(face: FaceModel, skin: Surface) -> Surface:
    """Build the sheet.

    Rows run from the crown down: over the dome of the head by elevation, then falling to the hem by height.
    Columns run from the left front edge round the back to the right one.
    """
    centre = _centre(face)
    hem = float(face.pivots["jaw"][1]) - 0.22
    elevation = np.concatenate([np.linspace(np.pi / 2, 0, _DOME_ROWS), np.zeros(_FALL_ROWS)])
    fall = np.concatenate([np.zeros(_DOME_ROWS), np.linspace(0, 1, _FALL_ROWS + 1)[1:]])
    # The front edge: from the parting outwards over the temples, then straight down beside the cheeks.
    edge = np.interp(elevation, np.radians([0, 12, 25, 42, 60, 90]), [0.90, 0.86, 0.72, 0.40, 0.10, 0.03])
    edge = edge - 0.04 * fall
    share = np.linspace(0, 1, _COLUMNS)
    angle = edge[:, None] + (2 * np.pi - 2 * edge[:, None]) * share

    low, high = np.broadcast_arrays(elevation[:, None], angle)
    reach = _Reach(skin, centre)(high, low)
    from_edge = np.minimum(share, 1 - share) * (2 * np.pi - 2 * edge[:, None])
    gap = _GAP_AT_FACE + (_GAP - _GAP_AT_FACE) * np.clip(from_edge / 0.35, 0, 1) ** 0.7
    # Below the ears the hair hangs, first a little fuller, then turning in at the hem.
    curl = 0.05 * np.sin(np.pi * np.clip(fall * 1.2, 0, 1)) - 0.13 * fall**3
    reach = reach + gap + curl[:, None]

    level = np.cos(low) * reach
    y = centre[1] + np.sin(low) * reach - fall[:, None] * (centre[1] - hem)
    vertices = np.stack([np.sin(angle) * level, y, centre[2] + np.cos(angle) * level], axis=-1).reshape(-1, 3)
    n = len(vertices)
    along = np.linspace(0, 1, len(elevation))[:, None] * np.ones_like(share)
    mirrored = np.minimum(share, 1 - share) * 2
    shade = 0.62 + 0.38 * np.clip(from_edge / 0.30, 0, 1)
    shade = shade * (1.0 - 0.35 * fall[:, None] ** 2)
    return Surface(
        name="hair",
        vertices=vertices,
        quads=grid_quads(len(elevation), _COLUMNS, closed=False),
        morphs=np.zeros((len(face.morph_names), n, 3), dtype=np.float32),
        uv=place_strand(np.tile(mirrored, len(elevation)), along.ravel()),
        colour=np.zeros((n, 3)),
        cover=np.zeros(n),
        shade=shade.ravel(),
        gloss=np.broadcast_to((0.065, 16.0), (n, 2)),
        follow=np.ones((n, 2)),
        drawn=np.ones((len(elevation) - 1) * (_COLUMNS - 1), dtype=bool),
    )


def _centre(face: FaceModel) -> Floats:
    """Return the middle of the skull: the origin of elevations and of the angles round the head."""
    eyes, crown, skull = face.eye_centres.mean(axis=0), face.pivots["head-2"], face.pivots["head"]
    return np.array([0.0, eyes[1] + 0.12, 0.5 * (crown[2] + skull[2]) + 0.05])


class _Reach:
    """How far the head reaches from its centre in each direction, smoothed."""

    def __init__(self, skin: Surface, centre: Floats) -> None:
        arm = skin.vertices - centre
        distance = np.linalg.norm(arm, axis=1)
        angle = np.arctan2(arm[:, 0], arm[:, 2])
        elevation = np.arcsin(arm[:, 1] / distance)
        head = elevation > _LOWEST
        column, row = self._bins(angle[head], elevation[head])
        reach = np.zeros((_BINS, _BINS))
        np.maximum.at(reach, (np.rint(row).astype(int), np.rint(column).astype(int) % _BINS), distance[head])
        reach = maximum_filter(reach, size=(5, 5), mode=("nearest", "wrap"))
        # What hangs from the equator must clear the ears below it.
        equator = round(float(self._bins(np.zeros(1), np.zeros(1))[1][0]))
        outwards = reach[: equator + 1] * np.cos(np.linspace(_LOWEST, 0, equator + 1))[:, None]
        reach[equator] = outwards.max(axis=0)
        self._reach = gaussian_filter(reach, 2.0, mode=("nearest", "wrap"))

    def __call__(self, angle: Floats, elevation: Floats) -> Floats:
        column, row = self._bins(angle, elevation)
        reach: Floats = map_coordinates(self._reach, [row, column], order=1, mode="grid-wrap")
        return reach

    @staticmethod
    def _bins(angle: Floats, elevation: Floats) -> tuple[Floats, Floats]:
        column = angle % (2 * np.pi) / (2 * np.pi) * _BINS
        row = np.clip((elevation - _LOWEST) / (np.pi / 2 - _LOWEST), 0, 1) * (_BINS - 1)
        return column, row
