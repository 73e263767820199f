"""The face's control mesh: head, neck and shoulders of one identity with its morphs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.face.assets import load_compiled
from synth.face.compilation import DELTA_SCALE, JOINTS, MASKS, POSITION_SCALE
from synth.face.identity import DEFAULT_IDENTITY, Identity, find_identity

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Morphs = NDArray[np.float32]

MORPH_NAMES = (
    *("eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft"),
    *("eyeSquintLeft", "eyeWideLeft"),
    *("eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight"),
    *("eyeSquintRight", "eyeWideRight"),
    *("jawForward", "jawLeft", "jawRight", "jawOpen"),
    *("mouthClose", "mouthFunnel", "mouthPucker", "mouthLeft", "mouthRight"),
    *("mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight"),
    *("mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight"),
    *("mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper"),
    *("mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft", "mouthLowerDownRight"),
    *("mouthUpperUpLeft", "mouthUpperUpRight"),
    *("browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    *("cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft", "noseSneerRight", "tongueOut"),
)
"""The 52 ARKit morphs, in Apple's order; Left and Right are the subject's."""

_LID_MIDDLE = 0.06
_LID_OVERLAP = 1.25
"""Half-width in dm of the middle of the eye, and how much further than to touch closed lids move."""

PARTS = (
    *("upper-teeth", "lower-teeth", "tongue"),
    *("l-eyelashes-1", "l-eyelashes-2", "r-eyelashes-1", "r-eyelashes-2"),
)


@dataclass(frozen=True)
class Part:
    """A loose piece: teeth, tongue, lashes.

    Attributes
    ----------
    vertices : (P, 3) float64
        Neutral positions in dm.
    quads : (R, 4) int64
        Counter-clockwise corners, as rows of ``vertices``.
    morphs : (52, P, 3) float32
        Displacements in dm at weight 1.
    """

    vertices: Floats
    quads: Indices
    morphs: Morphs


@dataclass(frozen=True)
class FaceModel:
    """Control mesh of one identity's head, neck and shoulders, not subdivided.

    Lengths are in dm; +y is up, the face looks towards +z, the subject's left is +x.

    Attributes
    ----------
    identity : Identity
        Whose face it is.
    vertices : (V, 3) float64
        Neutral positions.
    base_index : (V,) int64
        Each vertex's number in ``base.obj``, ascending.
    quads : (Q, 4) int64
        Counter-clockwise corners (seen from outside), as rows of ``vertices``.
    morph_names : tuple of 52 str
        ARKit names, see `MORPH_NAMES`.
    morphs : (52, V, 3) float32
        Displacements at weight 1.
    pivots : dict of str to (3,) float64
        Joints: ``jaw``, ``neck``, ``head`` (the skull's base), ``head-2`` (the crown), ``l_eye``, ``r_eye``.
    eye_centres : (2, 3) float64
        Centres of the left and the right eyeball.
    eye_radius : float
        Radius of the eyeballs.
    template : (V, 3) float64
        Positions on the base mesh before any identity: where on the face a vertex is, whoever the face belongs to.
    masks : dict of str to (V,) float64
        How much a vertex belongs to ``lips``, ``eyelids``, ``ears``, ``inside-mouth``; 0 to 1.
    parts : dict of str to Part
        Raw helpers, see `PARTS`; lashes 1 are the lower, 2 the upper ones.
    """

    identity: Identity
    vertices: Floats
    base_index: Indices
    quads: Indices
    morph_names: tuple[str, ...]
    morphs: Morphs
    pivots: Mapping[str, Floats]
    eye_centres: Floats
    eye_radius: float
    template: Floats
    masks: Mapping[str, Floats]
    parts: Mapping[str, Part]


def load_face(face_dir: Path, identity: str = DEFAULT_IDENTITY) -> FaceModel:
    """Load the face of one identity from compiled face data.

    Parameters
    ----------
    face_dir : Path
        Folder made by `synth.face.assets.fetch`.
    identity : str
        A key of `synth.face.identity.IDENTITIES`.

    Raises
    ------
    AssetError
        If the data are missing or damaged, or the identity is unknown.
    """
    chosen = find_identity(identity)
    arrays = load_compiled(face_dir)
    targets = _Targets(arrays)
    template = arrays["position"] * POSITION_SCALE
    shaped = template.copy()
    for name, weight in chosen.targets.items():
        rows, delta = targets[name]
        shaped[rows] += weight * delta
    morphs = np.zeros((len(MORPH_NAMES), *shaped.shape), dtype=np.float32)
    for k, name in enumerate(MORPH_NAMES):
        rows, delta = targets[f"faceunits/{name}"]
        morphs[k, rows] = delta

    _fit_blinks(morphs, arrays, shaped)
    body, quads = _part_rows(arrays["quads_body"])
    pivots = {name.replace("-eye", "_eye"): shaped[arrays[f"cube_{name}"]].mean(axis=0) for name in JOINTS}
    balls = [shaped[np.unique(arrays[f"quads_{side}-eye"])] for side in "lr"]
    centres = np.array([ball.mean(axis=0) for ball in balls])
    return FaceModel(
        identity=chosen,
        vertices=shaped[body],
        base_index=arrays["index"][body].astype(np.int64),
        quads=quads,
        morph_names=MORPH_NAMES,
        morphs=morphs[:, body],
        pivots=pivots,
        eye_centres=centres,
        eye_radius=float(np.median(np.linalg.norm(np.concatenate(balls) - centres.repeat(len(balls[0]), 0), axis=1))),
        template=template[body],
        masks={name: arrays["masks"][k, body] / 255.0 for k, name in enumerate(MASKS)},
        parts={name: _part(arrays[f"quads_{name}"], shaped, morphs) for name in PARTS},
    )


def _fit_blinks(morphs: Morphs, arrays: Mapping[str, NDArray[Any]], shaped: Floats) -> None:
    """Scale the blinks so that the lids of this identity just meet: they were made for the base mesh's wider eyes."""
    for side, name in (("l", "eyeBlinkLeft"), ("r", "eyeBlinkRight")):
        blink = morphs[MORPH_NAMES.index(name)]
        centre = shaped[arrays[f"cube_{side}-eye"]].mean(axis=0)
        lower, upper = (np.unique(arrays[f"quads_{side}-eyelashes-{row}"]) for row in (1, 2))
        # Over the middle of the eye, where the lids are furthest apart.
        lower, upper = (row[np.abs(shaped[row, 0] - centre[0]) < _LID_MIDDLE] for row in (lower, upper))
        roots = [row[np.argmin(np.linalg.norm(shaped[row] - centre, axis=1))] for row in (lower, upper)]
        gap = shaped[roots[1], 1] - shaped[roots[0], 1]
        travel = blink[roots[0], 1] - blink[roots[1], 1]
        blink *= _LID_OVERLAP * gap / travel


class _Targets:
    """The compiled targets by name: rows and displacements in dm."""

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._arrays = arrays
        self._number = {str(name): k for k, name in enumerate(arrays["target_names"])}

    def __getitem__(self, name: str) -> tuple[Indices, Floats]:
        k = self._number[name]
        span = slice(*self._arrays["target_start"][k : k + 2])
        return self._arrays["target_index"][span].astype(np.int64), self._arrays["target_delta"][span] * DELTA_SCALE


def _part_rows(quads: NDArray[Any]) -> tuple[Indices, Indices]:
    """Return the rows that ``quads`` use, ascending, and the quads in terms of them."""
    rows, inverse = np.unique(quads, return_inverse=True)
    return rows.astype(np.int64), inverse.reshape(quads.shape).astype(np.int64)


def _part(quads: NDArray[Any], shaped: Floats, morphs: Morphs) -> Part:
    rows, own = _part_rows(quads)
    return Part(vertices=shaped[rows], quads=own, morphs=morphs[:, rows])
