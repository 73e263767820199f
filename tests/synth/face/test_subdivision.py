import numpy as np

from synth.face.subdivision import catmull_clark

CUBE = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
CORNERS = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], dtype=float)


def test_cube_after_one_step_is_the_known_one() -> None:
    """Corners go to 5/9, edge points to 3/4, face points stay: the rules of Catmull and Clark (1978) by hand."""
    matrix, quads = catmull_clark(CUBE, 8)
    points = matrix @ CORNERS
    assert points.shape == (26, 3)
    assert quads.shape == (24, 4)
    np.testing.assert_allclose(np.abs(points[:8]), 5 / 9)
    np.testing.assert_allclose(np.sort(np.abs(points[8:20]), axis=1), np.tile([0, 0.75, 0.75], (12, 1)), atol=1e-12)
    np.testing.assert_allclose(np.sort(np.abs(points[20:]), axis=1), np.tile([0, 0, 1], (6, 1)), atol=1e-12)


def test_sense_of_rotation_is_kept() -> None:
    matrix, quads = catmull_clark(CUBE, 8)
    points = matrix @ CORNERS
    a, b, c, d = (points[quads[:, k]] for k in range(4))
    outward = np.einsum("ij,ij->i", np.cross(c - a, d - b), a + b + c + d)
    assert (outward > 0).all()


def test_borders_are_smoothed_along_themselves_only() -> None:
    flat = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], dtype=float)
    matrix, _ = catmull_clark(np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), 6)
    points = matrix @ flat
    np.testing.assert_allclose(points[1], [1, 0, 0])
    np.testing.assert_allclose(points[0], [0.125, 0.125, 0])
    np.testing.assert_allclose(np.asarray(matrix.sum(axis=1)).ravel(), 1)
