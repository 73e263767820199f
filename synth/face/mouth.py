"""The inside of the mouth: two rows of teeth with gums, and the tongue."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.face.eyes import grid_quads
from synth.face.mesh import FaceModel, Part
from synth.face.subdivision import catmull_clark
from synth.face.surface import Surface, loose_surface

Floats = NDArray[np.float64]

_ENAMEL = np.array([0.90, 0.865, 0.80])
_GUM = np.array([0.72, 0.40, 0.40])
_TONGUE = np.array([0.71, 0.37, 0.37])
_TONGUE_REST = np.array([0.0, 0.045, 0.03])
"""How far the tongue lies below and behind its helper; dm."""
_GAP = np.array([0.42, 0.30, 0.26])

_WIDTHS = (0.088, 0.068, 0.078, 0.070, 0.068, 0.095, 0.090)
"""Widths of the upper teeth from the middle outwards, in dm; the lower row is narrower."""
_COLUMNS = 7
"""Columns of the grid on each tooth."""
_LEVELS = np.array(
    [
        *[(0.10, -0.040), (0.00, -0.027), (-0.02, -0.011), (0.03, 0.0), (0.14, 0.005), (0.32, 0.011)],
        *[(0.52, 0.012), (0.72, 0.009), (0.88, 0.004), (1.00, 0.002), (1.06, 0.009), (1.35, 0.011), (1.80, 0.0)],
    ]
)
"""Rows of the grid: height above the biting edge as a share of the tooth's length, and standing out in dm."""
_FIRST_GUM_LEVEL = 9


@dataclass(frozen=True)
class _Row:
    """One row of teeth: lengths in dm relative to the middle of its helper's front."""

    name: str
    part: Part
    up: float
    half_width: float
    inset: float
    scale: float
    edge: float
    length: float


def teeth(face: FaceModel) -> list[Surface]:
    """Return both rows of teeth, set behind the lips where the helpers are."""
    upper, lower = face.parts["upper-teeth"], face.parts["lower-teeth"]
    bite = float(upper.vertices[:, 1].min())
    rows = (
        _Row(
            name="upper-teeth",
            part=upper,
            up=1.0,
            half_width=0.305,
            inset=0.012,
            scale=1.0,
            edge=bite - 0.042,
            length=0.105,
        ),
        _Row(
            name="lower-teeth",
            part=lower,
            up=-1.0,
            half_width=0.285,
            inset=0.022,
            scale=0.86,
            edge=bite - 0.020,
            length=0.085,
        ),
    )
    return [_teeth(row) for row in rows]


def _teeth(row: _Row) -> Surface:
    """Build one row as a grid: columns along the arch, rows from behind the biting edge over the gum."""
    widths = np.array(_WIDTHS) * row.scale
    middles = np.cumsum(widths) - 0.5 * widths
    within = np.tile(np.linspace(-1, 1, _COLUMNS), 2 * len(widths))
    tooth = np.repeat([*range(len(widths))[::-1], *range(len(widths))], _COLUMNS)
    along = np.repeat([*-middles[::-1], *middles], _COLUMNS) + 0.5 * widths[tooth] * within
    place, outward = _arch(row, along)
    length = row.length * np.interp(tooth, [0, 1, 2, 3, 6], [1.0, 0.88, 1.0, 0.86, 0.75])
    beside = np.abs(within)

    share, out = (values[:, None] for values in _LEVELS.T)
    level = np.arange(len(_LEVELS))[:, None]
    gum = level >= _FIRST_GUM_LEVEL
    # Corners of the biting edge are round, teeth are parted by grooves, and the gum reaches down between them.
    share = share + 0.10 * beside**4 * (level <= 4) - 0.10 * beside**2.5 * gum
    out = out - 0.014 * beside**6 * (level <= _FIRST_GUM_LEVEL)
    height = row.edge + row.up * length * share
    flat = place + outward * out[..., None]
    vertices = np.stack([flat[..., 0], height, flat[..., 1]], axis=-1).reshape(-1, 3)
    enamel = _ENAMEL + (_GAP - _ENAMEL) * (0.75 * beside**10)[:, None]
    colour = np.where(gum[..., None], _GUM, enamel).reshape(-1, 3)

    quads = grid_quads(len(_LEVELS), len(along), closed=False)
    # Little light reaches the teeth behind the corners of the mouth, and the roots.
    dim = 1.0 - 0.72 * np.clip((np.abs(along) - 0.12) / 0.16, 0, 1)
    depth = np.interp(level[:, 0], [0, 2, 8, 12], [0.5, 0.95, 0.85, 0.55])
    return loose_surface(
        row.name,
        vertices,
        quads[:, ::-1] if row.up > 0 else quads,
        _carried(row.part, vertices),
        colour,
        gloss=(0.28, 50.0),
        shade=np.outer(depth, dim).ravel(),
    )


def _arch(row: _Row, s: Floats) -> tuple[Floats, Floats]:
    """Return places (n, 2: x and z) and outward directions at arc lengths ``s`` from the middle of an elliptic arch."""
    front = float(row.part.vertices[:, 2].max()) - row.inset
    depth = front - float(row.part.vertices[:, 2].min())
    t = np.linspace(-np.pi / 2, np.pi / 2, 721)
    curve = np.column_stack([row.half_width * np.sin(t), front - depth + depth * np.cos(t)])
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    arc -= arc[-1] / 2
    theta = np.interp(s, arc, t)
    place = np.column_stack([row.half_width * np.sin(theta), front - depth + depth * np.cos(theta)])
    outward = np.column_stack([depth * np.sin(theta), row.half_width * np.cos(theta)])
    return place, outward / np.linalg.norm(outward, axis=1, keepdims=True)


def _carried(part: Part, vertices: Floats) -> Floats:
    """Let new vertices move as the helper's vertices near them do."""
    distance = np.linalg.norm(vertices[:, None] - part.vertices, axis=2)
    weight = 1.0 / (distance**2 + 0.02**2) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    carried: Floats = np.einsum("np,mpk->mnk", weight, part.morphs.astype(np.float64))
    return carried


def tongue(face: FaceModel) -> Surface:
    """Return the tongue: its helper, subdivided."""
    part = face.parts["tongue"]
    matrix, quads = catmull_clark(part.quads, len(part.vertices))
    vertices = matrix @ part.vertices - _TONGUE_REST
    morphs = np.stack([matrix @ morph for morph in part.morphs])
    back = np.clip((vertices[:, 2] - vertices[:, 2].min()) / np.ptp(vertices[:, 2]), 0, 1)
    return loose_surface("tongue", vertices, quads, morphs, _TONGUE, gloss=(0.16, 18.0), shade=0.25 + 0.55 * back)
