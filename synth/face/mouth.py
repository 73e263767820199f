"""The inside of the mouth: two rows of teeth with gums, and the tongue."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.face.eyes import grid_quads
from synth.face.mesh import FaceModel, Part
from synth.face.subdivision import catmull_clark
from synth.face.surface import Surface, loose_surface

Floats = NDArray[np.float64]

_NECK_ENAMEL, _ENAMEL, _EDGE_ENAMEL = (
    np.array(colour) for colour in ((0.88, 0.81, 0.70), (0.925, 0.890, 0.830), (0.865, 0.865, 0.850))
)
"""Enamel near the gum, where it is thin, in the middle, and at the edge, where light shines through."""
_GUM, _DEEP_GUM = np.array([0.76, 0.45, 0.44]), np.array([0.60, 0.28, 0.28])
_GAP = np.array([0.40, 0.28, 0.24])
_TONGUE_TIP, _TONGUE_ROOT = np.array([0.80, 0.46, 0.45]), np.array([0.55, 0.25, 0.26])

_HALF_WIDTH = 0.326
"""Half-width in dm of the upper helper that the sizes below belong to; they grow with it."""
_WIDTHS = (0.088, 0.067, 0.077, 0.070, 0.066, 0.098)
"""Widths of the upper teeth from the middle outwards, in dm: two incisors, canine, two premolars, a molar."""
_LENGTHS = (1.00, 0.89, 1.02, 0.86, 0.80, 0.74)
_THICKNESS = (0.022, 0.022, 0.028, 0.040, 0.044, 0.052)
"""Their crowns' lengths as a share of the first one's, and their thickness near the biting edge, in dm."""
_COLUMNS = ((-1.0, -0.7, 0.0, 0.7),) * 5 + ((-1.0, -0.6, 0.6),)
"""Columns of vertices across each tooth, from -1 on the side of the middle to 1 on the other, which is the next -1."""
_LEVELS = np.array(
    [
        *[(0.30, 0.000), (0.02, 0.000), (0.00, 0.000), (0.10, 0.006), (0.45, 0.011), (0.82, 0.007)],
        *[(1.00, 0.002), (1.04, 0.008), (1.35, 0.010), (1.80, -0.010)],
    ]
)
"""Rows of vertices: height above the biting edge as a share of the crown's length, and standing out in dm."""
_LINGUAL = (1.3, 1.0)
"""How far the first rows, the back of the teeth, lie behind the edge, as a multiple of the thickness."""
_GUM_LINE = 6
"""Row of vertices on the border of crown and gum."""
_LIPS_MEET = (474, 493)
"""Numbers in ``base.obj`` of the inner upper and lower lip on the middle line."""
_ROOM, _LEAST_ROOM = 0.030, -0.002
"""Room in dm between the front teeth and closed lips, and the least to the lips of an open mouth.

It is measured to the control mesh, which the smooth lips keep about 0.015 clear of.
"""
_NEAR = 0.45
"""Distance in dm from the front teeth within which the lips are."""
_STILL = 0.002
"""Movement of a helper in dm that is only noise of the data."""

_TONGUE_DOWN, _BEHIND_TEETH, _BESIDE_TEETH = 0.045, 0.055, 0.085
"""How far the tongue lies below its helper, its tip behind the front of the lower row, and its sides within it; dm."""
_ROOT_DOWN, _FURROW = 0.10, 0.012
"""How much lower its root lies than that, and how deep the furrow along its middle is; dm."""


@dataclass(frozen=True)
class _Row:
    """One row of teeth: lengths in dm.

    The arch is half an ellipse with its front at ``front``, as wide as twice ``half_width`` and as deep as ``depth``.
    Sizes of teeth grow by ``scale``. Their roots lean inwards by ``lean`` for each length of a crown.
    """

    name: str
    part: Part
    up: float
    scale: float
    half_width: float
    front: float
    depth: float
    edge: float
    length: float
    lean: float


def teeth(face: FaceModel) -> list[Surface]:
    """Return the upper and the lower row of teeth with their gums, behind the lips; the lower one goes with the jaw."""
    return [_teeth(row) for row in _rows(face)]


def teeth_points(face: FaceModel) -> dict[str, Floats]:
    """Return the MPEG-4 feature points on the teeth of `teeth`, between the middle incisors.

    Returns
    -------
    dict of str to (3,) float64
        "9.8" and "9.10", the gum line and the biting edge of the upper row; "9.9" and "9.11", those of the lower row.
        Positions in dm of the neutral face.
    """
    points = {}
    for row, (at_gum, at_edge) in zip(_rows(face), (("9.8", "9.10"), ("9.9", "9.11")), strict=True):
        place, _ = _arch(row, np.zeros(1))
        for name, height in ((at_gum, row.edge + row.up * row.length), (at_edge, row.edge)):
            points[name] = np.array([place[0, 0], height, place[0, 1]])
    return points


def _rows(face: FaceModel) -> tuple[_Row, _Row]:
    """Fit both rows to the face: as wide as its helpers, behind its lips, with their edges where its lips meet."""
    upper, lower = face.parts["upper-teeth"], face.parts["lower-teeth"]
    half_width = float(np.abs(upper.vertices[:, 0]).max())
    scale = half_width / _HALF_WIDTH
    front, back = float(upper.vertices[:, 2].max()), float(upper.vertices[:, 2].min())
    lips = np.searchsorted(face.base_index, _LIPS_MEET)
    bite = float(face.vertices[lips, 1].mean()) - 0.022 * scale
    first_try = _Row(
        name="upper-teeth",
        part=upper,
        up=1.0,
        scale=scale,
        half_width=0.925 * half_width,
        front=front,
        depth=front - back,
        edge=bite,
        length=0.103 * scale,
        lean=0.0,
    )
    forwards = _room(face, first_try)
    return (
        replace(first_try, front=front + forwards),
        _Row(
            name="lower-teeth",
            part=lower,
            up=-1.0,
            scale=0.88 * scale,
            half_width=0.825 * half_width,
            front=front + forwards - 0.030 * scale,
            depth=front - back - 0.02 * scale,
            edge=bite + 0.006 * scale,
            length=0.090 * scale,
            lean=0.03,
        ),
    )


def _room(face: FaceModel, row: _Row) -> float:
    """Return how far the upper row can come forwards until it is as near to the lips as it should be; dm."""
    place, outward = _arch(row, row.scale * np.linspace(-1, 1, 13) * sum(_WIDTHS[:3]))
    heights = row.edge + row.up * row.length * np.linspace(0.1, 0.8, 5)
    flat = place + outward * (row.scale * _LEVELS[:, 1].max())
    points = np.array([(x, height, z) for height in heights for x, z in flat])
    jaw_open = face.morphs[face.morph_names.index("jawOpen")]
    closed, opened = (
        _before_lips(points, vertices, face.quads) for vertices in (face.vertices, face.vertices + jaw_open)
    )
    return min(closed - _ROOM * row.scale, opened - _LEAST_ROOM * row.scale)


def _before_lips(points: Floats, vertices: Floats, quads: NDArray[np.int64]) -> float:
    """Return the least distance along z from places (N, 3) to the inside of the lips, negative beyond it."""
    near = np.abs(vertices[quads].mean(axis=1) - points.mean(axis=0)).max(axis=1) < _NEAR
    corners = vertices[quads[near][:, [[0, 1, 2], [0, 2, 3]]]].reshape(-1, 3, 3)
    corners = corners[np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] < 0]
    # Weights of the corners at the place where the line through each point meets each triangle.
    arms = corners[None, ..., :2] - points[:, None, None, :2]
    doubled = [_turn(arms[:, :, (k + 1) % 3], arms[:, :, (k + 2) % 3]) for k in range(3)]
    area = doubled[0] + doubled[1] + doubled[2]
    weights = np.stack(doubled, axis=-1) / np.where(area == 0.0, np.inf, area)[..., None]
    depth = np.einsum("ptk,tk->pt", weights, corners[..., 2]) - points[:, 2:]
    depth = np.where((weights >= 0.0).all(axis=2) & (area != 0.0), depth, np.inf)
    nearest = depth[np.arange(len(points)), np.argmin(np.abs(depth), axis=1)]
    return float(nearest.min())


def _turn(a: Floats, b: Floats) -> Floats:
    turn: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return turn


def _teeth(row: _Row) -> Surface:
    """Build one row as a grid: columns along the arch, rows from behind the biting edge over the gum."""
    tooth, within, along = _along(row.scale)
    place, outward = _arch(row, along)
    beside = np.abs(within)
    last_level = len(_LEVELS) - 1

    share, out = (values[:, None] for values in _LEVELS.T)
    level = np.arange(len(_LEVELS))[:, None]
    gum = level > _GUM_LINE
    # Corners of the biting edge are round, teeth are parted by grooves, and the gum reaches down between them.
    share = share + 0.07 * beside**4 * (level <= 3) - 0.16 * beside**2.5 * (level >= _GUM_LINE) * (level < last_level)
    out = row.scale * (out - np.where(gum, 0.004, 0.013) * beside**6 - row.lean * np.maximum(share - 0.5, 0.0))
    for behind, multiple in enumerate(_LINGUAL):
        out[behind] = -multiple * row.scale * np.asarray(_THICKNESS)[tooth]
    height = row.edge + row.up * row.length * np.asarray(_LENGTHS)[tooth] * share
    flat = place + outward * out[..., None]
    vertices = np.stack([flat[..., 0], height, flat[..., 1]], axis=-1).reshape(-1, 3)

    # Little light reaches the teeth behind the corners of the mouth, and the roots.
    from_front = (row.front - place[:, 1]) / row.scale
    dim = 1.0 - 0.80 * np.clip((from_front - 0.02) / 0.17, 0, 1)
    depth = np.interp(level[:, 0], [0, 1, 2, 3, 7, 8, 9], [0.45, 0.65, 0.85, 0.95, 0.85, 0.65, 0.35])
    quads = grid_quads(len(_LEVELS), len(along), closed=False)
    surface = loose_surface(
        row.name,
        vertices,
        quads[:, ::-1] if row.up > 0 else quads,
        _carried(row.part, vertices),
        _teeth_colour(tooth, beside),
        gloss=(0.30, 60.0),
        shade=np.outer(depth, dim).ravel(),
    )
    return _dull_in_shade(surface)


def _dull_in_shade(surface: Surface) -> Surface:
    """Weaken highlights where no light comes: wet things deep in the mouth would look grey."""
    return replace(surface, gloss=surface.gloss * np.column_stack([surface.shade**2, np.ones(len(surface.shade))]))


def _teeth_colour(tooth: NDArray[np.int64], beside: Floats) -> Floats:
    """Paint crowns from edge to neck, canines a little darker, the gaps between them, and gums."""
    share = np.clip(_LEVELS[:, 0], 0, 1)[:, None, None]
    enamel = np.where(
        share < 0.45,
        _EDGE_ENAMEL + (_ENAMEL - _EDGE_ENAMEL) * (share / 0.45),
        _ENAMEL + (_NECK_ENAMEL - _ENAMEL) * ((share - 0.45) / 0.55) ** 2,
    )
    enamel = enamel * np.where(tooth == 2, 0.97, 1.0)[:, None]
    enamel = enamel + (_GAP - enamel) * (0.75 * beside**10)[:, None]
    level = np.arange(len(_LEVELS))[:, None, None]
    deep = np.clip((level - _GUM_LINE - 1) / 2, 0, 1)
    colour: Floats = np.where(level > _GUM_LINE, _GUM + (_DEEP_GUM - _GUM) * deep, enamel)
    return colour.reshape(-1, 3)


def _along(scale: float) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return tooth, place within the tooth and arc length from the middle of all columns, from right to left."""
    tooth = np.repeat(np.arange(len(_WIDTHS)), [len(columns) for columns in _COLUMNS])
    within = np.concatenate(_COLUMNS)
    # The outer side of the last tooth.
    tooth, within = np.append(tooth, len(_WIDTHS) - 1), np.append(within, 1.0)
    widths = scale * np.asarray(_WIDTHS)
    arc = (np.cumsum(widths) - 0.5 * widths)[tooth] + 0.5 * widths[tooth] * within
    return (
        np.concatenate([tooth[:0:-1], tooth]),
        np.concatenate([within[:0:-1], within]),
        np.concatenate([-arc[:0:-1], arc]),
    )


def _arch(row: _Row, s: Floats) -> tuple[Floats, Floats]:
    """Return places (n, 2: x and z) and outward directions at arc lengths ``s`` from the middle of the arch."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 721)
    curve = np.column_stack([row.half_width * np.sin(t), row.front - row.depth + row.depth * np.cos(t)])
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    arc -= arc[-1] / 2
    theta = np.interp(s, arc, t)
    place = np.column_stack([row.half_width * np.sin(theta), row.front - row.depth + row.depth * np.cos(theta)])
    outward = np.column_stack([row.depth * np.sin(theta), row.half_width * np.cos(theta)])
    return place, outward / np.linalg.norm(outward, axis=1, keepdims=True)


def _carried(part: Part, vertices: Floats) -> Floats:
    """Let new vertices move as the helper does: teeth are stiff, so one affine map for each morph is all of it."""
    moving = np.flatnonzero(np.abs(part.morphs).max(axis=(1, 2)) > _STILL)
    design = np.column_stack([part.vertices, np.ones(len(part.vertices))])
    wanted = part.morphs[moving].astype(np.float64).swapaxes(0, 1).reshape(len(design), -1)
    maps, *_ = np.linalg.lstsq(design, wanted, rcond=None)
    carried = np.zeros((len(part.morphs), len(vertices), 3))
    places = np.column_stack([vertices, np.ones(len(vertices))])
    carried[moving] = (places @ maps).reshape(len(vertices), -1, 3).swapaxes(0, 1)
    return carried


def tongue(face: FaceModel) -> Surface:
    """Return the tongue: its helper, smoothed, lowered behind the teeth, and dark towards its root.

    Its vertices are the helper's, in their order.
    """
    part = face.parts["tongue"]
    n = len(part.vertices)
    matrix, _ = catmull_clark(part.quads, n)
    smooth = matrix[:n]
    vertices, morphs = smooth @ part.vertices, np.stack([smooth @ morph for morph in part.morphs])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    forward = np.clip((vertices[:, 2] - low[2]) / (high - low)[2], 0, 1)
    middle = np.exp(-((vertices[:, 0] / (0.12 * (high - low)[0])) ** 2))
    top = np.clip((vertices[:, 1] - low[1]) / (high - low)[1], 0, 1)
    # The root of the helper is high: lowered, it leaves a dark hollow above it when the jaw opens.
    down = _TONGUE_DOWN + _ROOT_DOWN * (1 - forward) ** 1.5 + _FURROW * middle * top
    _, lower = _rows(face)
    back = high[2] - (lower.front - _BEHIND_TEETH * lower.scale)
    vertices = vertices - np.column_stack([np.zeros(n), down, np.full(n, back)])
    vertices[:, 0] *= _narrowing(vertices, lower)
    colour = _TONGUE_ROOT + (_TONGUE_TIP - _TONGUE_ROOT) * forward[:, None]
    shade = (0.05 + 0.75 * forward**2.2) * (1 - 0.22 * middle * top)
    return _dull_in_shade(
        loose_surface("tongue", vertices, part.quads, morphs, colour, gloss=(0.24, 26.0), shade=shade)
    )


def _narrowing(vertices: Floats, lower: _Row) -> Floats:
    """Return the factors (N,) of the tongue's width with which each part fits between the teeth of the lower row."""
    half_width = lower.half_width - _BESIDE_TEETH * lower.scale
    z, x = vertices[:, 2], np.abs(vertices[:, 0])
    knots = np.linspace(z.min(), z.max(), 12)
    widest = np.array([x[np.abs(z - knot) < knots[1] - knots[0]].max() for knot in knots])
    along = np.clip((knots - (lower.front - lower.depth)) / lower.depth, 0.0, 0.95)
    room = half_width * np.sqrt(1 - along**2)
    factors: Floats = np.interp(z, knots, np.minimum(1.0, room / widest))
    return factors
