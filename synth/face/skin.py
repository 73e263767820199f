"""Skin, hair and clothes: the subdivided body mesh with its paint."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from synth.face.brows import carry_brows
from synth.face.hair import hair_layer, hidden_scalp
from synth.face.lips import CLOSED, sealing
from synth.face.mesh import FaceModel
from synth.face.palette import Palette
from synth.face.shading import openness, smooth, vertex_normals
from synth.face.subdivision import catmull_clark
from synth.face.surface import Surface, detach
from synth.face.wrapping import MIDDLE, above_hairline, below_neckline, mirrored, place, step, wrap

Floats = NDArray[np.float64]

_MOUTH = np.array([0.40, 0.16, 0.16])
_UPPER_LID, _LOWER_LID = np.array([0.16, 0.11, 0.10]), np.array([0.54, 0.42, 0.435])
"""Margins of the lids: the upper in its own dark colour, the lower as a part of the skin's."""
_TOP_THICKNESS = 0.035
"""How far the top stands off the skin; dm."""
_EARS = 0.35
"""How much blood shows in the ears."""
_MATT = {"down": 0.35, "aside": 0.35, "back": 0.35, "curls": 1.0}
"""How much less hair shines than skin, by the way it lies."""
_LUMINANCE = np.array([0.21, 0.72, 0.07])

_SMILE_ROUNDS = 12
"""Rounds of smoothing that take the sharp folds out of smiling cheeks."""


def skin(face: FaceModel) -> tuple[Surface, Surface]:
    """Return head, neck and shoulders, subdivided once, with the thickness of hair and top; a strip behind is apart."""
    palette, look = face.identity.palette, face.identity.look
    matrix, quads = catmull_clark(face.quads, len(face.vertices))
    matrix = _firm(matrix, np.maximum(face.masks["lips"], face.masks["eyelids"]))
    vertices, template = matrix @ face.vertices, matrix @ face.template
    morphs = np.stack([matrix @ morph for morph in face.morphs])
    masks = {name: np.clip(matrix @ mask, 0, 1) for name, mask in face.masks.items()}
    ears, lips, mouth = (masks[name] for name in ("ears", "lips", "inside-mouth"))
    vertices = _close_mouth(face, vertices, quads, morphs, masks)
    carry_brows(face, template, morphs)
    angle, height = wrap(template)
    inside = above_hairline(look.hair.hairline, angle, height)
    hair = step(inside, 0.0, look.hair.ramp) * (1 - step(ears, 0.0, 0.3))
    top = step(below_neckline(look.neckline, angle, height), 0.0, 0.25)

    shade = 0.28 + 0.72 * np.clip(openness(vertices, quads) / 0.92, 0, 1) ** 1.1
    shade *= 1 - 0.75 * mouth
    normals = vertex_normals(vertices, quads)
    layer = hair_layer(look.hair, template, hair) + _TOP_THICKNESS * top
    hidden: NDArray[np.bool_] = hidden_scalp(look.hair, template, inside) | _behind_eyes(face, vertices)
    vertices = vertices + normals * layer[:, None]

    lids = {f"{name}-lid": _lid_line(face, vertices, row) for name, row in (("lower", 1), ("upper", 2))}
    colour, cover = _own_colours(palette, masks | lids)
    whole = Surface(
        name="skin",
        vertices=vertices,
        quads=quads,
        morphs=morphs,
        uv=place(template),
        colour=colour,
        cover=cover,
        shade=shade,
        gloss=_gloss(
            palette, lips, np.maximum.reduce([top, mouth, _MATT[look.hair.strands] * step(inside, -0.03, 0.03)])
        ),
        follow=_follow(face, vertices),
        drawn=np.logical_not(hidden[quads].all(axis=1)),
    )
    return _open_behind(whole, template)


def _own_colours(palette: Palette, masks: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Return colours (N, 3) of lips, ears, the inside of the mouth and the lids' margins, and how much they cover."""
    skin = np.array(palette.skin)
    ears = skin + _EARS * (np.array(palette.flush) - skin)
    paints = (
        *(("ears", ears, 1.0), ("lips", palette.lips, 0.85), ("inside-mouth", _MOUTH, 1.0)),
        *(("lower-lid", _LOWER_LID * skin, 0.45), ("upper-lid", _UPPER_LID, 0.9)),
    )
    cover = np.zeros(len(masks["ears"]))
    colour = np.broadcast_to(skin, (len(cover), 3))
    for name, paint, strength in paints:
        colour = np.where(masks[name][:, None] > 0.02, paint, colour)
        cover = np.maximum(cover, strength * step(masks[name], 0.1, 0.9))
    return colour, cover


def _gloss(palette: Palette, lips: Floats, matt: Floats) -> Floats:
    """Return strength and exponent of the highlight (N, 2).

    The broad sheen of light skin would lie like fog on dark skin, whose form shows in narrower highlights.
    """
    light = float(np.square(palette.skin) @ _LUMINANCE)
    strength = 0.052 + 0.040 * light + (0.05 + 0.09 * light) * lips
    exponent = 28.0 - 28.0 * light + (8.0 + 14.0 * light) * lips + 10.0 * matt
    return np.stack([strength * (1 - matt), exponent], axis=1)


def _open_behind(whole: Surface, template: Floats) -> tuple[Surface, Surface]:
    """Detach the quads to the right of the middle of the nape, where the painting's left and right border meet.

    Whole quads of the control mesh are detached, since the others may be drawn as such.
    """
    behind = (np.abs(template[:, 0]) < MIDDLE) & (wrap(template)[0] > 0.5 * np.pi)
    right = template[whole.quads, 0].mean(axis=1) < 0
    touching = (behind[whole.quads].any(axis=1) & right).reshape(-1, 4).any(axis=1)
    rest, strip = detach(whole, "nape", np.repeat(touching, 4))
    rows = np.unique(whole.quads[np.repeat(touching, 4)])
    uv = np.where(behind[rows, None], mirrored(strip.uv), strip.uv)
    return rest, replace(strip, uv=uv)


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
    for name in CLOSED:
        morph = morphs[number[name]]
        morph += sealing(vertices + morph, quads, lips, jaw_drop)
    return vertices


def _firm(matrix: sparse.csr_array, places: Floats) -> sparse.csr_array:
    """Keep lips and lids where the control mesh has them: smoothing alone would part lips that touch.

    The control points are moved beforehand by as much as the subdivision draws them in.
    """
    n = matrix.shape[1]
    drawn_in = sparse.eye_array(n) - matrix[:n]
    return sparse.csr_array(matrix @ (sparse.eye_array(n) + sparse.diags_array(step(places, 0.0, 0.5)) @ drawn_in))


def _lid_line(face: FaceModel, vertices: Floats, row: int) -> Floats:
    """Return how much each vertex belongs to the margin of the lower (row 1) or upper lids (row 2)."""
    line = np.zeros(len(vertices))
    for side, centre in zip("lr", face.eye_centres, strict=True):
        lashes = face.parts[f"{side}-eyelashes-{row}"].vertices
        roots = lashes[np.linalg.norm(lashes - centre, axis=1) < 1.22 * face.eye_radius]
        near = np.flatnonzero(np.linalg.norm(vertices - centre, axis=1) < 2 * face.eye_radius)
        distance = np.linalg.norm(vertices[near, None] - roots, axis=2).min(axis=1)
        line[near] = np.maximum(line[near], 1 - step(distance, 0.006, 0.020))
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
    # The collar and the shoulders stay; what hardly moves need not be drawn anew either.
    root, top = neck[1] + 0.10, skull[1] - 0.25
    bend = step(vertices[:, 1], root, top)
    # The border between skull and neck runs from below the chin obliquely up to the nape.
    chin_floor = jaw[1] - 0.16
    border = chin_floor + (skull[1] - 0.05 - chin_floor) * np.clip((0.75 - vertices[:, 2]) / 0.85, 0, 1)
    turn = step(vertices[:, 1] - border, -0.42, 0.10)
    return np.stack([bend, turn], axis=1)
