"""The declaration of a questionnaire: page, validation, scoring, codebook and export derive from it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import pandas as pd

from evaluation.errors import AnswerError

Texts = Mapping[str, str]
"""One text per language code, for instance ``{"en": "Angry", "zh": "愤怒的"}``."""

# Only ASCII digits: int() alone would also take "٤", "1_0" and " 4 ".
_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]{1,9}")


class Option(NamedTuple):
    """One labelled answer of a Likert item."""

    value: int
    label: Texts
    description: Texts


class CodebookRow(NamedTuple):
    """What one exported variable means."""

    variable: str
    text: str
    values: str
    scoring: str
    source: str


@dataclass(frozen=True, kw_only=True)
class BipolarItem:
    """A pair of adjectives with a row of points between them.

    Parameters
    ----------
    id : str
        Name of the item, unique in its instrument.
    left, right : mapping of str to str
        The adjective at the lowest and at the highest value, per language.
    low, high : int
        Range of the answer, both included.
    """

    kind: ClassVar[Literal["bipolar"]] = "bipolar"
    id: str
    left: Texts
    right: Texts
    low: int = -4
    high: int = 4

    @property
    def values(self) -> tuple[int, ...]:
        """Return the answers offered, in the order of the page."""
        return tuple(range(self.low, self.high + 1))

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        return frozenset(self.left) & frozenset(self.right)

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        return f"{self.left[language]} – {self.right[language]}"

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return f"{self.low} ({self.left[language]}) to {self.high} ({self.right[language]})"


@dataclass(frozen=True, kw_only=True)
class LikertItem:
    """A question with labelled answers.

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
    id: str
    prompt: Texts
    options: tuple[Option, ...]

    @property
    def values(self) -> tuple[int, ...]:
        """Return the answers offered, in the order of the page."""
        return tuple(option.value for option in self.options)

    @property
    def languages(self) -> frozenset[str]:
        """Return the languages in which every text of the item is there."""
        complete = frozenset(self.prompt)
        for option in self.options:
            complete &= frozenset(option.label) & frozenset(option.description)
        return complete

    def text(self, language: str) -> str:
        """Return the item as one line of a codebook."""
        return self.prompt[language]

    def describe_values(self, language: str) -> str:
        """Return what the answers mean as one line of a codebook."""
        return "; ".join(f"{option.value} = {option.label[language]}" for option in self.options)


Item = BipolarItem | LikertItem


@dataclass(frozen=True, kw_only=True)
class Score:
    """A number made of the answers: the weighted sum of items over a divisor.

    Parameters
    ----------
    name : str
        Name of the score, unique over all instruments of a study, since it becomes a column.
    text : str
        What it measures, and its range.
    weights : mapping of str to int
        Weight of each item that takes part.
    divisor : int
        What the weighted sum is divided by.
    source : str
        Where the formula is published.
    """

    name: str
    text: str
    weights: Mapping[str, int]
    divisor: int
    source: str

    @property
    def formula(self) -> str:
        """Return the formula as text, for instance ``(Q1 - Q4 + Q7 - Q10) / 16``."""
        signs = ["-" if weight < 0 else "+" for weight in self.weights.values()]
        factors = [item if abs(weight) == 1 else f"{abs(weight)} {item}" for item, weight in self.weights.items()]
        rest = "".join(f" {sign} {factor}" for sign, factor in zip(signs[1:], factors[1:], strict=True))
        total = signs[0].removeprefix("+") + factors[0] + rest
        return total if self.divisor == 1 else f"({total}) / {self.divisor}"


@dataclass(frozen=True, kw_only=True)
class Instrument:
    """A questionnaire.

    Parameters
    ----------
    name : str
        Name in study files and in the export.
    title, instruction : mapping of str to str
        Heading, and what the rater is asked to do, per language.
    items : tuple of BipolarItem or LikertItem
        The items in the order of the page.
    scores : tuple of Score
        What is computed from the answers.
    source : str
        Where the instrument is published.
    """

    name: str
    title: Texts
    instruction: Texts
    items: tuple[Item, ...]
    scores: tuple[Score, ...]
    source: str

    @property
    def languages(self) -> tuple[str, ...]:
        """Return the languages in which the whole instrument can be shown, sorted."""
        complete = frozenset(self.title) & frozenset(self.instruction)
        for item in self.items:
            complete &= item.languages
        return tuple(sorted(complete))

    def validate(self, raw: Mapping[str, str | int]) -> dict[str, int]:
        """Return the answers as whole numbers, in the order of the items.

        Parameters
        ----------
        raw : mapping of str to str or int
            Answer of each item, as sent by a form (``"-3"``) or as JSON (``-3``). Only the items of this
            instrument are read; other keys (a form's token, another instrument) are left alone.

        Returns
        -------
        dict of str to int
            One answer for each item.

        Raises
        ------
        AnswerError
            If an item is missing or empty, not a whole number, or not one of the values offered. A missing answer
            is never replaced by zero or any other value.
        """
        return {item.id: self.validate_item(item, raw.get(item.id)) for item in self.items}

    def validate_item(self, item: Item, raw: str | int | None) -> int:
        """Return the answer to one item as a whole number.

        Raises
        ------
        AnswerError
            As `validate`.
        """
        right = _range_text(item.values)
        if raw is None or raw == "":
            raise AnswerError(self.name, item.id, "there is no answer", right)
        if isinstance(raw, str) and _WHOLE_NUMBER.fullmatch(raw):
            value = int(raw)
        elif isinstance(raw, int) and not isinstance(raw, bool):
            value = raw
        else:
            raise AnswerError(self.name, item.id, f"{raw!r} is not a whole number", right)
        if value not in item.values:
            raise AnswerError(self.name, item.id, f"{value} is not one of the answers offered", right)
        return value

    def score(self, answers: Mapping[str, int]) -> dict[str, float]:
        """Return the scores of one complete set of answers.

        Parameters
        ----------
        answers : mapping of str to int
            As returned by `validate`.

        Returns
        -------
        dict of str to float
            Value of each score.

        Raises
        ------
        AnswerError
            If an answer that a score needs is missing or not valid.
        """
        checked = self.validate(answers)
        return {
            score.name: sum(weight * checked[item] for item, weight in score.weights.items()) / score.divisor
            for score in self.scores
        }

    def score_table(self, answers: pd.DataFrame) -> pd.DataFrame:
        """Return the scores of many sets of answers at once.

        Parameters
        ----------
        answers : pandas.DataFrame
            One row for each set of answers, one numeric column for each item; NaN where an answer is missing.

        Returns
        -------
        pandas.DataFrame
            The same rows, one column for each score; NaN where an item the score needs is missing.
        """
        columns = {}
        for score in self.scores:
            values = answers[list(score.weights)].to_numpy(dtype=float)
            columns[score.name] = values @ list(score.weights.values()) / score.divisor
        return pd.DataFrame(columns, index=answers.index)

    def codebook(self) -> list[CodebookRow]:
        """Return one row for each item and each score, in English."""
        items = [
            CodebookRow(
                variable=f"{self.name}.{item.id}",
                text=item.text("en"),
                values=item.describe_values("en"),
                scoring=", ".join(self._used_in(item.id)),
                source=self.source,
            )
            for item in self.items
        ]
        scores = [
            CodebookRow(score.name, score.text, self._score_range(score), score.formula, score.source)
            for score in self.scores
        ]
        return items + scores

    def _used_in(self, item: str) -> list[str]:
        return [f"{score.name} ({score.weights[item]:+d})" for score in self.scores if item in score.weights]

    def _score_range(self, score: Score) -> str:
        values = {item.id: item.values for item in self.items}
        products = [sorted(weight * value for value in values[item]) for item, weight in score.weights.items()]
        low = sum(product[0] for product in products) / score.divisor
        high = sum(product[-1] for product in products) / score.divisor
        return f"{low:g} to {high:g}, in steps of {1 / score.divisor:g}"


def _range_text(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    if len(values) == high - low + 1:
        return f"a whole number from {low} to {high}"
    return f"one of {', '.join(str(value) for value in values)}"
