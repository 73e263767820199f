from pathlib import Path

import numpy as np
import pytest

from synth.face.identity import IDENTITIES
from synth.face.mesh import FaceModel, load_face
from synth.face.skin import skin
from synth.face.surface import Surface


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def person(request: pytest.FixtureRequest, face_dir: Path) -> FaceModel:
    return load_face(face_dir, request.param)


@pytest.fixture(scope="module")
def pieces(person: FaceModel) -> tuple[Surface, Surface]:
    return skin(person)


def test_control_vertices_come_first(person: FaceModel, pieces: tuple[Surface, Surface]) -> None:
    """Subdivision, hair and clothes move them a little only; the afro stands off furthest."""
    body = pieces[0].vertices[: len(person.vertices)]
    assert np.linalg.norm(body - person.vertices, axis=1).max() < 0.35
    face = (person.template[:, 2] > 1.2) & (person.template[:, 1] > 6.3) & (person.template[:, 1] < 7.7)
    assert np.linalg.norm(body - person.vertices, axis=1)[face].max() < 0.06


def test_values_are_in_range(pieces: tuple[Surface, Surface]) -> None:
    for piece in pieces:
        for values in (piece.uv, piece.colour, piece.cover, piece.shade, piece.follow):
            assert np.isfinite(values).all()
        for values in (piece.uv[:, 0], piece.colour, piece.cover, piece.shade, piece.follow):
            assert values.min() >= 0
            assert values.max() <= 1 + 1e-9
        assert (piece.gloss >= 0).all()


def test_no_quad_jumps_across_the_painting(pieces: tuple[Surface, Surface]) -> None:
    """The painting's borders meet behind; a quad that spanned both would show all of it."""
    for piece in pieces:
        across = piece.uv[piece.quads[piece.drawn], 0]
        # Round the crown a quad may turn by a good part of a circle.
        away_from_crown = piece.uv[piece.quads[piece.drawn], 1].max(axis=1) < 0.85
        assert np.ptp(across[away_from_crown], axis=1).max() < 0.2


def test_strip_and_skin_fit_together(pieces: tuple[Surface, Surface]) -> None:
    body, strip = pieces
    together = [
        row for piece in pieces for row in np.sort(piece.vertices[piece.quads[piece.drawn]].mean(axis=1), axis=0)
    ]
    assert len(together) == body.drawn.sum() + strip.drawn.sum()
    known = {tuple(vertex) for vertex in body.vertices}
    assert all(tuple(vertex) in known for vertex in strip.vertices)
    assert not body.drawn.all()


def test_bust_is_alike_on_both_sides_but_for_the_hair(person: FaceModel, pieces: tuple[Surface, Surface]) -> None:
    body = pieces[0].vertices
    bare = body[(body[:, 2] > person.eye_centres[0, 2] - 0.2) & (body[:, 1] < person.eye_centres[0, 1] + 0.3)]
    left, right = bare[bare[:, 0] > 0.02], bare[bare[:, 0] < -0.02] * (-1, 1, 1)
    assert abs(len(left) - len(right)) < 0.02 * len(left)
    assert left.mean(axis=0) == pytest.approx(right.mean(axis=0), abs=0.01)
