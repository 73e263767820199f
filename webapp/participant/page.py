"""A trial's instruments as its page lays them out: items in order, poles as shown, one block for each word."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import Instrument, Item
from evaluation.instruments.display import as_shown
from evaluation.study import StudySpec
from webapp.services.asking import Asked


@dataclass(frozen=True)
class Block:
    """Items that stand together; those about a word stand under it.

    Attributes
    ----------
    word : str or None
        The word that the items are about.
    items : tuple of items
        In the order of the page, poles as shown.
    """

    word: str | None
    items: tuple[Item, ...]


@dataclass(frozen=True)
class Section:
    """One instrument of a page.

    Attributes
    ----------
    instrument : Instrument
        As shown, with the items of this very trial.
    blocks : tuple of Block
        All its items, in the order of the page.
    about_words : tuple of items
        Of an instrument that asks about each word, the items as they are asked about every one of them.
    """

    instrument: Instrument
    blocks: tuple[Block, ...]
    about_words: tuple[Item, ...] = ()

    def of_every_word(self, item: Item) -> Item:
        """Return the item that is asked about every word, of which `item` asks about one."""
        return next(own for own in self.about_words if own.id == item.id.rpartition("-")[0])


def sections(spec: StudySpec, asks: Sequence[Asked], words: Sequence[str]) -> tuple[Section, ...]:
    """Return what a page shows of the instruments it asks.

    Parameters
    ----------
    spec : StudySpec
        The study.
    asks : sequence of Asked
        The instruments, in the order of the page.
    words : sequence of str
        The words of the sentence, where there is one.
    """
    return tuple(_section(spec, ask, words) for ask in asks)


def _section(spec: StudySpec, ask: Asked, words: Sequence[str]) -> Section:
    shown = as_shown(ask.instrument, ask.display)
    declared = ask.instrument if shown.name == DISCUSSION.name else spec.instrument(shown.name)
    if declared.per != "word":
        return Section(shown, (Block(None, shown.items),))
    places = groupby(shown.items, key=lambda item: int(item.id.rpartition("-")[2]))
    blocks = tuple(Block(words[place - 1], tuple(items)) for place, items in places)
    return Section(shown, blocks, declared.items)
