"""Catmull-Clark subdivision as one fixed sparse matrix (Catmull and Clark 1978)."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Indices = NDArray[np.int64]


def catmull_clark(quads: Indices, n_vertices: int) -> tuple[sparse.csr_array, Indices]:
    """Return the matrix of one Catmull-Clark step, and the finer quads.

    Parameters
    ----------
    quads : (Q, 4) int64
        Corners of each face in order.
    n_vertices : int
        Number V of vertices of the control mesh.

    Returns
    -------
    matrix : (V + E + Q, V) sparse float64
        New vertices as weights of the old: first the moved old ones, then edge points, then face points.
    finer : (4 Q, 4) int64
        The quads of the subdivided mesh, in the same sense of rotation; rows 4 k to 4 k + 3 come from quad k.
    """
    n_quads = len(quads)
    ends, edge_of_side = np.unique(
        np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1),
        axis=0,
        return_inverse=True,
    )
    edge_of_side = edge_of_side.reshape(n_quads, 4)
    faces = _incidence(np.repeat(np.arange(n_quads), 4), quads.ravel(), (n_quads, n_vertices)) / 4
    midpoints = _incidence(np.repeat(np.arange(len(ends)), 2), ends.ravel(), (len(ends), n_vertices)) / 2

    sides = np.bincount(edge_of_side.ravel(), minlength=len(ends))
    adjacent = _incidence(edge_of_side.ravel(), np.repeat(np.arange(n_quads), 4), (len(ends), n_quads))
    inner = sides == 2
    face_mean = sparse.diags_array(np.where(inner, 0.5 / sides, 0.0)) @ adjacent @ faces
    edges = sparse.diags_array(np.where(inner, 0.5, 1.0)) @ midpoints + face_mean

    matrix = sparse.vstack([_vertex_points(quads, ends, inner, faces, midpoints), edges, faces], format="csr")
    edge_points = n_vertices + edge_of_side
    face_points = n_vertices + len(ends) + np.arange(n_quads)
    finer = np.stack(
        [
            quads,
            edge_points,
            np.broadcast_to(face_points[:, None], quads.shape),
            np.roll(edge_points, 1, axis=1),
        ],
        axis=-1,
    )
    return sparse.csr_array(matrix), finer.reshape(-1, 4).astype(np.int64)


def _vertex_points(
    quads: Indices,
    ends: Indices,
    inner: NDArray[np.bool_],
    faces: sparse.csr_array,
    midpoints: sparse.csr_array,
) -> sparse.csr_array:
    """Weigh the moved old vertices: (F + 2 R + (n - 3) P) / n inside, (1, 6, 1) / 8 along a border."""
    n_vertices = faces.shape[1]
    valence = np.bincount(quads.ravel(), minlength=n_vertices)
    edge_valence = np.bincount(ends.ravel(), minlength=n_vertices)
    to_face = _incidence(quads.ravel(), np.repeat(np.arange(len(quads)), 4), (n_vertices, len(quads)))
    to_edge = _incidence(ends.ravel(), np.repeat(np.arange(len(ends)), 2), (n_vertices, len(ends)))
    own = sparse.eye_array(n_vertices)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_faces = np.where(valence > 0, 1.0 / valence**2, 0.0)
        of_edges = np.where(edge_valence > 0, 2.0 / (edge_valence * valence), 0.0)
        of_self = np.where(valence > 0, (valence - 3.0) / valence, 1.0)
    inside = (
        sparse.diags_array(of_faces) @ to_face @ faces
        + sparse.diags_array(of_edges) @ to_edge @ midpoints
        + sparse.diags_array(of_self) @ own
    )
    border_ends = ends[~inner]
    on_border = np.isin(np.arange(n_vertices), border_ends)
    border_edges = _incidence(border_ends.ravel(), np.repeat(np.flatnonzero(~inner), 2), (n_vertices, len(ends)))
    along = 0.5 * own + 0.25 * border_edges @ midpoints
    return sparse.csr_array(
        sparse.diags_array((~on_border).astype(float)) @ inside + sparse.diags_array(on_border.astype(float)) @ along
    )


def _incidence(rows: Indices, columns: Indices, shape: tuple[int, int]) -> sparse.csr_array:
    return sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=shape)
