"""Eyes: painted balls with pupils that can grow, and lashes."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.face.mesh import FaceModel
from synth.face.palette import Palette
from synth.face.surface import Surface, loose_surface
from synth.face.wrapping import step

Floats = NDArray[np.float64]

IRIS = np.radians(27.0)
PUPIL = np.radians(10.5)
"""Half-angles that iris and pupil take on the ball."""

EYES = ("left-eye", "right-eye")

_MERIDIANS = 26
_SOFT = np.radians(0.6)
"""Half the width of the pupil's edge."""
_RINGS = np.concatenate(
    [
        [PUPIL - _SOFT, PUPIL + _SOFT],
        np.radians([14.0, 18.5, 22.5, 25.6, 28.2]),
        np.radians([36.0, 47.0, 62.0, 82.0, 106.0, 136.0]),
    ]
)
"""Angles of the ball's rings of vertices from its pole, the middle of the pupil."""

_BULGE = 0.045
"""Height of the cornea above the ball, as a share of the ball's radius."""
_LARGEST, _SMALLEST = 0.995, 0.88
_SCLERA_FILM, _CORNEA_FILM = 0.012, 0.006
"""Radius of the ball and room below the lids, as shares of the face's eye radius."""

PUPIL_RANGE = (0.5, 1.6)
"""Factors of the pupil between which its growth is nearly exact."""

_BLACK = np.array([0.020, 0.018, 0.018])
_SCLERA = np.array([0.875, 0.850, 0.825])
_VEIN = np.array([0.82, 0.64, 0.58])
_RIM = 0.30
"""Brightness of the limbal ring as a share of the iris's own."""

_LASH = np.array([0.085, 0.065, 0.06])
# The helper strips of lashes are grids; these are their vertices at the roots and at the tips, from the nose outwards.
_STRIPS = {
    "upper": (
        "eyelashes-2",
        (12, 14, 11, 10, 9, 1, 0, 2, 3, 4, 5, 6, 7),
        (39, 42, 41, 40, 43, 50, 51, 49, 48, 47, 46, 45, 44),
    ),
    "lower": (
        "eyelashes-1",
        (9, 8, 23, 7, 6, 5, 4, 3, 2, 1, 22, 0),
        (38, 39, 36, 40, 41, 42, 43, 44, 45, 46, 37, 47),
    ),
}
_OUTER_EDGE = 0.33
"""Where the strip leaves the lid's outer edge, as a share of its width."""


@dataclass(frozen=True)
class _Fringe:
    """The lashes of one lid.

    Length is a share of the helper strip's width; width is that of a lash's base as a share of the room between two
    lashes; lift bends them up, as a share of their length; softness mixes skin into the colour of the bases and tips.
    """

    lid: str
    count: int
    length: float
    width: float
    lift: float
    levels: int
    softness: tuple[float, float]


# A lash is narrower than a pixel. Wide bases that taper make a line that frays, as real lashes do from where one talks
# to somebody; thin ones would break into dots.
_FRINGES = {
    "female": (
        _Fringe(lid="upper", count=28, length=0.46, width=0.9, lift=0.25, levels=3, softness=(0.0, 0.55)),
        _Fringe(lid="lower", count=20, length=0.20, width=0.9, lift=-0.10, levels=2, softness=(0.80, 0.95)),
    ),
    "male": (
        _Fringe(lid="upper", count=26, length=0.30, width=0.9, lift=0.10, levels=2, softness=(0.20, 0.70)),
        _Fringe(lid="lower", count=18, length=0.16, width=0.9, lift=-0.05, levels=2, softness=(0.75, 0.95)),
    ),
}


def eyeballs(face: FaceModel, palette: Palette) -> list[Surface]:
    """Return the left and the right eyeball, each a ball round its centre that looks along +z.

    Parameters
    ----------
    face : FaceModel
        The face whose lids the balls fit under.
    palette : Palette
        Its colours.

    Returns
    -------
    list of Surface
        Both have the same vertices relative to their centres; the first vertex is the middle of the pupil.
    """
    angle, turn, points = _ball(face)
    up = np.sin(angle) * np.sin(turn)
    # The upper lid throws a shadow on the ball. It is the same along each parallel of the ball, so that it stays when
    # the eye looks aside; when the eye looks up or down the lid follows, and the shadow with it.
    shade = 1.0 - 0.50 * step(up, 0.00, 0.40) - 0.12 * step(angle, np.radians(40), np.radians(75))
    gloss = np.where((angle < IRIS)[:, None], (4.0, 800.0), (0.35, 110.0))
    quads = _cap_quads(len(_RINGS), _MERIDIANS)
    still = np.zeros((len(face.morph_names), len(points), 3), dtype=np.float32)
    balls = []
    for name, centre in zip(EYES, face.eye_centres, strict=True):
        ball = loose_surface(
            name, points + centre, quads, still, _ball_colour(angle, turn, palette), gloss=(0, 1), shade=shade
        )
        balls.append(replace(ball, gloss=gloss))
    return balls


def pupil_growth(face: FaceModel) -> Floats:
    """Return how a ball's vertices move when its pupil grows.

    Parameters
    ----------
    face : FaceModel
        The face of the balls of `eyeballs`.

    Returns
    -------
    (N, 3) float64
        Displacements in dm of one ball that looks along +z, for each unit of the pupil's diameter factor: at
        ``rest + (factor - 1) * growth`` the pupil's disc is ``factor`` times as wide, for factors from 0.5 to 1.6.
        The iris gives way; its rim, the limbal ring, stays.
    """
    angle, turn, points = _ball(face)
    away = np.linalg.norm(points[:, :2], axis=1)
    edge = away[np.argmin(np.abs(angle - _RINGS[1]))]
    rim = away[np.flatnonzero(angle >= _RINGS[5])[0]]
    outward = np.where(away <= edge, away, edge * np.clip((rim - away) / (rim - edge), 0.0, 1.0))
    # Depth follows the chord of the bulge between the smallest and the largest pupil.
    by_distance = np.argsort(away)
    front = by_distance[points[by_distance, 2] > 0]
    depth = [np.interp(away + (factor - 1.0) * outward, away[front], points[front, 2]) for factor in PUPIL_RANGE]
    chord = (depth[1] - depth[0]) / (PUPIL_RANGE[1] - PUPIL_RANGE[0])
    return np.column_stack([outward * np.cos(turn), outward * np.sin(turn), np.where(outward > 0, chord, 0.0)])


def pupil_diameter(face: FaceModel) -> float:
    """Return the diameter of the pupils at factor 1, in dm."""
    angle, _, points = _ball(face)
    rings = [np.linalg.norm(points[np.isclose(angle, ring), :2], axis=1).mean() for ring in _RINGS[:2]]
    return float(sum(rings))


def pupil_points(face: FaceModel) -> Floats:
    """Return the middles of the left and the right pupil (2, 3) of eyes that look along +z, in dm."""
    _, _, points = _ball(face)
    middles: Floats = face.eye_centres + points[0]
    return middles


def _ball(face: FaceModel) -> tuple[Floats, Floats, Floats]:
    """Return angle from the pole, turn about it, and place (N, 3) relative to the centre, of a ball's vertices."""
    around = np.linspace(0, 2 * np.pi, _MERIDIANS, endpoint=False)
    rings, turns = (grid.ravel() for grid in np.meshgrid(_RINGS, around, indexing="ij"))
    angle, turn = np.concatenate([[0.0], rings]), np.concatenate([[0.0], turns])
    radius = _fitting_radius(face) * (1.0 + _BULGE * np.clip(1 - (angle / IRIS) ** 2, 0, 1))
    direction = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    return angle, turn, direction * radius[:, None]


def _fitting_radius(face: FaceModel) -> float:
    """Return the ball's radius in dm with which it stays under the lids, whatever they do."""
    number = {name: k for k, name in enumerate(face.morph_names)}
    poses: list[dict[str, float]] = [{"eyeBlink": blink} for blink in np.linspace(0.0, 1.0, 6)]
    poses += [{name: 1.0} for name in ("eyeSquint", "eyeWide", "eyeLookUp", "eyeLookDown")]
    anywhere, in_front = [], []
    for side, centre in zip(("Left", "Right"), face.eye_centres, strict=True):
        lids = _outer_lids(face, centre)
        rows, inverse = np.unique(lids, return_inverse=True)
        for pose in poses:
            moved = face.vertices[rows] - centre
            for name, weight in pose.items():
                moved = moved + weight * face.morphs[number[name + side], rows]
            arms = _samples(moved[inverse.reshape(lids.shape)])
            distance = np.linalg.norm(arms, axis=1)
            anywhere.append(distance.min())
            in_front.append(distance[arms[:, 2] > 0.7 * distance].min())
    room = np.array([min(anywhere) / face.eye_radius - _SCLERA_FILM, min(in_front) / face.eye_radius - _CORNEA_FILM])
    share = np.clip((room / (1.0, 1.0 + _BULGE)).min(), _SMALLEST, _LARGEST)
    return float(share * face.eye_radius)


def _outer_lids(face: FaceModel, centre: Floats) -> NDArray[np.int64]:
    """Return the quads (Q, 4) of the control mesh that are the outside of one eye's lids."""
    middle = face.vertices[face.quads].mean(axis=1) - centre
    close = np.linalg.norm(middle, axis=1) / face.eye_radius
    front = (close < 1.6) & (middle[:, 2] > 0.3 * face.eye_radius)
    a, b, c, d = (face.vertices[face.quads[front, k]] for k in range(4))
    outwards = np.einsum("ij,ij->i", np.cross(c - a, d - b), middle[front]) > 0
    # The lining of the socket behind the ball's front looks outwards, too, but lies inside the ball.
    lids: NDArray[np.int64] = face.quads[front][outwards & (close[front] > 1.0)]
    return lids


def _samples(corners: Floats) -> Floats:
    """Return evenly spread places (M, 3) on quads (Q, 4, 3)."""
    steps = np.linspace(0.0, 1.0, 4)
    across, down = (grid.ravel() for grid in np.meshgrid(steps, steps))
    weights = np.stack([(1 - across) * (1 - down), across * (1 - down), across * down, (1 - across) * down], axis=1)
    places: Floats = np.einsum("sk,qkx->qsx", weights, corners).reshape(-1, 3)
    return places


def _ball_colour(angle: Floats, turn: Floats, palette: Palette) -> Floats:
    """Paint pupil, iris with fibres and a dark rim, and a sclera that is not quite even."""
    rng = np.random.default_rng(20130607)
    meridian = np.rint(turn / (2 * np.pi) * _MERIDIANS).astype(int)
    inner, outer = rng.standard_normal((2, _MERIDIANS))
    depth = np.clip((angle - PUPIL) / (IRIS - PUPIL), 0, 1)
    fibres = 1.0 + 0.09 * np.where(depth < 0.45, inner[meridian], outer[meridian])
    # Light falls in from above and gathers in the lower half.
    bright = (1.22 - 0.30 * depth - 0.16 * np.sin(turn)) * fibres
    iris = np.array(palette.iris) * (bright * (1 - (1 - _RIM) * step(depth, 0.66, 0.92)))[:, None]
    white = _SCLERA * (1 + 0.012 * rng.standard_normal(len(angle)))[:, None]
    white = white + (_VEIN - white) * (0.55 * step(angle, 0.6, 1.4))[:, None]
    colour = np.where((angle < PUPIL)[:, None], _BLACK, iris)
    return np.where((angle > IRIS)[:, None], white, colour)


def _cap_quads(n_rings: int, n_columns: int) -> NDArray[np.int64]:
    """Return the quads of a pole (row 0) and rings about it; those at the pole have one corner twice."""
    first = 1 + np.arange(n_columns)
    onward = 1 + (np.arange(n_columns) + 1) % n_columns
    pole = np.stack([np.zeros(n_columns, dtype=np.int64), first, onward, onward], axis=1)
    return np.concatenate([pole, 1 + grid_quads(n_rings, n_columns)])


def lashes(face: FaceModel) -> list[Surface]:
    """Return the lashes of the left and of the right eye: thin spikes that grow from the lids and go with them.

    The upper ones are longer and thicker than the lower ones, and those of women than those of men.
    """
    return [_lashes(face, side) for side in range(2)]


def _lashes(face: FaceModel, side: int) -> Surface:
    skin = np.array(face.identity.palette.skin)
    vertices, quads, morphs, colours = [], [], [], []
    start = 0
    for fringe in _FRINGES[face.identity.sex]:
        strip, roots, tips = _STRIPS[fringe.lid]
        part = face.parts[f"{'lr'[side]}-{strip}"]
        root, tip = part.vertices[list(roots)], part.vertices[list(tips)]
        root_morph, tip_morph = (part.morphs[:, list(rows)].swapaxes(0, 1) for rows in (roots, tips))
        at = np.linspace(0.3, len(roots) - 1.3, fringe.count)
        # The shortest lashes are next to the nose, the longest ones beyond the middle of the eye; none is quite even.
        along = at / (len(roots) - 1)
        length = fringe.length * np.interp(along, [0.0, 0.15, 0.7, 1.0], [0.45, 0.65, 1.0, 0.75])
        length *= 1.0 + 0.16 * np.sin(4.7 * np.arange(fringe.count))
        # The strip starts on the lid's inner edge; lashes grow from the outer one.
        base = _between(root + _OUTER_EDGE * (tip - root), at)
        way = length[:, None] * _between(tip - root, at)
        size = np.linalg.norm(way, axis=1, keepdims=True)
        way = way + size * (0.0, fringe.lift, 0.0)
        aside = _unit(_between(np.gradient(root, axis=0), at))
        front = _unit(np.cross(aside, way))
        front = front * np.sign(np.einsum("ij,ij->i", front, base - face.eye_centres[side]))[:, None]
        width = 0.5 * fringe.width * np.linalg.norm(np.gradient(base, axis=0), axis=1)
        spikes = _spikes(base, way, width[:, None] * aside, front, fringe.levels)
        vertices.append(spikes.reshape(-1, 3))
        base_morph = _between(root_morph + _OUTER_EDGE * (tip_morph - root_morph), at)
        way_morph = length[:, None, None] * _between(tip_morph - root_morph, at)
        share = np.append(np.repeat(np.arange(fringe.levels - 1), 3), fringe.levels - 1) / (fringe.levels - 1)
        moved = base_morph[:, None] + share[:, None, None] * way_morph[:, None]
        morphs.append(moved.reshape(-1, *moved.shape[2:]).swapaxes(0, 1))
        soft = np.interp(share, (0.0, 1.0), fringe.softness)[:, None]
        colours.append(np.tile(_LASH + soft * (skin - _LASH), (fringe.count, 1)))
        quads.append(start + _spike_quads(*spikes.shape[:2]))
        start += len(vertices[-1])
    return loose_surface(
        f"{('left', 'right')[side]}-lashes",
        np.concatenate(vertices),
        np.concatenate(quads),
        np.concatenate(morphs, axis=1),
        np.concatenate(colours),
        gloss=(0.0, 1.0),
    )


def _spikes(base: Floats, way: Floats, aside: Floats, front: Floats, levels: int) -> Floats:
    """Return the vertices (lash, 3 (levels - 1) + 1, 3): three for each level, and the tip."""
    size = np.linalg.norm(way, axis=1, keepdims=True)
    corners = np.stack([-aside, aside, 0.1 * size * front], axis=1)
    rings = []
    for share in np.arange(levels - 1) / (levels - 1):
        # Lashes start forwards and curl up, so their middle lies in front of the straight line.
        middle = base + share * way + 0.5 * share * (1 - share) * size * front
        rings.append(middle[:, None] + (1 - share) * corners)
    return np.concatenate([*rings, (base + way)[:, None]], axis=1)


def _spike_quads(n_lashes: int, n_vertices: int) -> NDArray[np.int64]:
    """Return the sides of spikes whose rings of three corners end in a tip."""
    rings = n_vertices // 3
    sides = grid_quads(rings, 3)
    last = 3 * (rings - 1) + np.arange(3)
    tip = np.stack([last, np.full(3, n_vertices - 1), np.full(3, n_vertices - 1), np.roll(last, -1)], axis=1)
    one = np.concatenate([sides, tip])
    quads: NDArray[np.int64] = (np.arange(n_lashes)[:, None, None] * n_vertices + one).reshape(-1, 4)
    return quads


def _between(row: NDArray[np.floating], at: Floats) -> Floats:
    """Return values (n, ...) of a row (k, ...) at fractional places."""
    low = np.floor(at).astype(int)
    part = (at - low).reshape(-1, *[1] * (row.ndim - 1))
    return np.asarray(row[low] * (1 - part) + row[np.minimum(low + 1, len(row) - 1)] * part, dtype=np.float64)


def _unit(vectors: Floats) -> Floats:
    lengths: Floats = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / lengths


def grid_quads(n_rows: int, n_columns: int, *, closed: bool = True) -> NDArray[np.int64]:
    """Return the quads of a grid of vertices, row after row; the columns close to a ring."""
    rows = np.arange(n_rows - 1)[:, None]
    columns = np.arange(n_columns if closed else n_columns - 1)[None, :]
    onward = (columns + 1) % n_columns
    corners = (rows, columns), (rows + 1, columns), (rows + 1, onward), (rows, onward)
    return np.stack([r * n_columns + c for r, c in corners], axis=-1).reshape(-1, 4).astype(np.int64)
