"""Surfaces: the pieces that a picture of the face is made of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """One painted piece of the figure in its neutral shape.

    Attributes
    ----------
    name : str
        What it is, for instance "skin", "hair", "upper-teeth", "tongue", "left-eye". In "skin" and "tongue" the first
        rows are the control mesh's vertices in their order, so that feature points are found on them.
    vertices : (N, 3) float64
        Positions in dm.
    quads : (Q, 4) int64
        Corners, counter-clockwise from outside.
    morphs : (52, N, 3) float
        Displacements in dm at weight 1.
    uv : (N, 2) float64
        Places on the painting.
    colour : (N, 3) float64
        Own colour, sRGB from 0 to 1.
    cover : (N,) float64
        How much the own colour covers the painting, 0 to 1.
    shade : (N,) float64
        How much of the light reaches the place, 0 to 1.
    gloss : (N, 2) float64
        Strength and exponent of the highlight.
    follow : (N, 2) float64
        How much the place follows the neck's and the head's share of the head's rotation, 0 to 1.
    drawn : (Q,) bool
        Which quads are drawn; the others are always hidden and only shape the normals.
    """

    name: str
    vertices: Floats
    quads: NDArray[np.int64]
    morphs: NDArray[np.float32] | Floats
    uv: Floats
    colour: Floats
    cover: Floats
    shade: Floats
    gloss: Floats
    follow: Floats
    drawn: NDArray[np.bool_]


def loose_surface(
    name: str,
    vertices: Floats,
    quads: NDArray[np.int64],
    morphs: NDArray[np.float32] | Floats,
    colour: Floats,
    *,
    gloss: tuple[float, float],
    shade: Floats | None = None,
) -> Surface:
    """Return a piece inside the head that carries its own colours and follows the head fully."""
    n = len(vertices)
    return Surface(
        name=name,
        vertices=vertices,
        quads=quads,
        morphs=morphs,
        uv=np.zeros((n, 2)),
        colour=np.broadcast_to(colour, (n, 3)),
        cover=np.ones(n),
        shade=np.ones(n) if shade is None else shade,
        gloss=np.broadcast_to(gloss, (n, 2)),
        follow=np.ones((n, 2)),
        drawn=np.ones(len(quads), dtype=bool),
    )
