"""Skin, hair and clothes: the subdivided body mesh with its paint."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from synth.face.brows import carry_brows
from synth.face.lips import CLOSED, sealing
from synth.face.mesh import FaceModel
from synth.face.painting import above_hairline, below_neckline, place, wrap
from synth.face.palette import Palette
from synth.face.shading import openness, smooth, vertex_normals
from synth.face.subdivision import catmull_clark
from synth.face.surface import Surface

Floats = NDArray[np.float64]

_MOUTH = np.array([0.40, 0.16, 0.16])
_UPPER_LID, _LOWER_LID = np.array([0.16, 0.11, 0.10]), np.array([0.48, 0.30, 0.27])
_HAIR_THICKNESS, _SHIRT_THICKNESS = 0.10, 0.035
"""How far hair and shirt stand off the skin; dm."""

_SMILE_ROUNDS = 12
"""Rounds of smoothing that take the sharp folds out of smiling cheeks."""


def skin(face: FaceModel, palette: Palette) -> Surface:
    """Return head, neck and shoulders, subdivided once, with the hair's and the shirt's thickness added."""
    matrix, quads = catmull_clark(face.quads, len(face.vertices))
    matrix = _firm(matrix, np.maximum(face.masks["lips"], face.masks["eyelids"]))
    vertices, template = matrix @ face.vertices, matrix @ face.template
    morphs = np.stack([matrix @ morph for morph in face.morphs])
    masks = {name: np.clip(matrix @ mask, 0, 1) for name, mask in face.masks.items()}
    ears, lips, mouth = masks["ears"], masks["lips"], masks["inside-mouth"]
    vertices = _close_mouth(face, vertices, quads, morphs, masks)
    carry_brows(face, template, morphs)
    angle, height = wrap(template)
    hair = _step(above_hairline(angle, height), 0.0, 0.35) * (1 - _step(ears, 0.0, 0.3))
    # The sheet of hair hides the scalp, but for the parting and a margin along the hairline.
    covered = (hair > 0.9) & (np.abs(template[:, 0]) > 0.25) & (template[:, 1] > 7.3)
    hidden = covered | _behind_eyes(face, vertices)
    shirt = _step(below_neckline(angle, height), -0.01, 0.05)

    shade = 0.28 + 0.72 * np.clip(openness(vertices, quads) / 0.92, 0, 1) ** 1.1
    shade *= 1 - 0.75 * mouth
    thickness = _HAIR_THICKNESS * hair + _SHIRT_THICKNESS * shirt
    vertices = vertices + vertex_normals(vertices, quads) * thickness[:, None]

    colour = np.broadcast_to(np.array(palette.skin), vertices.shape)
    cover = _step(ears, 0.1, 0.6)
    upper, lower = (_lid_line(face, vertices, row) for row in (2, 1))
    paints = ((lips, palette.lips, 0.85), (mouth, _MOUTH, 1.0), (lower, _LOWER_LID, 0.45), (upper, _UPPER_LID, 0.9))
    for mask, paint, strength in paints:
        colour = colour + (np.asarray(paint) - colour) * (mask > 0.02)[:, None]
        cover = np.maximum(cover, strength * _step(mask, 0.1, 0.9))
    gloss = np.stack([0.075 + 0.15 * lips - 0.075 * shirt + 0.10 * hair, 12.0 + 16.0 * lips + 10 * hair], axis=1)
    return Surface(
        name="skin",
        vertices=vertices,
        quads=quads,
        morphs=morphs,
        uv=place(template),
        colour=colour,
        cover=cover,
        shade=shade,
        gloss=gloss,
        follow=_follow(face, vertices),
        drawn=~hidden[quads].all(axis=1),
    )


def _close_mouth(
    face: FaceModel, vertices: Floats, quads: NDArray[np.int64], morphs: Floats, masks: dict[str, Floats]
) -> Floats:
    """Return vertices whose lips meet; let them meet in the morphs that leave the mouth closed, too."""
    number = {name: k for k, name in enumerate(face.morph_names)}
    lips = masks["lips"]
    cheeks = 1 - np.clip(2 * smooth(np.maximum(lips, masks["eyelids"]), quads, rounds=4), 0, 1)
    for name in ("mouthSmileLeft", "mouthSmileRight"):
        morph = morphs[number[name]]
        morph += cheeks[:, None] * (smooth(morph, quads, rounds=_SMILE_ROUNDS) - morph)

    jaw_drop = -morphs[number["jawOpen"], :, 1]
    vertices = vertices + sealing(vertices, quads, lips, jaw_drop)
    leftward = _step(vertices[:, 0], -0.1, 0.1)[:, None]
    for name in CLOSED:
        left, right = (morphs[number[name + side]] for side in ("Left", "Right"))
        seal = sealing(vertices + left + right, quads, lips, jaw_drop)
        left += leftward * seal
        right += (1 - leftward) * seal
    return vertices


def _firm(matrix: sparse.csr_array, places: Floats) -> sparse.csr_array:
    """Keep lips and lids where the control mesh has them: smoothing alone would part lips that touch.

    The control points are moved beforehand by as much as the subdivision draws them in.
    """
    n = matrix.shape[1]
    drawn_in = sparse.eye_array(n) - matrix[:n]
    return sparse.csr_array(matrix @ (sparse.eye_array(n) + sparse.diags_array(_step(places, 0.0, 0.5)) @ drawn_in))


def _lid_line(face: FaceModel, vertices: Floats, row: int) -> Floats:
    """Return how much each vertex belongs to the margin of the lower (row 1) or upper lids (row 2)."""
    line = np.zeros(len(vertices))
    for side, centre in zip("lr", face.eye_centres, strict=True):
        lashes = face.parts[f"{side}-eyelashes-{row}"].vertices
        roots = lashes[np.linalg.norm(lashes - centre, axis=1) < 1.22 * face.eye_radius]
        near = np.flatnonzero(np.linalg.norm(vertices - centre, axis=1) < 2 * face.eye_radius)
        distance = np.linalg.norm(vertices[near, None] - roots, axis=2).min(axis=1)
        line[near] = np.maximum(line[near], 1 - _step(distance, 0.006, 0.020))
    return line


def _behind_eyes(face: FaceModel, vertices: Floats) -> NDArray[np.bool_]:
    """Tell which vertices line the sockets behind the eyeballs, where nobody sees them."""
    arms = vertices[:, None] - face.eye_centres
    near = np.linalg.norm(arms, axis=2) < 1.6 * face.eye_radius
    behind: NDArray[np.bool_] = (near & (arms[..., 2] < 0.0)).any(axis=1)
    return behind


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
    t: Floats = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)
