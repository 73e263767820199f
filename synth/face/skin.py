"""Skin, hair and clothes: the subdivided body mesh with its paint."""

import numpy as np
from numpy.typing import NDArray

from synth.face.mesh import FaceModel
from synth.face.painting import Palette, above_hairline, below_neckline, place, wrap
from synth.face.shading import openness, vertex_normals
from synth.face.subdivision import catmull_clark
from synth.face.surface import Surface

Floats = NDArray[np.float64]

_MOUTH = np.array([0.40, 0.16, 0.16])
_HAIR_THICKNESS, _SHIRT_THICKNESS = 0.10, 0.035
"""How far hair and shirt stand off the skin; dm."""


def skin(face: FaceModel, palette: Palette) -> Surface:
    """Return head, neck and shoulders, subdivided once, with the hair's and the shirt's thickness added."""
    matrix, quads = catmull_clark(face.quads, len(face.vertices))
    vertices, template = matrix @ face.vertices, matrix @ face.template
    masks = {name: np.clip(matrix @ mask, 0, 1) for name, mask in face.masks.items()}
    ears, lips, mouth = masks["ears"], masks["lips"], masks["inside-mouth"]
    angle, height = wrap(template)
    hair = _step(above_hairline(angle, height), 0.0, 0.35) * (1 - _step(ears, 0.0, 0.3))
    shirt = _step(below_neckline(angle, height), -0.01, 0.05)

    shade = 0.28 + 0.72 * np.clip(openness(vertices, quads) / 0.92, 0, 1) ** 1.1
    shade *= 1 - 0.75 * mouth
    thickness = _HAIR_THICKNESS * hair + _SHIRT_THICKNESS * shirt
    vertices = vertices + vertex_normals(vertices, quads) * thickness[:, None]

    colour = np.broadcast_to(np.array(palette.skin), vertices.shape)
    cover = _step(ears, 0.1, 0.6)
    for mask, paint, strength in ((lips, palette.lips, 0.85), (mouth, _MOUTH, 1.0)):
        colour = colour + (np.asarray(paint) - colour) * (mask > 0.02)[:, None]
        cover = np.maximum(cover, strength * _step(mask, 0.1, 0.9))
    gloss = np.stack([0.075 + 0.15 * lips - 0.075 * shirt + 0.10 * hair, 12.0 + 16.0 * lips + 10 * hair], axis=1)
    return Surface(
        vertices=vertices,
        quads=quads,
        morphs=np.stack([matrix @ morph for morph in face.morphs]),
        uv=place(template),
        colour=colour,
        cover=cover,
        shade=shade,
        gloss=gloss,
        follow=_follow(face, vertices),
    )


def _follow(face: FaceModel, vertices: Floats) -> Floats:
    """Weigh the neck's share by height above its root, the skull's share by distance above the jaw's underside."""
    neck, skull, jaw = (face.pivots[name] for name in ("neck", "head", "jaw"))
    root, top = neck[1] - 0.05, skull[1] - 0.25
    bend = _step(vertices[:, 1], root - 0.15, top)
    # The border between skull and neck runs from below the chin obliquely up to the nape.
    chin_floor = jaw[1] - 0.16
    border = chin_floor + (skull[1] - 0.05 - chin_floor) * np.clip((0.75 - vertices[:, 2]) / 0.85, 0, 1)
    turn = _step(vertices[:, 1] - border, -0.42, 0.10)
    return np.stack([bend, turn], axis=1)


def _step(x: Floats, low: float, high: float) -> Floats:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)
