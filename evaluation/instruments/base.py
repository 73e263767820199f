"""The declaration of a questionnaire: page, validation, scoring, codebook and export derive from it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal, NamedTuple

import pandas as pd

from evaluation.errors import AnswerError, EvaluationError
from evaluation.instruments.answers import ItemError
from evaluation.instruments.items import Answer, ChoiceItem, Item, Texts

Per = Literal["trial", "clip", "word"]
"""What the items are asked about: the trial as a whole, each clip that it shows, or each word of its sentence."""


class CodebookRow(NamedTuple):
    """What one exported variable means."""

    variable: str
    text: str
    values: str
    scoring: str
    source: str


@dataclass(frozen=True, kw_only=True)
class Score:
    """A number made of the answers: the weighted sum of items and a constant, over a divisor.

    Parameters
    ----------
    name : str
        Name of the score, unique over all instruments of a part of a study, since it becomes a column.
    text : str
        What it measures, and its range.
    weights : mapping of str to int or fractions.Fraction
        Weight of each item that takes part, none of them 0.
    divisor : int
        What the sum is divided by, above 0.
    source : str
        Where the formula is published.
    constant : int or fractions.Fraction
        What is added to the weighted items before the division.
    """

    name: str
    text: str
    weights: Mapping[str, int | Fraction]
    divisor: int
    source: str
    constant: int | Fraction = 0

    @property
    def formula(self) -> str:
        """Return the formula as text, for instance ``(Q1 - Q4 + Q7 - Q10) / 16``; `parse_formula` reads it."""
        weights, constant, divisor = self._whole()
        terms = [(weight < 0, _times(abs(weight), item)) for item, weight in weights.items()]
        if constant:
            terms.append((constant < 0, str(abs(constant))))
        rest = "".join(f" {'-' if negative else '+'} {term}" for negative, term in terms[1:])
        total = ("-" if terms[0][0] else "") + terms[0][1] + rest
        if divisor == 1:
            return total
        return f"({total}) / {divisor}" if len(terms) > 1 else f"{total} / {divisor}"

    def value(self, answers: Mapping[str, int]) -> float:
        """Return the score of one set of answers, which holds every item of `weights`."""
        total = sum((weight * answers[item] for item, weight in self.weights.items()), start=Fraction(self.constant))
        return float(total / self.divisor)

    def column(self, answers: pd.DataFrame) -> pd.Series:
        """Return the score of each row; NaN where an item of `weights` is missing."""
        weights, constant, divisor = self._whole()
        # Whole numbers make the sum exact, so that a row scores as `value` does.
        values = answers[list(weights)].to_numpy(dtype=float)
        return pd.Series((values @ list(weights.values()) + constant) / divisor, index=answers.index, dtype=float)

    def describe_values(self, values: Mapping[str, Sequence[int]]) -> str:
        """Return range and steps as one line of a codebook, given the answers that each item offers."""
        low = high = Fraction(self.constant)
        steps = []
        for item, weight in self.weights.items():
            ends = sorted((weight * min(values[item]), weight * max(values[item])))
            low, high = low + ends[0], high + ends[1]
            steps.append(Fraction(weight) * math.gcd(*(value - values[item][0] for value in values[item])))
        scale = math.lcm(*(step.denominator for step in steps))
        step = Fraction(math.gcd(*(int(step * scale) for step in steps)), scale) / self.divisor
        ends_text = f"{float(low / self.divisor):g} to {float(high / self.divisor):g}"
        return f"{ends_text}, in steps of {float(step):g}"

    def _whole(self) -> tuple[dict[str, int], int, int]:
        """Return weights, constant and divisor as whole numbers of the same formula."""
        numbers = [*self.weights.values(), self.constant]
        scale = math.lcm(*(number.denominator for number in numbers))
        weights = {item: int(weight * scale) for item, weight in self.weights.items()}
        return weights, int(self.constant * scale), self.divisor * scale


@dataclass(frozen=True, kw_only=True)
class Instrument:
    """A questionnaire.

    Parameters
    ----------
    name : str
        Name in study files and in the export.
    title, instruction : mapping of str to str
        Heading, and what the rater is asked to do, per language.
    items : tuple of items
        The items in the order of the page.
    scores : tuple of Score
        What is computed from the answers.
    source : str
        Where the instrument is published.
    per : {"trial", "clip", "word"}
        Whether the items are asked once in a trial, for each clip that it shows, or for each word of its sentence.
    clips : tuple of str, optional
        Which values of a presentation's ``together`` the instrument needs; None if it can do with any.
    """

    name: str
    title: Texts
    instruction: Texts
    items: tuple[Item, ...]
    scores: tuple[Score, ...]
    source: str
    per: Per = "trial"
    clips: tuple[str, ...] | None = None

    @property
    def languages(self) -> tuple[str, ...]:
        """Return the languages in which the whole instrument can be shown, sorted."""
        complete = frozenset(self.title) & frozenset(self.instruction)
        for item in self.items:
            complete &= item.languages
        return tuple(sorted(complete))

    def expanded(self, *, clips: int = 1, words: Sequence[str] = ()) -> "Instrument":
        """Return the instrument as one trial asks it.

        Parameters
        ----------
        clips : int
            How many clips the trial shows, for an instrument that asks about each clip.
        words : sequence of str
            The words of the sentence, for an instrument that asks about each word.

        Returns
        -------
        Instrument
            Itself if its items are asked once in a trial. Otherwise one with every item for each clip or word: the
            items of the k-th (from 1) have ids that end in ``-k`` and prompts that begin with the clip's letter or
            the word. It has no scores, which are computed for each clip or word: see `by_place`.

        Raises
        ------
        EvaluationError
            If there is no clip or word to ask about.
        """
        if self.per == "trial":
            return self
        subjects = [clip_letter(place) for place in range(1, clips + 1)] if self.per == "clip" else list(words)
        if not subjects:
            raise EvaluationError(f"{self.name} asks about each {self.per}, but there is none.")
        items = tuple(
            replace(item, id=f"{item.id}-{place}", prompt=_about(subject, item.prompt, item.languages))
            for place, subject in enumerate(subjects, start=1)
            for item in self.items
        )
        return replace(self, items=items, scores=(), per="trial")

    def by_place(self, answers: Mapping[str, Answer]) -> dict[int, dict[str, Answer]]:
        """Return the answers to an expanded instrument for each clip or word, by this instrument's item ids.

        Parameters
        ----------
        answers : mapping of str to answer
            As `validate` of the expanded instrument returns them.

        Returns
        -------
        dict of int to dict
            The answers about the k-th clip or word by k, counted from 1, each as `score` takes them.

        Raises
        ------
        EvaluationError
            If an answer is not to one of the expanded instrument's items.
        """
        known = {item.id for item in self.items}
        places: dict[int, dict[str, Answer]] = {}
        for key, answer in answers.items():
            item, _, place = key.rpartition("-")
            if item not in known or not (place.isascii() and place.isdecimal()):
                raise EvaluationError(f"{self.name} has no item {key!r}; right is an item's id, - and a number.")
            places.setdefault(int(place), {})[item] = answer
        return dict(sorted(places.items()))

    def validate(self, raw: Mapping[str, object]) -> dict[str, Answer]:
        """Return the answers in the order of the items.

        Parameters
        ----------
        raw : mapping of str to object
            Answer of each item, as sent by a form (``"-3"``) or as JSON (``-3``; a list for a multiple choice). Only
            the items of this instrument are read; other keys (a form's token, another instrument) are left alone.

        Returns
        -------
        dict of str to answer
            One answer for each item that has one; only optional items may lack it.

        Raises
        ------
        AnswerError
            If the answer to an item that needs one is missing or empty, or an answer is not one of those offered. A
            missing answer is never replaced by zero or any other value.
        """
        answers = {item.id: self.validate_item(item, raw.get(item.id)) for item in self.items}
        return {item: answer for item, answer in answers.items() if answer is not None}

    def validate_item(self, item: Item, raw: object) -> Answer | None:
        """Return the answer to one item; None if it is optional and left out.

        Raises
        ------
        AnswerError
            As `validate`.
        """
        try:
            return item.parse(raw)
        except ItemError as error:
            raise AnswerError(self.name, item.id, error.message, error.right) from error

    def score(self, answers: Mapping[str, object]) -> dict[str, float]:
        """Return the scores of one complete set of answers.

        Parameters
        ----------
        answers : mapping of str to answer
            As returned by `validate`; for an instrument that asks about each clip or word, the answers about one.

        Returns
        -------
        dict of str to float
            Value of each score.

        Raises
        ------
        AnswerError
            If an answer is missing or not valid.
        """
        checked = self.validate(answers)
        numbers = {item: answer for item, answer in checked.items() if isinstance(answer, int)}
        return {score.name: score.value(numbers) for score in self.scores}

    def partial_scores(self, answers: Mapping[str, int]) -> dict[str, float]:
        """Return those scores whose items all have an answer, from valid keyed numbers about one clip or word."""
        return {score.name: score.value(answers) for score in self.scores if score.weights.keys() <= answers.keys()}

    def dimensions(self, *, labels: bool = False) -> tuple[str, ...]:
        """Return what raters of an annotation rate with it: its scores, or else the items with numbers.

        Parameters
        ----------
        labels : bool
            Also the items of which one option is chosen: raters can agree on labels, which have no mean.
        """
        if self.scores:
            return tuple(score.name for score in self.scores)
        chosen = [item.id for item in self.items if labels and isinstance(item, ChoiceItem) and not item.multiple]
        return tuple(item.id for item in self.items if item.numeric or item.id in chosen)

    def score_table(self, answers: pd.DataFrame) -> pd.DataFrame:
        """Return the scores of many sets of answers at once.

        Parameters
        ----------
        answers : pandas.DataFrame
            One row for each set of answers, one numeric column for each item that a score needs; NaN where an answer
            is missing.

        Returns
        -------
        pandas.DataFrame
            The same rows, one column for each score; NaN where an item the score needs is missing.
        """
        return pd.DataFrame({score.name: score.column(answers) for score in self.scores}, index=answers.index)

    def codebook(self) -> list[CodebookRow]:
        """Return one row for each item and each score, in English or, if it has none, in its first language."""
        language = "en" if "en" in self.languages else self.languages[0]
        suffix, about = ("", "") if self.per == "trial" else ("-k", f" (of the {self.per} k, from 1)")
        items = [
            CodebookRow(
                variable=f"{self.name}.{item.id}{suffix}",
                text=f"{item.text(language)}{about}",
                values=item.describe_values(language),
                scoring=", ".join(self._used_in(item.id)),
                source=self.source,
            )
            for item in self.items
        ]
        values = {item.id: item.values for item in self.items}
        each = "" if self.per == "trial" else f" (of each {self.per})"
        scores = [
            CodebookRow(score.name, f"{score.text}{each}", score.describe_values(values), score.formula, score.source)
            for score in self.scores
        ]
        return items + scores

    def _used_in(self, item: str) -> list[str]:
        weights = {score.name: score.weights[item] for score in self.scores if item in score.weights}
        return [f"{name} ({'+' if weight > 0 else ''}{weight})" for name, weight in weights.items()]


def clip_letter(place: int) -> str:
    """Return how people call the clip at a place, counted from 1: A, B ... Z, then 27, 28 ..."""
    return chr(ord("A") + place - 1) if place <= 26 else str(place)


def _about(subject: str, prompt: Texts | None, languages: frozenset[str]) -> Texts:
    if prompt is None:
        return dict.fromkeys(sorted(languages), subject)
    return {language: f"{subject} – {text}" for language, text in prompt.items()}


def _times(factor: int, item: str) -> str:
    return item if factor == 1 else f"{factor} * {item}"
