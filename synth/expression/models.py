"""The way from an emotion to a face: a PAD to PEP model and the PEP to FAP translation that belongs to it."""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.model_set import FILE_NAME, KINDS, ModelSet, bundled_set
from synth.expression.pad_pep import PadPepModel
from synth.expression.pep import PEP_COUNT
from synth.expression.pep_fap import PepFapModel, template
from synth.expression.samples import check_pad
from synth.expression.word_table import TableModel, word_table
from synth.fap.table import within_reach

Floats = NDArray[np.float64]

TABLE, NEUTRAL = "table", "neutral"

MODEL_NAMES = (TABLE, *KINDS, NEUTRAL)
"""The models that come with padlab."""

DEFAULT_MODEL = TABLE
"""The model that is used where none is named."""

_NAME = re.compile(rf"(?:(?P<set>[A-Za-z0-9][A-Za-z0-9._-]*)/)?(?P<kind>{'|'.join(MODEL_NAMES)})")


@dataclass(frozen=True, eq=False)
class ExpressionModel:
    """From PAD to PEP and FAP.

    Attributes
    ----------
    name : str
        By which it was asked for.
    pad_pep : PadPepModel
        From PAD to the nine PEPs of MTAP 2013; trained models are calibrated, see `synth.expression.calibration`.
    pep_fap : PepFapModel
        From these to FAPs.
    """

    name: str
    pad_pep: PadPepModel
    pep_fap: PepFapModel

    def apex(self, pad: NDArray[np.floating] | Floats, *, intensity: float = 1.0) -> tuple[Floats, Floats]:
        """Return the PEPs (N, 9) and FAPs (N, 68) of PAD values (N, 3), both times the intensity.

        FAPs stay within the face's reach (`synth.fap.table.within_reach`).
        """
        pep = intensity * self.pad_pep.predict(pad)
        return pep, within_reach(self.pep_fap.translate(pep))


@dataclass(frozen=True)
class NeutralModel:
    """The face that shows nothing, whatever the emotion: a baseline of experiments (MTAP 2013, Table 9)."""

    digest: str = "neutral"

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return PEPs (N, 9) of 0 for PAD values (N, 3)."""
        return np.zeros((len(check_pad(pad)), PEP_COUNT))


def check_model_name(name: object) -> str:
    """Return a model's name if it is one: a built-in one, or ``SET/KIND`` for one of a trained set.

    Raises
    ------
    SpecError
        If it is not.
    """
    found = _NAME.fullmatch(name) if isinstance(name, str) else None
    if not isinstance(name, str) or found is None or (found["set"] and found["kind"] not in KINDS):
        raise SpecError(
            f"There is no model {name!r}; there are {', '.join(MODEL_NAMES)}, and SET/{', SET/'.join(KINDS)} of a set "
            "made by `padlab train`."
        )
    return name


def load_model(name: str, models_dir: Path | None = None) -> ExpressionModel:
    """Return a model by its name.

    Parameters
    ----------
    name : str
        "table" (the fourteen words), "ann", "linear" or "quadratic" (trained on padlab's pseudo database), "neutral"
        (no expression), or for instance "mine/ann", that of the trained set in the folder ``mine``.
    models_dir : Path, optional
        The folder of trained sets.

    Raises
    ------
    SpecError
        If there is no such model.
    """
    found = _NAME.fullmatch(check_model_name(name))
    if found is None or found["set"] is None:
        return _built_in(name)
    file = None if models_dir is None else models_dir / found["set"] / FILE_NAME
    if file is None or not file.is_file():
        names = [path.parent.name for path in models_dir.glob(f"*/{FILE_NAME}")] if models_dir else []
        there = sorted(name for name in names if _NAME.fullmatch(f"{name}/{KINDS[0]}"))
        raise SpecError(
            f"There is no trained set {found['set']!r}; "
            + (f"there are {', '.join(there)}." if there else "make one with `padlab train`.")
        )
    # What tells files apart is a key of the cache, so that a set that was trained anew is noticed. Its time alone does
    # not: a copy may keep it, and file systems count it in steps.
    now = file.stat()
    return _of_set(name, _read(file, (now.st_mtime_ns, now.st_ino, now.st_size)), found["kind"])


@lru_cache(maxsize=4)
def _read(file: Path, _version: tuple[int, int, int]) -> ModelSet:
    return ModelSet.read(file)


@lru_cache(maxsize=len(MODEL_NAMES))
def _built_in(name: str) -> ExpressionModel:
    if name == TABLE:
        return ExpressionModel(name, TableModel.fit(*word_table()[1:]), template())
    if name == NEUTRAL:
        return ExpressionModel(name, NeutralModel(), template())
    return _of_set(name, bundled_set(), name)


def _of_set(name: str, models: ModelSet, kind: str) -> ExpressionModel:
    return ExpressionModel(name, models.for_drawing(kind), models.pep_fap)
