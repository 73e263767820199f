"""From FAP values to the motion of the face: morph weights, a smooth residual, head rotation and gaze.

A FAP says how far a feature point goes along one axis. The morphs whose weights together bring all points nearest to
where their FAPs want them are found by bounded least squares; points whose FAP is 0 are asked to stay. What the morphs
then leave to do at the points that do move is done by bumps (see `synth.face.residual`), so that a point ends where the
standard says; a point whose FAPs are all 0 goes along with its neighbours, as flesh does.
"""

import numpy as np
from numpy.typing import NDArray

from synth.face.eyes import PUPIL
from synth.face.feature_points import VERTICES
from synth.face.motion import Motion
from synth.face.residual import displacing_faps
from synth.face.rig import Rig
from synth.fap.table import Fap, check_sequence, column, faps
from synth.fap.units import ANGLE_UNIT, STEPS, FaceUnits

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

PUPIL_RANGE = (0.5, 1.6)
"""Narrowest and widest pupil, as a multiple of the neutral one."""

MAX_WEIGHT = 2.0
"""Largest weight of any morph."""

# At 1 the morphs look weak on video, and most bear half as much again; the inner brow bears twice as much. Beyond the
# lower limits lids cross, jaws unhinge and cheeks crease like paper.
_LIMIT = 1.5
_LIMIT_OF = {
    "browInnerUp": MAX_WEIGHT,
    **dict.fromkeys(("eyeBlinkLeft", "eyeBlinkRight", "cheekSquintLeft", "cheekSquintRight"), 1.0),
    **dict.fromkeys(("jawOpen", "mouthClose", "mouthRollLower", "mouthRollUpper"), 1.0),
    **dict.fromkeys(("mouthSmileLeft", "mouthSmileRight"), 1.0),
}

# Gaze moves the eyeballs themselves; these morphs only let the lids follow.
_FOLLOWERS = ("eyeLookUp", "eyeLookDown", "eyeLookIn", "eyeLookOut")
_FOLLOW_ANGLE = 0.6
"""Turn of an eye, in radians, at which its lids have followed all the way."""

# How much a FAP's distance counts, as a factor. Lids are small and their opening is seen at once. A point that is asked
# to stay while its neighbours go may be dragged along a little, as flesh is, and what no PEP drives (depth of lips and
# jaw, cheeks, nose) may be dragged even more.
_LID_COUNT = 3.0
_STAY_COUNT = 0.15
_DRAGGED_COUNT = 0.1
_DRAGGED = frozenset({14, 16, 17, 18, 39, 40, 41, 42, 61, 62, 63})
_REGION_OF_GROUP = {2: "mouth", 8: "mouth", 3: "eyes", 4: "brows", 5: "cheeks", 9: "nose"}

# A smile lifts the cheeks (AU 6 comes with AU 12), which no PEP can say. Where the cheek's FAP is 0, its point is asked
# to go up with the corner of the mouth: cheek FAP, corner FAP, share of the corner's distance.
_LIFTED_CHEEKS = ((41, 12), (42, 13))
_LIFT = 0.6
_LIFT_COUNT = 0.4

# How wide the lips part is seen before all else, so the gaps between inner upper and lower lip points are rows of
# their own: the sum of two FAPs that both close.
_LIP_GAPS = ((4, 5), (8, 10), (9, 11))
_GAP_COUNT = 1.5

# Cost of a weight of 1, as a distance in dm: small, so that it only decides between morphs that do the same. Morphs
# that are no part of an ordinary expression cost more, as those that pull the mouth to one side.
_COST = 0.008
_COST_OF = {
    **dict.fromkeys(("mouthLeft", "mouthRight", "jawLeft", "jawRight"), 0.06),
    **dict.fromkeys(("cheekPuff", "jawForward", "mouthFunnel", "mouthRollUpper"), 0.03),
    **dict.fromkeys(("mouthPucker", "mouthRollLower"), 0.015),
    **dict.fromkeys(("mouthLowerDownLeft", "mouthLowerDownRight"), 0.008),
}

# A point that a FAP displaces along one axis stays where it is along the others. The morphs are asked to see to it by
# this factor; the bumps do the rest.
_ACROSS_COUNT = 0.3

# A point counts as driven by the share of its squared distance in the sum of that and this part of the mean square of
# all points: nearly fully unless it moves far less than the rest, and not at all if it does not move.
_FAINT = 0.02

# No FAP says how deep the corners of the mouth lie. Drawn out or up alone they keep their depth, like all points; drawn
# out and up at once, as in a smile, they may slide back round the teeth, as the morphs have it.
_CORNER_DEPTH = 0.3
_CORNERS = ("2.4", "2.5", "8.3", "8.4")

_LIPS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
_LIDS = ((19, 21), (20, 22))
_LIP_OVERLAP = 0.004
"""How far lips that press on each other sink in; dm."""
_LID_CONTACT, _LID_SEAL = 0.85, 0.10
"""The share of the neutral gap from which closing lids begin to overlap, and by how much of it they do when closed."""

_STEPS = 600
_RELAXATION = 1.6
_BATCH = 256
"""Frames solved at once: enough to be fast, and few enough that long clips take no more memory than short ones."""


def solve(values: NDArray[np.floating] | Floats, rig: Rig) -> Motion:
    """Find the motion that FAP values ask of a face.

    Each of FAP 3 to 68 takes its feature point as far as value times FAPU, exactly, along its axis and not along the
    others, with these limits of flesh: lips and lids that would pass through each other meet instead (a lip or lid
    without a value of its own gives way), and closed lids overlap by a tenth of the eye's opening, so that no white is
    seen.

    Parameters
    ----------
    values : (T, 68)
        FAP values in FAPU, see `synth.fap.table`. The two high-level parameters are left out.
    rig : Rig
        The figure, whose own feature points and units count.

    Returns
    -------
    Motion
        With ``weights`` that minimise, over 0 <= w <= w_max, the sum of the squared distances along the FAPs'
        directions and a small cost of the weights, and the ``residual`` that remains.

    Raises
    ------
    SpecError
        If ``values`` is not a finite (T, 68) array.
    """
    sequence = check_sequence(values)
    face, units = rig.face, FaceUnits.measure(rig.face)
    left = sequence[:, [column(23), column(25)]]
    right = sequence[:, [column(24), column(26)]]
    eyes = np.stack([left, right], axis=1) * ANGLE_UNIT
    weights = np.zeros((len(sequence), len(face.morph_names)))
    _follow_gaze(weights, eyes, face.morph_names)
    morphs, points = _System(rig), _Residual(rig)
    residual = np.zeros((len(sequence), len(rig.control.names), 3))
    # Clips hold still for long: each different frame is solved once.
    frames, first, place = np.unique(sequence, axis=0, return_index=True, return_inverse=True)
    own_weights, own_residual = weights[first], residual[first]
    for start in range(0, len(frames), _BATCH):
        batch = slice(start, start + _BATCH)
        targets, driven = points.targets(frames[batch])
        own_weights[batch, morphs.morphs] = morphs.solve(frames[batch], driven)
        own_residual[batch] = points.remaining(targets, driven, own_weights[batch])
    pupil = 2.0 * face.eye_radius * np.sin(PUPIL)
    return Motion(
        weights=own_weights[place.reshape(-1)],
        head=sequence[:, [column(48), column(49), column(50)]] * ANGLE_UNIT,
        eyes=eyes,
        thrust=sequence[:, [column(27), column(28)]] * units.ES / STEPS,
        pupils=np.clip(1.0 + sequence[:, [column(29), column(30)]] * units.IRISD / STEPS / pupil, *PUPIL_RANGE),
        residual=own_residual[place.reshape(-1)],
    )


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

    def __init__(self, rig: Rig) -> None:
        face, points = rig.face, list(rig.control.names)
        rows = moving_faps()
        names = [name for name in face.morph_names if not name.startswith("eyeLook") and name != "tongueOut"]
        self.morphs = np.array([face.morph_names.index(name) for name in names])
        self._points = np.array([points.index(fap.points[0]) for fap in rows])
        directions = np.array([fap.direction for fap in rows])
        reach = np.einsum("mfx,fx->fm", rig.control.reach[self.morphs][:, self._points], directions)
        self._columns = np.array([column(fap.fap) for fap in rows])
        reach = _symmetrised(reach, rows, names)
        self._steps = FaceUnits.measure(face).steps()[self._columns]
        costs = np.array([_COST_OF.get(name, _COST) for name in names])
        self._cost = np.diag(costs**2)
        numbers = [fap.fap for fap in rows]
        self._cheeks, self._corners = np.array([[numbers.index(fap) for fap in pair] for pair in _LIFTED_CHEEKS]).T
        self._gaps = np.zeros((len(_LIP_GAPS), len(rows)))
        for k, pair in enumerate(_LIP_GAPS):
            self._gaps[k, [numbers.index(fap) for fap in pair]] = 1.0
        moved = {(points.index(fap.points[0]), int(np.abs(fap.direction or (0,)).argmax())) for fap in rows}
        across = [
            (p, axis) for p in dict.fromkeys(self._points.tolist()) for axis in range(3) if (p, axis) not in moved
        ]
        self._across = np.array([p for p, _ in across])
        self._deep = np.array([points[p] in _CORNERS for p, _ in across])
        aside = np.array([rig.control.reach[self.morphs, p, axis] for p, axis in across])
        self._reach = np.vstack([reach, self._gaps @ reach, aside])
        self._limit = np.array([_LIMIT_OF.get(name, _LIMIT) for name in names])
        regions = [_REGION_OF_GROUP[fap.group] for fap in rows]
        self._same_region = np.array([[one == other for one in regions] for other in regions], dtype=np.float64)
        self._same_region /= self._same_region.sum(axis=1, keepdims=True)
        self._moving_count = np.array([_count(fap) for fap in rows])
        self._moving_count[self._cheeks] = _LIFT_COUNT
        self._staying_count = np.array([_STAY_COUNT * _count(fap) for fap in rows])

    def solve(self, sequence: Floats, driven: Floats) -> Floats:
        """Return the weights (T, M) of the system's morphs for all frames at once.

        Parameters
        ----------
        sequence : (T, 68)
            FAP values.
        driven : (T, P)
            How much each control point is driven, 0 to 1.
        """
        distances = sequence[:, self._columns] * self._steps
        still = distances[:, self._cheeks] == 0.0
        distances[:, self._cheeks] += still * _LIFT * np.maximum(distances[:, self._corners], 0.0)
        counts = np.hstack(
            [
                self._counts(distances),
                np.full((len(distances), len(_LIP_GAPS)), _GAP_COUNT),
                _ACROSS_COUNT * driven[:, self._across] * np.where(self._deep, _CORNER_DEPTH, 1.0),
            ]
        )
        distances = np.hstack([distances, distances @ self._gaps.T, np.zeros((len(distances), len(self._across)))])
        normal = np.einsum("tf,fm,fn->tmn", counts**2, self._reach, self._reach, optimize=True) + self._cost
        wanted = (distances * counts**2) @ self._reach
        return _bounded_least_squares(normal, wanted, self._limit)

    def _counts(self, distances: Floats) -> Floats:
        """Return how much each FAP counts in each frame: (T, F).

        A FAP counts as moving by its share in the mean square of its region. This does not depend on how far the whole
        region goes, so half the values give half the weights, and an expression grows along a straight line.
        """
        squares = distances**2
        moving: Floats = squares / np.maximum(squares + squares @ self._same_region.T, 1e-30)
        counts: Floats = self._staying_count + (self._moving_count - self._staying_count) * moving
        return counts


class _Residual:
    """Where the control points of one figure are to go, and what the morphs leave to do."""

    def __init__(self, rig: Rig) -> None:
        self._reach, self._kernel = rig.control.reach, rig.control.kernel
        points = rig.control.names
        number = {name: k for k, name in enumerate(points)}
        steps = FaceUnits.measure(rig.face).steps()
        self._along = np.zeros((len(steps), len(points), 3))
        for fap in displacing_faps():
            if fap.direction is not None:
                index = column(fap.fap)
                self._along[index, number[fap.points[0]]] = np.multiply(fap.direction, steps[index])
        self._corners = np.array([number[name] for name in _CORNERS])
        self._upper, self._lower = np.array([[number[name] for name in pair] for pair in _LIPS]).T
        self._borders = np.array([number["6.3"], number["6.4"]])
        tongue = rig.rest[rig.control.rows[self._borders]].astype(np.float64)
        self._half_width = 0.5 * (tongue[0, 0] - tongue[1, 0])

    def targets(self, sequence: Floats) -> tuple[Floats, Floats]:
        """Return where the points are to go, (T, P, 3) in dm, and how much each is driven, (T, P) from 0 to 1."""
        targets = np.einsum("tf,fpx->tpx", _meeting_lids(sequence), self._along, optimize=True)
        angle = sequence[:, column(47), None] * ANGLE_UNIT
        # FAP 47 turns the tongue's borders up about its middle.
        targets[:, self._borders, 0] -= np.array([1.0, -1.0]) * self._half_width * (1.0 - np.cos(angle))
        targets[:, self._borders, 1] += self._half_width * np.sin(angle)
        squares = (targets**2).sum(axis=2)
        driven = squares / np.maximum(squares + _FAINT * squares.mean(axis=1, keepdims=True), 1e-30)
        self._let_lips_meet(targets, driven)
        return targets, driven

    def _let_lips_meet(self, targets: Floats, driven: Floats) -> None:
        """Let lips that would pass through each other share the way to where they meet, in place."""
        up, low = targets[:, self._upper, 1], targets[:, self._lower, 1]
        excess = np.maximum(low - up - _LIP_OVERLAP, 0.0)
        # Whichever is not driven gives way.
        yields = np.stack([1.0 - driven[:, self._upper], 1.0 - driven[:, self._lower]]) + 1e-6
        yields /= yields.sum(axis=0)
        targets[:, self._upper, 1] += yields[0] * excess
        targets[:, self._lower, 1] -= yields[1] * excess
        touching = np.where(excess > 0.0, np.maximum(driven[:, self._upper], driven[:, self._lower]), 0.0)
        for side in (self._upper, self._lower):
            driven[:, side] = np.maximum(driven[:, side], touching)

    def remaining(self, targets: Floats, driven: Floats, weights: Floats) -> Floats:
        """Return the bumps (T, P, 3) that take the points from where the morphs bring them to their targets.

        Driven points are interpolated exactly; the less a point is driven, the more it goes along with the others.
        Inner lip points always count: what is asked of the gap between them holds though neither is driven.
        """
        reached = np.einsum("tm,mpx->tpx", weights, self._reach, optimize=True)
        missing = driven[:, :, None] * (targets - reached)
        missing[:, self._corners, 2] *= 1.0 - _diagonal(targets[:, self._corners])
        pinned = driven.copy()
        wanted = targets[:, self._upper, 1] - targets[:, self._lower, 1]
        opening = reached[:, self._upper, 1] - reached[:, self._lower, 1]
        half = 0.5 * (wanted - opening)
        for own, other, sign in ((self._upper, self._lower, 1.0), (self._lower, self._upper, -1.0)):
            # An undriven lip keeps the wanted distance from a driven one, or goes half the way.
            after = targets[:, other, 1] + sign * wanted - reached[:, own, 1]
            follow = driven[:, other] * after + (1.0 - driven[:, other]) * sign * half
            missing[:, own, 1] += (1.0 - driven[:, own]) * follow
            pinned[:, own] = 1.0
        count = pinned[:, :, None] * self._kernel * pinned[:, None, :]
        count += np.eye(len(self._kernel)) * (1.0 - pinned**2)[:, :, None]
        bumps: Floats = pinned[:, :, None] * np.linalg.solve(count, pinned[:, :, None] * missing)
        return bumps


def _diagonal(displacements: Floats) -> Floats:
    """Return how evenly displacements (..., 3) go sideways and up or down at once: 0 along an axis, 1 half-way."""
    x, y = displacements[..., 0] ** 2, displacements[..., 1] ** 2
    even: Floats = 4.0 * x * y / np.maximum((x + y) ** 2, 1e-30)
    return even


def _meeting_lids(sequence: Floats) -> Floats:
    """Return FAPs whose lids meet rather than cross, and overlap a little once they are closed."""
    result = sequence.copy()
    for upper, lower in _LIDS:
        pair = [column(upper), column(lower)]
        closing = sequence[:, pair].sum(axis=1) / STEPS
        t = np.clip((closing - _LID_CONTACT) / (1.0 - _LID_CONTACT), 0.0, 1.0)
        sealed = np.minimum(closing, 1.0) + _LID_SEAL * t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
        parts = np.maximum(sequence[:, pair], 0.0)
        share = parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-30)
        result[:, pair] += share * ((sealed - closing) * STEPS * (closing > _LID_CONTACT))[:, None]
    return result


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
    """Minimise ``w N w / 2 - b w`` over 0 <= w <= limit for each of T problems.

    The alternating direction method of multipliers with over-relaxation (Boyd et al. 2011, section 3.4.3) solves all
    problems together; a fixed number of steps makes the result a pure function of the input.

    Parameters
    ----------
    normal : (T, M, M)
        Symmetric positive definite matrices N.
    wanted : (T, M)
        Right-hand sides b.
    limit : (M,)
        Upper bounds.

    Returns
    -------
    (T, M) float64
        The weights.
    """
    spectrum, basis = np.linalg.eigh(normal)
    # The geometric mean of the extreme eigenvalues is the penalty with the best guaranteed rate.
    penalty = np.sqrt(spectrum[:, :1] * spectrum[:, -1:])
    inverse = (basis / (spectrum + penalty)[:, None, :]) @ basis.transpose(0, 2, 1)
    bounded = np.zeros_like(wanted)
    dual = np.zeros_like(wanted)
    for _ in range(_STEPS):
        free = (inverse @ (wanted + penalty * (bounded - dual))[:, :, None])[:, :, 0]
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
