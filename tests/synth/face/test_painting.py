import subprocess
import sys
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.face.identity import IDENTITIES, Identity
from synth.face.look import Brows, Neckline
from synth.face.mesh import FaceModel
from synth.face.painting import HEIGHT, WIDTH, paint
from synth.face.wrapping import above_hairline, below_neckline, canvas, mirrored, place, wrap

EACH = pytest.mark.parametrize("identity", IDENTITIES.values(), ids=IDENTITIES)
FOREHEAD, BROW, ABOVE_EAR, CHEST = (0.0, 7.75), (0.30, 7.54), (1.6, 8.0), (0.0, 4.9)


def painted(identity: Identity, at: tuple[float, float], radius: float = 0.02) -> np.ndarray:
    """The mean colour near an angle and a height, sRGB from 0 to 1."""
    angle, height = canvas(WIDTH, HEIGHT)
    near = np.hypot(angle - at[0], height - at[1]) < radius
    assert near.sum() > 20
    return paint(identity.palette, identity.look)[near].mean(axis=0) / 255


@EACH
def test_pictures_are_no_larger_than_the_renderer_bears(identity: Identity) -> None:
    picture = paint(identity.palette, identity.look)
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert picture.dtype == np.uint8
    assert max(picture.shape) <= 1024
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0] = 0


def test_pictures_differ() -> None:
    pictures = [paint(identity.palette, identity.look).astype(int) for identity in IDENTITIES.values()]
    for one, other in combinations(pictures, 2):
        assert np.abs(one - other).mean() > 4


def test_another_process_paints_the_same_bytes() -> None:
    script = (
        "import hashlib; from synth.face.identity import IDENTITIES; from synth.face.painting import paint\n"
        "for one in IDENTITIES.values(): print(hashlib.sha256(paint(one.palette, one.look).tobytes()).hexdigest())"
    )
    other = [subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True) for _ in "ab"]
    assert other[0].stdout == other[1].stdout
    assert len(set(other[0].stdout.split())) == len(IDENTITIES)


@EACH
def test_each_coat_has_its_colour_where_it_belongs(identity: Identity) -> None:
    palette = identity.palette
    for at, colour, tolerance in (
        (FOREHEAD, palette.skin, 0.06),
        (ABOVE_EAR, palette.hair, 0.10),
        (CHEST, palette.shirt, 0.06),
    ):
        assert painted(identity, at, 0.15) == pytest.approx(colour, abs=tolerance), at
    assert painted(identity, BROW).mean() < 0.75 * painted(identity, FOREHEAD).mean()


@EACH
def test_left_and_right_are_alike_but_not_the_same(identity: Identity) -> None:
    picture = paint(identity.palette, identity.look).astype(float)
    flipped = picture[:, ::-1]
    assert (picture != flipped).any(axis=2).mean() > 0.3
    angle, height = canvas(WIDTH, HEIGHT)
    face = (np.abs(angle) < 0.6) & (height > 6.2) & (height < 7.4)
    assert np.abs(picture - flipped)[face].mean() < 4


@EACH
def test_hair_is_clear_of_brows_and_eyes(identity: Identity) -> None:
    angle, height = canvas(256, 512)
    face = (np.abs(angle) < 0.62) & (height > 6.2) & (height < 7.62)
    assert above_hairline(identity.look.hair.hairline, angle, height)[face].max() < -0.05


@EACH
def test_neck_is_bare_and_shoulders_are_covered(identity: Identity, face: FaceModel) -> None:
    angle, height = wrap(face.template)
    under = below_neckline(identity.look.neckline, angle, height)
    x, y, _ = face.template.T
    assert under[np.abs(x) > 1.3].min() > 0.05
    assert under[(y > 6.0)].max() < -0.1


def test_a_beard_darkens_the_chin_and_leaves_the_forehead() -> None:
    shaven = replace(IDENTITIES["erik"], look=replace(IDENTITIES["erik"].look, beard=0.0))
    grown = replace(shaven, look=replace(shaven.look, beard=1.0))
    chin = (0.45, 6.42)
    assert painted(grown, chin).mean() < 0.93 * painted(shaven, chin).mean()
    assert painted(grown, FOREHEAD) == pytest.approx(painted(shaven, FOREHEAD), abs=0.01)


@pytest.mark.parametrize(("field", "value"), [("thickness", 1.6), ("raised", 0.06), ("length", 1.3), ("density", 0.3)])
def test_brows_follow_their_shape(field: str, value: float) -> None:
    mei = IDENTITIES["mei"]
    usual = replace(mei, look=replace(mei.look, brows=Brows()))
    other = replace(mei, look=replace(mei.look, brows=replace(Brows(), **{field: value})))
    places = {
        "thickness": ((0.30, 7.592), -1),
        "raised": ((0.30, 7.61), -1),
        "length": ((0.66, 7.50), -1),
        "density": ((0.30, 7.54), 1),
    }
    at, sign = places[field]
    assert sign * (painted(other, at).mean() - painted(usual, at).mean()) > 0.03


def test_a_lower_neckline_bares_the_throat() -> None:
    neckline = Neckline(height=5.5, drop=0.3, width=0.8, pointed=True)
    assert below_neckline(neckline, 0.0, 5.3) < 0 < below_neckline(neckline, 1.0, 5.3)
    assert below_neckline(neckline, 0.0, 5.1) > 0


@given(st.floats(-3.13, 3.13), st.floats(6.4, 7.4))
def test_places_on_the_head_are_found_again_on_the_canvas(angle: float, height: float) -> None:
    template = np.array([[0.8 * np.sin(angle), height, 0.4 + 0.8 * np.cos(angle)]])
    (across, up), (width, rows) = place(template)[0], (2048, 2048)
    angles, heights = canvas(width, rows)
    column, row = min(int(across * width), width - 1), min(int((1 - up) * rows), rows - 1)
    assert angles[row, column] == pytest.approx(angle, abs=0.02)
    assert heights[row, column] == pytest.approx(height, abs=0.01)


def test_the_middle_of_the_nape_lies_on_both_borders() -> None:
    uv = place(np.array([[0.0, 6.8, -0.4], [0.0, 6.8, 1.2]]))
    assert uv[:, 0] == pytest.approx([1.0, 0.5])
    assert mirrored(uv)[:, 0] == pytest.approx([0.0, 0.5])


@given(st.floats(0.0, np.pi), st.floats(6.0, 9.0))
def test_the_distance_to_the_hairline_is_a_distance(angle: float, height: float) -> None:
    """It changes no faster than one walks, and its sign says on which side one is."""
    line = IDENTITIES["mei"].look.hair.hairline
    here, there = above_hairline(line, angle, height), above_hairline(line, angle, height + 0.01)
    assert abs(there - here) <= 0.01 + 1e-9
    if height > 8.2:
        assert here > 0
