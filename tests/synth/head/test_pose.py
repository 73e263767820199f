import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from synth.errors import SpecError
from synth.head import pose
from synth.head.pose import FIVE, five_points, landmarks, many_points, nose_tilt, pose_noise, project

FOCAL = 800.0
FACE = np.array([landmarks()[name] for name in FIVE], dtype=float)
# What the original method takes for granted: corners on one straight line.
STRAIGHT = np.array([[-42, 0, 0], [-15, 0, 0], [15, 0, 0], [42, 0, 0], [0, -32, 24]], dtype=float)
STRAIGHT_OPTIONS = {"tilt": float(np.degrees(np.arctan2(24, 32))), "depth": 0.0}
ALL = np.array(list(landmarks().values()), dtype=float)
TURNS = np.array(
    [
        [0, 0, 0],
        [12, 0, 0],
        [-16, 0, 0],
        [0, 12, 0],
        [0, -9, 0],
        [0, 0, 10],
        [8, 6, 0],
        [-6, 0, 7],
        [0, -8, -5],
        [9, 7, -6],
    ],
    dtype=float,
)


def seen(angles, model, position=(0.0, 0.0, 700.0)):
    return project(angles, model, focal=FOCAL, position=position)


def test_projection_has_the_signs_of_the_faps():
    straight, down, left, right = seen(np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]], float), FACE)
    # Picture: x to the right, where the subject's left is, and y downward.
    assert straight[3, 0] > 0.0 > straight[0, 0]
    assert straight[4, 1] > 0.0
    # Pitch down lowers the tip of the nose, yaw left takes it to the right, roll right lowers the right eye.
    assert down[4, 1] > straight[4, 1]
    assert left[4, 0] > 0.0
    assert right[0, 1] > right[3, 1]


def test_projection_agrees_with_a_camera_written_out():
    angles, position = np.array([[7.0, -11.0, 4.0]]), np.array([30.0, -20.0, 650.0])
    turn = Rotation.from_euler("y", -11, degrees=True) * Rotation.from_euler("x", 7, degrees=True)
    turn *= Rotation.from_euler("z", 4, degrees=True)
    x, y, z = turn.apply(FACE).T
    depth = position[2] - z
    expected = FOCAL * np.stack([(x + position[0]) / depth, (-y + position[1]) / depth], axis=1)
    np.testing.assert_allclose(seen(angles, FACE, position)[0], expected)


def test_five_points_recover_rotations_of_an_ideal_face():
    found = five_points(seen(TURNS, STRAIGHT), focal=FOCAL, **STRAIGHT_OPTIONS)
    np.testing.assert_allclose(found, TURNS, atol=1e-6)


def test_five_points_recover_rotations_of_a_real_face():
    np.testing.assert_allclose(five_points(seen(TURNS, FACE), focal=FOCAL), TURNS, atol=1.0)


def test_off_the_axis_roll_is_a_little_wrong():
    found = five_points(seen(TURNS, STRAIGHT, (60, -40, 700)), focal=FOCAL, **STRAIGHT_OPTIONS)
    np.testing.assert_allclose(found[:, :2], TURNS[:, :2], atol=0.2)
    np.testing.assert_allclose(found[:, 2], TURNS[:, 2], atol=0.9)


@settings(max_examples=40, deadline=None)
@given(
    pitch=st.floats(-20, 20),
    yaw=st.floats(-20, 20),
    roll=st.floats(-20, 20),
    distance=st.floats(500, 1500),
    moved=st.floats(0.7, 1.3),
)
def test_distance_does_not_matter(pitch, yaw, roll, distance, moved):
    neutral = seen(np.zeros((1, 3)), STRAIGHT, (0, 0, distance))
    turned = seen(np.array([[pitch, yaw, roll]]), STRAIGHT, (0, 0, distance * moved))
    found = five_points(np.concatenate([neutral, turned]), focal=FOCAL, **STRAIGHT_OPTIONS)
    np.testing.assert_allclose(found[1], [pitch, yaw, roll], atol=1e-4)


def test_a_straight_line_through_real_corners_triples_yaw():
    yaw = five_points(seen(np.array([[0.0, 0, 0], [0, 5, 0]]), FACE), focal=FOCAL, depth=0.0)[1, 1]
    assert 2.5 < yaw / 5.0 < 4.5
    corrected = five_points(seen(np.array([[0.0, 0, 0], [0, 5, 0]]), FACE), focal=FOCAL)[1, 1]
    assert corrected == pytest.approx(5.0, abs=0.1)


def test_angles_are_relative_to_the_reference():
    found = five_points(seen(TURNS, FACE), focal=FOCAL, reference=4)
    assert found[4].tolist() == [0, 0, 0]
    neutral_first = five_points(seen(TURNS, FACE), focal=FOCAL)
    assert found[3, 1] - neutral_first[3, 1] == pytest.approx(9.0, abs=0.5)


def test_nodding_beyond_the_tilt_is_taken_for_the_other_root():
    assert 30.0 < nose_tilt() < 45.0
    deep = np.array([[0.0, 0, 0], [nose_tilt() + 10.0, 0, 0]])
    found = five_points(seen(deep, FACE, (0, 0, 5000)), focal=FOCAL)[1, 0]
    assert found < nose_tilt()


def test_noise_of_five_points():
    rng = np.random.default_rng(1)
    still = pose_noise(0.0, rng=rng)
    np.testing.assert_allclose([*still.bias, *still.sd], 0.0, atol=1e-9)
    tenth, half = pose_noise(0.1, rng=rng), pose_noise(0.5, rng=rng)
    # Yaw is the weak one: about a degree for a tenth of a pixel.
    np.testing.assert_allclose(tenth.sd, [0.3, 1.0, 0.1], rtol=0.2)
    np.testing.assert_allclose(half.sd, 5 * tenth.sd, rtol=0.2)
    # Twice the distance halves the picture, so noise counts double and more.
    assert (pose_noise(0.1, rng=rng, distance=1600.0).sd > 1.8 * tenth.sd).all()


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (np.zeros((2, 4, 2)), {}, r"shape \(2, 4, 2\)"),
        (np.zeros((0, 5, 2)), {}, "shape"),
        (np.full((1, 5, 2), np.nan), {}, "point 0 of frame 0 is not finite"),
        (np.zeros((1, 5, 2)), {}, "corners of frame 0 are not in order"),
        (seen(TURNS, FACE) * [-1, 1], {}, "not in order from left to right"),
        (seen(TURNS, FACE) * [1, -1], {}, "nose is above the eyes"),
        (seen(TURNS, FACE), {"focal": 0.0}, "focal length is 0"),
        (seen(TURNS, FACE), {"focal": np.nan}, "focal length is nan"),
        (seen(TURNS, FACE), {"reference": 10}, "no frame 10 for the reference"),
        (seen(TURNS, FACE), {"tilt": 90.0}, "tilt of the nose is 90"),
        (seen(TURNS, FACE), {"depth": -0.1}, "depth of the eye corners is -0.1"),
    ],
)
def test_malformed_points_are_refused(points, options, message):
    with pytest.raises(SpecError, match=message):
        five_points(points, **{"focal": FOCAL, **options})


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (ALL[:5], "K at least 6"),
        (ALL * [1, 1, 0], "in one plane"),
        (np.full((6, 3), np.nan), "finite"),
    ],
)
def test_malformed_models_are_refused(model, message):
    with pytest.raises(SpecError, match=message):
        many_points(np.zeros((1, len(model), 2)), model, focal=FOCAL)


def test_without_opencv_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(SpecError, match=r"pip install 'padlab\[pose\]'"):
        many_points(seen(TURNS, ALL), ALL, focal=FOCAL)


@pytest.mark.parametrize(
    "options", [{"noise": -1.0}, {"noise": np.nan}, {"noise": 0.1, "samples": 1}, {"noise": 0.1, "method": "six"}]
)
def test_malformed_requests_for_noise_are_refused(options):
    with pytest.raises(SpecError, match="Pose: "):
        pose_noise(options.pop("noise"), rng=np.random.default_rng(0), **options)


def test_landmarks_are_a_symmetric_face():
    places = landmarks()
    for name, (x, y, z) in places.items():
        other = name.replace("left", "#").replace("right", "left").replace("#", "right")
        assert places[other] == (-x, y, z)
    assert set(FIVE) < set(places)
    assert len(places) >= pose.MIN_POINTS


class TestWithOpenCV:
    @pytest.fixture(autouse=True)
    def opencv(self):
        pytest.importorskip("cv2")

    def test_many_points_recover_rotations(self):
        points = seen(TURNS, ALL, (60, -40, 700))
        np.testing.assert_allclose(many_points(points, ALL, focal=FOCAL, adapt=False), TURNS, atol=1e-3)
        np.testing.assert_allclose(many_points(points, ALL, focal=FOCAL), TURNS, atol=0.05)

    def test_a_fitting_focal_length_matters_little(self):
        found = many_points(seen(TURNS, ALL), ALL, focal=1.2 * FOCAL)
        np.testing.assert_allclose(found, TURNS, atol=1.5)

    def test_the_model_takes_on_the_speakers_proportions(self):
        other = seen(TURNS, ALL * [1.05, 0.95, 1.1])
        np.testing.assert_allclose(many_points(other, ALL, focal=FOCAL), TURNS, atol=1.5)
        fixed = many_points(other, ALL, focal=FOCAL, adapt=False)
        assert fixed[1, 0] / TURNS[1, 0] > 1.3

    def test_mirrored_pictures_are_refused(self):
        with pytest.raises(SpecError, match="mirrored"):
            many_points(seen(TURNS, ALL) * [-1, 1], ALL, focal=FOCAL)

    def test_many_points_bear_more_noise(self):
        few, many = (
            pose_noise(0.5, rng=np.random.default_rng(2), method=name, samples=200) for name in ("five", "many")
        )
        assert many.sd[1] < 0.4 * few.sd[1]
        np.testing.assert_allclose(many.sd, [1.1, 1.1, 0.27], rtol=0.3)
