"""Errors of the evaluation package: each message says what is wrong, where, and what would be right."""

from collections.abc import Sequence
from typing import NamedTuple


class EvaluationError(Exception):
    """Base of every error that ``evaluation`` raises on purpose."""


class Problem(NamedTuple):
    """One thing that is wrong in a study file.

    Attributes
    ----------
    line : int or None
        Line in the file, counted from 1; None if the problem has no place (an empty file, say).
    field : str
        Path of the field, for instance ``conditions[0].label.zh``; empty for the file as a whole.
    message : str
        What is wrong and what would be right.
    """

    line: int | None
    field: str
    message: str


class StudyFileError(EvaluationError):
    """A study file cannot be read or does not describe a study.

    Parameters
    ----------
    name : str
        Name of the file.
    problems : sequence of Problem
        Everything that was found, at least one; ``line`` and ``field`` are those of the first.
    """

    def __init__(self, name: str, problems: Sequence[Problem]) -> None:
        self.name = name
        self.problems = tuple(problems)
        self.line = self.problems[0].line
        self.field = self.problems[0].field
        super().__init__("\n".join(self._sentence(problem) for problem in self.problems))

    def _sentence(self, problem: Problem) -> str:
        place = [self.name]
        if problem.line is not None:
            place.append(f"line {problem.line}")
        if problem.field:
            place.append(problem.field)
        return f"{', '.join(place)}: {problem.message}"


class AnswerError(EvaluationError):
    """An answer to an instrument is missing or not one of those offered.

    Parameters
    ----------
    instrument : str
        Name of the instrument.
    item : str
        Id of the item.
    message : str
        What is wrong.
    right : str
        What would be right, for instance ``a whole number from -4 to 4``.
    """

    def __init__(self, instrument: str, item: str, message: str, right: str) -> None:
        self.instrument = instrument
        self.item = item
        self.right = right
        super().__init__(f"{instrument}, {item}: {message}; {right} is needed.")


class DataError(EvaluationError, ValueError):
    """Data have the wrong shape, columns or values: nothing can be computed from them until they are mended."""


class InsufficientDataError(EvaluationError):
    """The data are sound, but too few or too alike for the statistic asked for."""
