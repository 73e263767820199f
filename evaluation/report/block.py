"""A piece of the full report: tables for reading, frames for files, sentences for the front page."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import pandas as pd

from evaluation.errors import EvaluationError
from evaluation.report.analysis import StudyReport
from evaluation.report.ratings import Unavailable
from evaluation.report.section import Section
from evaluation.statistics.result import Result

T = TypeVar("T", bound=Result)


class Block(NamedTuple):
    """A piece of the full report.

    Attributes
    ----------
    sections : tuple of Section
        Tables, their cells written out. A section without a frame of its own name names the one that its numbers come
        from in `Section.source`.
    frames : mapping of str to pandas.DataFrame
        The same with full digits, by name: each becomes a file.
    sentences : tuple of str
        Main results, for the head of the report.
    """

    sections: tuple[Section, ...]
    frames: Mapping[str, pd.DataFrame]
    sentences: tuple[str, ...] = ()


Maker = Callable[[StudyReport], Block | None]
"""Makes a block of a report; None if the study has nothing that the block is about."""


def attempt(compute: Callable[[], T]) -> T | Unavailable:
    """Return a result, or in words why there is none."""
    try:
        return compute()
    except EvaluationError as error:
        return Unavailable(str(error))


def results_section(
    name: str, title: str, results: Sequence[tuple[str, str, Result | Unavailable]], notes: Sequence[str] = ()
) -> Section:
    """Return a table that has a line for each result: what was computed, over which unit, and its sentence.

    Parameters
    ----------
    name, title : str
        Of the section.
    results : sequence of (str, str, Result or Unavailable)
        Name of the analysis, its unit, and what came out.
    notes : sequence of str
        Sentences under the table, before the flags of the results.
    """
    rows = tuple(
        (analysis, unit, found.reason if isinstance(found, Unavailable) else found.apa())
        for analysis, unit, found in results
    )
    flags = [
        f"{analysis}: {flag}" for analysis, _, found in results if isinstance(found, Result) for flag in found.flags
    ]
    return Section(name, title, ("Analysis", "Unit", "Result"), 3, rows, tuple(dict.fromkeys([*notes, *flags])))


def stacked(
    results: Mapping[str, Result | Unavailable],
    column: str,
    frame_of: Callable[[Result], pd.DataFrame] = lambda found: found.to_frame(),
) -> pd.DataFrame:
    """Return the frames of several results one under the other, with a first column that tells them apart."""
    found = {name: frame_of(result) for name, result in results.items() if isinstance(result, Result)}
    if not found:
        return pd.DataFrame(columns=[column])
    table = pd.concat([frame.assign(**{column: name}) for name, frame in found.items()], ignore_index=True)
    return table[[column, *(other for other in table.columns if other != column)]]
