"""Making up for what regression takes away, before a face is drawn.

A model that predicts the mean face of all that raters gave a PAD to shows less than any of these faces (regression
toward the mean), for two reasons that are known and can be made up for:

- Its inputs in training were means of a few raters, whose error flattens what is learned. An input without error is as
  far from the mean as an observed one that is further out by one over the reliability (regression calibration: Carroll,
  Ruppert, Stefanski and Crainiceanu 2006, Measurement Error in Nonlinear Models, chapter 4).
- Its outputs vary less than the faces do. They are spread about their mean until they vary as much, as speech and face
  synthesis do with the global variance of what they predict (Toda and Tokuda 2007, IEICE Trans. Inf. Syst. E90-D:816).

The papers do neither. Errors and correlations (`synth.expression.evaluation`) are those of the models without it.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.pad_pep import PadPepModel, bounded
from synth.expression.samples import check_pad, check_pairs, digest

Floats = NDArray[np.float64]

LARGEST_GAIN = 2.0
"""A PEP that PAD tells next to nothing about would otherwise be thrown about by chance."""

LEAST_RELIABILITY = 0.5


@dataclass(frozen=True, eq=False)
class Calibration:
    """How far inputs and outputs of a model are spread.

    Attributes
    ----------
    pad_mean : (3,) float64
        Mean PAD of the training samples.
    reliability : (3,) float64
        Reliability of their P, A and D, more than 0 and at most 1.
    pep_mean : (K,) float64
        Mean of the training samples' PEPs.
    gain : (K,) float64
        By how much predictions are spread about it, 1 to `LARGEST_GAIN`.
    """

    pad_mean: Floats
    reliability: Floats
    pep_mean: Floats
    gain: Floats

    def __post_init__(self) -> None:
        for name in ("pad_mean", "reliability", "pep_mean", "gain"):
            values = getattr(self, name)
            shape = (3,) if name in {"pad_mean", "reliability"} else self.pep_mean.shape
            if values.shape != shape or values.ndim != 1 or not np.isfinite(values).all():
                wanted = shape if len(shape) == 1 else "(K,)"
                raise SpecError(
                    f"Calibration: {name}, of shape {values.shape}, must be finite numbers of shape {wanted}."
                )
        if not ((self.reliability > 0.0) & (self.reliability <= 1.0)).all() or (self.gain < 1.0).any():
            raise SpecError("Calibration: reliabilities must be more than 0 and at most 1, gains at least 1.")

    @classmethod
    def of(cls, model: PadPepModel, pad: Floats, pep: Floats, *, reliability: Floats | None = None) -> Self:
        """Find the calibration of a model on the samples that it was trained on, PAD (N, 3) and PEP (N, K).

        ``reliability`` (3,) is that of the mean over raters; left out, the PAD are taken for exact. It counts as
        `LEAST_RELIABILITY` where it is less.

        Raises
        ------
        SpecError
            If the samples are not pairs of finite numbers, or the reliability is not three.
        """
        check_pairs(check_pad(pad), pep)
        if reliability is not None and (np.shape(reliability) != (3,) or not np.isfinite(reliability).all()):
            raise SpecError("Calibration: the reliability must be three finite numbers, of P, A and D.")
        known = np.ones(3) if reliability is None else np.clip(reliability, LEAST_RELIABILITY, 1.0)
        mean = pad.mean(axis=0)
        # PAD without the raters' error vary by the root of the reliability less; dividing by the reliability, as
        # drawing does, leaves one over the root.
        drawn = np.clip(mean + (pad - mean) / np.sqrt(known), -1.0, 1.0)
        spread, wanted = model.predict(drawn).std(axis=0), pep.std(axis=0)
        gain = np.clip(wanted / np.maximum(spread, 1e-12), 1.0, LARGEST_GAIN)
        return cls(pad_mean=mean, reliability=known, pep_mean=pep.mean(axis=0), gain=gain)


@dataclass(frozen=True, eq=False)
class CalibratedModel:
    """A model as faces are drawn by it.

    Attributes
    ----------
    model : PadPepModel
        The model.
    calibration : Calibration
        How far its inputs and outputs are spread.
    """

    model: PadPepModel
    calibration: Calibration

    @property
    def digest(self) -> str:
        """Sha-256 of the model and the calibration."""
        own = self.calibration
        return digest(f"calibrated {self.model.digest}", own.pad_mean, own.reliability, own.pep_mean, own.gain)

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, K), clipped to [-1, 1], of PAD values (N, 3)."""
        own = self.calibration
        further = np.clip(own.pad_mean + (check_pad(pad) - own.pad_mean) / own.reliability, -1.0, 1.0)
        return bounded(own.pep_mean + own.gain * (self.model.predict(further) - own.pep_mean))
