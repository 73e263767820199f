"""The page "papers beside ours": the tables of both papers, recomputed from what they print."""

import itertools
from collections.abc import Sequence

import pandas as pd

from evaluation.report import html, papers_acii, papers_mtap, papers_pad
from evaluation.report.block import Block
from evaluation.report.printed_check import COLUMNS, HEADER, NO, ROUNDING, YES
from evaluation.report.section import NOTHING, Section
from evaluation.statistics.printed_tables import ACII, MTAP, citation

TITLE = "The papers' tables beside ours"

_MISSING = (
    ("MTAP 2013, section 2.4", "SD and pairwise r of the evaluators", "ratings of 5 evaluators for 486 samples"),
    (
        "MTAP 2013, section 3.1",
        "27.3 frames a period, 7.36 frames a syllable",
        "the angles and the timing of the speech",
    ),
    ("MTAP 2013, Table 3", "range, SD and averages of head rotation", "the angles"),
    ("MTAP 2013, section 4.3", "canonical r of .81, mean r of PEPs of .31", "PAD and PEP of the samples"),
    ("MTAP 2013, Table 6", "NMSE and ρ of each PEP", "measured and predicted PEP of the samples"),
    ("MTAP 2013, Table 8", "evaluated PAD", "answers of 15 raters to 12 items"),
    ("MTAP 2013, Table 10", "mean opinion scores and F", "the scores, or the SD of sentences' means"),
    ("ACII 2007, Table 6", "mean PAD of each expression", "annotations of 213 images"),
    ("ACII 2007, Table 7", "r of each PEP", "measured and predicted PEP of the images"),
    ("ACII 2007, Table 8", "evaluated PAD", "answers of 14 raters to 12 items"),
)


def blocks() -> tuple[Block, ...]:
    """Return the page's blocks: where the print does not reproduce, each table of each paper, and what is out of reach.

    Returns
    -------
    tuple of Block
        The same at every call. The first block's sentences say how many printed numbers agree.

    Notes
    -----
    A printed number agrees if the recomputed one, rounded as it was, is the same. Where inputs are printed with few
    digits, the recomputed number is also given with the lowest and the highest value that they can have given before
    they were rounded; a printed number within reach of these agrees only with unrounded inputs.
    """
    mtap, acii = papers_mtap.blocks(), papers_acii.blocks()
    tables = (
        *_after(mtap, "mtap_table_8", papers_pad.scale(MTAP)),
        *_after(acii, "acii_table_8", papers_pad.scale(ACII)),
        papers_pad.common_words(),
    )
    return (_overview(tables), *tables, _missing())


def render_papers() -> str:
    """Return the page as the text of one HTML file that needs nothing else, the same at every call."""
    found = blocks()
    return html.page(
        "papers.html",
        title=TITLE,
        headline=[sentence for block in found for sentence in block.sentences],
        sections=[section for block in found for section in block.sections],
        papers=[citation(MTAP), citation(ACII)],
        strong=(NO, ROUNDING),
    )


def _after(found: Sequence[Block], name: str, block: Block) -> list[Block]:
    place = next(k for k, one in enumerate(found) if one.sections[0].name == name)
    return [*found[: place + 1], block, *found[place + 1 :]]


def _overview(tables: Sequence[Block]) -> Block:
    checked = [block for block in tables if list(block.frames[block.sections[0].frame].columns) == list(COLUMNS)]
    frames, rows = [], []
    for block in checked:
        section = block.sections[0]
        frame = block.frames[section.frame]
        apart = frame["agrees"].isin([NO, ROUNDING])
        place = section.title.partition(":")[0]
        frames.append(frame.assign(place=place))
        for row in itertools.compress(section.rows, apart):
            number, *others = row
            rows.append((f"{place}: {number}", *others, *[NOTHING] * (len(HEADER) - len(row))))
    everything = pd.concat(frames, ignore_index=True)[["place", *COLUMNS]]
    counts = everything["agrees"].value_counts()
    yes, rounding, no = (int(counts.get(verdict, 0)) for verdict in (YES, ROUNDING, NO))
    sentences = (
        f"{yes + rounding + no} printed numbers can be recomputed from other printed ones: {yes} agree, {rounding} can "
        f"agree only if its inputs were not rounded, {no} do not reproduce.",
        "What does not reproduce may come from inputs that are not printed; nothing follows from it about the data.",
    )
    notes = (
        "“Yes” means that the recomputed number rounds to the printed one; “if unrounded”, that it does not, but that "
        "inputs with more digits than printed can have given it. The column “Unrounded” shows what such inputs can "
        "have given; there is none where the inputs are counts.",
    )
    section = Section("papers_overview", "Where the print does not reproduce", HEADER, 2, tuple(rows), notes)
    return Block((section,), {"papers_overview": everything}, sentences)


def _missing() -> Block:
    header = ("Place", "Printed", "What is not printed")
    section = Section("papers_missing", "What cannot be recomputed from the print", header, 3, _MISSING)
    return Block((section,), {"papers_missing": pd.DataFrame(_MISSING, columns=["place", "printed", "needed"])})
