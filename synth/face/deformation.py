"""From FAP values to the motion of the face: morph weights, head rotation and gaze.

A FAP says how far a feature point goes along one axis. The morphs whose weights together bring all points nearest to
where their FAPs want them are found by bounded least squares; points whose FAP is 0 are asked to stay.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.face.feature_points import VERTICES, skin_rows
from synth.face.mesh import FaceModel
from synth.fap.table import Fap, check_sequence, column, faps
from synth.fap.units import ANGLE_UNIT, FaceUnits

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

MAX_WEIGHT = 1.5
"""Largest weight of a morph: the morphs at 1 look weak on video, and bear half as much again."""

# These morphs reach their end at 1: beyond it lids cross and jaws unhinge.
_FULL_AT_ONE = frozenset({"eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthClose", "mouthRollLower", "mouthRollUpper"})

# Gaze moves the eyeballs themselves; these morphs only let the lids follow.
_FOLLOWERS = ("eyeLookUp", "eyeLookDown", "eyeLookIn", "eyeLookOut")
_FOLLOW_ANGLE = 0.6
"""Turn of an eye, in radians, at which its lids have followed all the way."""

# How much a FAP's distance counts. Lids are small and their opening is seen at once. What no PEP drives (depth of lips
# and jaw, cheeks, nose) may be dragged along by the movement of others, as flesh is.
_LID_COUNT = 3.0
_DRAGGED_COUNT = 0.2
_DRAGGED = frozenset({14, 16, 17, 18, 39, 40, 41, 42, 61, 62, 63})

# Cost of a weight of 1, as a distance in dm: small, so that it only decides between morphs that do the same.
_COST = 0.003
_COST_OF = {"cheekPuff": 0.03, "mouthFunnel": 0.01, "mouthRollUpper": 0.01, "mouthRollLower": 0.01}

_STEPS = 600
_RELAXATION = 1.6


@dataclass(frozen=True, eq=False)
class Motion:
    """What the renderer needs for each of T frames.

    Attributes
    ----------
    weights : (T, 52) float64
        Morph weights in the face's order, 0 to `MAX_WEIGHT`.
    head : (T, 3) float64
        Pitch (down positive), yaw (to the subject's left positive) and roll (to the subject's right positive), rad.
    eyes : (T, 2, 2) float64
        Left and right eye: yaw (to the subject's left positive) and pitch (down positive), rad.
    """

    weights: Floats
    head: Floats
    eyes: Floats


def solve(values: NDArray[np.floating] | Floats, face: FaceModel) -> Motion:
    """Find the motion that FAP values ask of a face.

    Parameters
    ----------
    values : (T, 68)
        FAP values in FAPU, see `synth.fap.table`. The ears, the tongue, the depth of the eyeballs, the size of the
        pupils and the two high-level parameters have no morphs and are left out.
    face : FaceModel
        The face, whose own feature points and units count.

    Returns
    -------
    Motion
        With ``weights`` that minimise, over 0 <= w <= w_max, the sum of the squared distances along the FAPs'
        directions and a small cost of the weights.

    Raises
    ------
    SpecError
        If ``values`` is not a finite (T, 68) array.
    """
    sequence = check_sequence(values)
    system = _System(face)
    weights = np.zeros((len(sequence), len(face.morph_names)))
    weights[:, system.morphs] = system.solve(sequence)
    head = sequence[:, [column(48), column(49), column(50)]] * ANGLE_UNIT
    left = sequence[:, [column(23), column(25)]]
    right = sequence[:, [column(24), column(26)]]
    eyes = np.stack([left, right], axis=1) * ANGLE_UNIT
    _follow_gaze(weights, eyes, face.morph_names)
    return Motion(weights=weights, head=head, eyes=eyes)


def moving_faps() -> tuple[Fap, ...]:
    """Return the FAPs that displace a point of the skin for which there are morphs."""
    return tuple(
        fap
        for fap in faps().values()
        if fap.direction is not None and fap.group != 10 and all(point in VERTICES for point in fap.points)
        if not fap.name.count("tongue")
    )


class _System:
    """The least-squares problem of one face: ``A w = b`` with rows for FAPs and columns for morphs."""

    def __init__(self, face: FaceModel) -> None:
        rows = moving_faps()
        names = [name for name in face.morph_names if not name.startswith("eyeLook") and name != "tongueOut"]
        self.morphs = np.array([face.morph_names.index(name) for name in names])
        points = skin_rows(face, [fap.points[0] for fap in rows])
        directions = np.array([fap.direction for fap in rows])
        reach = np.einsum("mfx,fx->fm", face.morphs[self.morphs][:, points].astype(np.float64), directions)
        self._columns = np.array([column(fap.fap) for fap in rows])
        reach = _symmetrised(reach, rows, names)
        counts = np.array([_count(fap) for fap in rows])
        self._wanted = FaceUnits.measure(face).steps()[self._columns] * counts**2
        costs = np.array([_COST_OF.get(name, _COST) for name in names])
        self._normal = reach.T @ (reach * counts[:, None] ** 2) + np.diag(costs**2)
        self._reach = reach
        self._limit = np.array([1.0 if name in _FULL_AT_ONE else MAX_WEIGHT for name in names])

    def solve(self, sequence: Floats) -> Floats:
        """Return the weights (T, M) of the system's morphs for all frames at once."""
        wanted = (sequence[:, self._columns] * self._wanted) @ self._reach
        return _bounded_least_squares(self._normal, wanted, self._limit)


def _count(fap: Fap) -> float:
    if fap.fap in _DRAGGED:
        return _DRAGGED_COUNT
    return _LID_COUNT if fap.group == 3 else 1.0


def _symmetrised(reach: Floats, rows: tuple[Fap, ...], names: list[str]) -> Floats:
    """Average the reach with its mirror image: the face units' left and right differ by up to 0.02 dm."""
    numbers = [fap.fap for fap in rows]
    mirror_row = [numbers.index(fap.mirror or fap.fap) for fap in rows]
    mirror_name = [names.index(_other_side(name)) for name in names]
    # Seen in a mirror left is right, so a parameter on the middle line that moves sideways changes its sign.
    sideways = np.array([-1.0 if fap.mirror is None and fap.positive in {"left", "right"} else 1.0 for fap in rows])
    return (reach + sideways[:, None] * reach[np.ix_(mirror_row, mirror_name)]) / 2.0


def _other_side(name: str) -> str:
    if name.endswith("Left"):
        return name.removesuffix("Left") + "Right"
    return name.removesuffix("Right") + "Left" if name.endswith("Right") else name


def _bounded_least_squares(normal: Floats, wanted: Floats, limit: Floats) -> Floats:
    """Minimise ``w N w / 2 - wanted w`` over 0 <= w <= limit for every row of ``wanted``: (T, M) to (T, M).

    The alternating direction method of multipliers with over-relaxation (Boyd et al. 2011, section 3.4.3) solves all
    rows together with one factorisation; a fixed number of steps makes the result a pure function of the input.
    """
    spectrum, basis = np.linalg.eigh(normal)
    # The geometric mean of the extreme eigenvalues is the penalty with the best guaranteed rate.
    penalty = float(np.sqrt(spectrum[0] * spectrum[-1]))
    inverse = (basis / (spectrum + penalty)) @ basis.T
    bounded = np.zeros_like(wanted)
    dual = np.zeros_like(wanted)
    for _ in range(_STEPS):
        free = (wanted + penalty * (bounded - dual)) @ inverse
        relaxed = _RELAXATION * free + (1.0 - _RELAXATION) * bounded
        bounded = np.clip(relaxed + dual, 0.0, limit)
        dual += relaxed - bounded
    return bounded


def _follow_gaze(weights: Floats, eyes: Floats, names: tuple[str, ...]) -> None:
    """Let the lids follow the eyes, in place: the gaze's share of `_FOLLOW_ANGLE` becomes the weight."""
    for eye, side in enumerate(("Left", "Right")):
        yaw, pitch = eyes[:, eye, 0], eyes[:, eye, 1]
        outward = yaw if side == "Left" else -yaw
        for morph, angle in zip(_FOLLOWERS, (-pitch, pitch, -outward, outward), strict=True):
            weights[:, names.index(morph + side)] = np.clip(angle / _FOLLOW_ANGLE, 0.0, 1.0)
