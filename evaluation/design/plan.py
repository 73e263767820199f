"""What a participant will do in one part of a study, trial by trial."""

from dataclasses import dataclass
from typing import Literal

from evaluation.study_parts import Cell

TrialKind = Literal["before", "training", "rating", "repeat", "gold", "instructed", "after"]
KINDS: tuple[TrialKind, ...] = ("before", "training", "rating", "repeat", "gold", "instructed", "after")
COUNTING: tuple[TrialKind, ...] = ("rating",)
"""The kinds whose answers are the study's data; repeats tell of reliability, the others of the rater."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedTrial:
    """One page of a participant.

    Attributes
    ----------
    kind : str
        "rating" counts; "repeat" is a rating's second time; "training", "gold" and "instructed" are those of the study
        file; "before" and "after" ask one instrument without a clip.
    cells : tuple of Cell
        What is shown, from left to right or top to bottom; none, one, or several that are rated together.
    instruments : tuple of str
        What is asked, in the order of the page.
    check : int or None
        Place in the part's training, gold or instructed, from 0.
    repeats : int or None
        Place, in the part's plan, of the trial that this one repeats, from 0.
    """

    kind: TrialKind
    cells: tuple[Cell, ...] = ()
    instruments: tuple[str, ...] = ()
    check: int | None = None
    repeats: int | None = None
