"""Answers to items as forms and JSON bring them: read strictly, refused with what would be right."""

import re
from collections.abc import Sequence

from evaluation.errors import EvaluationError

# Only ASCII digits: int() alone would also take "٤", "1_0" and " 4 ".
_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]{1,9}")


class ItemError(EvaluationError):
    """An answer to an item is missing or not one of those offered; `Instrument.validate_item` says whose.

    Parameters
    ----------
    message : str
        What is wrong.
    right : str
        What would be right.
    """

    def __init__(self, message: str, right: str) -> None:
        self.message = message
        self.right = right
        super().__init__(f"{message}; {right} is needed.")


def is_missing(raw: object) -> bool:
    """Tell whether there is no answer."""
    return raw is None or raw == ""


def one_of(raw: object, values: Sequence[int]) -> int:
    """Return an answer as a whole number.

    Parameters
    ----------
    raw : object
        As a form sends it (``"-3"``) or as JSON (``-3``).
    values : sequence of int
        The answers offered.

    Returns
    -------
    int
        One of `values`.

    Raises
    ------
    ItemError
        If it is missing, no whole number, or not one of the answers offered.
    """
    right = _range_text(values)
    if is_missing(raw):
        raise ItemError("there is no answer", right)
    if isinstance(raw, str) and _WHOLE_NUMBER.fullmatch(raw):
        value = int(raw)
    elif isinstance(raw, int) and not isinstance(raw, bool):
        value = raw
    else:
        raise ItemError(f"{shown(raw)} is not a whole number", right)
    if value not in values:
        raise ItemError(f"{shown(value)} is not one of the answers offered", right)
    return value


def shown(raw: object) -> str:
    """Return an answer for a message, cut off where it is long."""
    if isinstance(raw, int) and abs(raw) > 10**30:
        return "the number"
    text = repr(raw)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _range_text(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    if len(values) == high - low + 1:
        return f"a whole number from {low} to {high}"
    return f"one of {listed(values)}"


def listed(values: Sequence[int]) -> str:
    """Return the answers offered for a message."""
    return ", ".join(str(value) for value in values)
