import numpy as np
import pytest

from synth.errors import SpecError
from synth.face.feature_points import PAIRS, VERTICES, feature_points, skin_rows
from synth.face.identity import IDENTITIES
from synth.face.mesh import load_face
from synth.face.rig import Rig
from synth.fap.table import faps


@pytest.fixture
def at(face):
    return feature_points(face)


def test_all_eighty_four(at, rig):
    # ISO/IEC 14496-2 has 84 feature points in eleven groups of these sizes.
    sizes = [14, 14, 6, 4, 4, 1, 10, 15, 10, 6]
    names = {f"{group}.{k}" for group, size in zip(range(2, 12), sizes, strict=True) for k in range(1, size + 1)}
    assert len(names) == 84
    assert set(rig.feature_points()) == names
    assert set(at) == names - {"11.5"}


@pytest.mark.parametrize("identity", sorted(IDENTITIES))
def test_drawn_points_lie_on_the_figure(face_dir, identity):
    """Each is a vertex that is drawn, or close to one; the hair rises over the skull."""
    rig = Rig(load_face(face_dir, identity))
    points = rig.feature_points()
    drawn = rig.rest[np.unique(rig.triangles)]
    for name, place in points.items():
        if name in {"7.1", "11.1", "11.2", "11.3", "11.4", "11.6"}:
            continue
        assert np.linalg.norm(drawn - place, axis=1).min() < (0.12 if name == "11.5" else 0.05), name
    assert 0.01 < points["11.5"][1] - points["11.4"][1] < 0.8


def test_every_fap_of_the_face_has_its_points(at):
    assert {point for fap in faps().values() for point in fap.points} <= set(at)


def test_left_is_the_mirror_image_of_right(at):
    for left, right, _, _ in PAIRS:
        assert at[left][0] > 0.0, left
        np.testing.assert_allclose(at[left] * [-1, 1, 1], at[right], atol=1e-3, err_msg=left)


def test_middle_points_are_on_the_middle_line(at):
    for name in ("2.1", "2.2", "2.3", "2.10", "7.1", "8.1", "8.2", "9.3", "9.12", "9.15", "11.1", "11.4", "11.6"):
        assert abs(at[name][0]) < 1e-4, name


@pytest.mark.parametrize(
    ("above", "below"),
    [
        *(("11.4", "11.1"), ("11.1", "4.3"), ("4.3", "3.13"), ("3.13", "3.1"), ("3.1", "3.5"), ("3.5", "3.3")),
        *(("3.3", "3.9"), ("3.9", "9.3"), ("9.3", "9.15"), ("9.15", "8.1"), ("8.1", "2.2"), ("2.2", "2.3")),
        *(("2.3", "8.2"), ("8.2", "2.10"), ("2.10", "2.1"), ("8.10", "8.1"), ("10.1", "10.5"), ("5.3", "5.1")),
        *(("8.5", "2.6"), ("2.6", "2.8"), ("2.8", "8.7"), ("9.8", "9.10"), ("9.11", "9.9")),
    ],
)
def test_order_from_crown_to_chin(at, above, below):
    assert at[above][1] > at[below][1]


def test_order_from_the_middle_to_the_left(at):
    for names in (("2.2", "2.6", "2.4", "8.3"), ("4.1", "4.3", "4.5"), ("3.11", "3.5", "3.7"), ("9.3", "9.5", "9.1")):
        xs = [at[name][0] for name in names]
        assert xs == sorted(xs)
        assert len(set(xs)) == len(xs)


def test_lips_touch_and_the_nose_leads(at):
    assert at["2.2"][1] - at["2.3"][1] < 0.03, "lips apart by more than 3 mm"
    front = [name for name in VERTICES if name != "9.3"]
    assert all(at["9.3"][2] > at[name][2] for name in front)


def test_lid_points_are_above_and_below_the_pupil(at):
    for upper, lower, pupil in (("3.1", "3.3", "3.5"), ("3.2", "3.4", "3.6")):
        assert abs(at[upper][0] - at[pupil][0]) < 0.02
        assert abs(at[lower][0] - at[pupil][0]) < 0.02


def test_the_same_points_on_another_face(face):
    rows = skin_rows(face, ["8.3", "8.4"])
    assert face.base_index[rows].tolist() == [VERTICES["8.3"], VERTICES["8.4"]]


def test_unknown_points_are_refused(face):
    with pytest.raises(SpecError, match=r"'11\.5' is not a vertex"):
        skin_rows(face, ["8.1", "11.5"])
    with pytest.raises(SpecError, match=r"6\.1 .* not on the skin"):
        skin_rows(face, ["6.1"])
