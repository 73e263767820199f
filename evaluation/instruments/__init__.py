"""The instruments (questionnaires) that a study can use, by name."""

from types import MappingProxyType

from evaluation.errors import EvaluationError
from evaluation.instruments.base import BipolarItem, CodebookRow, Instrument, Item, LikertItem, Option, Score
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12

__all__ = ["BipolarItem", "CodebookRow", "Instrument", "Item", "LikertItem", "Option", "Score", "get", "names"]

_INSTRUMENTS = MappingProxyType({instrument.name: instrument for instrument in (PAD12, MOS5)})


def names() -> tuple[str, ...]:
    """Return the names of all instruments."""
    return tuple(_INSTRUMENTS)


def get(name: str) -> Instrument:
    """Return the instrument of this name.

    Raises
    ------
    EvaluationError
        If there is none; the message lists those there are.
    """
    if name not in _INSTRUMENTS:
        raise EvaluationError(f"There is no instrument {name!r}; there are {', '.join(names())}.")
    return _INSTRUMENTS[name]
