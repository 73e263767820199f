"""Hair: a layer over the scalp, and what hangs or stands off from it: a bob, a bun."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter
from scipy.spatial import cKDTree

from synth.face.eyes import grid_quads
from synth.face.look import Hairstyle
from synth.face.mesh import FaceModel
from synth.face.surface import Surface
from synth.face.wrapping import place_strand, step

Floats = NDArray[np.float64]

_COLUMNS, _HEAD_ROWS, _FALL_ROWS = 37, 8, 8
_LINING_ROWS = _FALL_ROWS + 5
"""Rows of the bob's dark inner side; further up the scalp is close behind the bob."""
_LINING_GAP = 0.014
"""How far the lining lies within the bob, dm."""
_BUN_ROWS, _BUN_COLUMNS, _BUN_ELEVATION = 11, 24, 0.66
_BINS, _LOWEST = 72, -0.55
"""Size of the grid of directions, and its lowest elevation in radians: below the ears."""
_SEED = 77


def hair_layer(style: Hairstyle, template: Floats, inside: Floats) -> Floats:
    """Return how far the hair stands off the scalp at each place.

    Parameters
    ----------
    style : Hairstyle
        The style.
    template : (N, 3) float64
        Places on the template; dm.
    inside : (N,) float64
        0 on bare skin to 1 where the hair has its full thickness.

    Returns
    -------
    (N,) float64
        Thickness, dm.
    """
    top = step(template[:, 1], 7.5, 8.15)
    thickness = style.sides + (style.top - style.sides) * top
    if style.strands == "curls":
        uneven = np.random.default_rng(_SEED).standard_normal(len(template))
    else:
        x, y, z = template.T
        uneven = np.sin(17.0 * x + 5.0 * z + 1.0) * np.sin(7.0 * z - 6.0 * x + 2.0) + 0.6 * np.sin(29.0 * x - 4.0 * y)
    return inside * (thickness + style.rough * uneven)


def hidden_scalp(style: Hairstyle, template: Floats, inside: Floats) -> NDArray[np.bool_]:
    """Tell which places of the scalp (N,) lie under loose hair, given how far inside the hairline they are in dm."""
    if style.loose != "bob":
        return np.zeros(len(template), dtype=bool)
    return (inside > 0.35) & (template[:, 1] > 7.3) & (template[:, 1] < 7.6) & (template[:, 2] < 0.4)


def loose_hair(face: FaceModel, skin: Surface) -> list[Surface]:
    """Return the hair that hangs or stands off, over a skin whose scalp already has its layer."""
    style = face.identity.look.hair
    if style.loose == "bob":
        return _bob(face, skin)
    return [_bun(face, skin)] if style.loose == "bun" else []


@dataclass(frozen=True)
class _BobGrid:
    """The grid of a bob: rows from the temples down, columns from the left front edge round the back to the right one.

    Rows first go over the head by ``elevation`` (R, 1), then ``fall`` (R, 1) to the hem, 0 to 1. ``angle`` (R, C) goes
    round the head; ``from_edge`` (R, C) is the angle to the nearer front edge.
    """

    elevation: Floats
    fall: Floats
    angle: Floats
    from_edge: Floats

    @classmethod
    def make(cls) -> Self:
        elevation = np.concatenate([np.linspace(0.95, 0, _HEAD_ROWS), np.zeros(_FALL_ROWS)])[:, None]
        fall = np.concatenate([np.zeros(_HEAD_ROWS), np.linspace(0, 1, _FALL_ROWS + 1)[1:]])[:, None]
        left = np.interp(elevation, [0.0, 0.2, 0.5], [0.90, 0.87, 0.80]) - 0.05 * fall
        right = left + 0.04
        round_back = 2 * np.pi - left - right
        share = np.linspace(0, 1, _COLUMNS)
        return cls(elevation, fall, left + round_back * share, np.minimum(share, 1 - share) * round_back)


def _bob(face: FaceModel, skin: Surface) -> list[Surface]:
    """Build the hanging part of a chin-length bob, and its dark lining."""
    grid = _BobGrid.make()
    vertices = _hang(face, skin, grid)
    share, along = np.meshgrid(np.linspace(0, 1, vertices.shape[1]), np.linspace(0, 1, len(vertices)))
    uv = np.stack([share, along], axis=-1)
    # Darker towards the front edge, but not where it comes out of the layer.
    shade = 1.0 - 0.34 * (1 - step(grid.from_edge, 0.0, 0.25)) * (1 - step(grid.elevation, 0.0, 0.45))
    shade = shade * (1.0 - 0.35 * grid.fall**2)
    # What hangs near the shoulders lags behind the head.
    follow = np.stack([np.ones_like(shade), np.broadcast_to(1.0 - 0.22 * grid.fall, shade.shape)], axis=-1)
    outside = _hair_surface(face, "hair", vertices, strands=uv, shade=shade, follow=follow)

    # The dark inside needs no locks: every other column is enough.
    rows = slice(-_LINING_ROWS, None), slice(None, None, 2)
    inwards = np.stack([-np.sin(grid.angle), np.zeros_like(grid.angle), -np.cos(grid.angle)], axis=-1)
    lining = vertices + _LINING_GAP * inwards
    lining[..., 1] += 2 * _LINING_GAP * grid.fall**2
    inside = _hair_surface(
        face,
        "hair-lining",
        lining[rows],
        strands=uv[rows],
        shade=0.3 * shade[rows],
        follow=follow[rows],
        gloss=(0.0, 1.0),
        flipped=True,
    )
    return [outside, inside]


def _hang(face: FaceModel, skin: Surface, grid: _BobGrid) -> Floats:
    """Return the places (R, C, 3) of a bob's outer side: out of the layer on the scalp, over the ears, to the hem."""
    rng = np.random.default_rng(_SEED)
    centre = _centre(face)
    high, fall, angle, from_edge = grid.elevation, grid.fall, grid.angle, grid.from_edge
    swell = 0.045 * step(from_edge, 0.0, 0.45)
    gap = swell - (swell + 0.035) * step(high, 0.25, 0.95)
    # Locks of different fullness; they also come out of the layer at different heights.
    locks = gaussian_filter(rng.standard_normal(_COLUMNS), 0.6) * (0.014 + 0.010 * step(high, 0.1, 0.5))
    # Below the ears the hair hangs, first a little fuller, then turning in at the hem.
    inner = np.clip(from_edge / 0.5, 0, 1)
    curl = 0.06 * np.sin(np.pi * np.clip(fall * 1.1, 0, 1)) - (0.05 + 0.11 * inner) * fall**3
    reach = _Reach(skin, centre)(angle, np.broadcast_to(high, angle.shape)) + gap + curl + locks

    # Longest beside the chin, rounded at the front, and uneven as hair is.
    hem = float(face.pivots["jaw"][1]) - 0.19 + 0.24 * np.clip(from_edge / 2.2, 0, 1)
    hem = hem + 0.17 * (1 - step(from_edge, 0.0, 0.32)) + 0.010 * inner * rng.standard_normal(_COLUMNS)
    y = centre[1] + np.sin(high) * reach - fall * (centre[1] - hem)
    level = np.cos(high) * reach
    return np.stack([np.sin(angle) * level, y, centre[2] + np.cos(angle) * level], axis=-1)


def _bun(face: FaceModel, skin: Surface) -> Surface:
    """Build a bun behind the crown: a flattened ball whose strands wind round it."""
    centre = _centre(face)
    reach = float(_Reach(skin, centre)(np.array([np.pi]), np.array([_BUN_ELEVATION]))[0])
    axis = np.array([0.0, np.sin(_BUN_ELEVATION), -np.cos(_BUN_ELEVATION)])
    up, aside = np.array([0.0, -axis[2], axis[1]]), np.array([1.0, 0.0, 0.0])
    polar = np.linspace(0.0, 0.80 * np.pi, _BUN_ROWS)[:, None, None]
    turn = np.linspace(0, 2 * np.pi, _BUN_COLUMNS + 1)[None, :, None]
    swell = 1.0 + 0.045 * np.sin(3 * turn + 5.0 * polar) + 0.02 * np.sin(7 * turn - 3.0 * polar)
    out = reach + 0.12 + 0.25 * np.cos(polar) * swell
    vertices = centre + axis * out + 0.34 * np.sin(polar) * swell * (np.cos(turn) * up + np.sin(turn) * aside)
    winding = 0.5 + 0.42 * np.cos(turn + 3.5 * polar)
    along = np.broadcast_to(polar / np.pi, winding.shape)
    return _hair_surface(
        face,
        "hair",
        vertices,
        strands=np.concatenate([winding, along], axis=-1),
        shade=0.95 - 0.50 * step(along[..., 0], 0.45, 0.80),
        follow=np.ones((*vertices.shape[:2], 2)),
        flipped=True,
    )


def _hair_surface(
    face: FaceModel,
    name: str,
    vertices: Floats,
    *,
    strands: Floats,
    shade: Floats,
    follow: Floats,
    gloss: tuple[float, float] = (0.049, 22.0),
    flipped: bool = False,
) -> Surface:
    """Make a surface of a grid (R, C, 3) of vertices.

    It shows the painted strands: ``strands`` (R, C, 2) are places across and along them. The rest is as in `Surface`,
    as grids.
    """
    rows, columns = vertices.shape[:2]
    n = rows * columns
    quads = grid_quads(rows, columns, closed=False)
    return Surface(
        name=name,
        vertices=vertices.reshape(-1, 3),
        quads=quads[:, ::-1] if flipped else quads,
        morphs=np.zeros((len(face.morph_names), n, 3), dtype=np.float32),
        uv=place_strand(*strands.reshape(-1, 2).T),
        colour=np.zeros((n, 3)),
        cover=np.zeros(n),
        shade=shade.ravel(),
        gloss=np.broadcast_to(gloss, (n, 2)),
        follow=follow.reshape(-1, 2),
        drawn=np.ones(len(quads), dtype=bool),
    )


def _centre(face: FaceModel) -> Floats:
    """Return the middle of the skull: the origin of elevations and of the angles round the head."""
    eyes, crown, skull = face.eye_centres.mean(axis=0), face.pivots["head-2"], face.pivots["head"]
    return np.array([0.0, eyes[1] + 0.12, 0.5 * (crown[2] + skull[2]) + 0.05])


class _Reach:
    """How far the head reaches from its centre in each direction; low down with room for the ears."""

    def __init__(self, skin: Surface, centre: Floats) -> None:
        arm = skin.vertices - centre
        distance = np.linalg.norm(arm, axis=1)
        angle = np.arctan2(arm[:, 0], arm[:, 2])
        elevation = np.arcsin(arm[:, 1] / distance)
        scalp = elevation > 0.0
        self._scalp = cKDTree(arm[scalp] / distance[scalp, None])
        self._distance = distance[scalp]
        head = elevation > _LOWEST
        column, row = self._bins(angle[head], elevation[head])
        reach = np.zeros((_BINS, _BINS))
        np.maximum.at(reach, (np.rint(row).astype(int), np.rint(column).astype(int) % _BINS), distance[head])
        reach = maximum_filter(reach, size=(5, 3), mode=("nearest", "wrap"))
        # What hangs from the equator must clear the ears below it.
        equator = round(float(self._bins(np.zeros(1), np.zeros(1))[1][0]))
        outwards = reach[: equator + 1] * np.cos(np.linspace(_LOWEST, 0, equator + 1))[:, None]
        reach[equator] = outwards.max(axis=0)
        self._ears = gaussian_filter(reach, 2.0, mode=("nearest", "wrap"))

    def __call__(self, angle: Floats, elevation: Floats) -> Floats:
        column, row = self._bins(angle, elevation)
        ears = map_coordinates(self._ears, [row, column], order=1, mode="grid-wrap")
        level = np.cos(elevation)
        direction = np.stack([np.sin(angle) * level, np.sin(elevation), np.cos(angle) * level], axis=-1)
        away, near = self._scalp.query(direction, k=4)
        weight = 1.0 / (away**2 + 1e-4)
        scalp = (weight * self._distance[near]).sum(axis=-1) / weight.sum(axis=-1)
        # Over the ears the way out is long and smooth; at the temples the hair stays close.
        aside = np.abs((angle + np.pi) % (2 * np.pi) - np.pi)
        reach: Floats = ears + (scalp - ears) * step(elevation / (0.4 + 0.5 * step(aside, 0.9, 1.4)), 0.0, 1.0)
        return reach

    @staticmethod
    def _bins(angle: Floats, elevation: Floats) -> tuple[Floats, Floats]:
        column = angle % (2 * np.pi) / (2 * np.pi) * _BINS
        row = np.clip((elevation - _LOWEST) / (np.pi / 2 - _LOWEST), 0, 1) * (_BINS - 1)
        return column, row
