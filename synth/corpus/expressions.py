"""A set of measured expressions with, once it is annotated, their PAD."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.measurement import (
    ACII_CODES,
    HUMAN_EYEBALL,
    Landmarks,
    acii_movements,
    measurable_faps,
    measure_faps,
    scaled,
)
from synth.expression.pep import ACII, MTAP

Floats = NDArray[np.float64]

FORMAT = 1
"""Version of the measuring; raise it when the same points give other values."""

SCHEMES = (MTAP, ACII)


@dataclass(frozen=True, eq=False)
class ExpressionSet:
    """N expressions of several people.

    Attributes
    ----------
    name : str
        Name of the set.
    scheme : str
        Whose way of collecting it follows: "mtap2013" or "acii2007".
    samples : tuple of N str
        Name of each expression.
    subjects : tuple of N str
        Who shows it.
    emotions : tuple of N str
        The intended emotion, "" if none.
    displays : tuple of N str
        What is shown, for instance a FACS formula; "" if it is not known.
    landmarks : Landmarks
        The feature points that all is measured on.
    faps : (N, 68) float64
        FAPs in FAPU, see `synth.expression.measurement.measure_faps`.
    measured : tuple of int
        The FAPs that the points tell; the others are 0.
    acii_peps : (N, 12) float64
        The PEPs of ACII 2007, Table 3, each in [-1, 1]: scaled linearly over this set.
    acii_codes : tuple of 12 str
        Their codes.
    pad : (N, 3) float64 or None
        P, A and D: mean over raters, each in [-1, 1]; None before annotation.
    pseudo : bool
        Whether a program made the expressions.
    note : str
        What may be concluded from results on the set.
    eyeball : float
        Radius of the eyeballs as a share of ES, which the measured gaze depends on.
    digest : str
        Sha-256 of who shows what, the points and the PAD.
    """

    name: str
    scheme: str
    samples: tuple[str, ...]
    subjects: tuple[str, ...]
    emotions: tuple[str, ...]
    displays: tuple[str, ...]
    landmarks: Landmarks
    faps: Floats
    measured: tuple[int, ...]
    acii_peps: Floats
    acii_codes: tuple[str, ...]
    pad: Floats | None
    pseudo: bool
    note: str
    eyeball: float
    digest: str

    @classmethod
    def measure(
        cls,
        landmarks: Landmarks,
        *,
        name: str,
        scheme: str,
        samples: Sequence[str],
        subjects: Sequence[str],
        emotions: Sequence[str] | None = None,
        displays: Sequence[str] | None = None,
        pseudo: bool = False,
        note: str = "",
        eyeball: float = HUMAN_EYEBALL,
    ) -> Self:
        """Measure N expressions; the parameters are those of the class.

        Raises
        ------
        SpecError
            If there are no expressions, there are not as many names as expressions, a sample's name comes twice, the
            scheme is unknown, or the points do not do.
        """
        count = len(landmarks)
        if scheme not in SCHEMES:
            raise SpecError(f"Expressions: there is no scheme {scheme!r}; there are {', '.join(SCHEMES)}.")
        if not count:
            raise SpecError("Expressions: the set is empty; at least one expression is needed.")
        columns = {
            "samples": tuple(samples),
            "subjects": tuple(subjects),
            "emotions": tuple(emotions) if emotions is not None else ("",) * count,
            "displays": tuple(displays) if displays is not None else ("",) * count,
        }
        for what, values in columns.items():
            if len(values) != count:
                raise SpecError(f"Expressions: there are {len(values)} {what} for {count} expressions.")
        if len(set(samples)) != count:
            twice = next(sample for k, sample in enumerate(samples) if sample in columns["samples"][:k])
            raise SpecError(f"Expressions: the sample {twice!r} comes twice.")
        return cls(
            name=name,
            scheme=scheme,
            **columns,
            landmarks=landmarks,
            faps=measure_faps(landmarks, eyeball=eyeball),
            measured=measurable_faps(landmarks.points),
            acii_peps=scaled(acii_movements(landmarks)),
            acii_codes=ACII_CODES,
            pad=None,
            pseudo=pseudo,
            note=note,
            eyeball=eyeball,
            digest=_digest(scheme, tuple(columns.values()), landmarks, eyeball, None),
        )

    def with_pad(self, pad: NDArray[np.floating] | Floats) -> Self:
        """Return the set with annotated PAD values (N, 3).

        Raises
        ------
        SpecError
            If the shape is another, or a value is not a number from -1 to 1.
        """
        array = np.array(pad, dtype=np.float64)
        if array.shape != (len(self.samples), 3):
            raise SpecError(f"Expressions: the PAD has shape {array.shape}, but must be ({len(self.samples)}, 3).")
        if not (np.abs(array) <= 1.0).all():
            row, col = np.argwhere(~(np.abs(array) <= 1.0))[0]
            raise SpecError(
                f"Expressions: {'PAD'[col]} of sample {self.samples[row]} is {array[row, col]}, but must be a number "
                "from -1 to 1."
            )
        columns = (self.samples, self.subjects, self.emotions, self.displays)
        return replace(self, pad=array + 0.0, digest=_digest(self.scheme, columns, self.landmarks, self.eyeball, array))

    def __len__(self) -> int:
        return len(self.samples)


def _digest(
    scheme: str,
    columns: tuple[tuple[str, ...], ...],
    landmarks: Landmarks,
    eyeball: float,
    pad: Floats | None,
) -> str:
    # The last digits may differ between machines, so they do not count. What is measured follows from the points.
    places = [np.round(array, 6) + 0.0 for array in (landmarks.neutral, landmarks.apex)]
    values = None if pad is None else (np.round(pad, 6) + 0.0).tolist()
    content = [FORMAT, scheme, columns, landmarks.points, *(array.tolist() for array in places), eyeball, values]
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()
