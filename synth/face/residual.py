"""The residual: smooth local displacements that take feature points where the morphs alone do not.

Each control point carries a kernel, a smooth bump that ends at the point's radius. A sum of bumps interpolates the
points' displacements (radial basis functions with the compactly supported kernel of Wendland 1995). Distances are
taken in space with two further coordinates, by which the lower lip lies apart from the upper one and the lower lid
from the upper one, though they touch.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from synth.face.feature_points import TONGUE_START, VERTICES, skin_rows
from synth.face.mesh import FaceModel
from synth.face.surface import Surface
from synth.fap.table import Fap, faps

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

# How far a point's bump reaches, in dm. Inner corners of the lips lie close to the outer ones, so theirs end early.
_RADIUS = {
    **{"2.1": 0.80, "2.10": 0.42, "2.4": 0.16, "2.5": 0.16, "8.3": 0.42, "8.4": 0.42, "9.3": 0.30},
    **{"9.1": 0.20, "9.2": 0.20, "6.1": 0.40, "6.2": 0.40, "6.3": 0.22, "6.4": 0.22},
}
_RADIUS_OF_GROUP = {"2": 0.28, "3": 0.24, "4": 0.42, "5": 0.48, "8": 0.30, "10": 0.36}

_LIPS_APART, _LIDS_APART = 0.45, 0.30
"""Distance in the further coordinates between lower and upper lip, and between lower and upper lid; dm."""

_NEAREST_LID = 0.08
"""How far from the skin a lash may be to go with it; dm."""


class ControlPoints:
    """The feature points of one figure that its FAPs displace, with their bumps.

    Parameters
    ----------
    face : FaceModel
        The face.
    surfaces : sequence of Surface
        All pieces of the figure, see `synth.face.surface`.

    Attributes
    ----------
    names : tuple of P str
        The feature points.
    rows : (P,) int64
        Their rows in the concatenated vertices of the surfaces.
    basis : (N, P) sparse float64
        Share of each bump at each vertex; a displacement field is ``basis @ residual`` with ``residual`` (P, 3).
    kernel : (P, P) float64
        The same at the points themselves.
    reach : (52, P, 3) float64
        How far each morph at weight 1 takes each point; dm.
    """

    def __init__(self, face: FaceModel, surfaces: Sequence[Surface]) -> None:
        starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
        at = {surface.name: (surface, int(start)) for surface, start in zip(surfaces, starts[:-1], strict=True)}
        self.names = tuple(dict.fromkeys(point for fap in displacing_faps() for point in fap.points))
        on_tongue = np.array([name.startswith("6.") for name in self.names])
        skin, skin_start = at["skin"]
        tongue, tongue_start = at["tongue"]
        own = np.zeros(len(self.names), dtype=np.int64)
        own[~on_tongue] = skin_rows(face, [name for name in self.names if not name.startswith("6.")])
        own[on_tongue] = [VERTICES[name] - TONGUE_START for name in self.names if name.startswith("6.")]
        self.rows = own + np.where(on_tongue, tongue_start, skin_start)

        places = _unfolded(face, skin)
        bumps = sparse.lil_array((int(starts[-1]), len(self.names)))
        for column, name in enumerate(self.names):
            surface_places, start = (tongue.vertices, tongue_start) if on_tongue[column] else (places, skin_start)
            values = _bump(surface_places, surface_places[own[column]], _radius(name))
            near = np.flatnonzero(values)
            bumps[start + near, [column] * len(near)] = values[near]
        basis = bumps.tocsr()
        self.basis = _with_lashes(basis, at, skin, skin_start)
        self.kernel = self.basis[self.rows].toarray()
        self.reach = np.zeros((len(skin.morphs), len(self.names), 3))
        self.reach[:, ~on_tongue] = skin.morphs[:, own[~on_tongue]]
        self.reach[:, on_tongue] = tongue.morphs[:, own[on_tongue]]


def displacing_faps() -> tuple[Fap, ...]:
    """Return the FAPs that displace points of skin and tongue (all of 3 to 68 but those of eyeballs and head)."""
    return tuple(
        fap for fap in faps().values() if fap.points and all(point in VERTICES for point in fap.points) if fap.group > 1
    )


def _radius(name: str) -> float:
    return _RADIUS.get(name) or _RADIUS_OF_GROUP[name.partition(".")[0]]


def _bump(places: Floats, centre: Floats, radius: float) -> Floats:
    """Wendland's kernel of smoothness C2: ``(1 - q)^4 (4 q + 1)`` for q < 1."""
    q = np.minimum(np.linalg.norm(places - centre, axis=1) / radius, 1.0)
    bump: Floats = (1.0 - q) ** 4 * (4.0 * q + 1.0)
    return bump


def _unfolded(face: FaceModel, skin: Surface) -> Floats:
    """Return the skin's places with the further coordinates (N, 5): how far the jaw, and how far blinks, take them."""
    number = {name: k for k, name in enumerate(face.morph_names)}
    jaw = -np.asarray(skin.morphs[number["jawOpen"], :, 1], np.float64)
    left, right = (np.asarray(skin.morphs[number[f"eyeBlink{side}"], :, 1], np.float64) for side in ("Left", "Right"))
    lids = -np.minimum(left, right)
    apart = np.column_stack(
        [_LIPS_APART * np.clip(jaw / jaw.max(), 0, 1), _LIDS_APART * np.clip(lids / lids.max(), 0, 1)]
    )
    return np.hstack([skin.vertices, apart])


def _with_lashes(
    basis: sparse.csr_array, at: Mapping[str, tuple[Surface, int]], skin: Surface, skin_start: int
) -> sparse.csr_array:
    """Let each lash go with the skin that it grows on."""
    tree = cKDTree(skin.vertices)
    n = basis.shape[0]
    whole = basis
    for name, (surface, start) in at.items():
        if "lashes" in name:
            distance, nearest = tree.query(surface.vertices)
            rooted = np.flatnonzero(distance < _NEAREST_LID)
            choose = sparse.csr_array(
                (np.ones(len(rooted)), (start + rooted, skin_start + nearest[rooted])), shape=(n, n)
            )
            whole = whole + choose @ basis
    return sparse.csr_array(whole)
