"""Face animation parameter units (FAPU): what one step of a FAP is on a given face."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.face.feature_points import skin_rows
from synth.face.mesh import FaceModel
from synth.fap.table import FAP_COUNT, column, faps

Floats = NDArray[np.float64]

STEPS = 1024
"""Parts into which each length of the neutral face is divided."""

ANGLE_UNIT = 1e-5
"""One AU, in radians."""


@dataclass(frozen=True, slots=True)
class FaceUnits:
    """The five lengths of a neutral face that scale its FAPs, in dm.

    Attributes
    ----------
    IRISD : float
        Iris diameter, taken as the opening of the lids: 3.1 to 3.3, vertical, mean of both eyes.
    ES : float
        Eye separation: 3.5 to 3.6, horizontal.
    ENS : float
        Eye to nose: 3.5 to 9.15, vertical, mean of both eyes.
    MNS : float
        Mouth to nose: 9.15 to 2.2, vertical.
    MW : float
        Mouth width: 8.3 to 8.4, horizontal.
    """

    IRISD: float
    ES: float
    ENS: float
    MNS: float
    MW: float

    def __post_init__(self) -> None:
        for name in ("IRISD", "ES", "ENS", "MNS", "MW"):
            if not getattr(self, name) > 0.0:
                raise SpecError(f"Face units: {name} is {getattr(self, name)!r} dm, but must be greater than 0.")

    @classmethod
    def measure(cls, face: FaceModel) -> Self:
        """Measure the units on the neutral face (ISO/IEC 14496-2, Annex C)."""
        names = ("3.1", "3.2", "3.3", "3.4", "9.15", "2.2", "8.3", "8.4")
        at = dict(zip(names, face.vertices[skin_rows(face, names)], strict=True))
        # Eyes that look straight ahead have their pupils, 3.5 and 3.6, right before their centres.
        left, right = face.eye_centres
        x, y = 0, 1
        return cls(
            IRISD=float(at["3.1"][y] - at["3.3"][y] + at["3.2"][y] - at["3.4"][y]) / 2.0,
            ES=float(left[x] - right[x]),
            ENS=float((left[y] + right[y]) / 2.0 - at["9.15"][y]),
            MNS=float(at["9.15"][y] - at["2.2"][y]),
            MW=float(at["8.3"][x] - at["8.4"][x]),
        )

    def steps(self) -> Floats:
        """Return what one step of each FAP is: (68,), dm or rad; 0 for the two high-level parameters."""
        size = np.zeros(FAP_COUNT)
        for fap in faps().values():
            if fap.unit is not None:
                size[column(fap.fap)] = ANGLE_UNIT if fap.is_rotation else getattr(self, fap.unit) / STEPS
        return size
