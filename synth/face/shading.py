"""Shading that is known beforehand: how open each place of the neutral face is to the light around it."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Floats = NDArray[np.float64]

_DIRECTIONS = 96
_CELL = 0.045
_BIAS = 0.07
"""Size of the depth grid's cells, and the depth by which something must lie in front to hide a place; dm."""


def vertex_normals(vertices: Floats, quads: NDArray[np.int64]) -> Floats:
    """Return unit normals (N, 3) as area-weighted means of the quads around each vertex."""
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    normals = np.zeros_like(vertices)
    across = np.cross(c - a, d - b)
    for k in range(4):
        np.add.at(normals, quads[:, k], across)
    lengths: Floats = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.maximum(lengths, 1e-12)


def openness(vertices: Floats, quads: NDArray[np.int64]) -> Floats:
    """Return the share of the sky above each vertex that the mesh itself does not hide, from 0 to 1 (N,).

    Depth grids are looked up along evenly spread directions; the result is smoothed over neighbours.
    """
    normals = vertex_normals(vertices, quads)
    points = np.concatenate([vertices, vertices[quads].mean(axis=1)])
    seen, possible = np.zeros(len(vertices)), np.zeros(len(vertices))
    for direction in _spread(_DIRECTIONS):
        cosine = normals @ direction
        aside = np.cross(direction, [0.31, 0.92, 0.24])
        aside /= np.linalg.norm(aside)
        plane = np.stack([aside, np.cross(direction, aside)], axis=1)
        cell = np.floor(points @ plane / _CELL).astype(int)
        cell -= cell.min(axis=0)
        key = cell[:, 0] * (cell[:, 1].max() + 1) + cell[:, 1]
        depth = points @ direction
        nearest = np.full(key.max() + 1, -np.inf)
        np.maximum.at(nearest, key, depth)
        n = len(vertices)
        visible = depth[:n] > nearest[key[:n]] - _BIAS
        weight = np.maximum(0.0, cosine)
        seen += weight * visible
        possible += weight
    return smooth(seen / possible, quads, rounds=2)


def _spread(n: int) -> Floats:
    """Return ``n`` directions evenly over the sphere (a Fibonacci spiral)."""
    k = np.arange(n) + 0.5
    up = 1 - 2 * k / n
    around = np.pi * (1 + np.sqrt(5)) * k
    level = np.sqrt(1 - up**2)
    return np.column_stack([level * np.cos(around), up, level * np.sin(around)])


def smooth(values: Floats, quads: NDArray[np.int64], *, rounds: int) -> Floats:
    """Return values (N,) or (N, k) of vertices, drawn halfway to their neighbours' mean in each round."""
    n = len(values)
    pairs = np.concatenate([quads[:, [0, 1]], quads[:, [1, 2]], quads[:, [2, 3]], quads[:, [3, 0]]])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    near = sparse.csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    mean = sparse.diags_array(1.0 / np.asarray(near.sum(axis=1)).ravel()) @ near
    for _ in range(rounds):
        values = 0.5 * values + 0.5 * (mean @ values)
    return values
