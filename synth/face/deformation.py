"""From FAP values to the motion of the face: morph weights, a smooth residual, head rotation and gaze.

A FAP says how far a feature point goes along one axis. The morphs whose weights together bring all points nearest to
where their FAPs want them are found by bounded least squares; points whose FAP is 0 are asked to stay. What the morphs
then leave to do at the points that do move is done by bumps (see `synth.face.residual`), so that a point ends where the
standard says; a point whose FAPs are all 0 goes along with its neighbours, as flesh does.
"""

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from synth.face.eyes import PUPIL_RANGE, pupil_diameter
from synth.face.landing import Landing
from synth.face.morph_solver import MorphSolver
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.fap.table import check_sequence, column
from synth.fap.units import ANGLE_UNIT, STEPS

Floats = NDArray[np.float64]

# Gaze moves the eyeballs themselves; these morphs only let the lids follow.
_FOLLOWERS = ("eyeLookUp", "eyeLookDown", "eyeLookIn", "eyeLookOut")
_FOLLOW_ANGLE = 0.6
"""Turn of an eye, in radians, at which its lids have followed all the way."""

_BATCH = 256
"""Frames solved at once: enough to be fast, and few enough that long clips take no more memory than short ones."""


def solve(values: NDArray[np.floating] | Floats, rig: Rig) -> Motion:
    """Find the motion that FAP values ask of a face.

    Each of FAP 3 to 68 takes its feature point as far as value times FAPU along its axis and not along the others
    (ISO/IEC 14496-2, Annex C), but for these limits of flesh: lips and lids that would pass through each other meet
    instead (a lip or lid without a value of its own gives way), closed lids overlap by a tenth of the eye's opening, so
    that no white is seen, and a displacement counts less the further it is below a tenth of a millimetre, so that
    nothing jumps where a value leaves 0.

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
    face, units = rig.face, rig.units
    left = sequence[:, [column(23), column(25)]]
    right = sequence[:, [column(24), column(26)]]
    eyes = np.stack([left, right], axis=1) * ANGLE_UNIT
    weights = np.zeros((len(sequence), len(face.morph_names)))
    _follow_gaze(weights, eyes, face.morph_names)
    morphs, points = MorphSolver(rig), Landing(rig)
    # Clips hold still for long: each different frame is solved once.
    frames, first, place = np.unique(sequence, axis=0, return_index=True, return_inverse=True)
    own_weights, own_residual = weights[first], np.zeros((len(frames), len(rig.control.names), 3))
    # The matrices are small: threads would only wait for each other, and take the cores from those who draw.
    with threadpool_limits(1, user_api="blas"):
        for start in range(0, len(frames), _BATCH):
            batch = slice(start, start + _BATCH)
            targets, driven = points.targets(frames[batch])
            own_weights[batch, morphs.morphs] = morphs.solve(frames[batch], driven)
            own_residual[batch] = points.remaining(targets, driven, own_weights[batch])
    pupil = pupil_diameter(face)
    return Motion(
        weights=own_weights[place.reshape(-1)],
        head=sequence[:, [column(48), column(49), column(50)]] * ANGLE_UNIT,
        eyes=eyes,
        thrust=sequence[:, [column(27), column(28)]] * units.ES / STEPS,
        pupils=np.clip(1.0 + sequence[:, [column(29), column(30)]] * units.IRISD / STEPS / pupil, *PUPIL_RANGE),
        residual=own_residual[place.reshape(-1)],
    )


def _follow_gaze(weights: Floats, eyes: Floats, names: tuple[str, ...]) -> None:
    """Let the lids follow the eyes, in place: the gaze's share of `_FOLLOW_ANGLE` becomes the weight."""
    for eye, side in enumerate(("Left", "Right")):
        yaw, pitch = eyes[:, eye, 0], eyes[:, eye, 1]
        outward = yaw if side == "Left" else -yaw
        for morph, angle in zip(_FOLLOWERS, (-pitch, pitch, -outward, outward), strict=True):
            weights[:, names.index(morph + side)] = np.clip(angle / _FOLLOW_ANGLE, 0.0, 1.0)
