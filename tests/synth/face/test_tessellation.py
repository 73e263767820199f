from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from synth.face.appearance import dress
from synth.face.feature_points import skin_rows
from synth.face.mesh import FaceModel
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.face.shading import vertex_normals
from synth.face.subdivision import catmull_clark
from synth.face.tessellation import Tessellation, roughness, tessellate

ROWS, COLUMNS = 4, 5


def grid() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fine vertices, fine quads, and control quads of a slightly bent sheet."""
    y, x = (axis.ravel().astype(float) for axis in np.mgrid[: ROWS + 1, : COLUMNS + 1])
    z = 0.05 * x**2 - 0.02 * x * y
    r, c = (axis.ravel() for axis in np.mgrid[:ROWS, :COLUMNS])
    first = r * (COLUMNS + 1) + c
    quads = np.stack([first, first + 1, first + COLUMNS + 2, first + COLUMNS + 1], axis=1)
    matrix, finer = catmull_clark(quads, len(x))
    return matrix @ np.column_stack([x, y, z]), finer, quads


VERTICES, QUADS, CONTROL = grid()


def areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Signed areas seen along z."""
    a, b, c = (vertices[triangles[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def thinned(fine: np.ndarray, drawn: np.ndarray | None = None) -> Tessellation:
    shown = np.ones(len(QUADS), dtype=bool) if drawn is None else drawn
    return tessellate(QUADS, int(CONTROL.max()) + 1, fine=fine, drawn=shown)


flags = st.lists(st.booleans(), min_size=ROWS * COLUMNS, max_size=ROWS * COLUMNS).map(np.array)


@given(flags)
@settings(max_examples=60, deadline=None)
def test_no_cracks_no_overlaps_no_folds(fine: np.ndarray) -> None:
    piece = thinned(fine)
    vertices = VERTICES[piece.rows]
    signed = areas(vertices, piece.triangles)
    assert (signed > 1e-9).all(), "each triangle faces the same way"
    # The sheet's rounded corners are a little larger or smaller, depending on which of them are fine.
    assert signed.sum() == pytest.approx(areas(VERTICES, all_fine()).sum(), rel=0.02)
    sides = Counter()
    for triangle in piece.triangles:
        for a, b in zip(triangle, np.roll(triangle, -1), strict=True):
            sides[int(a), int(b)] += 1
    assert max(sides.values()) == 1
    border = {side for side in sides if side[::-1] not in sides}
    # A crack is a side without a neighbour inside the sheet.
    on_rim = np.isin(piece.rows, rim())
    assert all(on_rim[a] and on_rim[b] for a, b in border)


def all_fine() -> np.ndarray:
    return QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def rim() -> np.ndarray:
    sides = Counter(
        tuple(sorted((int(a), int(b)))) for quad in QUADS for a, b in zip(quad, np.roll(quad, -1), strict=True)
    )
    return np.unique([end for side, count in sides.items() if count == 1 for end in side])


@given(flags)
@settings(max_examples=30, deadline=None)
def test_control_vertices_come_first(fine: np.ndarray) -> None:
    piece = thinned(fine)
    assert (piece.rows[: CONTROL.max() + 1] == np.arange(CONTROL.max() + 1)).all()
    assert (np.diff(piece.rows) > 0).all()
    assert piece.around.shape == (len(piece.rows), len(piece.faces))
    assert (np.asarray(piece.around.sum(axis=1)).ravel()[np.unique(piece.triangles)] >= 1).all()


def test_fine_everywhere_is_the_fine_mesh() -> None:
    piece = thinned(np.ones(len(CONTROL), dtype=bool))
    assert (np.sort(piece.rows[piece.triangles], axis=0) == np.sort(all_fine(), axis=0)).all()


def test_coarse_everywhere_is_the_control_mesh() -> None:
    piece = thinned(np.zeros(len(CONTROL), dtype=bool))
    assert len(piece.rows) == CONTROL.max() + 1
    assert len(piece.triangles) == 2 * len(CONTROL)


def test_hidden_quads_are_not_drawn_but_shape_normals() -> None:
    hidden = np.zeros(len(CONTROL), dtype=bool)
    hidden[7] = True
    piece = thinned(np.zeros(len(CONTROL), dtype=bool), ~np.repeat(hidden, 4))
    assert len(piece.triangles) == 2 * len(CONTROL) - 2
    assert len(piece.faces) == len(CONTROL)


def test_roughness_is_the_distance_to_the_fine_surface() -> None:
    flat = VERTICES * (1, 1, 0)
    still = np.zeros((1, *VERTICES.shape))
    assert roughness(flat, still, QUADS) == pytest.approx(0, abs=1e-12)
    lifted = flat.copy()
    centre = QUADS[4 * 6, 2]
    lifted[centre, 2] = 0.03
    found = roughness(lifted, still, QUADS)
    assert found[6] == pytest.approx(0.03)
    assert np.delete(found, 6) == pytest.approx(0, abs=1e-12)
    assert roughness(flat, (lifted - flat)[None], QUADS)[6] == pytest.approx(0.03)


def test_figure_is_light(rig: Rig) -> None:
    """Drawing time goes with the triangles."""
    skin = rig.spans["skin"]
    of_skin = (rig.triangles >= skin.start) & (rig.triangles < skin.stop)
    assert of_skin.all(axis=1).sum() < 15_000


def test_feature_points_keep_their_rows(face: FaceModel, rig: Rig) -> None:
    whole = next(surface for surface in dress(face)[0] if surface.name == "skin")
    rows = skin_rows(face, ["2.1", "8.3", "3.1", "4.1", "9.3"])
    start = rig.spans["skin"].start
    assert rig.rest[start + rows] == pytest.approx(whole.vertices[rows], abs=1e-6)


def test_reduced_normals_are_near_the_fine_ones(face: FaceModel, rig: Rig) -> None:
    """Where the face is seen, shading hardly changes."""
    whole = next(surface for surface in dress(face)[0] if surface.name == "skin")
    fine = vertex_normals(whole.vertices, whole.quads)[: len(face.vertices)]
    _, normals = rig.pose(Motion.of())
    start = rig.spans["skin"].start
    seen = np.unique(rig.triangles)
    seen = seen[(seen >= start) & (seen < start + len(face.vertices))] - start
    front = seen[(fine[seen, 2] > 0.3) & (face.masks["ears"][seen] < 0.1) & (face.masks["inside-mouth"][seen] < 0.1)]
    cosine = np.einsum("ij,ij->i", fine[front], normals[start + front])
    assert np.median(cosine) > 0.999
    assert np.quantile(cosine, 0.01) > 0.95


def test_around_averages_faces() -> None:
    piece = thinned(np.zeros(len(CONTROL), dtype=bool))
    assert sparse.issparse(piece.around)
    assert set(piece.around.data) == {1.0}
