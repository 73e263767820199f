"""glTF: a figure and its motion as one GLB file that a standard viewer plays.

The mesh has the 52 ARKit morphs as targets, then one for each pupil that changes its size and a few for what the
motion's residual adds. The head turns by the joints ``neck``, ``skull`` and ``throat``, the eyes by joints of their
own. Lengths are in metres, as the format asks.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from synth.errors import SpecError
from synth.face.eyes import EYES
from synth.face.mesh import MORPH_NAMES
from synth.face.motion import MORPHS, Motion
from synth.face.rig import NECK_SHARE, Rig
from synth.files import write_whole
from synth.interchange.glb import INDICES, VERTICES, GlbBuilder

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

METRE = 0.1
"""One dm, the rig's unit, in metres."""

MAX_COMPONENTS = 12
"""Most targets that the residual may take."""

TOLERANCE = 1e-3
"""How far control points may be from where the residual takes them before one more target is added; dm (0.1 mm)."""

JOINTS = ("root", "neck", "skull", "throat", *EYES)
"""The throat turns with the skull but does not bend with the neck, as what lies below the chin does."""

_PUPILS = ("pupilLeft", "pupilRight")
# Displacements and changes of normals too small to be seen are left out, which halves the file.
_SMALLEST_MOVE, _SMALLEST_TILT = 2e-6, 4e-3


def write_gltf(path: Path, rig: Rig, motion: Motion, *, fps: float) -> None:
    """Write a figure and its animation as a GLB file, which appears complete or not at all.

    Parameters
    ----------
    path : Path
        The file; its folder must exist.
    rig : Rig
        The figure.
    motion : Motion
        Its motion, at least one frame.
    fps : float
        Frames per second.

    Raises
    ------
    SpecError
        If the motion has no frames, or the rate is not above 0.
    VideoError
        If the file cannot be written.
    """
    if not len(motion):
        raise SpecError("glTF: the motion has no frames; give at least one.")
    if not 0 < fps < float("inf"):
        raise SpecError(f"glTF: {fps} frames per second are impossible; give a number above 0.")
    targets = _Targets(rig, motion)
    builder = GlbBuilder()
    document = builder.document
    document["asset"] |= {
        "generator": "padlab",
        "copyright": "Face data: MakeHuman, CC0 1.0",
        "extras": {"identity": rig.face.identity.name},
    }
    document["scene"] = 0
    document["scenes"] = [{"nodes": [0, 1]}]
    document["nodes"] = [{"name": "figure", "mesh": 0, "skin": 0}, *_joint_nodes(rig)]
    document["skins"] = [_skin(builder, rig)]
    _add_mesh(builder, rig, targets)
    document["animations"] = [_animation(builder, rig, motion, targets, fps)]
    write_whole(path, builder.to_bytes())


class _Targets:
    """The morph targets: displacements, normals and weights over time."""

    def __init__(self, rig: Rig, motion: Motion) -> None:
        self.rest, self.normals = rig.pose(Motion.of())
        self.names = list(MORPH_NAMES)
        columns = [motion.weights]
        shapes = [rig.pose(Motion.of(weights)) for weights in np.eye(MORPHS)]
        # The rig moves a pupil along a line from its neutral size, so one step tells the way.
        for eye, name in enumerate(_PUPILS):
            growth = motion.pupils[:, eye] - 1.0
            if growth.any():
                pupils = np.ones((1, 2))
                pupils[0, eye] += 0.5
                positions, normals = rig.pose(replace(Motion.of(), pupils=pupils))
                shapes.append((self.rest + 2 * (positions - self.rest), normals))
                self.names.append(name)
                columns.append(growth[:, None])
        parts, courses = _components(rig, motion.residual)
        for k, part in enumerate(parts, start=1):
            shapes.append(rig.pose(replace(Motion.of(), residual=part[None])))
            self.names.append(f"residual{k}")
        columns.append(courses)
        self.moves = [(positions - self.rest) * METRE for positions, _ in shapes]
        self.tilts = [normals - self.normals for _, normals in shapes]
        self.weights = np.hstack(columns)


def _components(rig: Rig, residual: Floats) -> tuple[list[Floats], Floats]:
    """Split residuals (T, P, 3) into K displacements (P, 3) and their courses (T, K), as few as leave no visible error.

    The principal components of the displacement field, weighted by what each control point moves on the mesh.
    """
    frames, points = residual.shape[:2]
    none: tuple[list[Floats], Floats] = ([], np.zeros((frames, 0)))
    if not residual.any():
        return none
    basis = rig.control.basis
    spectrum, vectors = np.linalg.eigh((basis.T @ basis).toarray())
    root = np.sqrt(np.maximum(spectrum, spectrum[-1] * 1e-12))
    moved = np.einsum("ip,tpx->tix", root[:, None] * vectors.T, residual).reshape(frames, -1)
    courses, sizes, fields = np.linalg.svd(moved, full_matrices=False)
    parts = [(vectors / root) @ field.reshape(points, 3) for field in fields[:MAX_COMPONENTS]]
    courses = courses * sizes
    left, count = residual.copy(), 0
    while count < len(parts) and _farthest(rig.control.kernel, left) > TOLERANCE:
        left -= courses[:, count, None, None] * parts[count]
        count += 1
    # A largest weight of 1 suits the sliders of viewers.
    reach = np.abs(courses[:, :count]).max(axis=0)
    return [part * size for part, size in zip(parts, reach, strict=False)], courses[:, :count] / reach


def _farthest(kernel: Floats, residual: Floats) -> float:
    """Return the largest displacement of any control point in any frame, in dm."""
    return float(np.linalg.norm(np.einsum("qp,tpx->tqx", kernel, residual), axis=2).max())


def _joint_nodes(rig: Rig) -> list[dict[str, Any]]:
    """Return the joints in the order of `JOINTS`, as nodes that follow the figure's own node."""
    places = _joint_places(rig)
    parents = {"neck": "root", "skull": "neck", "throat": "root", **dict.fromkeys(EYES, "skull")}
    nodes: list[dict[str, Any]] = []
    for joint in JOINTS:
        node: dict[str, Any] = {"name": joint}
        if joint in parents:
            node["translation"] = (places[joint] - places[parents[joint]]).tolist()
        children = [1 + JOINTS.index(child) for child, parent in parents.items() if parent == joint]
        if children:
            node["children"] = children
        nodes.append(node)
    return nodes


def _joint_places(rig: Rig) -> dict[str, Floats]:
    """Return where the joints are, in metres."""
    pivots = rig.face.pivots
    places = [np.zeros(3), pivots["neck"], pivots["head"], pivots["head"], *rig.face.eye_centres]
    return {joint: place * METRE for joint, place in zip(JOINTS, places, strict=True)}


def _skin(builder: GlbBuilder, rig: Rig) -> dict[str, Any]:
    inverse = np.tile(np.eye(4, dtype=np.float32), (len(JOINTS), 1, 1))
    # Matrices lie column after column, so the translation is the last row here.
    inverse[:, 3, :3] = [-place for place in _joint_places(rig).values()]
    joints = [1 + k for k in range(len(JOINTS))]
    return {"name": "head", "joints": joints, "skeleton": 1, "inverseBindMatrices": builder.accessor(inverse)}


def _skinning(rig: Rig) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the joints and their weights of each vertex, twice (N, 4).

    The rig turns a place by its shares of two angles, the format blends the positions that whole turns give. At the
    corners, where a share is 0 or 1, both are the same; between them the weights are bilinear.
    """
    # The third digit is far below what is seen, and vertices that follow fully or not at all then have one joint.
    neck, skull = np.round(rig.follow, 3).T
    weights = np.column_stack([(1 - neck) * (1 - skull), neck * (1 - skull), neck * skull, (1 - neck) * skull])
    weights = weights.astype(np.float32)
    joints = np.where(weights > 0, np.arange(4), 0).astype(np.uint8)
    for name in EYES:
        joints[rig.spans[name]] = (JOINTS.index(name), 0, 0, 0)
        weights[rig.spans[name]] = (1, 0, 0, 0)
    return joints, weights


def _head_rotations(head: Floats) -> tuple[Rotation, Rotation]:
    """Return the rotations of neck and skull for pitch, yaw and roll (T, 3), as the rig shares them."""
    turn = Rotation.from_euler("YXZ", head[:, [1, 0, 2]]).as_rotvec()
    return Rotation.from_rotvec(NECK_SHARE * turn), Rotation.from_rotvec((1 - NECK_SHARE) * turn)


def _add_mesh(builder: GlbBuilder, rig: Rig, targets: _Targets) -> None:
    """Add the mesh with one primitive for each surface, two where part of it hides the painting."""
    colours, ratio = _colours(rig)
    picture = iio.imwrite("<bytes>", rig.texture, extension=".png")
    joints, weights = _skinning(rig)
    document = builder.document
    document["images"] = [{"name": "painting", "mimeType": "image/png", "bufferView": builder.view(picture)}]
    document["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]
    document["textures"] = [{"source": 0, "sampler": 0}]
    document["materials"] = []
    painted = (ratio <= 1.0).all(axis=1) & (rig.paint[:, 3] > 0)
    a, b, c = rig.triangles.T
    # Where quads end in a point, one of their two triangles has no area.
    corners = rig.triangles[(a != b) & (b != c) & (c != a)].astype(np.int64)
    primitives = []
    for name, span in rig.spans.items():
        own = corners[(corners[:, 0] >= span.start) & (corners[:, 0] < span.stop)]
        on_painting = painted[own].all(axis=1)
        for textured, triangles in ((True, own[on_painting]), (False, own[~on_painting])):
            if not len(triangles):
                continue
            rows, places = np.unique(triangles, return_inverse=True)
            attributes = _vertices(builder, rig, targets, rows)
            attributes["JOINTS_0"] = builder.accessor(joints[rows], target=VERTICES)
            attributes["WEIGHTS_0"] = builder.accessor(weights[rows], target=VERTICES)
            tint = np.rint(65535 * np.clip((ratio if textured else colours)[rows], 0.0, 1.0))
            opaque = np.column_stack([tint, np.full(len(rows), 65535)]).astype(np.uint16)
            attributes["COLOR_0"] = builder.accessor(opaque, target=VERTICES, normalized=True)
            if textured:
                # The format counts from the upper border of the picture, the rig from the lower one.
                uv = np.column_stack([rig.uv[rows, 0], 1.0 - rig.uv[rows, 1]]).astype(np.float32)
                attributes["TEXCOORD_0"] = builder.accessor(uv, target=VERTICES)
            document["materials"].append(_material(name, rig.gloss[rows], textured=textured))
            narrow = places.reshape(-1).astype(np.uint16 if len(rows) < 2**16 else np.uint32)
            primitives.append(
                {
                    "attributes": attributes,
                    "indices": builder.accessor(narrow, target=INDICES),
                    "material": len(document["materials"]) - 1,
                    "targets": _primitive_targets(builder, targets, rows),
                }
            )
    document["meshes"] = [
        {
            "name": rig.face.identity.name,
            "primitives": primitives,
            "weights": [0.0] * len(targets.names),
            "extras": {"targetNames": targets.names},
        }
    ]


def _vertices(builder: GlbBuilder, rig: Rig, targets: _Targets, rows: Indices) -> dict[str, int]:
    positions = (targets.rest[rows] * METRE).astype(np.float32)
    return {
        "POSITION": builder.accessor(positions, target=VERTICES, bounds=True),
        "NORMAL": builder.accessor(targets.normals[rows].astype(np.float32), target=VERTICES),
    }


def _primitive_targets(builder: GlbBuilder, targets: _Targets, rows: Indices) -> list[dict[str, int]]:
    """Return the targets of some vertices; those that none of them follows share one accessor of zeros."""
    nothing = builder.zeros(len(rows))
    found = []
    for moves, tilts in zip(targets.moves, targets.tilts, strict=True):
        own, tilt = moves[rows].astype(np.float32), tilts[rows].astype(np.float32)
        still = (np.abs(own) < _SMALLEST_MOVE).all()
        found.append(
            {
                "POSITION": nothing if still else builder.sparse(own, smallest=_SMALLEST_MOVE),
                "NORMAL": nothing if still else builder.sparse(tilt, smallest=_SMALLEST_TILT),
            }
        )
    return found


def _colours(rig: Rig) -> tuple[Floats, Floats]:
    """Return each vertex's colour and the factor of the painting that shows it, twice (N, 3), linear light."""
    height, width = rig.texture.shape[:2]
    # The painting at the vertices, between the centres of its pixels.
    at = [(1.0 - rig.uv[:, 1]) * height - 0.5, rig.uv[:, 0] * width - 0.5]
    painting = np.moveaxis(rig.texture / 255.0, 2, 0)
    texel = np.stack([map_coordinates(layer, at, order=1, mode="nearest") for layer in painting], axis=1)
    # The rig's light is the square of sRGB; viewers use the true curve.
    wanted = _linear(np.sqrt(rig.paint[:, :3] + rig.paint[:, 3:] * texel**2))
    return wanted, wanted / np.maximum(_linear(texel), 1e-6)


def _linear(colour: Floats) -> Floats:
    """Return linear light of sRGB values from 0 to 1 (IEC 61966-2-1)."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def _material(name: str, gloss: NDArray[np.float32], *, textured: bool) -> dict[str, Any]:
    # Blinn's exponent n is 2 / roughness^4 - 2 in the format's terms.
    roughness = float((2.0 / (float(gloss[:, 1].mean()) + 2.0)) ** 0.25)
    surface: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": round(roughness, 3)}
    if textured:
        surface["baseColorTexture"] = {"index": 0}
    return {"name": name if textured else f"{name}-own-colour", "pbrMetallicRoughness": surface}


def _animation(builder: GlbBuilder, rig: Rig, motion: Motion, targets: _Targets, fps: float) -> dict[str, Any]:
    """Return the animation: a key for each frame."""
    times = builder.accessor((np.arange(len(motion)) / fps).astype(np.float32), bounds=True)
    neck, skull = _head_rotations(motion.head)
    tracks: list[tuple[int, str, Floats]] = [(0, "weights", targets.weights.reshape(-1))]
    for joint, turn in (("neck", neck), ("skull", skull), ("throat", skull)):
        tracks.append((1 + JOINTS.index(joint), "rotation", turn.as_quat()))
    for eye, name in enumerate(EYES):
        node = 1 + JOINTS.index(name)
        tracks.append((node, "rotation", Rotation.from_euler("YX", motion.eyes[:, eye]).as_quat()))
        if motion.thrust[:, eye].any():
            at = np.array(builder.document["nodes"][node]["translation"])
            forward = np.array([0.0, 0.0, METRE])
            tracks.append((node, "translation", at + motion.thrust[:, eye, None] * forward))
    animation: dict[str, Any] = {"name": "clip", "channels": [], "samplers": []}
    for node, path, values in tracks:
        output = builder.accessor(values.astype(np.float32))
        animation["samplers"].append({"input": times, "interpolation": "LINEAR", "output": output})
        sampler = len(animation["samplers"]) - 1
        animation["channels"].append({"sampler": sampler, "target": {"node": node, "path": path}})
    return animation
