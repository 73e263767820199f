from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from synth.face.appearance import dress
from synth.face.identity import IDENTITIES
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import Renderer

SIZE = 180, 144
TURNS = ((0.0, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, -0.5, 0.0), (0.3, 0.0, 0.0), (-0.3, 0.0, 0.0), (0.0, 0.0, 0.3))


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def pictures(request: pytest.FixtureRequest, face_dir: Path) -> Iterator[tuple[str, list[np.ndarray]]]:
    rig = Rig(load_face(face_dir, request.param))
    with Renderer(rig, width=SIZE[0], height=SIZE[1]) as renderer:
        yield request.param, [renderer.frame(Motion.of(head=turn)) for turn in TURNS]


def background(picture: np.ndarray) -> np.ndarray:
    """Tell where nothing is; the upper corners always are empty."""
    return (np.abs(picture.astype(int) - picture[0, 0]) < 4).all(axis=2)


def test_eyes_come_last(face_dir: Path) -> None:
    surfaces, painting = dress(load_face(face_dir))
    assert [surface.name for surface in surfaces[-2:]] == ["left-eye", "right-eye"]
    assert len({surface.name for surface in surfaces}) == len(surfaces)
    assert painting.ndim == 3


def test_the_background_shows_through_nowhere(pictures: tuple[str, list[np.ndarray]]) -> None:
    """Within the figure's rows no run of background lies between two parts of the head."""
    _, frames = pictures
    for picture, turn in zip(frames, TURNS, strict=True):
        empty = background(picture)
        # Above the ears the head is one piece.
        for row in empty[: int(0.32 * len(empty))]:
            figure = np.flatnonzero(~row)
            if len(figure) > 5:
                assert row[figure[0] : figure[-1]].sum() <= 1, turn


def test_the_figure_stays_in_the_picture(pictures: tuple[str, list[np.ndarray]]) -> None:
    _, frames = pictures
    for picture in frames:
        empty = background(picture)
        assert empty[0].mean() > 0.8
        assert empty[: len(empty) // 2, [0, -1]].all()
    assert background(frames[0])[0].all()


def test_the_top_covers_the_shoulders(pictures: tuple[str, list[np.ndarray]]) -> None:
    name, frames = pictures
    shirt = np.array(IDENTITIES[name].palette.shirt)
    skin = np.array(IDENTITIES[name].palette.skin)
    empty = background(frames[0])
    for columns in (slice(None, SIZE[0] // 4), slice(-SIZE[0] // 4, None)):
        seen = frames[0][-8:, columns][~empty[-8:, columns]].mean(axis=0)
        # Hue rather than brightness: the light falls off towards the shoulders.
        like_shirt, like_skin = (np.linalg.norm(seen / seen.sum() - colour / colour.sum()) for colour in (shirt, skin))
        assert like_shirt < like_skin


def test_people_look_different(face_dir: Path) -> None:
    frames = []
    for name in IDENTITIES:
        with Renderer(Rig(load_face(face_dir, name)), width=SIZE[0], height=SIZE[1]) as renderer:
            frames.append(renderer.frame(Motion.of()).astype(int))
    for k, one in enumerate(frames):
        for other in frames[:k]:
            assert np.abs(one - other).mean() > 5
