from pathlib import Path

import numpy as np
import pytest

from synth.face.hair import hair_layer
from synth.face.identity import IDENTITIES
from synth.face.look import AFRO, CLOSE_CROP, SHORT_CUT
from synth.face.mesh import load_face
from synth.face.rig import Rig


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def figure(request: pytest.FixtureRequest, face_dir: Path) -> Rig:
    return Rig(load_face(face_dir, request.param))


def strands(rig: Rig) -> np.ndarray:
    """Vertices of all loose hair."""
    spans = [span for name, span in rig.spans.items() if name.startswith("hair")]
    return np.concatenate([rig.rest[span] for span in spans]) if spans else np.zeros((0, 3))


def test_the_layer_is_thick_where_the_style_says() -> None:
    top, side = np.array([[0.0, 8.4, 0.4]]), np.array([[0.75, 7.3, 0.4]])
    for style in (SHORT_CUT, CLOSE_CROP, AFRO):
        for place, thickness in ((top, style.top), (side, style.sides)):
            assert hair_layer(style, place, np.ones(1)) == pytest.approx(thickness, abs=3 * style.rough + 1e-9)
            assert hair_layer(style, place, np.zeros(1)) == 0


def test_loose_hair_is_light(figure: Rig) -> None:
    assert len(strands(figure)) < 1500


def test_hair_leaves_the_face_free(figure: Rig) -> None:
    """Nothing hangs in front of brows, eyes, nose or mouth, seen from the front."""
    face = figure.face
    (left, eyes, _), (right, *_) = face.eye_centres
    hair = strands(figure)
    in_front = hair[hair[:, 2] > face.eye_centres[0, 2] - 0.3]
    before = (in_front[:, 0] < left + 1.6 * face.eye_radius) & (in_front[:, 0] > right - 1.6 * face.eye_radius)
    assert not (before & (in_front[:, 1] < eyes + 0.6)).any()


def test_hair_hangs_clear_of_the_shoulders(figure: Rig) -> None:
    hair = strands(figure)
    if len(hair):
        assert hair[:, 1].min() > figure.face.pivots["neck"][1] + 0.1


def test_hair_is_no_wider_than_a_head_with_hair(figure: Rig) -> None:
    hair = strands(figure)
    if len(hair):
        skull = np.abs(figure.face.vertices[figure.face.masks["ears"] > 0.5, 0]).max()
        assert np.abs(hair[:, 0]).max() < skull + 0.25


def test_hair_does_not_move_with_the_face(figure: Rig) -> None:
    for name, span in figure.spans.items():
        if name.startswith("hair"):
            assert np.ptp(figure.control.basis[span].toarray()) == 0
