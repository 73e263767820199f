from pathlib import Path

import numpy as np
import pytest

from synth.errors import AssetError
from synth.face.mesh import MORPH_NAMES, FaceModel, load_face


def morph(face: FaceModel, name: str) -> np.ndarray:
    return face.morphs[face.morph_names.index(name)]


def test_shapes_and_types(face: FaceModel) -> None:
    n = len(face.vertices)
    assert face.vertices.shape == (n, 3)
    assert face.vertices.dtype == np.float64
    assert face.base_index.shape == (n,)
    assert (np.diff(face.base_index) > 0).all()
    assert face.quads.shape[1] == 4
    assert set(face.quads.ravel()) == set(range(n))
    assert face.morphs.shape == (52, n, 3)
    assert face.morphs.dtype == np.float32
    assert face.morph_names == MORPH_NAMES
    assert len(set(MORPH_NAMES)) == 52


def test_axes(face: FaceModel) -> None:
    """The subject's left is +x, up is +y, the face looks towards +z."""
    assert face.pivots["l_eye"][0] > 0 > face.pivots["r_eye"][0]
    assert face.pivots["neck"][1] < face.pivots["jaw"][1] < face.pivots["l_eye"][1] < face.pivots["head-2"][1]
    assert face.pivots["l_eye"][2] > face.pivots["head"][2]
    for name, side in (("eyeBlinkLeft", 1), ("mouthSmileRight", -1)):
        size = np.linalg.norm(morph(face, name), axis=1)
        assert side * np.average(face.vertices[:, 0], weights=size) > 0.15


def test_quads_face_outwards(face: FaceModel) -> None:
    a, b, c, d = (face.vertices[face.quads[:, k]] for k in range(4))
    volume = np.einsum("ij,ij->i", (a + b + c + d) / 4 - face.vertices.mean(axis=0), np.cross(c - a, d - b)).sum()
    assert volume > 0


def test_jaw_lowers_chin_and_lower_teeth_but_not_the_upper(face: FaceModel) -> None:
    k = face.morph_names.index("jawOpen")
    assert morph(face, "jawOpen")[:, 1].min() < -0.15
    assert face.parts["lower-teeth"].morphs[k, :, 1].max() < -0.05
    assert np.abs(face.parts["upper-teeth"].morphs[k]).max() == 0
    assert face.parts["tongue"].morphs[k, :, 1].min() < -0.1


def test_blinks_fit_the_identity(face: FaceModel) -> None:
    """Closed upper lids come down about as far as the eye is open, not further."""
    for side, name, centre in zip("lr", ("eyeBlinkLeft", "eyeBlinkRight"), face.eye_centres, strict=True):
        k = face.morph_names.index(name)
        heights = {}
        for row in (1, 2):
            lash = face.parts[f"{side}-eyelashes-{row}"]
            root = np.argmin(np.abs(lash.vertices[:, 0] - centre[0]) + np.linalg.norm(lash.vertices - centre, axis=1))
            heights[row] = lash.vertices[root, 1] + lash.morphs[k, root, 1]
        assert heights[2] == pytest.approx(heights[1] - 0.01, abs=0.015)


def test_eyes_are_where_the_lids_are(face: FaceModel) -> None:
    lids = face.vertices[face.masks["eyelids"] > 0.5]
    for centre in face.eye_centres:
        own = lids[np.sign(lids[:, 0]) == np.sign(centre[0])]
        distance = np.linalg.norm(own - centre, axis=1)
        assert face.eye_radius < np.median(distance) < 1.4 * face.eye_radius


def test_unknown_identity_is_refused_with_the_known_ones(face_dir: Path) -> None:
    with pytest.raises(AssetError, match=r"nobody.*mei"):
        load_face(face_dir, "nobody")
