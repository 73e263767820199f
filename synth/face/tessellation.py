"""Tessellation: which quads of a subdivided mesh are drawn finely, and which as the control mesh's larger ones.

Drawing in software takes time for each triangle, however small it is. A quad of the control mesh that its four fine
quads hardly leave is drawn as one; its corners still lie on the fine surface. At the border of fine quads the midpoints
of shared edges become corners of the large quad, too, so that no cracks appear.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from synth.face.mesh import FaceModel
from synth.face.surface import Surface

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]

_TOLERANCE = 0.0035
"""How far a large quad may be from the fine surface, in dm: two thirds of a pixel of a 720 x 576 picture."""
_LIP_TOLERANCE, _EAR_TOLERANCE, _NECK_TOLERANCE, _TRUNK_TOLERANCE = 0.0015, 0.008, 0.007, 0.015
"""The same where lips touch, where nobody looks closely, and where the control mesh is coarse."""
_CHIN = 0.16
"""How far the underside of the chin lies below the joint of the jaw; dm."""
_AWAY = -0.3
"""Depth of the unit normal from which on a place is seen at most at a glance, when the head turns far."""


@dataclass(frozen=True)
class Tessellation:
    """The drawn part of a mesh of V vertices.

    Attributes
    ----------
    rows : (N,) int64
        The vertices that are kept, ascending, so that the control mesh's come first.
    triangles : (T, 3) int64
        Corners as rows of the kept vertices, in the quads' sense of rotation.
    faces : (F, 4) int64
        Corners of the flat pieces whose normals make those of the vertices, as rows of the kept vertices.
    around : (N, F) sparse float64
        1 where a vertex lies on a face.
    """

    rows: Indices
    triangles: Indices
    faces: Indices
    around: sparse.csr_array


def reduced(face: FaceModel, surfaces: Sequence[Surface]) -> tuple[list[Surface], list[Tessellation]]:
    """Return the surfaces with only the vertices that count, and how each of them is drawn.

    Parameters
    ----------
    face : FaceModel
        The face that they were made for.
    surfaces : sequence of Surface
        The figure's pieces. The one named "skin" is drawn coarsely where this does not show; of the others all is kept.

    Returns
    -------
    surfaces : list of Surface
        The same pieces with fewer vertices; their ``quads`` are the tessellations' faces.
    tessellations : list of Tessellation
        One for each.
    """
    pieces = []
    for surface in surfaces:
        if surface.name == "skin":
            fine = _fine(face, surface)
            pieces.append(tessellate(surface.quads, len(face.vertices), fine=fine, drawn=surface.drawn))
        else:
            pieces.append(_whole(surface))
    kept = [
        surface.part(piece.rows, piece.faces, np.ones(len(piece.faces), dtype=bool))
        for surface, piece in zip(surfaces, pieces, strict=True)
    ]
    return kept, pieces


def _fine(face: FaceModel, skin: Surface) -> Flags:
    """Tell which quads of the control mesh are drawn as their four fine ones."""
    corners, _, _ = _parts(skin.quads)
    ears, lips, mouth = (face.masks[name][corners] for name in ("ears", "lips", "inside-mouth"))
    tolerance = np.full(len(corners), _TOLERANCE)
    tolerance[lips.max(axis=1) > 0.5] = _LIP_TOLERANCE
    tolerance[ears.max(axis=1) > 0.1] = _EAR_TOLERANCE
    top = skin.vertices[corners, 1].max(axis=1)
    tolerance[top < face.pivots["jaw"][1] - _CHIN] = _NECK_TOLERANCE
    tolerance[top < face.pivots["neck"][1]] = _TRUNK_TOLERANCE
    rough = roughness(skin.vertices, skin.morphs, skin.quads) > tolerance
    facing = _normals(skin.vertices, corners)[:, 2] > _AWAY
    inside = mouth.min(axis=1) > 0.5
    fine: Flags = rough & facing & ~inside
    return fine


def _whole(surface: Surface) -> Tessellation:
    n, quads = len(surface.vertices), surface.quads
    around = sparse.csr_array(
        (np.ones(quads.size), (quads.ravel(), np.repeat(np.arange(len(quads)), 4))), shape=(n, len(quads))
    )
    return Tessellation(rows=np.arange(n), triangles=_halves(quads[surface.drawn]), faces=quads, around=around)


def roughness(vertices: Floats, morphs: NDArray[np.floating] | Floats, quads: Indices) -> Floats:
    """Return how far four fine quads stand off the one that would replace them.

    Parameters
    ----------
    vertices : (V, 3) float64
        The fine mesh; dm.
    morphs : (M, V, 3) float
        Displacements of its vertices.
    quads : (4 K, 4) int64
        Its quads as `synth.face.subdivision.catmull_clark` returns them: four for each quad of the control mesh.

    Returns
    -------
    (K,) float64
        The largest distance, along the surface's normal, of an edge's midpoint from the middle of its ends and of the
        centre from the middle of the corners; dm, over the neutral shape and each morph at weight 1.
    """
    corners, midpoints, centres = _parts(quads)
    normals = _normals(vertices, corners)

    def off(places: Floats, among: Indices) -> Floats:
        ends = places[corners[among]]
        edges = places[midpoints[among]] - 0.5 * (ends + np.roll(ends, -1, axis=1))
        middle = places[centres[among]] - ends.mean(axis=1)
        vectors = np.concatenate([edges, middle[:, None]], axis=1)
        distances: Floats = np.einsum("kex,kx->ke", vectors, normals[among])
        return distances

    everywhere = np.arange(len(corners))
    neutral = off(vertices, everywhere)
    largest: Floats = np.abs(neutral).max(axis=1)
    for morph in morphs:
        moved = everywhere[morph[centres].any(axis=1)]
        largest[moved] = np.maximum(
            largest[moved], np.abs(neutral[moved] + off(morph.astype(np.float64), moved)).max(axis=1)
        )
    return largest


def tessellate(quads: Indices, n_control: int, *, fine: Flags, drawn: Flags) -> Tessellation:
    """Return the mesh with four fine quads where ``fine`` says so, and one elsewhere.

    Parameters
    ----------
    quads : (4 K, 4) int64
        The fine quads as `synth.face.subdivision.catmull_clark` returns them: four for each quad of the control mesh.
    n_control : int
        Number of vertices of the control mesh, which are all kept.
    fine : (K,) bool
        Which quads of the control mesh are drawn finely.
    drawn : (4 K,) bool
        Which fine quads are seen at all. The others only shape the normals.
    """
    corners, midpoints, _ = _parts(quads)
    # A large quad with so many fine neighbours would need nearly as many triangles.
    split: Flags = np.logical_or(fine, np.isin(midpoints, midpoints[fine]).sum(axis=1) >= 3)
    small = np.flatnonzero(np.repeat(split, 4))
    large = np.flatnonzero(~split)
    bent: Flags = np.isin(midpoints[large], midpoints[split])

    pieces = [_halves(quads[small[drawn[small]]])]
    seen = np.isin(large, np.flatnonzero(drawn) // 4)
    plain = ~bent.any(axis=1)
    pieces.append(_halves(corners[large[seen & plain]]))
    for quad, sides in zip(large[seen & ~plain], bent[seen & ~plain], strict=True):
        pieces.append(_fan(corners[quad], midpoints[quad], sides))
    triangles = np.concatenate(pieces)

    faces = np.concatenate([quads[small], corners[large]])
    owner = len(small) + np.arange(len(large))
    on_edge = np.nonzero(bent)
    members = np.concatenate([faces.ravel(), midpoints[large][on_edge]])
    of_face = np.concatenate([np.repeat(np.arange(len(faces)), 4), owner[on_edge[0]]])

    rows = np.union1d(np.arange(n_control), triangles)
    # Only faces that touch a vertex in use count; those of the hidden part are not worth their time.
    used = np.isin(members, triangles)
    touching = np.unique(of_face[used])
    rows = np.union1d(rows, faces[touching])
    place = np.full(int(quads.max()) + 1, -1)
    place[rows] = np.arange(len(rows))
    number = np.full(len(faces), -1)
    number[touching] = np.arange(len(touching))
    around = sparse.csr_array(
        (np.ones(int(used.sum())), (place[members[used]], number[of_face[used]])), shape=(len(rows), len(touching))
    )
    return Tessellation(rows=rows, triangles=place[triangles], faces=place[faces[touching]], around=around)


def _normals(vertices: Floats, quads: Indices) -> Floats:
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    across = np.cross(c - a, d - b)
    normals: Floats = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return normals


def _parts(quads: Indices) -> tuple[Indices, Indices, Indices]:
    """Return corners (K, 4), midpoints of the edges that begin at them (K, 4), and centres (K,) of the large quads."""
    groups = quads.reshape(-1, 4, 4)
    return groups[:, :, 0], groups[:, :, 1], groups[:, 0, 2]


def _halves(quads: Indices) -> Indices:
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def _fan(corners: Indices, midpoints: Indices, bent: Flags) -> Indices:
    """Return triangles (T, 3) of a quad with the midpoints of its ``bent`` edges, spread from the first of them."""
    outline = [point for k in range(4) for point in ([corners[k], midpoints[k]] if bent[k] else [corners[k]])]
    start = outline.index(midpoints[np.argmax(bent)])
    ring = outline[start:] + outline[:start]
    return np.array([(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)])
