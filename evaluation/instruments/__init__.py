"""The instruments (questionnaires) that a study can use, by name."""

from types import MappingProxyType

from evaluation.errors import EvaluationError
from evaluation.instruments.base import CodebookRow, Instrument, Score, clip_letter
from evaluation.instruments.emotion14 import EMOTION14
from evaluation.instruments.items import (
    Answer,
    BipolarItem,
    ChoiceItem,
    Item,
    LikertItem,
    Option,
    PictorialItem,
    SliderItem,
    TextItem,
)
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad5 import PAD5
from evaluation.instruments.pad12 import PAD12
from evaluation.instruments.paired import PAIRED
from evaluation.instruments.prosodic_word import PROSODIC_WORDS
from evaluation.instruments.sam import SAM
from evaluation.instruments.slider100 import SLIDER100

__all__ = [
    "Answer",
    "BipolarItem",
    "ChoiceItem",
    "CodebookRow",
    "Instrument",
    "Item",
    "LikertItem",
    "Option",
    "PictorialItem",
    "Score",
    "SliderItem",
    "TextItem",
    "clip_letter",
    "get",
    "names",
]

_INSTRUMENTS = MappingProxyType(
    {
        instrument.name: instrument
        for instrument in (PAD12, MOS5, PAD5, SAM, EMOTION14, PROSODIC_WORDS, PAIRED, SLIDER100)
    }
)


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
