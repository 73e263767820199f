"""Teeth stay behind the lips and the tongue behind the teeth, whatever the mouth does. For each identity."""

import copy

import numpy as np
import pytest

from synth.face.feature_points import VERTICES
from synth.face.identity import IDENTITIES
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.mouth import teeth, teeth_points, tongue
from synth.face.rig import Rig
from synth.render import Renderer

# Morphs that part the lips at weight 1, or put out the tongue.
OPENING = {
    *("jawOpen", "mouthFunnel", "mouthShrugUpper", "tongueOut"),
    *("mouthLowerDownLeft", "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight"),
}

POSES = {
    "rest": {},
    "jaw 0.3": {"jawOpen": 0.3},
    "jaw 0.6": {"jawOpen": 0.6},
    "jaw 1": {"jawOpen": 1.0},
    "upper lip up": {"mouthUpperUp": 1.0},
    "lower lip down": {"mouthLowerDown": 1.0},
    "smile": {"mouthSmile": 1.0},
    "stretch": {"mouthStretch": 1.5},
    "funnel": {"mouthFunnel": 1.0},
    "pucker": {"mouthPucker": 1.0},
    "lower lip rolled": {"mouthRollLower": 1.0},
    "frown": {"mouthFrown": 1.5},
    "jaw to the left": {"jawLeft": 1.0},
    "jaw to the right": {"jawRight": 1.0},
    "jaw forward": {"jawForward": 1.0},
}


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def rig(request, face_dir):
    return Rig(load_face(face_dir, request.param))


def crowns(rig: Rig, name: str) -> np.ndarray:
    """Return the rows of the rig that are crowns of the six front teeth of a row, without their necks."""
    span = rig.spans[name]
    at, places = teeth_points(rig.face), rig.rest[span]
    edge, gum = (at[point][1] for point in (("9.10", "9.8") if name == "upper-teeth" else ("9.11", "9.9")))
    share = (places[:, 1] - edge) / (gum - edge)
    front = np.abs(places[:, 0]) < 0.62 * np.abs(places[:, 0]).max()
    return span.start + np.flatnonzero(front & (share < 0.86))


def first_skin_ahead(rig: Rig, positions: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return for each row what lies in front of it: -1 the inside of the mouth, +1 the outside of skin, 0 nothing.

    A place that sees the outside of the skin from behind is inside the flesh.
    """
    # Off the middle line, where edges of the mesh run.
    points = positions[rows] + [1e-4, 0.0, 0.0]
    corners = positions[rig.triangles[(rig.triangles < rig.spans["skin"].stop).all(axis=1)]]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    touched = (corners[..., :2].max(axis=1) >= low).all(axis=1) & (corners[..., :2].min(axis=1) <= high).all(axis=1)
    corners = corners[touched]
    arms = corners[None, ..., :2] - points[:, None, None, :2]

    def turn(a, b):
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    doubled = np.stack([turn(arms[:, :, (k + 1) % 3], arms[:, :, (k + 2) % 3]) for k in range(3)], axis=-1)
    area = doubled.sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = doubled / area[..., None]
    ahead = np.einsum("ptk,tk->pt", np.nan_to_num(weights), corners[..., 2]) - points[:, 2:]
    ahead = np.where((weights >= 0).all(axis=2) & (ahead > 0), ahead, np.inf)
    nearest = ahead.argmin(axis=1)
    facing = np.sign(area[0, nearest])
    return np.where(np.isfinite(ahead.min(axis=1)), facing, 0.0)


@pytest.mark.parametrize("pose", POSES)
def test_front_teeth_are_not_in_the_flesh(rig, weights, pose):
    positions, _ = rig.pose(Motion.of(weights(**POSES[pose])))
    for name in ("upper-teeth", "lower-teeth"):
        rows = crowns(rig, name)
        assert len(rows) > 80
        assert not (first_skin_ahead(rig, positions, rows) > 0).any(), name


def test_closed_lips_hide_teeth_and_tongue(rig, weights):
    """It is not seen in any picture of a closed mouth whether teeth and tongue are painted as they are, or dark."""
    dark = copy.copy(rig)
    dark.paint, dark.gloss = rig.paint.copy(), rig.gloss.copy()
    for name in ("upper-teeth", "lower-teeth", "tongue"):
        dark.paint[rig.spans[name]] = (0.010, 0.002, 0.002, 0.0)
        dark.gloss[rig.spans[name]] = (0.0, 1.0)
    closed = [
        name for name in rig.face.morph_names if name not in OPENING and name.startswith(("mouth", "jaw", "cheek"))
    ]
    poses = {name: {name: 1.0} for name in (*closed, "mouthSmile", "mouthPress")}
    poses |= {"rest": {}, "mouthFrown": {"mouthFrown": 1.5}, "mouthStretch": {"mouthStretch": 1.5}}
    poses |= {"closed over an open jaw": {"jawOpen": 0.6, "mouthClose": 0.6}}
    seen = {}
    with Renderer(rig) as one, Renderer(dark) as other:
        for name, pose in poses.items():
            pictures = [renderer.frame(Motion.of(weights(**pose))).astype(int) for renderer in (one, other)]
            seen[name] = int((np.abs(pictures[0] - pictures[1]).max(axis=2) > 24).sum())
    assert {name: count for name, count in seen.items() if count > 2} == {}


def test_an_open_mouth_shows_teeth_and_tongue(rig, weights):
    positions, _ = rig.pose(Motion.of(weights(jawOpen=0.8)))
    for name in ("upper-teeth", "lower-teeth", "tongue"):
        span = rig.spans[name]
        ahead = first_skin_ahead(rig, positions, np.arange(span.start, span.stop))
        assert (ahead == 0).sum() > 5, name


def test_the_lower_row_goes_with_the_jaw_and_stays_stiff(rig, weights):
    rest, _ = rig.pose(Motion.of())
    opened, _ = rig.pose(Motion.of(weights(jawOpen=1.0)))
    upper, lower = rig.spans["upper-teeth"], rig.spans["lower-teeth"]
    np.testing.assert_allclose(opened[upper], rest[upper], atol=1e-9)
    assert (opened[lower] - rest[lower])[:, 1].max() < -0.05
    chosen = np.arange(lower.start, lower.stop, 7)
    before, after = (np.linalg.norm(p[chosen, None] - p[chosen], axis=2) for p in (rest, opened))
    apart = before > 0.05
    np.testing.assert_allclose(after[apart], before[apart], rtol=0.05)


def test_the_rows_bite_past_each_other(rig):
    """The lower incisors close behind the upper ones."""
    at = teeth_points(rig.face)
    assert at["9.10"][1] < at["9.11"][1] < at["9.10"][1] + 0.03
    assert 0.02 < at["9.10"][2] - at["9.11"][2] < 0.06


def test_feature_points_are_on_the_teeth(rig):
    at = teeth_points(rig.face)
    assert set(at) == {"9.8", "9.9", "9.10", "9.11"}
    assert all(abs(point[0]) < 1e-9 for point in at.values())
    upper, lower = (surface.vertices for surface in teeth(rig.face))
    for name, row in (("9.8", upper), ("9.10", upper), ("9.9", lower), ("9.11", lower)):
        assert np.linalg.norm(row - at[name], axis=1).min() < 0.03, name
    lowest_upper, highest_lower = upper[:, 1].min(), lower[:, 1].max()
    assert at["9.10"][1] == pytest.approx(lowest_upper, abs=0.005)
    assert at["9.11"][1] == pytest.approx(highest_lower, abs=0.005)
    assert at["9.8"][1] - at["9.10"][1] > at["9.11"][1] - at["9.9"][1] > 0.06


def test_incisors_and_canines_are_in_proportion(rig):
    """Middle incisors are the widest front teeth and taller than wide; canines are wider than what is beside them."""
    at = teeth_points(rig.face)
    upper = teeth(rig.face)[0]
    length = at["9.8"][1] - at["9.10"][1]
    share = (upper.vertices[:, 1] - at["9.10"][1]) / length
    gap = (upper.colour[:, 0] < 0.62) & (upper.colour[:, 1] > 0.30) & (share > 0.11) & (share < 0.19)
    gaps = upper.vertices[gap][:, [0, 2]]
    gaps = gaps[gaps[:, 0] > -1e-9]
    widths = np.linalg.norm(np.diff(gaps[np.argsort(gaps[:, 0])], axis=0), axis=1)
    middle, lateral, canine = widths[:3]
    assert middle > canine > lateral
    assert 0.7 < middle / length < 0.95


def test_the_tongue_lies_within_the_arch(rig):
    rest, _ = rig.pose(Motion.of())
    body, lower = rest[rig.spans["tongue"]], rest[rig.spans["lower-teeth"]]
    lingual = lower[: len(lower) // 10]
    # Above the gum's edge, where there are teeth beside it.
    beside = body[body[:, 1] > lower[:, 1].mean()]
    arch = np.interp(np.abs(beside[:, 0]), *lingual[lingual[:, 0] >= 0][:, [0, 2]].T)
    assert (beside[:, 2] < arch).all()


def test_the_tongue_keeps_its_helpers_vertices(face):
    part, surface = face.parts["tongue"], tongue(face)
    assert len(surface.vertices) == len(part.vertices)
    assert np.linalg.norm(surface.vertices - part.vertices, axis=1).max() < 0.2
    rows = {name: VERTICES[name] - VERTICES["6.1"] + 1 for name in ("6.1", "6.2", "6.3", "6.4")}
    tip = surface.vertices[rows["6.1"]]
    assert tip[2] > surface.vertices[:, 2].max() - 0.02
    assert surface.vertices[rows["6.3"], 0] > 0 > surface.vertices[rows["6.4"], 0]


def test_the_mouth_costs_few_vertices(face):
    assert all(len(surface.vertices) <= 480 for surface in teeth(face))
    assert len(tongue(face).vertices) <= 260
