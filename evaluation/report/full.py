"""The full report: all that a study's data can say, block by block."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import pandas as pd

from evaluation.report import tables
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, Maker
from evaluation.report.comparison import comparison
from evaluation.report.design import design
from evaluation.report.methods import methods
from evaluation.report.pad_results import intended_words, pad_results
from evaluation.report.precision import precision
from evaluation.report.rater_agreement import rater_agreement, rater_consistencies
from evaluation.report.rater_quality import rater_quality
from evaluation.report.scale_quality import scale_quality
from evaluation.report.section import Section
from evaluation.statistics.wording import counted

MAKERS: Mapping[str, Maker] = MappingProxyType(
    {
        "comparison": comparison,
        "precision": precision,
        "pad_results": pad_results,
        "intended_words": intended_words,
        "rater_agreement": rater_agreement,
        "rater_consistencies": rater_consistencies,
        "rater_quality": rater_quality,
        "scale_quality": scale_quality,
    }
)
"""What makes each block, in the order of reading."""

_NOT_TWICE = frozenset({"rater_quality", "rater_consistencies"})
"""Blocks that are not repeated for the raters used alone."""


@dataclass(frozen=True, eq=False)
class FullReport:
    """A study's report with everything.

    Attributes
    ----------
    report : StudyReport
        The main results, which the experimenter's page shows, too.
    """

    report: StudyReport

    @cached_property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks that the study has something for, by name; those of the raters used alone as ``NAME_used``."""
        found = {"design": design(self.report)}
        for name, make in MAKERS.items():
            block = make(self.report)
            if block is not None:
                found[name] = block
            again = make(self.report.used) if self.report.used is not None and name not in _NOT_TWICE else None
            if again is not None:
                found[f"{name}_used"] = _of_used(again, self.report.used.participants if self.report.used else 0)
        return found

    @property
    def sections(self) -> tuple[Section, ...]:
        """All tables in the order of reading: the design, the main results, then the blocks."""
        blocks = dict(self.blocks)
        first = blocks.pop("design").sections
        return (*first, *tables.sections(self.report), *(one for block in blocks.values() for one in block.sections))

    @property
    def frames(self) -> dict[str, pd.DataFrame]:
        """All numbers with full digits; each section's are in the frame that it names."""
        found = tables.frames(self.report)
        for block in self.blocks.values():
            found.update(block.frames)
        return found

    @property
    def headline(self) -> list[str]:
        """The main results as sentences."""
        return [*(one for block in self.blocks.values() for one in block.sentences), *tables.headline(self.report)]

    @property
    def further(self) -> tuple[str, ...]:
        """Names of the frames that no table on the page is made of."""
        shown = {section.frame for section in self.sections}
        return tuple(name for name in self.frames if name not in shown)

    @property
    def methods(self) -> str:
        """A paragraph on methods for a paper."""
        return methods(self.report, self.blocks)


def _of_used(block: Block, raters: int) -> Block:
    """Return a block under the names that tell that it is about the raters used."""
    sections = tuple(
        one._replace(
            name=f"{one.name}_used",
            title=f"{one.title} – the {counted(raters, 'rater')} used",
            source=f"{one.source}_used" if one.source else "",
        )
        for one in block.sections
    )
    frames = {f"{name}_used": frame for name, frame in block.frames.items()}
    return Block(sections, frames, tuple(f"With the {counted(raters, 'rater')} used: {one}" for one in block.sentences))
