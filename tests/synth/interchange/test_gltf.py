"""GLB files, read back by a strict loader that knows the format's rules and nothing of how padlab writes it."""

import io
import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from synth.clip_spec import ClipSpec
from synth.errors import SpecError, VideoError
from synth.face.deformation import solve
from synth.face.mesh import MORPH_NAMES
from synth.face.motion import Motion
from synth.fap.table import column
from synth.interchange.gltf import MAX_COMPONENTS, write_gltf
from synth.plan import plan_clip

TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
STILL_TOLERANCE = 0.0015
"""dm (0.15 mm): what the residual's components leave, and displacements that are left out."""
LID_TOLERANCE = 0.02
"""dm (2 mm): what lids lack that an eyeball pushes, which no morph can say."""
TURNED_TOLERANCE = 0.005
"""dm (0.5 mm): what blending whole turns of the head differs from sharing their angles, where the neck bends."""


class Glb:
    """A GLB file; every rule that is broken is an assertion that fails."""

    def __init__(self, content: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack_from("<I4s", content, 12)
        assert kind == b"JSON"
        assert size % 4 == 0
        self.document: dict[str, Any] = json.loads(content[20 : 20 + size])
        start = 20 + size
        size, kind = struct.unpack_from("<I4s", content, start)
        assert kind == b"BIN\0"
        assert size % 4 == 0
        assert start + 8 + size == len(content)
        self.binary = content[start + 8 :]
        assert self.document["asset"]["version"] == "2.0"
        assert self.document["buffers"] == [{"byteLength": len(self.binary)}]
        for view in self.document["bufferViews"]:
            assert view["buffer"] == 0
            assert view["byteOffset"] % 4 == 0
            assert view["byteLength"] > 0
            assert view["byteOffset"] + view["byteLength"] <= len(self.binary)
        self.arrays = [self._array(accessor) for accessor in self.document["accessors"]]
        self._check_nodes()

    def view(self, number: int, *, target: int | None = None) -> bytes:
        view = self.document["bufferViews"][number]
        assert "byteStride" not in view
        assert view.get("target") == target
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def _array(self, accessor: dict[str, Any]) -> np.ndarray:
        kind, width, count = np.dtype(TYPES[accessor["componentType"]]), SIZES[accessor["type"]], accessor["count"]
        assert count > 0
        values = np.zeros((count, width), dtype=kind)
        if "bufferView" in accessor:
            target = self.document["bufferViews"][accessor["bufferView"]].get("target")
            content = self.view(accessor["bufferView"], target=target)
            assert len(content) == count * width * kind.itemsize
            assert target != 34962 or width * kind.itemsize % 4 == 0
            values = np.frombuffer(content, dtype=kind).reshape(count, width)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            index_kind = np.dtype(TYPES[sparse["indices"]["componentType"]])
            rows = np.frombuffer(self.view(sparse["indices"]["bufferView"]), dtype=index_kind).astype(int)
            changed = np.frombuffer(self.view(sparse["values"]["bufferView"]), dtype=kind).reshape(-1, width)
            assert len(rows) == len(changed) == sparse["count"] > 0
            assert (np.diff(rows) > 0).all()
            assert rows[-1] < count
            values = values.copy()
            values[rows] = changed
        if "min" in accessor:
            np.testing.assert_array_equal(np.array(accessor["min"], dtype=kind), values.min(axis=0))
            np.testing.assert_array_equal(np.array(accessor["max"], dtype=kind), values.max(axis=0))
        assert np.isfinite(values).all()
        return values.astype(np.float64) / (np.iinfo(kind).max if accessor.get("normalized") else 1)

    def _check_nodes(self) -> None:
        nodes = self.document["nodes"]
        children = [child for node in nodes for child in node.get("children", [])]
        assert len(children) == len(set(children)), "a node has two parents"
        roots = self.document["scenes"][self.document["scene"]]["nodes"]
        assert sorted(children + roots) == list(range(len(nodes))), "a node is in no tree or is a child and a root"

    def bounds(self, accessor: int) -> bool:
        return {"min", "max"} <= set(self.document["accessors"][accessor])

    def world(self, pose: dict[tuple[int, str], np.ndarray]) -> list[np.ndarray]:
        """The nodes' matrices with some properties replaced."""
        nodes = self.document["nodes"]
        matrices: list[np.ndarray] = [np.eye(4)] * len(nodes)
        reached = []

        def visit(number: int, parent: np.ndarray) -> None:
            reached.append(number)
            local = np.eye(4)
            local[:3, 3] = pose.get((number, "translation"), nodes[number].get("translation", np.zeros(3)))
            local[:3, :3] = Rotation.from_quat(pose.get((number, "rotation"), [0, 0, 0, 1])).as_matrix()
            matrices[number] = parent @ local
            for child in nodes[number].get("children", []):
                visit(child, matrices[number])

        for root in self.document["scenes"][0]["nodes"]:
            visit(root, np.eye(4))
        assert len(reached) == len(nodes)
        return matrices

    def animated(self, frame: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Morph weights and nodes' matrices at a key of the animation."""
        (animation,) = self.document["animations"]
        pose: dict[tuple[int, str], np.ndarray] = {}
        targets = [(channel["target"]["node"], channel["target"]["path"]) for channel in animation["channels"]]
        assert len(targets) == len(set(targets))
        for target, channel in zip(targets, animation["channels"], strict=True):
            sampler = animation["samplers"][channel["sampler"]]
            assert sampler["interpolation"] == "LINEAR"
            times, values = self.arrays[sampler["input"]][:, 0], self.arrays[sampler["output"]]
            assert self.bounds(sampler["input"])
            assert times[0] == 0
            assert (np.diff(times) > 0).all()
            values = values.reshape(len(times), -1)
            assert values.shape[1] == {"rotation": 4, "translation": 3}.get(target[1], len(self.target_names))
            if target[1] == "rotation":
                np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
                assert (np.einsum("ti,ti->t", values[1:], values[:-1]) > 0).all(), "the long way round"
            pose[target] = values[frame]
        return pose.pop((0, "weights")), self.world(pose)

    @property
    def target_names(self) -> list[str]:
        names: list[str] = self.document["meshes"][0]["extras"]["targetNames"]
        return names

    def places(self, primitive: dict[str, Any], weights: np.ndarray, matrices: list[np.ndarray]) -> np.ndarray:
        """A primitive's vertices, morphed and skinned."""
        (skin,) = self.document["skins"]
        attributes = {name: self.arrays[number] for name, number in primitive["attributes"].items()}
        assert len({len(values) for values in attributes.values()}) == 1
        assert self.bounds(primitive["attributes"]["POSITION"])
        np.testing.assert_allclose(np.linalg.norm(attributes["NORMAL"], axis=1), 1.0, atol=1e-3)
        points = attributes["POSITION"].copy()
        assert len(primitive["targets"]) == len(weights) == len(self.document["meshes"][0]["weights"])
        for target, weight in zip(primitive["targets"], weights, strict=True):
            assert self.bounds(target["POSITION"])
            assert len(self.arrays[target["POSITION"]]) == len(self.arrays[target["NORMAL"]]) == len(points)
            points += weight * self.arrays[target["POSITION"]]
        inverse = self.arrays[skin["inverseBindMatrices"]].reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = np.array([matrices[node] for node in skin["joints"]]) @ inverse
        shares, which = attributes["WEIGHTS_0"], attributes["JOINTS_0"].astype(int)
        np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-6)
        assert which.max() < len(joints)
        assert (which[shares == 0] == 0).all()
        blended = np.einsum("nk,nkij->nij", shares, joints[which])
        return np.einsum("nij,nj->ni", blended, np.column_stack([points, np.ones(len(points))]))[:, :3]


@pytest.fixture(scope="module")
def faps() -> np.ndarray:
    """Five seconds of a smile with speech-like jaw, a turning head, wandering eyes and growing pupils."""
    values = plan_clip(ClipSpec(pad=(0.55, 0.24, 0.28), hold_s=4.1)).faps
    t = np.arange(len(values)) / 25
    for fap, course in {3: 120 * np.sin(9 * t) ** 2, 23: 15000 * np.sin(3 * t), 24: 15000 * np.sin(3 * t)}.items():
        values[:, column(fap)] += course
    for fap, reach in {48: 12000, 49: 17000, 50: 9000, 27: 40, 28: 40, 29: 40, 30: 40}.items():
        values[:, column(fap)] += reach * np.sin(t + fap)
    return values


@pytest.fixture(scope="module")
def motion(faps, rig) -> Motion:
    return solve(faps, rig)


@pytest.fixture(scope="module")
def written(motion, rig, tmp_path_factory) -> bytes:
    path: Path = tmp_path_factory.mktemp("gltf") / "clip.glb"
    write_gltf(path, rig, motion, fps=25)
    assert [file.name for file in path.parent.iterdir()] == ["clip.glb"]
    return path.read_bytes()


def distances(glb: Glb, rig, motion: Motion, frame: int) -> np.ndarray:
    """How far each written vertex is from the nearest of the rig's vertices that rest where it rests, in dm."""
    weights, matrices = glb.animated(frame)
    posed, _ = rig.pose(motion, frame)
    by_place = cKDTree(rig.rest)
    found = []
    for primitive in glb.document["meshes"][0]["primitives"]:
        at_rest = 10 * glb.places(primitive, np.zeros(len(weights)), glb.world({}))
        moved = 10 * glb.places(primitive, weights, matrices)
        for rows, place in zip(by_place.query_ball_point(at_rest, 1e-5), moved, strict=True):
            assert rows, "a vertex that the rig does not have"
            found.append(np.linalg.norm(posed[rows] - place, axis=1).min())
    return np.array(found)


@pytest.mark.parametrize("frame", [0, 40, 77, 124])
def test_the_animation_moves_the_mesh_as_the_rig_does(written, rig, motion, frame):
    off = distances(Glb(written), rig, motion, frame)
    assert off.max() < LID_TOLERANCE
    assert np.quantile(off, 0.99) < TURNED_TOLERANCE
    assert np.median(off) < STILL_TOLERANCE / 2


def test_without_turns_of_the_head_places_agree_to_a_tenth_of_a_millimetre(rig, motion, tmp_path):
    still = replace(motion, head=np.zeros_like(motion.head))[40:80]
    write_gltf(tmp_path / "still.glb", rig, still, fps=25)
    off = distances(Glb((tmp_path / "still.glb").read_bytes()), rig, still, 20)
    assert np.quantile(off, 0.99) < STILL_TOLERANCE
    assert off.max() < LID_TOLERANCE


def test_every_drawn_triangle_is_there_once_and_has_an_area(written, rig):
    glb = Glb(written)
    corners = 0
    for primitive in glb.document["meshes"][0]["primitives"]:
        assert (
            glb.document["bufferViews"][glb.document["accessors"][primitive["indices"]]["bufferView"]]["target"]
            == 34963
        )
        triangles = glb.arrays[primitive["indices"]].astype(int).reshape(-1, 3)
        assert set(triangles.ravel()) == set(range(len(glb.arrays[primitive["attributes"]["POSITION"]])))
        assert (triangles != np.roll(triangles, 1, axis=1)).all()
        corners += len(triangles)
    a, b, c = rig.triangles.T
    assert corners == ((a != b) & (b != c) & (c != a)).sum()


def test_targets_have_arkits_names_and_the_residual_few_more(written, motion):
    names = Glb(written).target_names
    assert tuple(names[:52]) == MORPH_NAMES
    assert names[52:54] == ["pupilLeft", "pupilRight"]
    assert motion.residual.any()
    assert names[54:] == [f"residual{k}" for k in range(1, len(names) - 53)]
    assert 1 <= len(names) - 54 <= MAX_COMPONENTS


def test_the_weights_are_the_motions(written, motion):
    glb = Glb(written)
    for frame in (0, 60, 124):
        weights, _ = glb.animated(frame)
        np.testing.assert_allclose(weights[:52], motion.weights[frame], atol=1e-6)
        np.testing.assert_allclose(weights[52:54], motion.pupils[frame] - 1, atol=1e-6)
    sampler = glb.document["animations"][0]["samplers"][0]
    np.testing.assert_allclose(glb.arrays[sampler["input"]][:, 0], np.arange(125) / 25, atol=1e-6)


def test_the_painting_is_whole_and_the_right_way_up(written, rig):
    glb = Glb(written)
    (image,) = glb.document["images"]
    assert image["mimeType"] == "image/png"
    picture = iio.imread(io.BytesIO(glb.view(image["bufferView"])))
    np.testing.assert_array_equal(picture, rig.texture)
    skin = glb.document["meshes"][0]["primitives"][0]
    places, uv, tint = (glb.arrays[skin["attributes"][name]] for name in ("POSITION", "TEXCOORD_0", "COLOR_0"))
    height, width = picture.shape[:2]
    column, row = np.clip((uv * (width, height)).astype(int), 0, (width - 1, height - 1)).T
    shown = tint[:, :3] * (picture[row, column] / 255.0) ** 2.2
    face = (np.abs(places[:, 0]) < 0.03) & (places[:, 2] > 0.1)
    eye_line = rig.face.eye_centres[:, 1].mean() / 10
    forehead = shown[face & (np.abs(places[:, 1] - eye_line - 0.04) < 0.01)].mean(axis=0)
    shirt = shown[places[:, 1] < rig.face.pivots["neck"][1] / 10 - 0.03].mean(axis=0)
    assert forehead[0] > forehead[1] > forehead[2]
    assert shirt[2] > shirt[0]


def test_a_clip_of_five_seconds_stays_small(written):
    assert len(written) < 8e6


def test_equal_motions_give_equal_bytes(written, rig, motion, tmp_path):
    write_gltf(tmp_path / "again.glb", rig, motion, fps=25)
    assert (tmp_path / "again.glb").read_bytes() == written


def test_one_frame_without_residual_is_enough(rig, weights, tmp_path):
    motion = Motion.of(weights(mouthSmile=0.8, jawOpen=0.3), head=(0.1, -0.1, 0.05), eyes=((0.2, 0.1), (0.2, 0.1)))
    write_gltf(tmp_path / "one.glb", rig, motion, fps=30)
    glb = Glb((tmp_path / "one.glb").read_bytes())
    assert tuple(glb.target_names) == MORPH_NAMES
    assert distances(glb, rig, motion, 0).max() < TURNED_TOLERANCE


def test_what_cannot_be_written_is_told(rig, tmp_path):
    with pytest.raises(SpecError, match="no frames"):
        write_gltf(tmp_path / "a.glb", rig, Motion.of()[:0], fps=25)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(SpecError, match="frames per second"):
            write_gltf(tmp_path / "a.glb", rig, Motion.of(), fps=fps)
    with pytest.raises(VideoError, match="missing"):
        write_gltf(tmp_path / "missing" / "a.glb", rig, Motion.of(), fps=25)
    assert list(tmp_path.iterdir()) == []
