"""What a simulated rater answers: the truth of what is shown, seen through noise, put where the page has it."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby

import numpy as np

from evaluation.instruments import Answer, Instrument, Item
from evaluation.instruments.display import Display, keyed
from evaluation.seeding import generator
from evaluation.simulate import answer_instrument
from webapp.bots.known import INDIFFERENT, Known, Truth
from webapp.bots.page import Field, Page

_WORD = re.compile(r".+-([1-9][0-9]*)")
_TEXT = "A simulated answer"


class Rater:
    """One person, whose answers depend on a seed, their number and what they are shown.

    Parameters
    ----------
    index : int
        The rater's number, from 0.
    seed : int
        Seed of all raters' noise.
    known : Known
        What the clips truly show.

    Notes
    -----
    Answers are those of `evaluation.simulate.answer_instrument`. A clip is seen anew, with other noise, whenever it
    comes again, and alike in whatever order the clips come. Instruments that are not known, since the study is another
    site's, are answered at random.
    """

    def __init__(self, index: int, *, seed: int, known: Known) -> None:
        self._index = index
        self._seed = seed
        self._known = known
        self._seen: Counter[tuple[str, ...]] = Counter()

    def answer(self, page: Page, fields: Mapping[str, Field]) -> list[tuple[str, str]]:
        """Return what to send for the fields of a page: (name, value), several of a name for a multiple choice."""
        clips = sorted(page.clips, key=lambda clip: clip.place)
        truths = [self._known.truth(clip.digest) for clip in clips] or [INDIFFERENT]
        wanted = self._known.wanted(page.prompt) if page.prompt else {}
        sent: list[tuple[str, str]] = []
        for name, group in groupby(fields.values(), key=lambda one: one.name.partition(".")[0]):
            asked = {one.name.partition(".")[2]: one for one in group}
            what = (name, *(truth.digest for truth in truths))
            self._seen[what] += 1
            rng = generator(self._seed, "simulated rater", self._index, *what, self._seen[what])
            answers = self._answers(name, asked, truths, wanted, rng)
            sent += [(asked[item].name, value) for item, answer in answers.items() for value in _plain(answer)]
        return sent

    def _answers(
        self,
        name: str,
        asked: Mapping[str, Field],
        truths: Sequence[Truth],
        wanted: Mapping[str, Sequence[int]],
        rng: np.random.Generator,
    ) -> dict[str, Answer]:
        """Return the answers to an instrument as they are to be given on the page."""
        declared = self._known.instrument(name)
        if declared is None:
            return _any_answers(asked, rng)
        words = max((int(found[1]) for found in map(_WORD.fullmatch, asked) if found), default=0)
        instrument = declared.expanded(clips=len(truths), words=[str(place + 1) for place in range(words)])
        pads, qualities = [truth.pad for truth in truths], [truth.quality for truth in truths]
        answers = answer_instrument(instrument, pads, qualities, rng=rng)
        answers |= {item: wanted[one.name][0] for item, one in asked.items() if one.name in wanted}
        return keyed(instrument, _display(instrument, asked), answers)


def _display(instrument: Instrument, asked: Mapping[str, Field]) -> Display:
    """Return which items have their right pole on the left, by what the page shows there."""
    flipped = [item.id for item in instrument.items if item.id in asked and _flipped(item, asked[item.id])]
    return Display(tuple(item.id for item in instrument.items), frozenset(flipped))


def _flipped(item: Item, shown: Field) -> bool:
    left, right = getattr(item, "left", None), getattr(item, "right", None)
    if shown.left is None or left is None or right is None or shown.left in _texts(left):
        return False
    return shown.left in _texts(right)


def _texts(texts: Mapping[str, str]) -> set[str]:
    return {" ".join(text.split()) for text in texts.values()}


def _any_answers(asked: Mapping[str, Field], rng: np.random.Generator) -> dict[str, Answer]:
    """Return answers to what is not known: any of those offered, nothing where nothing is needed."""
    answers: dict[str, Answer] = {}
    for item, one in asked.items():
        if one.kind == "text":
            if one.required:
                answers[item] = _TEXT
            continue
        offered = one.offered
        answers[item] = offered[int(rng.integers(len(offered)))]
    return answers


def _plain(answer: Answer) -> list[str]:
    """Return the values that a form sends for an answer."""
    return [str(value) for value in answer] if isinstance(answer, tuple) else [str(answer)]
