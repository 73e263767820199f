"""The rig: from morph weights, head pose and gaze to the vertices of the whole figure."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial.transform import Rotation

from synth.face.appearance import dress
from synth.face.eyes import EYES, pupil_growth
from synth.face.mesh import FaceModel
from synth.face.motion import Motion
from synth.face.residual import ControlPoints
from synth.face.tessellation import reduced

Floats = NDArray[np.float64]

NECK_SHARE = 0.4
"""Part of the head's rotation that happens along the neck; the rest happens at the base of the skull."""


class Rig:
    """The figure that is drawn: all surfaces in one set of vertices.

    Parameters
    ----------
    face : FaceModel
        The face, see `synth.face.mesh.load_face`.

    Attributes
    ----------
    face : FaceModel
        The same.
    spans : dict of str to slice
        Rows of each surface, by its name.
    control : ControlPoints
        The feature points that FAPs displace.
    rest : (N, 3) float32
        Neutral positions in dm.
    triangles : (T, 3) uint32
        Corners, counter-clockwise from outside.
    uv : (N, 2) float32
        Places on ``texture``.
    gloss : (N, 2) float32
        Strength and exponent of the highlight.
    paint : (N, 4) float32
        Own colour, linear light, multiplied by its cover; then the weight of the texture.
    texture : (H, W, 3) uint8
        The painting of skin, brows and hair, sRGB.
    """

    def __init__(self, face: FaceModel) -> None:
        self.face = face
        dressed, self.texture = dress(face)
        surfaces, pieces = reduced(face, dressed)
        starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
        self.spans = {
            surface.name: slice(int(start), int(end))
            for surface, start, end in zip(surfaces, starts[:-1], starts[1:], strict=True)
        }
        rest = np.concatenate([surface.vertices for surface in surfaces])
        morphs = np.concatenate([surface.morphs for surface in surfaces], axis=1, dtype=np.float32)

        self.rest = rest.astype(np.float32)
        triangles = [piece.triangles + start for piece, start in zip(pieces, starts[:-1], strict=True)]
        self.triangles = np.concatenate(triangles).astype(np.uint32)
        self.uv = np.concatenate([surface.uv for surface in surfaces]).astype(np.float32)
        self.gloss = np.concatenate([surface.gloss for surface in surfaces]).astype(np.float32)
        self.paint = np.concatenate(
            [np.column_stack([s.colour**2 * (s.cover * s.shade)[:, None], (1 - s.cover) * s.shade]) for s in surfaces]
        ).astype(np.float32)
        self.control = ControlPoints(face, surfaces)
        self._rest = rest
        self._quads = np.concatenate([piece.faces + start for piece, start in zip(pieces, starts[:-1], strict=True)])
        # One sequential sparse product: the same result on each run, and most morphs move few vertices.
        self._morphs = sparse.csr_array(morphs.reshape(len(morphs), -1).T.astype(np.float64))
        self._around = sparse.csr_array(sparse.block_diag([piece.around for piece in pieces]))
        follow = np.concatenate([surface.follow for surface in surfaces])
        self._pupil_growth = pupil_growth(face)
        self._turns = _Turns(follow, face.pivots["neck"], face.pivots["head"])

    def pose(self, motion: Motion, frame: int = 0) -> tuple[Floats, Floats]:
        """Return positions (N, 3) in dm and unit normals (N, 3) of one frame of a motion."""
        positions = self._rest + (self._morphs @ motion.weights[frame]).reshape(-1, 3)
        if motion.residual.shape[1]:
            positions += self.control.basis @ motion.residual[frame]
        for eye, name in enumerate(EYES):
            span, centre = self.spans[name], self.face.eye_centres[eye]
            turn = Rotation.from_euler("YX", motion.eyes[frame, eye]).as_matrix()
            ball = self._rest[span] - centre + (motion.pupils[frame, eye] - 1.0) * self._pupil_growth
            positions[span] = ball @ turn.T + centre + (0, 0, motion.thrust[frame, eye])
        positions = self._turns.apply(positions, motion.head[frame])
        return positions, self._normals(positions)

    def _normals(self, positions: Floats) -> Floats:
        """Average the faces' area-weighted normals at each vertex."""
        a, b, c, d = (positions[self._quads[:, k]] for k in range(4))
        normals: Floats = self._around @ _cross(c - a, d - b)
        lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        normals /= np.maximum(lengths, 1e-12)[:, None]
        return normals


class _Turns:
    """The head's rotation: a share bends the neck above its root, the rest turns the skull on its base."""

    def __init__(self, follow: Floats, neck: Floats, skull: Floats) -> None:
        self._neck, self._skull = neck, skull
        self._follow = follow
        self._moving = np.flatnonzero((follow > 0).any(axis=1))

    def apply(self, positions: Floats, head: Floats) -> Floats:
        if not head.any():
            return positions
        pitch, yaw, roll = head
        turn = Rotation.from_euler("YXZ", [yaw, pitch, roll]).as_rotvec()
        moved = positions[self._moving]
        follow = self._follow[self._moving]
        moved = _rotate(moved, self._skull, (1 - NECK_SHARE) * turn, follow[:, 1])
        moved = _rotate(moved, self._neck, NECK_SHARE * turn, follow[:, 0])
        result = positions.copy()
        result[self._moving] = moved
        return result


def _rotate(points: Floats, pivot: Floats, turn: Floats, share: Floats) -> Floats:
    """Rotate each point about ``pivot`` by its share of the rotation vector ``turn`` (Rodrigues' formula)."""
    angle = float(np.linalg.norm(turn))
    axis = turn / angle
    arm = points - pivot
    across = _cross(np.broadcast_to(axis, arm.shape), arm)
    along = (arm @ axis)[:, None] * axis
    cosine, sine = np.cos(share * angle)[:, None], np.sin(share * angle)[:, None]
    return pivot + along + cosine * (arm - along) + sine * across


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows; a good deal faster than `numpy.cross`."""
    result = np.empty_like(a)
    result[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    result[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    result[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return result
