"""Motion: what the rig needs to know of each frame."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]

MORPHS = 52


@dataclass(frozen=True, eq=False)
class Motion:
    """The pose of a face in each of T frames.

    Attributes
    ----------
    weights : (T, 52) float64
        Morph weights in the face's order, usually 0 to 1.
    head : (T, 3) float64
        Pitch (down positive), yaw (to the subject's left positive) and roll (to the subject's right positive), rad.
    eyes : (T, 2, 2) float64
        Left and right eye: yaw (to the subject's left positive) and pitch (down positive), rad.
    thrust : (T, 2) float64
        How far the left and the right eyeball stand out, dm.
    pupils : (T, 2) float64
        Diameter of the left and the right pupil as a multiple of the neutral one.
    residual : (T, P, 3) float64
        What the morphs leave to do at each of the rig's control points, dm; see `synth.face.residual`.
        P may be 0: then nothing.

    Raises
    ------
    SpecError
        If an array has the wrong shape or a value that is not finite.
    """

    weights: Floats
    head: Floats
    eyes: Floats
    thrust: Floats
    pupils: Floats
    residual: Floats

    def __post_init__(self) -> None:
        frames = len(self.weights)
        shapes = {"weights": (MORPHS,), "head": (3,), "eyes": (2, 2), "thrust": (2,), "pupils": (2,)}
        for field in fields(self):
            array: Floats = getattr(self, field.name)
            expected = (frames, *shapes.get(field.name, (*array.shape[1:2], 3)))
            if array.shape != expected:
                raise SpecError(f"Motion: {field.name} has the shape {array.shape}; it must be {expected}.")
            if not np.isfinite(array).all():
                raise SpecError(f"Motion: {field.name} holds a value that is not a finite number.")

    @classmethod
    def of(
        cls, weights: ArrayLike | None = None, *, head: ArrayLike = (0, 0, 0), eyes: ArrayLike = ((0, 0), (0, 0))
    ) -> Self:
        """Return one frame of the given weights (52,), rotation (3,) and gaze (2, 2); by default the neutral face."""
        given = np.zeros(MORPHS) if weights is None else weights, head, eyes
        own_weights, own_head, own_eyes = (np.asarray(part, dtype=np.float64)[None] for part in given)
        return cls(own_weights, own_head, own_eyes, np.zeros((1, 2)), np.ones((1, 2)), np.zeros((1, 0, 3)))

    def __len__(self) -> int:
        return len(self.weights)

    def __getitem__(self, span: slice) -> Self:
        return type(self)(*(getattr(self, field.name)[span] for field in fields(self)))

    def changes(self) -> NDArray[np.bool_]:
        """Tell for each frame whether it differs from the one before; the first does (T,)."""
        changed = np.zeros(len(self), dtype=bool)
        changed[:1] = True
        for field in fields(self):
            rows = getattr(self, field.name)
            changed[1:] |= (rows[1:] != rows[:-1]).any(axis=tuple(range(1, rows.ndim)))
        return changed
