"""What the two papers print: the one home of their tables and of the figures in their text.

Inputs of a recomputation are numbers; what is to be recomputed is text, since its digits say how it was rounded.
"""

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import pandas as pd

from evaluation.errors import DataError

MTAP, ACII = "mtap_2013", "acii_2007"
"""Names of the papers: Jia et al. (2013), and Zhang et al. (2007)."""


class PrintedTable(NamedTuple):
    """A table of a paper.

    Attributes
    ----------
    frame : pandas.DataFrame
        Its rows; numbers to compute with are numbers, numbers to check are texts.
    unit : float
        The last digit of its numbers, for instance 0.01: each may be off by half of that.
    last : tuple of str
        Its last line of sums or averages, as printed; empty if it has none.
    """

    frame: pd.DataFrame
    unit: float
    last: tuple[str, ...]


def table(paper: str, number: int) -> PrintedTable:
    """Return a table of a paper.

    Parameters
    ----------
    paper : str
        `MTAP` or `ACII`.
    number : int
        Its number in the paper.

    Raises
    ------
    DataError
        If there is no such paper or its table is not among those kept here.
    """
    tables: dict[str, Any] = _paper(paper)["tables"]
    if str(number) not in tables:
        raise DataError(f"Table {number} of {paper} is not kept; there are {', '.join(tables)}.")
    found = tables[str(number)]
    frame = pd.DataFrame(found["rows"], columns=found["columns"])
    return PrintedTable(frame, float(found["unit"]), tuple(found.get("last", ())))


def figures(paper: str) -> Mapping[str, str]:
    """Return the figures in a paper's text by name, as they are printed; DataError if there is no such paper."""
    return dict(_paper(paper)["figures"])


def citation(paper: str) -> str:
    """Return authors, year, title and place of a paper; DataError if there is no such paper."""
    return str(_paper(paper)["cite"])


def rounding(text: str) -> float:
    """Return by how much a printed number may be off: half its last digit, for instance 0.005 for ``0.69``."""
    return 0.5 * 10.0 ** -len(text.partition(".")[2])


def _paper(paper: str) -> dict[str, Any]:
    papers = _content()
    if paper not in papers:
        raise DataError(f"There is no paper {paper!r}; there are {', '.join(papers)}.")
    found: dict[str, Any] = papers[paper]
    return found


@cache
def _content() -> dict[str, Any]:
    text = resources.files("evaluation.statistics").joinpath("printed_tables.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found
