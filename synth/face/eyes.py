"""Eyes: painted balls, lashes and the line of the lids."""

import numpy as np
from numpy.typing import NDArray

from synth.face.mesh import FaceModel, Part
from synth.face.palette import Palette
from synth.face.surface import Surface, loose_surface

Floats = NDArray[np.float64]

IRIS = np.radians(27.0)
PUPIL = np.radians(10.5)
"""Half-angles that iris and pupil take on the ball."""

EYES = ("left-eye", "right-eye")

_MERIDIANS = 40
_SCLERA = np.array([0.86, 0.835, 0.815])
_VEIN = np.array([0.80, 0.60, 0.56])
_LASH_CLEARANCE = 0.006
_LASH = np.array([0.085, 0.065, 0.06])


def eyeballs(face: FaceModel, palette: Palette) -> list[Surface]:
    """Return the left and the right eyeball, each a ball round its centre that looks along +z."""
    edge = np.radians(0.6)
    rings = np.concatenate(
        [
            [0.0, PUPIL - edge, PUPIL + edge],
            np.linspace(PUPIL + edge, IRIS - 3.5 * edge, 5)[1:],
            [IRIS - edge, IRIS + edge],
            np.linspace(IRIS + 4 * edge, np.radians(80), 7),
        ]
    )
    around = np.linspace(0, 2 * np.pi, _MERIDIANS, endpoint=False)
    angle, turn = (grid.ravel() for grid in np.meshgrid(rings, around, indexing="ij"))
    bulge = 1.0 + 0.045 * np.clip(1 - (angle / IRIS) ** 2, 0, 1)
    ball = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    points = ball * (bulge * face.eye_radius * 0.995)[:, None]
    colour = _ball_colour(angle, turn, palette)
    # The upper lid and its lashes throw a shadow on the ball; the corners are dim.
    shade = (
        1.0 - 0.50 * np.clip((ball[:, 1] - 0.10) / 0.35, 0, 1) - 0.35 * np.clip((np.abs(ball[:, 0]) - 0.35) / 0.5, 0, 1)
    )
    gloss = np.where((angle < IRIS)[:, None], (1.6, 260.0), (0.30, 90.0))
    quads = grid_quads(len(rings), _MERIDIANS)
    still = np.zeros((len(face.morph_names), len(points), 3), dtype=np.float32)
    balls = []
    for name, centre in zip(EYES, face.eye_centres, strict=True):
        ball_surface = loose_surface(
            name, points + centre, quads, still, colour, gloss=(0, 1), shade=np.maximum(shade, 0.3)
        )
        balls.append(Surface(**{**vars(ball_surface), "gloss": gloss}))
    return balls


def _ball_colour(angle: Floats, turn: Floats, palette: Palette) -> Floats:
    """Paint pupil, iris with spokes and a dark rim, and sclera."""
    iris = np.array(palette.iris)
    spokes = 1.0 + 0.09 * np.sin(turn * 17) + 0.07 * np.sin(turn * 11 + 1.0)
    depth = np.clip((angle - PUPIL) / (IRIS - PUPIL), 0, 1)
    ring = iris * ((1.30 - 0.55 * depth**2.5) * spokes)[:, None]
    white = _SCLERA + (_VEIN - _SCLERA) * np.clip((angle - IRIS * 1.3) / 1.2, 0, 1)[:, None]
    colour = np.where((angle <= PUPIL)[:, None], (0.02, 0.018, 0.018), ring)
    colour = np.where((angle >= IRIS - np.radians(1.0))[:, None], iris * 0.35, colour)
    return np.where((angle > IRIS)[:, None], white, colour)


def grid_quads(n_rows: int, n_columns: int, *, closed: bool = True) -> NDArray[np.int64]:
    """Return the quads of a grid of vertices, row after row; the columns close to a ring."""
    rows = np.arange(n_rows - 1)[:, None]
    columns = np.arange(n_columns if closed else n_columns - 1)[None, :]
    onward = (columns + 1) % n_columns
    corners = (rows, columns), (rows + 1, columns), (rows + 1, onward), (rows, onward)
    return np.stack([r * n_columns + c for r, c in corners], axis=-1).reshape(-1, 4).astype(np.int64)


def lashes(face: FaceModel) -> list[Surface]:
    """Return the lashes: the helper strips, drawn in towards their roots."""
    strips = []
    for side in range(2):
        for row, length in ((2, 0.45),):
            part = face.parts[f"{'lr'[side]}-eyelashes-{row}"]
            strips.append(
                _strip(f"{('left', 'right')[side]}-lashes", part, face.eye_centres[side], face.eye_radius, length)
            )
    return strips


def _strip(name: str, part: Part, centre: Floats, radius: float, length: float) -> Surface:
    arm = part.vertices - centre
    distance = np.linalg.norm(arm, axis=1)
    roots = np.flatnonzero(distance < radius * 1.16)
    nearest = roots[np.argmin(np.linalg.norm(part.vertices[:, None] - part.vertices[roots], axis=2), axis=1)]
    vertices = part.vertices[nearest] + length * (part.vertices - part.vertices[nearest])
    # In front of the lid's own margin.
    vertices = vertices + _LASH_CLEARANCE * (vertices - centre) / np.linalg.norm(vertices - centre, axis=1)[:, None]
    morphs = part.morphs[:, nearest] + length * (part.morphs - part.morphs[:, nearest])
    return loose_surface(name, vertices, part.quads, morphs, _LASH, gloss=(0.0, 1.0))
