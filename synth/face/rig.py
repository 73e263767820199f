"""The rig: from morph weights, head pose and gaze to the vertices of the whole figure."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial.transform import Rotation

from synth.errors import SpecError
from synth.face.appearance import dress
from synth.face.eyes import EYES, pupil_growth
from synth.face.feature_points import HAIR_TOP, SKULL_TOP, VERTICES, feature_points, skin_rows
from synth.face.mesh import FaceModel
from synth.face.motion import Motion
from synth.face.residual import ControlPoints
from synth.face.tessellation import reduced
from synth.fap.units import FaceUnits

Floats = NDArray[np.float64]

_NEAR_CROWN = 0.15
"""How far from the top of the skull the top of the hair is looked for; dm."""

_NO_TURN = 1e-12
"""Largest angle of the head, in radians, that is taken for none."""

_LID_REACH, _LID_FILM = 1.6, 0.02
"""How far from an eyeball skin counts as its lids, and how far these stay off it, in parts of the ball's radius."""

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
    units : FaceUnits
        The face animation parameter units of the face.
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
    follow : (N, 2) float64
        How much each vertex follows the neck's and the skull's share of the head's rotation, 0 to 1.
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
        self.units = FaceUnits.measure(face)
        self._rest = rest
        faces = np.concatenate([piece.faces + start for piece, start in zip(pieces, starts[:-1], strict=True)])
        self._corners = np.ascontiguousarray(faces.T)
        # One sequential sparse product: the same result on each run, and most morphs move few vertices.
        self._morphs = sparse.csr_array(morphs.reshape(len(morphs), -1).T.astype(np.float64))
        around = sparse.block_diag([piece.around for piece in pieces])
        self._around = sparse.csr_array(around).astype(np.float32)
        self.follow = np.concatenate([surface.follow for surface in surfaces])
        self._pupil_growth = pupil_growth(face)
        self._lids = [self._before_ball(eye) for eye in range(len(EYES))]
        self._turns = _Turns(self.follow, face.pivots["neck"], face.pivots["head"])

    def feature_points(self) -> dict[str, Floats]:
        """Return the neutral positions of all 84 feature points of MPEG-4 on the drawn figure: (3,), dm."""
        bare = feature_points(self.face)
        points = dict(bare)
        skin = [name for name in VERTICES if not name.startswith("6.")]
        points.update(zip(skin, self._rest[self.spans["skin"].start + skin_rows(self.face, skin)], strict=True))
        # The scalp's rows carry the hair's thickness, so the skull lies where the bare face has it.
        points[SKULL_TOP] = bare[SKULL_TOP]
        above = np.hypot(*(self._rest - points[SKULL_TOP])[:, [0, 2]].T) < _NEAR_CROWN
        points[HAIR_TOP] = points[SKULL_TOP] * (1, 0, 1) + (0, self._rest[above, 1].max(), 0)
        return points

    def pose(self, motion: Motion, frame: int = 0) -> tuple[Floats, Floats]:
        """Return positions (N, 3) in dm and unit normals (N, 3) of one frame of a motion.

        Raises
        ------
        SpecError
            If the motion has no such frame, or its residual is not one of this rig's control points.
        """
        points = motion.residual.shape[1]
        if not 0 <= frame < len(motion):
            raise SpecError(f"Motion: there is no frame {frame}; it has {len(motion)}, counted from 0.")
        if points not in {0, len(self.control.names)}:
            raise SpecError(
                f"Motion: the residual has {points} points; it must have {len(self.control.names)}, or none."
            )
        positions = self._rest + (self._morphs @ motion.weights[frame]).reshape(-1, 3)
        if points:
            positions += self.control.basis @ motion.residual[frame]
        for eye, name in enumerate(EYES):
            self._keep_off(positions, eye, motion.thrust[frame, eye])
            span, centre = self.spans[name], self.face.eye_centres[eye]
            turn = Rotation.from_euler("YX", motion.eyes[frame, eye]).as_matrix()
            ball = self._rest[span] - centre + (motion.pupils[frame, eye] - 1.0) * self._pupil_growth
            positions[span] = _times(ball, turn) + centre + (0, 0, motion.thrust[frame, eye])
        positions = self._turns.apply(positions, motion.head[frame])
        return positions, self._normals(positions)

    def _before_ball(self, eye: int) -> tuple[NDArray[np.int64], Floats]:
        """Return the rows of skin and lashes round the front of an eyeball, and how near its centre they may come."""
        centre = self.face.eye_centres[eye]
        ball = np.linalg.norm(self._rest[self.spans[EYES[eye]]] - centre, axis=1).max()
        soft = np.zeros(len(self._rest), dtype=bool)
        for name in ("skin", "left-lashes", "right-lashes"):
            soft[self.spans[name]] = True
        arms = self._rest - centre
        distance = np.linalg.norm(arms, axis=1)
        rows = np.flatnonzero(soft & (arms[:, 2] > 0) & (distance > ball) & (distance < _LID_REACH * ball))
        return rows, np.minimum(distance[rows], (1.0 + _LID_FILM) * ball)

    def _keep_off(self, positions: Floats, eye: int, thrust: float) -> None:
        """Push lids off the eyeball, in place: bumps move them along straight lines, which may lead through it."""
        rows, nearest = self._lids[eye]
        arms = positions[rows] - self.face.eye_centres[eye] - (0, 0, thrust)
        distance = np.sqrt(np.einsum("ij,ij->i", arms, arms))
        inside = distance < nearest
        if inside.any():
            arms, distance, nearest = arms[inside], distance[inside], nearest[inside]
            positions[rows[inside]] += arms * (nearest / np.maximum(distance, 1e-6) - 1.0)[:, None]

    def _normals(self, positions: Floats) -> Floats:
        """Average the faces' area-weighted normals at each vertex."""
        # Half the precision is plenty for shading, and coordinate by coordinate there is less to move.
        corners = [np.take(column, self._corners) for column in positions.T.astype(np.float32)]
        (ux, uy, uz), (vx, vy, vz) = ([place[k + 2] - place[k] for place in corners] for k in (0, 1))
        across = np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)
        normals = np.asarray(self._around @ across, dtype=np.float64)
        lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        normals /= np.maximum(lengths, 1e-12)[:, None]
        return normals


class _Turns:
    """The head's rotation: a share bends the neck above its root, the rest turns the skull on its base."""

    def __init__(self, follow: Floats, neck: Floats, skull: Floats) -> None:
        self._neck, self._skull = neck, skull
        rigid = (follow == 1).all(axis=1)
        still = (follow == 0).all(axis=1)
        self._still, self._bending = np.flatnonzero(still), np.flatnonzero(~rigid & ~still)
        self._share = follow[self._bending]

    def apply(self, positions: Floats, head: Floats) -> Floats:
        """Return the positions (N, 3) after a rotation of the head by pitch, yaw and roll (3,)."""
        # Angles far below what is seen would end in a division by 0.
        if np.abs(head).max() < _NO_TURN:
            return positions
        pitch, yaw, roll = head
        turn = Rotation.from_euler("YXZ", [yaw, pitch, roll]).as_rotvec()
        on_skull, on_neck = (1 - NECK_SHARE) * turn, NECK_SHARE * turn
        # Most of the head follows both fully: one rotation, and one shift.
        first, second = (Rotation.from_rotvec(part).as_matrix() for part in (on_skull, on_neck))
        shift = second @ (self._skull - first @ self._skull - self._neck) + self._neck
        result: Floats = _times(positions, second @ first) + shift
        bent = _rotate(positions[self._bending], self._skull, on_skull, self._share[:, 1])
        result[self._bending] = _rotate(bent, self._neck, on_neck, self._share[:, 0])
        result[self._still] = positions[self._still]
        return result


def _times(points: Floats, matrix: Floats) -> Floats:
    """Multiply each row by a matrix (3, 3). BLAS would start threads for it, which takes longer."""
    x, y, z = points.T
    return np.stack([x * row[0] + y * row[1] + z * row[2] for row in matrix], axis=1)


def _rotate(points: Floats, pivot: Floats, turn: Floats, share: Floats) -> Floats:
    """Rotate each point about ``pivot`` by its share of the rotation vector ``turn`` (Rodrigues' formula)."""
    angle = float(np.linalg.norm(turn))
    axis = turn / angle
    arm = points - pivot
    across = _cross(np.broadcast_to(axis, arm.shape), arm)
    along = np.einsum("ij,j->i", arm, axis)[:, None] * axis
    cosine, sine = np.cos(share * angle)[:, None], np.sin(share * angle)[:, None]
    turned: Floats = pivot + along + cosine * (arm - along) + sine * across
    return turned


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows; a good deal faster than `numpy.cross`."""
    result = np.empty_like(a)
    result[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    result[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    result[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return result
