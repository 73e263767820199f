"""What a FAP sequence says: its PEPs and the PAD that they stand for, frame by frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.model_set import ModelSet
from synth.expression.pep import codes
from synth.fap.table import check_sequence

Floats = NDArray[np.float64]


_EXPRESSIVE = [k for k, code in enumerate(codes()) if code not in {"3", "4", "5"}]


@dataclass(frozen=True, eq=False)
class Description:
    """PEP and PAD of each of T frames.

    Attributes
    ----------
    pep : (T, 9) float64
        The PEPs of MTAP 2013, cut to [-1, 1].
    pad : (T, 3) float64
        Pleasure, arousal and dominance, each in [-1, 1].
    apex : int
        The frame with the strongest expression, the first of several: the largest sum of squared PEPs but those of
        eyelids and gaze, as a blink is no expression.
    rmse : (3,) float64
        Root mean square error of P, A and D in the model's cross-validation.
    """

    pep: Floats
    pad: Floats
    apex: int
    rmse: Floats


def describe(values: NDArray[np.floating] | Floats, models: ModelSet) -> Description:
    """Estimate the emotion of FAP values, FAP to PEP to PAD (MTAP 2013, section 6: the framework reversed).

    Parameters
    ----------
    values : (T, 68)
        FAP values in FAPU, at least one frame.
    models : ModelSet
        The models whose translation and way back are used.

    Raises
    ------
    SpecError
        If ``values`` is not a finite (T, 68) array, or has no frame.
    """
    sequence = check_sequence(values)
    if not len(sequence):
        raise SpecError("Description: the sequence has no frame; at least one is needed.")
    pep = np.clip(models.pep_fap.invert(sequence), -1.0, 1.0)
    return Description(
        pep=pep,
        pad=models.pep_pad.predict(pep),
        apex=int(np.argmax(np.sum(pep[:, _EXPRESSIVE] ** 2, axis=1))),
        rmse=models.pep_pad.rmse,
    )
