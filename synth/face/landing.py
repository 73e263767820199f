"""Landing: where FAPs want the control points, and what the morphs leave to do to bring them there."""

import numpy as np
from numpy.typing import NDArray

from synth.face.morph_solver import CORNERS
from synth.face.residual import displacing_faps
from synth.face.rig import Rig
from synth.fap.table import column
from synth.fap.units import ANGLE_UNIT, STEPS

Floats = NDArray[np.float64]

# A point counts as driven by the share of its squared distance in the sum of that and the square of this one, in dm: a
# tenth of a millimetre. So nothing jumps when a value leaves 0, and whatever is seen arrives.
_FAINT = 0.001

# An eyeball that stands out pushes its lids before it.
_LIDS_OF_BALL = {27: ("3.1", "3.3"), 28: ("3.2", "3.4")}
_LID_PUSH = 0.9

_LIPS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
_LIDS = ((19, 21), (20, 22))
_LIP_OVERLAP = 0.004
"""How far lips that press on each other sink in; dm."""
_LID_CONTACT, _LID_SEAL = 0.85, 0.10
"""The share of the neutral gap from which closing lids begin to overlap, and by how much of it they do when closed."""


class Landing:
    """Where the control points of one figure are to go, and what the morphs leave to do."""

    def __init__(self, rig: Rig) -> None:
        self._reach, self._kernel = rig.control.reach, rig.control.kernel
        points = rig.control.names
        number = {name: k for k, name in enumerate(points)}
        steps = rig.units.steps()
        self._along = np.zeros((len(steps), len(points), 3))
        for fap in displacing_faps():
            if fap.direction is not None:
                index = column(fap.fap)
                self._along[index, number[fap.points[0]]] = np.multiply(fap.direction, steps[index])
        for ball, lids in _LIDS_OF_BALL.items():
            self._along[column(ball), [number[name] for name in lids], 2] = _LID_PUSH * steps[column(ball)]
        self._corners = np.array([number[name] for name in CORNERS])
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
        driven = squares / (squares + _FAINT**2)
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

    def remaining(self, targets: Floats, driven: Floats, weights: Floats) -> Floats:
        """Return the bumps (T, P, 3) that take the points from where the morphs bring them to their targets.

        Driven points are interpolated exactly; the less a point is driven, the more it goes along with the others.
        Inner lip points always count: what is asked of the gap between them holds though neither is driven.
        """
        reached = np.einsum("tm,mpx->tpx", weights, self._reach, optimize=True)
        missing = targets - reached
        # No FAP says how deep the corners of the mouth lie. Drawn out or up alone they keep their depth, like all
        # points; drawn out and up at once, as in a smile, they may slide back round the teeth, as the morphs have it.
        missing[:, self._corners, 2] *= 1.0 - _diagonal(targets[:, self._corners])
        pinned = np.sqrt(driven)
        wanted = targets[:, self._upper, 1] - targets[:, self._lower, 1]
        opening = reached[:, self._upper, 1] - reached[:, self._lower, 1]
        half = 0.5 * (wanted - opening)
        for own, other, sign in ((self._upper, self._lower, 1.0), (self._lower, self._upper, -1.0)):
            # An undriven lip keeps the wanted distance from a driven one, or goes half the way.
            after = targets[:, other, 1] + sign * wanted - reached[:, own, 1]
            follow = driven[:, other] * after + (1.0 - driven[:, other]) * sign * half
            missing[:, own] *= driven[:, own, None]
            missing[:, own, 1] += (1.0 - driven[:, own]) * follow
            pinned[:, own] = 1.0
        system = pinned[:, :, None] * self._kernel * pinned[:, None, :]
        system += np.eye(len(self._kernel)) * (1.0 - pinned**2)[:, :, None]
        bumps: Floats = pinned[:, :, None] * np.linalg.solve(system, pinned[:, :, None] * missing)
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
