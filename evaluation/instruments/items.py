"""The questions of instruments: what each shows, which answers it takes, and what they mean."""

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import ClassVar, Literal, NamedTuple

from evaluation.instruments.answers import ItemError, is_missing, listed, one_of, shown

Texts = Mapping[str, str]
"""One text per language code, for instance ``{"en": "Angry", "zh": "愤怒的"}``."""

Answer = int | str | tuple[int, ...]
"""A value; a text; or the values chosen, in ascending order."""

Figure = Literal["pleasure", "arousal", "dominance"]
"""What the figures of a pictorial item vary."""

_NO_TEXTS: Texts = MappingProxyType({})


class Option(NamedTuple):
    """One labelled answer; the description may be left out."""

    value: int
    label: Texts
    description: Texts = _NO_TEXTS


class _Ranged:
    """What items have in common whose answers are the whole numbers of a range."""

    required: ClassVar[bool] = True
    numeric: ClassVar[bool] = True
    low: int
    high: int

    @cached_property
    def values(self) -> tuple[int, ...]:
        """Return the answers offered, in the order of the page."""
        return tuple(range(self.low, self.high + 1))

    def parse(self, raw: object) -> int:
        """Return an answer as a whole number; ItemError if it is missing or out of range."""
        return one_of(raw, self.values)


@dataclass(frozen=True, kw_only=True)
class BipolarItem(_Ranged):
    """A pair of words with a row of points between them.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    left, right : mapping of str to str
        The word at the lowest and at the highest value, per language.
    low, high : int
        Range of the answer, both included.
    prompt : mapping of str to str, optional
        A question above the row, per language.
    """

    kind: ClassVar[Literal["bipolar"]] = "bipolar"
    id: str
    left: Texts
    right: Texts
    low: int = -4
    high: int = 4
    prompt: Texts | None = None

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        poles = frozenset(self.left) & frozenset(self.right)
        return poles if self.prompt is None else poles & frozenset(self.prompt)

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        poles = f"{self.left[language]} – {self.right[language]}"
        return poles if self.prompt is None else f"{self.prompt[language]} ({poles})"

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return f"{self.low} ({self.left[language]}) to {self.high} ({self.right[language]})"


class _Prompted(_Ranged):
    """What items have in common that ask for a number between two poles."""

    prompt: Texts
    left: Texts
    right: Texts

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        return frozenset(self.prompt) & frozenset(self.left) & frozenset(self.right)

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        return self.prompt[language]

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return f"{self.low} ({self.left[language]}) to {self.high} ({self.right[language]})"


@dataclass(frozen=True, kw_only=True)
class SliderItem(_Prompted):
    """A line on which a point is set; before it is touched there is no point.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    prompt : mapping of str to str
        The question, per language.
    left, right : mapping of str to str
        What the lowest and the highest value mean, per language.
    low, high : int
        Range of the answer, both included.
    """

    kind: ClassVar[Literal["slider"]] = "slider"
    id: str
    prompt: Texts
    left: Texts
    right: Texts
    low: int = 0
    high: int = 100


@dataclass(frozen=True, kw_only=True)
class PictorialItem(_Prompted):
    """A row of figures that vary in one quality, one of which is chosen.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    prompt : mapping of str to str
        The question, per language.
    figure : str
        What the figures vary: ``pleasure``, ``arousal`` or ``dominance``; the page draws them.
    left, right : mapping of str to str
        What the figures at the lowest and at the highest value stand for, per language.
    low, high : int
        Range of the answer, both included.
    """

    kind: ClassVar[Literal["pictorial"]] = "pictorial"
    id: str
    prompt: Texts
    figure: Figure
    left: Texts
    right: Texts
    low: int = 1
    high: int = 9


class _Optioned:
    """What items with labelled answers have in common."""

    prompt: Texts
    options: tuple[Option, ...]

    @cached_property
    def values(self) -> tuple[int, ...]:
        """Return the answers offered, in the order of the page."""
        return tuple(option.value for option in self.options)

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        complete = frozenset(self.prompt)
        for option in self.options:
            complete &= frozenset(option.label)
            if option.description:
                complete &= frozenset(option.description)
        return complete

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        return self.prompt[language]


@dataclass(frozen=True, kw_only=True)
class LikertItem(_Optioned):
    """A question with labelled answers that are steps of a scale.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    prompt : mapping of str to str
        The question, per language.
    options : tuple of Option
        The answers in the order of the page.
    """

    kind: ClassVar[Literal["likert"]] = "likert"
    required: ClassVar[bool] = True
    numeric: ClassVar[bool] = True
    id: str
    prompt: Texts
    options: tuple[Option, ...]

    def parse(self, raw: object) -> int:
        """Return an answer as a whole number; ItemError if it is missing or not offered."""
        return one_of(raw, self.values)

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return _described(self.options, language)


@dataclass(frozen=True, kw_only=True)
class ChoiceItem(_Optioned):
    """A question with labelled answers that have no order.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    prompt : mapping of str to str
        The question, per language.
    options : tuple of Option
        The answers in the order of the page.
    multiple : bool
        Whether several may be chosen.
    required : bool
        Whether at least one must be chosen.
    """

    kind: ClassVar[Literal["choice"]] = "choice"
    numeric: ClassVar[bool] = False
    id: str
    prompt: Texts
    options: tuple[Option, ...]
    multiple: bool = False
    required: bool = True

    def parse(self, raw: object) -> int | tuple[int, ...] | None:
        """Return an answer, of a multiple choice the values chosen in ascending order.

        Parameters
        ----------
        raw : object
            A value; of a multiple choice also a list or tuple of them, none of them twice.

        Returns
        -------
        int, tuple of int or None
            None if nothing is chosen and nothing needs to be.

        Raises
        ------
        ItemError
            If an answer is needed and missing, or not one of those offered.
        """
        if not self.multiple:
            return None if not self.required and is_missing(raw) else one_of(raw, self.values)
        parts = list(raw) if isinstance(raw, (list, tuple)) else [raw]
        parts = [part for part in parts if not is_missing(part)]
        right = f"a choice among {listed(self.values)}, each at most once,"
        if not parts:
            if self.required:
                raise ItemError("there is no answer", right)
            return None
        chosen = sorted(one_of(part, self.values) for part in parts)
        for value, following in pairwise(chosen):
            if value == following:
                raise ItemError(f"{value} is chosen twice", right)
        return tuple(chosen)

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        notes = ["several may be chosen"] * self.multiple + ["may be left out"] * (not self.required)
        return "; ".join([_described(self.options, language), *notes])


@dataclass(frozen=True, kw_only=True)
class TextItem:
    """A question answered in one's own words.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    prompt : mapping of str to str
        The question, per language.
    max_length : int
        The largest number of characters.
    required : bool
        Whether something must be written.
    """

    kind: ClassVar[Literal["text"]] = "text"
    numeric: ClassVar[bool] = False
    values: ClassVar[tuple[int, ...]] = ()
    id: str
    prompt: Texts
    max_length: int = 1000
    required: bool = False

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        return frozenset(self.prompt)

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        return self.prompt[language]

    def parse(self, raw: object) -> str | None:
        """Return an answer without the white space around it and with plain line ends.

        Parameters
        ----------
        raw : object
            A text; one of nothing but white space is missing.

        Returns
        -------
        str or None
            None if nothing is written and nothing needs to be.

        Raises
        ------
        ItemError
            If an answer is needed and missing, is no text, is too long, or holds characters that cannot be kept.
        """
        right = f"text of at most {self.max_length} characters"
        if raw is not None and not isinstance(raw, str):
            raise ItemError(f"{shown(raw)} is not text", right)
        # Browsers send a new line as two characters, which must not count against the length.
        answer = (raw or "").replace("\r\n", "\n").replace("\r", "\n").strip()
        if not answer:
            if self.required:
                raise ItemError("there is no answer", right)
            return None
        if len(answer) > self.max_length:
            raise ItemError(f"the text has {len(answer)} characters", right)
        # Databases keep neither U+0000 nor halves of surrogate pairs; no keyboard writes the other control characters.
        if any(unicodedata.category(sign) in {"Cc", "Cs"} and sign not in "\n\t" for sign in answer):
            raise ItemError("the text holds control characters", right)
        return answer

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return f"text, up to {self.max_length} characters{'' if self.required else '; may be left out'}"


Item = BipolarItem | LikertItem | PictorialItem | ChoiceItem | SliderItem | TextItem


def _described(options: Sequence[Option], language: str) -> str:
    return "; ".join(f"{option.value} = {option.label[language]}" for option in options)
