"""How an instrument stood on a rater's page: the order of its items, and which had their poles exchanged."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from evaluation.errors import DataError, EvaluationError
from evaluation.instruments.base import Instrument
from evaluation.instruments.items import Answer, BipolarItem, SliderItem
from evaluation.seeding import below, shuffled


@dataclass(frozen=True)
class Display:
    """Order and pole direction of an instrument's items.

    Attributes
    ----------
    order : tuple of str
        Ids of the items from first to last.
    flipped : frozenset of str
        Ids of the items that showed their right pole on the left.
    """

    order: tuple[str, ...]
    flipped: frozenset[str] = frozenset()

    def to_dict(self) -> dict[str, list[str]]:
        """Return plain JSON values, which `from_dict` reads."""
        return {"order": list(self.order), "flipped": sorted(self.flipped)}

    @classmethod
    def from_dict(cls, content: Mapping[str, object]) -> Self:
        """Return the display that `to_dict` wrote.

        Raises
        ------
        DataError
            If the content is not of its form.
        """
        lists = [content.get(field) for field in ("order", "flipped")]
        for ids in lists:
            if not isinstance(ids, list) or not all(isinstance(one, str) for one in ids) or len(set(ids)) < len(ids):
                raise DataError("A display must have the lists order and flipped, each of different item ids.")
        order, flipped = lists
        if not isinstance(order, list) or not isinstance(flipped, list) or not set(flipped) <= set(order):
            raise DataError("A display can only have flipped items that are in its order.")
        return cls(tuple(order), frozenset(flipped))


def arrange(instrument: Instrument, *, shuffle: bool, flip: bool, bits: np.random.PCG64) -> Display:
    """Return a way to show an instrument.

    Parameters
    ----------
    instrument : Instrument
        As one trial asks it (`Instrument.expanded`).
    shuffle : bool
        Whether the items come in random order.
    flip : bool
        Whether half of the items with two poles, chosen at random, show them exchanged; of an odd number the half is
        rounded up or down at random, so that each item is exchanged half of the time.
    bits : numpy.random.PCG64
        Source of chance, as `evaluation.seeding.bit_generator` returns; the same bits give the same display.

    Returns
    -------
    Display
        With every item in `order`.
    """
    ids = [item.id for item in instrument.items]
    order = shuffled(ids, bits) if shuffle else ids
    if not flip:
        return Display(tuple(order))
    poled = [item.id for item in instrument.items if isinstance(item, (BipolarItem, SliderItem))]
    half = (len(poled) + below(bits, 2)) // 2
    return Display(tuple(order), frozenset(shuffled(poled, bits)[:half]))


def as_shown(instrument: Instrument, display: Display) -> Instrument:
    """Return the instrument as the page shows it: items in the display's order, poles exchanged where flipped.

    The answers to it are those that `keyed` takes.

    Raises
    ------
    EvaluationError
        If the display is not one of this instrument.
    """
    _check(instrument, display)
    items = {item.id: item for item in instrument.items}
    shown = []
    for item_id in display.order:
        item = items[item_id]
        if item_id in display.flipped and isinstance(item, (BipolarItem, SliderItem)):
            item = replace(item, left=item.right, right=item.left)
        shown.append(item)
    return replace(instrument, items=tuple(shown))


def keyed(instrument: Instrument, display: Display, shown: Mapping[str, Answer]) -> dict[str, Answer]:
    """Return the answers as if no poles had been exchanged; it is its own inverse.

    Parameters
    ----------
    instrument : Instrument
        The instrument that was shown.
    display : Display
        How it was shown.
    shown : mapping of str to answer
        Answers as given on the page.

    Returns
    -------
    dict of str to answer
        The answer to a flipped item is the sum of its lowest and highest value less the answer given; the others are
        as given.

    Raises
    ------
    EvaluationError
        If the display is not one of this instrument.
    """
    _check(instrument, display)
    answers = dict(shown)
    for item in instrument.items:
        given = answers.get(item.id)
        if item.id in display.flipped and isinstance(item, (BipolarItem, SliderItem)) and isinstance(given, int):
            answers[item.id] = item.low + item.high - given
    return answers


def _check(instrument: Instrument, display: Display) -> None:
    items = {item.id: item for item in instrument.items}
    if sorted(display.order) != sorted(items):
        raise EvaluationError(f"{instrument.name} has the items {', '.join(items)}, but others are displayed.")
    for item_id in sorted(display.flipped):
        if not isinstance(items.get(item_id), (BipolarItem, SliderItem)):
            raise EvaluationError(f"{instrument.name}, {item_id}: there are no poles here that could be exchanged.")
