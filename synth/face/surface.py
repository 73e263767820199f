"""Surfaces: the pieces that a picture of the face is made of."""

from dataclasses import dataclass, replace
from typing import Self

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

    def part(self, rows: NDArray[np.int64], quads: NDArray[np.int64], drawn: NDArray[np.bool_]) -> Self:
        """Return some vertices (K,) of the surface, with quads (Q, 4) in terms of them, of which some are drawn."""
        by_vertex = ("vertices", "uv", "colour", "cover", "shade", "gloss", "follow")
        own = {name: getattr(self, name)[rows] for name in by_vertex}
        return replace(self, **own, morphs=self.morphs[:, rows], quads=quads, drawn=drawn)


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


def detach(surface: Surface, name: str, quads: NDArray[np.bool_]) -> tuple[Surface, Surface]:
    """Take some quads out of a surface as a piece of their own, whose texture coordinates may then jump at its edge.

    Parameters
    ----------
    surface : Surface
        The whole surface.
    name : str
        What the piece is called.
    quads : (Q,) bool
        The quads of the piece.

    Returns
    -------
    rest : Surface
        The same surface, which no longer draws those quads.
    piece : Surface
        The quads with copies of their vertices, in the order of the whole surface.
    """
    rows, own = np.unique(surface.quads[quads], return_inverse=True)
    piece = surface.part(rows, own.reshape(-1, 4).astype(np.int64), surface.drawn[quads])
    return replace(surface, drawn=surface.drawn & ~quads), replace(piece, name=name)
