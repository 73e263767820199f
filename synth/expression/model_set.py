"""A set of trained models in one file: the three PAD to PEP models, the PEP to FAP translation, and how they came."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.calibration import CalibratedModel, Calibration
from synth.expression.inverse import PepPadModel
from synth.expression.network import NetworkModel
from synth.expression.pad_pep import LinearModel, PadPepModel, QuadraticModel
from synth.expression.pep import MTAP, peps
from synth.expression.pep_fap import PepFapModel
from synth.files import write_whole

Floats = NDArray[np.float64]

FORMAT = 1
FILE_NAME = "models.json"
"""What the file of a set is called in its folder."""

KINDS = ("ann", "linear", "quadratic")
"""The PAD to PEP models of a set: neural networks, AMMSE, second-order polynomial."""


_CALIBRATION = ("pad_mean", "reliability", "pep_mean", "gain")


@dataclass(frozen=True, eq=False)
class ModelSet:
    """Models trained on one set of expressions.

    Attributes
    ----------
    ann : NetworkModel
        Nine neural networks (MTAP 2013, Eqs. 8-11).
    linear : LinearModel
        The AMMSE (MTAP 2013, Eqs. 5-7).
    quadratic : QuadraticModel
        The polynomial (ACII 2007, Eq. 3).
    pep_fap : PepFapModel
        The translation learned on the same expressions (MTAP 2013, Eqs. 3 and 4).
    pep_pad : PepPadModel
        The way back.
    calibrations : dict of str to Calibration
        How each of `KINDS` is spread when faces are drawn by it.
    origin : dict
        How the set was made, as plain JSON values: data, digest, seed, splits, and the errors found.
    """

    ann: NetworkModel
    linear: LinearModel
    quadratic: QuadraticModel
    pep_fap: PepFapModel
    pep_pad: PepPadModel
    calibrations: dict[str, Calibration]
    origin: dict[str, Any] = field(default_factory=dict)

    def pad_pep(self, kind: str) -> PadPepModel:
        """Return one of `KINDS`."""
        models: dict[str, PadPepModel] = {"ann": self.ann, "linear": self.linear, "quadratic": self.quadratic}
        if kind not in models:
            raise SpecError(f"There is no kind of model {kind!r}; there are {', '.join(KINDS)}.")
        return models[kind]

    def for_drawing(self, kind: str) -> CalibratedModel:
        """Return one of `KINDS` as faces are drawn by it."""
        return CalibratedModel(self.pad_pep(kind), self.calibrations[kind])

    def to_json(self) -> str:
        """Return the set as JSON; numbers keep all their digits."""
        parts = {
            "format": FORMAT,
            "origin": self.origin,
            "pep_fap": {"scheme": self.pep_fap.scheme, **_lists(self.pep_fap, "plus", "minus")},
            "pep_pad": _lists(self.pep_pad, "coefficients", "rmse", "correlation"),
            "linear": _lists(self.linear, "T", "V"),
            "quadratic": _lists(self.quadratic, "coefficients"),
            "ann": _lists(self.ann, "W1", "b1", "w2", "b2"),
            "calibrations": {kind: _lists(self.calibrations[kind], *_CALIBRATION) for kind in KINDS},
        }
        # One line for each part keeps changes of the file readable.
        lines = [f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in parts.items()]
        return "{\n" + ",\n".join(lines) + "\n}\n"

    @classmethod
    def from_json(cls, text: str, *, source: str) -> Self:
        """Make a set of JSON.

        Raises
        ------
        SpecError
            If it is not a set of models; the message names ``source``.
        """
        try:
            parts = json.loads(text)
            made_as = parts["format"]
            models = cls._of_parts(parts) if made_as == FORMAT else None
        except SpecError as error:
            raise SpecError(f"{source}: {error}") from error
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            raise SpecError(f"{source} is not a set of trained models ({type(error).__name__}: {error}).") from error
        if models is None:
            raise SpecError(f"{source} has the format {made_as!r}, but this padlab reads {FORMAT}.")
        models._check(source)
        return models

    @classmethod
    def _of_parts(cls, parts: Mapping[str, Any]) -> Self:
        arrays = {
            kind: {name: np.array(values, dtype=np.float64) for name, values in parts[kind].items() if name != "scheme"}
            for kind in ("pep_fap", "pep_pad", *KINDS)
        }
        return cls(
            ann=NetworkModel.of(**arrays["ann"]),
            linear=LinearModel(**arrays["linear"]),
            quadratic=QuadraticModel(**arrays["quadratic"]),
            pep_fap=PepFapModel(parts["pep_fap"]["scheme"], **arrays["pep_fap"]),
            pep_pad=PepPadModel(**arrays["pep_pad"]),
            calibrations={
                kind: Calibration(**{name: np.array(parts["calibrations"][kind][name]) for name in _CALIBRATION})
                for kind in KINDS
            },
            origin={**parts["origin"]},
        )

    def _check(self, source: str) -> None:
        if self.pep_fap.scheme != MTAP:
            raise SpecError(f"{source}: the PEPs must be those of {MTAP!r}, not of {self.pep_fap.scheme!r}.")
        count = len(peps(MTAP))
        shapes = {
            "linear T": (self.linear.T, (count, 3)),
            "linear V": (self.linear.V, (count,)),
            "quadratic coefficients": (self.quadratic.coefficients, (7, count)),
            "ann b2": (self.ann.b2, (count,)),
            "pep_pad coefficients": (self.pep_pad.coefficients, (2 * count + 1, 3)),
            "pep_pad rmse": (self.pep_pad.rmse, (3,)),
            **{f"{kind} gain": (own.gain, (count,)) for kind, own in self.calibrations.items()},
        }
        for name, (values, shape) in shapes.items():
            if values.shape != shape or not np.isfinite(values).all():
                raise SpecError(f"{source}: {name}, of shape {values.shape}, must be finite numbers of shape {shape}.")

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read a set from a file.

        Raises
        ------
        SpecError
            If it is not a set of models.
        OSError
            If it cannot be read.
        """
        try:
            text = file.read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise SpecError(f"{file} is not a set of trained models: it is not text.") from error
        return cls.from_json(text, source=str(file))

    def write(self, file: Path) -> None:
        """Write the set; the file appears complete or not at all."""
        write_whole(file, self.to_json())


@cache
def bundled_set() -> ModelSet:
    """Return the set that comes with padlab, trained on its pseudo expression database (see docs/models.md)."""
    text = resources.files("synth.data").joinpath("trained.json").read_text(encoding="utf-8")
    return ModelSet.from_json(text, source="padlab's own set")


def _lists(model: object, *names: str) -> dict[str, Any]:
    arrays = {name: getattr(model, name) for name in names}
    # JSON has no NaN, which is the correlation with a P, A or D that does not vary; null is read as NaN.
    return {name: np.asarray(np.where(np.isfinite(own), own, None)).tolist() for name, own in arrays.items()}
