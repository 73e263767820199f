"""Eyes stay under their lids, look alive, and let pupils grow; lashes go with the lids. For each identity."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from synth.face.eyes import EYES, IRIS, PUPIL, eyeballs, lashes, pupil_diameter, pupil_growth, pupil_points
from synth.face.identity import IDENTITIES
from synth.face.mesh import FaceModel, load_face
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import Renderer

GREEN = (0.0, 4.0, 0.0, 0.0)
GAZES = [(yaw, pitch) for yaw in (-0.5, 0.0, 0.5) for pitch in (-0.4, 0.0, 0.4)]


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def rig(request, face_dir):
    return Rig(load_face(face_dir, request.param))


@pytest.fixture(scope="module")
def ball(face: FaceModel) -> np.ndarray:
    """The left ball's vertices relative to its centre."""
    return eyeballs(face, face.identity.palette)[0].vertices - face.eye_centres[0]


def looking(yaw: float, pitch: float, weights: np.ndarray | None = None) -> Motion:
    return Motion.of(weights, eyes=((yaw, pitch), (yaw, pitch)))


def lids_follow(weights, pitch: float) -> np.ndarray:
    share = min(abs(pitch) / 0.6, 1.0)
    return weights(eyeLookDown=share) if pitch > 0 else weights(eyeLookUp=share)


def polar(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distances from the centre and angles from +z."""
    distance = np.linalg.norm(points, axis=1)
    return distance, np.arccos(points[:, 2] / distance)


def count_green(picture: np.ndarray) -> int:
    red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
    return int((green - np.maximum(red, blue) > 60).sum())


def test_closed_lids_hide_the_balls(rig, weights):
    closed = weights(eyeBlink=1.0)
    with Renderer(rig) as renderer:
        expected = renderer.frame(looking(0.0, 0.0, closed))
        for gaze in GAZES:
            np.testing.assert_array_equal(renderer.frame(looking(*gaze, closed)), expected)


def test_no_gaze_shows_the_rim_of_a_ball(rig, weights):
    """Behind its rim one would look into the socket."""
    painted = copy.copy(rig)
    painted.paint = rig.paint.copy()
    for name, centre in zip(EYES, rig.face.eye_centres, strict=True):
        span = rig.spans[name]
        _, angle = polar(rig.rest[span] - centre)
        painted.paint[span][angle > np.radians(130)] = GREEN
    with Renderer(painted) as renderer:
        for yaw, pitch in GAZES:
            assert count_green(renderer.frame(looking(yaw, pitch, lids_follow(weights, pitch)))) == 0, (yaw, pitch)


@pytest.mark.parametrize("blink", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
def test_lids_slide_over_the_balls(rig, weights, blink):
    """Wherever the eyes look, no place on the outside of a lid comes inside a ball."""
    rest, _ = rig.pose(Motion.of())
    triangles = rig.triangles[(rig.triangles < rig.spans["skin"].stop).all(axis=1)]
    for side, (name, centre) in enumerate(zip(EYES, rig.face.eye_centres, strict=True)):
        radius, angle = polar(rig.rest[rig.spans[name]] - centre)
        ring = np.argsort(angle)
        corners = rest[triangles] - centre
        middle = corners.mean(axis=1)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        distance = np.linalg.norm(middle, axis=1)
        eye = rig.face.eye_radius
        outside = (distance > eye) & (distance < 1.6 * eye) & (np.einsum("ij,ij->i", normal, middle) > 0)
        lids = triangles[outside & (middle[:, 2] > 0.3 * eye)]
        for yaw, pitch in GAZES:
            pose = np.maximum(weights(eyeBlink=blink), lids_follow(weights, pitch) * (1 - blink))
            moved, _ = rig.pose(looking(yaw, pitch, pose))
            places = (moved[lids] - centre).mean(axis=1)
            away = np.linalg.norm(places, axis=1)
            pole = moved[rig.spans[name]][0] - centre
            from_pole = np.arccos(np.clip(places @ pole / (away * np.linalg.norm(pole)), -1, 1))
            room = away - np.interp(from_pole, angle[ring], radius[ring])
            assert room.min() > 0.0, (side, yaw, pitch)


def test_catchlights_are_small_and_bright(rig, weights):
    with Renderer(rig) as renderer:
        picture = renderer.frame(Motion.of(weights(eyeWide=0.3))).astype(int)
        aside = renderer.frame(looking(0.5, 0.3, weights(eyeWide=0.3))).astype(int)
    eyes = np.abs(picture - aside).max(axis=2) > 8
    # White and brighter than any sclera.
    bright = eyes & (picture.min(axis=2) > 238)
    left, right = (bright[:, half].sum() for half in (slice(360, None), slice(None, 360)))
    assert 1 <= left <= 14
    assert 1 <= right <= 14


@given(factor=st.floats(0.5, 1.6))
def test_pupils_grow_as_wide_as_asked(face, ball, factor):
    growth = pupil_growth(face)
    away, moved = np.linalg.norm(ball[:, :2], axis=1), ball + (factor - 1) * growth
    width = np.linalg.norm(moved[:, :2], axis=1)
    radius, angle = polar(ball)
    pupil = angle < PUPIL + np.radians(1)
    np.testing.assert_allclose(width[pupil], factor * away[pupil], atol=1e-12)
    white = angle > IRIS
    np.testing.assert_array_equal(moved[white], ball[white])
    # Rings of the iris neither overtake each other nor leave the bulge.
    spoke = np.flatnonzero((np.abs(ball[:, 1]) < 1e-9) & (ball[:, 0] > 0) & (angle < np.radians(80)))
    assert len(spoke) > 8
    assert (np.diff(width[spoke[np.argsort(angle[spoke])]]) > 0).all()
    new_radius, new_angle = polar(moved)
    ring = np.argsort(angle)
    off = new_radius - np.interp(new_angle, angle[ring], radius[ring])
    assert np.abs(off).max() < 0.012 * face.eye_radius


def test_diameter_of_the_pupil(face, ball):
    black = eyeballs(face, face.identity.palette)[0].colour.max(axis=1) < 0.05
    widest = 2 * np.linalg.norm(ball[black, :2], axis=1).max()
    assert widest < pupil_diameter(face) < 1.15 * widest
    assert 0.25 < pupil_diameter(face) / (2 * face.eye_radius * np.sin(IRIS)) < 0.5


def test_middles_of_the_pupils_are_foremost(rig):
    for name, middle in zip(EYES, pupil_points(rig.face), strict=True):
        places = rig.rest[rig.spans[name]]
        assert np.linalg.norm(places[places[:, 2].argmax()] - middle) < 1e-5


def test_lashes_go_with_the_lids(rig, weights):
    """Each lash's lowest ring stays on its lid when the eye closes."""
    number = rig.face.morph_names.index("eyeBlinkLeft")
    rest, _ = rig.pose(Motion.of())
    closed, _ = rig.pose(Motion.of(weights(eyeBlink=1.0)))
    skin, own = rig.spans["skin"], rig.spans["left-lashes"]
    distance, nearest = cKDTree(rest[skin]).query(rest[own])
    roots = distance < 0.012
    assert roots.sum() > 40
    skin_moved = (closed - rest)[skin][nearest[roots]]
    lash_moved = (closed - rest)[own][roots]
    lid = np.abs(rig.face.morphs[number]).max()
    assert np.linalg.norm(lash_moved - skin_moved, axis=1).max() < 0.4 * lid
    assert np.median(np.linalg.norm(lash_moved - skin_moved, axis=1)) < 0.1 * lid


def test_upper_lashes_are_longer_and_those_of_men_shorter(face):
    def reach(made: FaceModel) -> tuple[float, float]:
        left = lashes(made)[0]
        out = np.linalg.norm(left.vertices - made.eye_centres[0], axis=1) / made.eye_radius
        number = made.morph_names.index("eyeBlinkLeft")
        upper = left.morphs[number, :, 1] < -0.02
        return float(out[upper].max()), float(out[~upper].max())

    woman = replace(face, identity=replace(face.identity, sex="female"))
    man = replace(face, identity=replace(face.identity, sex="male"))
    assert reach(woman)[0] > reach(woman)[1]
    assert reach(man)[0] < reach(woman)[0]


def test_eyes_cost_few_vertices(face):
    assert all(len(made.vertices) <= 360 for made in eyeballs(face, face.identity.palette))
    assert all(len(made.vertices) <= 300 for made in lashes(face))
