"""What the two papers print of their models, to stand beside ours."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PublishedTable:
    """A printed table of numbers.

    Attributes
    ----------
    source : str
        Where it is printed, and on which data it rests.
    columns : tuple of str
        What the columns are.
    values : (R, C) float64
        The numbers.
    """

    source: str
    columns: tuple[str, ...]
    values: Floats

    def column(self, name: str) -> Floats:
        """Return one column (R,)."""
        return self.values[:, self.columns.index(name)]


@cache
def _data() -> Mapping[str, Any]:
    text = resources.files("synth.data").joinpath("published_models.json").read_text(encoding="utf-8")
    data: Mapping[str, Any] = json.loads(text)
    return data


def _table(name: str) -> PublishedTable:
    row = _data()[name]
    return PublishedTable(row["source"], tuple(row["columns"]), np.array(row["rows"], dtype=np.float64))


def mtap_table_6() -> PublishedTable:
    """Return MTAP 2013, Table 6: rows are the nine PEPs."""
    return _table("mtap2013_table6")


def acii_table_7() -> PublishedTable:
    """Return ACII 2007, Table 7: rows are the twelve measured PEPs, in the order of the table."""
    return _table("acii2007_table7")


def acii_table_4() -> PublishedTable:
    """Return ACII 2007, Table 4: how many expressions of each intended emotion are in each cluster of PEPs."""
    return _table("acii2007_table4")


FIRST_CANONICAL_CORRELATION = 0.81
"""Of PAD and PEP (MTAP 2013, section 4.3)."""

HIDDEN = 8
"""The best number of hidden units (MTAP 2013, section 4.4)."""
