"""Morph weights: bounded least squares from FAP values, for all frames of a clip at once."""

import numpy as np
from numpy.typing import NDArray

from synth.face.feature_points import PAIRS, VERTICES
from synth.face.rig import Rig
from synth.fap.table import Fap, column, faps

Floats = NDArray[np.float64]

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

# How much a FAP's distance counts, as a factor. Lids are small and their opening is seen at once. A point that is asked
# to stay while its neighbours go may be dragged along a little, as flesh is, and what no PEP drives (depth of lips and
# jaw, cheeks, nose) may be dragged even more.
_LID_COUNT = 3.0
_STAY_COUNT = 0.15
_DRAGGED_COUNT = 0.1
_DRAGGED = frozenset({14, 16, 17, 18, 39, 40, 41, 42, 61, 62, 63})
_REGION_OF_GROUP = {2: "mouth", 8: "mouth", 3: "eyes", 4: "brows", 5: "cheeks", 9: "nose"}

# A smile lifts the cheeks (AU 6 comes with AU 12), which no PEP can say. The cheek's point is asked to go up with the
# corner of the mouth at least so far: cheek FAP, corner FAP, share of the corner's distance.
_LIFTED_CHEEKS = ((41, 12), (42, 13))
_LIFT = 0.6
_LIFT_COUNT = 0.4

# How wide the lips part is seen before all else, so the gaps between inner upper and lower lip points are rows of
# their own: the sum of two FAPs that both close.
_LIP_GAPS = ((4, 5), (8, 10), (9, 11))
_GAP_COUNT = 1.5

# Cost of a weight of 1, as a distance in dm: small, so that it only decides between morphs that do the same. Morphs
# that are no part of an ordinary expression cost more, as those that pull the mouth to one side.
_COST = 0.014
_COST_OF = {
    **dict.fromkeys(("mouthLeft", "mouthRight", "jawLeft", "jawRight", "cheekPuff"), 0.06),
    **dict.fromkeys(("jawForward", "mouthFunnel", "mouthRollUpper"), 0.03),
    **dict.fromkeys(("mouthPucker", "mouthRollLower", "mouthPressLeft", "mouthPressRight"), 0.025),
    # An open mouth shows its lower teeth where these bare them instead of the jaw's going down.
    **dict.fromkeys(("mouthLowerDownLeft", "mouthLowerDownRight"), 0.025),
    **dict.fromkeys(("jawOpen", "mouthSmileLeft", "mouthSmileRight"), 0.006),
}

# A point that a FAP displaces along one axis stays where it is along the others. The morphs are asked to see to it by
# this factor; the bumps do the rest.
_ACROSS_COUNT = 0.3

CORNERS = ("2.4", "2.5", "8.3", "8.4")
"""The corners of the mouth, inner and outer, left and right."""

# Depth that the morphs need not see to: the corners slide round the teeth, and a jaw that turns takes the chin back.
_DEEP = (*CORNERS, "2.1")
_DEPTH_COUNT = 0.2

_FAINT = 0.001
"""Distance in dm, a tenth of a millimetre, at which a FAP begins to count as moving."""

_STEPS = 600
_RELAXATION = 1.6


def moving_faps() -> tuple[Fap, ...]:
    """Return the FAPs that displace a point of the skin for which there are morphs."""
    return tuple(
        fap
        for fap in faps().values()
        if fap.direction is not None
        and fap.group in _REGION_OF_GROUP
        and all(point in VERTICES for point in fap.points)
    )


class MorphSolver:
    """The least-squares problem of one face: ``A w = b`` with rows for FAPs and columns for morphs.

    Attributes
    ----------
    morphs : (M,) int64
        The morphs that it weighs, as rows of the face's.
    """

    def __init__(self, rig: Rig) -> None:
        face, points = rig.face, list(rig.control.names)
        rows = moving_faps()
        names = [name for name in face.morph_names if not name.startswith("eyeLook") and name != "tongueOut"]
        self.morphs = np.array([face.morph_names.index(name) for name in names])
        self._points = np.array([points.index(fap.points[0]) for fap in rows])
        directions = np.array([fap.direction for fap in rows])
        places = _symmetrised(rig.control.reach[self.morphs], points, names)
        reach = np.einsum("mfx,fx->fm", places[:, self._points], directions)
        self._columns = np.array([column(fap.fap) for fap in rows])
        self._steps = rig.units.steps()[self._columns]
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
        self._deep = np.array([points[p] in _DEEP for p, _ in across])
        aside = np.array([places[:, p, axis] for p, axis in across])
        self._reach = np.vstack([reach, self._gaps @ reach, aside])
        self._limit = np.array([_LIMIT_OF.get(name, _LIMIT) for name in names])
        regions = [_REGION_OF_GROUP[fap.group] for fap in rows]
        self._same_region = np.array([[one == other for one in regions] for other in regions], dtype=np.float64)
        self._same_region /= self._same_region.sum(axis=1, keepdims=True)
        self._moving_count = np.array([_count(fap) for fap in rows])
        self._moving_count[self._cheeks] = _LIFT_COUNT
        self._staying_count = np.array([_STAY_COUNT * _count(fap) for fap in rows])

    def solve(self, sequence: Floats, driven: Floats) -> Floats:
        """Return the weights (T, M) of `morphs` for all frames at once.

        Parameters
        ----------
        sequence : (T, 68)
            FAP values.
        driven : (T, P)
            How much each control point is driven, 0 to 1.
        """
        distances = sequence[:, self._columns] * self._steps
        lift = _LIFT * np.maximum(distances[:, self._corners], 0.0)
        distances[:, self._cheeks] = np.maximum(distances[:, self._cheeks], lift)
        counts = np.hstack(
            [
                self._counts(distances),
                np.full((len(distances), len(_LIP_GAPS)), _GAP_COUNT),
                _ACROSS_COUNT * driven[:, self._across] * np.where(self._deep, _DEPTH_COUNT, 1.0),
            ]
        )
        distances = np.hstack([distances, distances @ self._gaps.T, np.zeros((len(distances), len(self._across)))])
        normal = np.einsum("tf,fm,fn->tmn", counts**2, self._reach, self._reach, optimize=True) + self._cost
        wanted = (distances * counts**2) @ self._reach
        return _bounded_least_squares(normal, wanted, self._limit)

    def _counts(self, distances: Floats) -> Floats:
        """Return how much each FAP counts in each frame: (T, F).

        A FAP counts as moving by its share in the mean square of its region. This hardly depends on how far the whole
        region goes, so half the values give half the weights, and an expression grows along a straight line.
        """
        squares = distances**2
        moving: Floats = squares / (squares + squares @ self._same_region.T + _FAINT**2)
        counts: Floats = self._staying_count + (self._moving_count - self._staying_count) * moving
        return counts


def _count(fap: Fap) -> float:
    if fap.fap in _DRAGGED:
        return _DRAGGED_COUNT
    return _LID_COUNT if fap.group == 3 else 1.0


def _symmetrised(reach: Floats, points: list[str], names: list[str]) -> Floats:
    """Average the reach (M, P, 3) with its mirror image: the face units' left and right differ by up to 0.02 dm."""
    across = {left: right for left, right, _, _ in PAIRS} | {right: left for left, right, _, _ in PAIRS}
    mirror_point = [points.index(across.get(point, point)) for point in points]
    mirror_name = [names.index(_other_side(name)) for name in names]
    return (reach + reach[mirror_name][:, mirror_point] * (-1.0, 1.0, 1.0)) / 2.0


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
