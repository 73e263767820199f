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
_EDGE, _MARGIN, _ROOT = 0, 9, 13
"""Rows of the grid: the biting edge, the margin of the gum, the end of the gum."""


@dataclass(frozen=True)
class _Row:
    """One row of teeth: lengths in dm relative to the middle of its helper's front."""

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
        _Row(part=upper, up=1.0, half_width=0.305, inset=0.012, scale=1.0, edge=bite - 0.042, length=0.105),
        _Row(part=lower, up=-1.0, half_width=0.285, inset=0.022, scale=0.86, edge=bite - 0.020, length=0.085),
    )
    return [_teeth(row) for row in rows]


def _teeth(row: _Row) -> Surface:
    """Build one row as a grid: columns along the arch, rows from behind the biting edge over the gum."""
    widths = np.array(_WIDTHS) * row.scale
    borders = np.concatenate([[0.0], np.cumsum(widths)])
    inside = np.linspace(-1, 1, _COLUMNS)
    along, tooth, within = [], [], []
    for k in (*range(len(widths) - 1, -1, -1), *range(len(widths))):
        side = -1.0 if len(along) < len(widths) else 1.0
        along.append(side * (borders[k] + widths[k] * (0.5 + side * 0.5 * inside)) if side > 0 else -(borders[k] + widths[k] * (0.5 - 0.5 * inside)))
        tooth.append(np.full(_COLUMNS, k))
        within.append(inside)
    s, k, u = np.concatenate(along), np.concatenate(tooth), np.concatenate(within)
    place, outward = _arch(row, s)

    length = row.length * np.interp(k, [0, 1, 2, 3, 6], [1.0, 0.88, 1.0, 0.86, 0.75])
    corner = np.abs(u) ** 4
    # Each grid row: height above the edge as a share of the tooth, and how far the surface stands out.
    levels = [(0.10, -0.045), (0.0, -0.030), (-0.02, -0.012), (0.03, 0.0), (0.14, 0.006), (0.32, 0.012)]
    levels += [(0.52, 0.013), (0.72, 0.010), (0.88, 0.004), (1.0, 0.002), (1.06, 0.010), (1.35, 0.012), (1.8, 0.0)]
    points, colours = [], []
    for j, (share, out) in enumerate(levels):
        round_edge = 0.10 * corner * (j <= 4)
        margin = 0.10 * np.abs(u) ** 2.5 * -1.0 * (j >= _MARGIN)
        height = row.edge + row.up * length * (share + round_edge + margin)
        groove = 0.014 * np.abs(u) ** 6 * (j < _MARGIN + 1)
        flat = place + outward * (out * 0.9 - groove)[:, None]
        points.append(np.column_stack([flat[:, 0], height, flat[:, 1]]))
        enamel = _ENAMEL + (_GAP - _ENAMEL) * (0.75 * np.abs(u) ** 10)[:, None]
        colours.append(enamel if j < _MARGIN else np.broadcast_to(_GUM, enamel.shape))
    vertices = np.concatenate(points)
    quads = grid_quads(len(levels), len(s), closed=False)
    if row.up > 0:
        quads = quads[:, ::-1]
    dim = 1.0 - 0.72 * np.clip((np.abs(s) - 0.12) / 0.16, 0, 1)
    shade = np.tile(dim, len(levels)) * np.repeat(np.interp(np.arange(len(levels)), [0, 2, 8, 12], [0.5, 0.95, 0.85, 0.55]), len(s))
    morphs = _carried(row.part, vertices)
    return loose_surface(vertices, quads, morphs, np.concatenate(colours), gloss=(0.28, 50.0), shade=shade)


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


def _carried(part: Part, vertices: Floats) -> NDArray[np.float64]:
    """Let new vertices move as the helper's vertices near them do."""
    distance = np.linalg.norm(vertices[:, None] - part.vertices, axis=2)
    weight = 1.0 / (distance**2 + 0.02**2) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    return np.einsum("np,mpk->mnk", weight, part.morphs.astype(np.float64))


def tongue(face: FaceModel) -> Surface:
    """Return the tongue: its helper, subdivided."""
    part = face.parts["tongue"]
    matrix, quads = catmull_clark(part.quads, len(part.vertices))
    vertices = matrix @ part.vertices - _TONGUE_REST
    morphs = np.stack([matrix @ morph for morph in part.morphs])
    back = np.clip((vertices[:, 2] - vertices[:, 2].min()) / np.ptp(vertices[:, 2]), 0, 1)
    return loose_surface(vertices, quads, morphs, _TONGUE, gloss=(0.16, 18.0), shade=0.25 + 0.55 * back)
