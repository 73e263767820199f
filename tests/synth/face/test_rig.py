import numpy as np
import pytest

from synth.errors import SpecError
from synth.face.deformation import solve
from synth.face.identity import IDENTITIES
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.fap.table import column


def _posed(rig: Rig, **pose: object) -> np.ndarray:
    return rig.pose(Motion.of(**pose))[0]


def test_the_neutral_pose_is_the_rest(rig: Rig) -> None:
    np.testing.assert_allclose(_posed(rig), rig.rest, atol=1e-5)


def test_normals_are_unit_vectors_that_point_out(rig: Rig) -> None:
    positions, normals = rig.pose(Motion.of())
    drawn = np.unique(rig.triangles)
    np.testing.assert_allclose(np.linalg.norm(normals[drawn], axis=1), 1.0, atol=1e-4)
    tip = rig.control.rows[rig.control.names.index("9.3")]
    assert normals[tip, 2] > 0.8
    left = rig.control.rows[rig.control.names.index("10.3")]
    assert positions[left, 0] > 0


def test_a_pose_does_not_depend_on_the_one_before(rig: Rig) -> None:
    weights = np.zeros(52)
    weights[17] = 0.7
    first = _posed(rig, weights=weights, head=(0.1, -0.2, 0.05))
    _posed(rig, weights=np.full(52, 0.3), eyes=((0.3, 0.1), (0.3, 0.1)))
    assert (_posed(rig, weights=weights, head=(0.1, -0.2, 0.05)) == first).all()


@pytest.mark.parametrize(("axis", "turn"), [(0, (0.3, 0, 0)), (1, (0, 0.3, 0)), (2, (0, 0, 0.3))])
def test_the_skull_turns_as_far_as_it_is_told(rig: Rig, axis: int, turn: tuple[float, float, float]) -> None:
    """Nose and ears turn rigidly by the whole angle: a share in the neck, the rest on the spine (FAP 48 to 50)."""
    rows = rig.control.rows[[rig.control.names.index(point) for point in ("9.3", "10.1", "10.2", "4.3", "4.4")]]
    here, there = _posed(rig)[rows], _posed(rig, head=turn)[rows]
    here, there = here - here.mean(axis=0), there - there.mean(axis=0)
    u, _, vt = np.linalg.svd(there.T @ here)
    rotation = u @ vt
    np.testing.assert_allclose(there, here @ rotation.T, atol=2e-3)
    angle = np.arccos((np.trace(rotation) - 1) / 2)
    assert angle == pytest.approx(0.3, abs=0.01)
    spin = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    # Pitch is positive down, about +x; yaw to the subject's left, about +y; roll to the subject's right, about +z.
    assert spin[axis] > 0.9 * np.linalg.norm(spin)


def test_the_neck_follows_smoothly_and_the_shoulders_stay(rig: Rig) -> None:
    here, there = _posed(rig), _posed(rig, head=(0.2, 0.4, 0.1))
    way = np.linalg.norm(there - here, axis=1)
    skin = rig.spans["skin"]
    low = np.flatnonzero(here[skin, 1] < rig.face.pivots["neck"][1] - 0.3)
    assert way[skin][low].max() < 0.02
    stretch = np.linalg.norm(there[rig.triangles[:, 0]] - there[rig.triangles[:, 1]], axis=1)
    before = np.linalg.norm(here[rig.triangles[:, 0]] - here[rig.triangles[:, 1]], axis=1)
    assert (stretch[before > 0.02] / before[before > 0.02]).max() < 2.5


def test_eyes_turn_about_their_centres(rig: Rig) -> None:
    here, there = _posed(rig), _posed(rig, eyes=((0.4, 0), (0, 0.2)))
    for name, centre in zip(("left-eye", "right-eye"), rig.face.eye_centres, strict=True):
        span = rig.spans[name]
        radius = np.linalg.norm(here[span] - centre, axis=1)
        np.testing.assert_allclose(np.linalg.norm(there[span] - centre, axis=1), radius, atol=1e-6)
    left, right = (
        there[rig.spans[name]].mean(axis=0) - here[rig.spans[name]].mean(axis=0) for name in ("left-eye", "right-eye")
    )
    assert left[0] > 0.01
    assert right[1] < -0.005


def test_a_pupil_grows_on_its_ball(rig: Rig) -> None:
    still = Motion.of()
    grown = Motion(still.weights, still.head, still.eyes, still.thrust, np.array([[1.5, 1.0]]), still.residual)
    way = rig.pose(grown)[0] - rig.pose(still)[0]
    assert 0.005 < np.linalg.norm(way[rig.spans["left-eye"]], axis=1).max() < 0.03
    way[rig.spans["left-eye"]] = 0.0
    assert not way.any()


@pytest.mark.parametrize("turn", [1e-320, 1e-170, 1e-100, 1e-13])
def test_a_turn_too_small_to_see_changes_nothing(rig: Rig, turn: float) -> None:
    np.testing.assert_allclose(_posed(rig, head=(turn, 0, 0)), _posed(rig), atol=1e-9)


def test_motions_of_other_figures_are_refused(rig: Rig) -> None:
    still = Motion.of()
    other = Motion(still.weights, still.head, still.eyes, still.thrust, still.pupils, np.zeros((1, 5, 3)))
    with pytest.raises(SpecError, match="residual has 5 points; it must have 43"):
        rig.pose(other)
    with pytest.raises(SpecError, match="no frame 3; it has 1"):
        rig.pose(still, 3)


@pytest.mark.parametrize("identity", sorted(IDENTITIES))
def test_closing_lids_stay_off_the_ball(face_dir, identity: str) -> None:
    """Whatever share of the way the lower lid takes."""
    rig = Rig(load_face(face_dir, identity))
    values = np.zeros((3, 68))
    for frame, (upper, lower) in enumerate(((1024, 0), (512, 512), (0, 500))):
        values[frame, [column(19), column(20)]], values[frame, [column(21), column(22)]] = upper, lower
    motion = solve(values, rig)
    skin, rest = rig.spans["skin"], rig.rest
    for name, centre in zip(("left-eye", "right-eye"), rig.face.eye_centres, strict=True):
        ball = np.linalg.norm(rest[rig.spans[name]] - centre, axis=1).max()
        away = np.linalg.norm(rest[skin] - centre, axis=1)
        lids = np.flatnonzero((away > 1.02 * ball) & (away < 1.5 * ball) & (rest[skin, 2] > centre[2]))
        for frame in range(3):
            places = rig.pose(motion, frame)[0][skin][lids]
            assert np.linalg.norm(places - centre, axis=1).min() > ball
