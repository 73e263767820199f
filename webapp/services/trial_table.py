"""The trials of a study as columns: what was shown, when, and how much of it was played."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from webapp.models import (
    AnnotationRound,
    Clip,
    Condition,
    Participant,
    PlaybackEvent,
    Stimulus,
    Study,
    Trial,
    TrialStimulus,
)
from webapp.services import studies

TRIAL_COLUMNS = {
    "participant": "number of the participant, counted from 1 in the order of enrolment",
    "part": "name of the part of the study",
    "trial": "place of the trial in the participant's order, counted from 1 over all parts",
    "kind": "what the trial is for; only those of the kind rating count",
    "round": "round of annotation, counted from 1; empty if there are none",
    "repeats": "which trial of the participant it repeats; empty if none",
    "stimulus": "what was shown; empty if nothing is",
    "condition": "in which condition; several that were shown together are joined with ;",
    "clip": "sha-256 of all that made the clip, which leads to its lineage in the media store; several joined with ;",
    "language": "language of the pages",
    "state": "answered, shown or waiting",
    "consented_at": "when the participant agreed (UTC)",
    "shown_at": "when the trial was first on the screen (UTC); empty if not yet",
    "answered_at": "when its answers were stored (UTC); empty if not yet",
    "seconds": "time between the two",
    "watched": "share of the clip that was played, of several the smallest; empty if nothing plays",
    "plays": "how often a clip was played to its end",
}
"""The columns of `trials` and what they mean."""

_BATCH = 50_000
Ints = npt.NDArray[np.int64]
Objects = npt.NDArray[np.object_]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialTable:
    """The trials of a study, an entry of each array for each, in the order of their keys.

    Attributes
    ----------
    key, participant, position : numpy.ndarray of int, shape (trials,)
        Key in the database, number of the participant from 1, and place in the participant's order.
    part, kind : pandas.Categorical, shape (trials,)
        Name of the part, and what the trial is for.
    round : numpy.ndarray of int, shape (trials,)
        Round of annotation from 1; 0 if there is none.
    pages : numpy.ndarray of int, shape (trials,)
        Which of the different pages the trial shows.
    cells : numpy.ndarray of int, shape (pages, clips)
        The cell that each page shows at each place; the last entry of `stimuli`, which is empty, where there is none.
    stimuli, conditions : pandas.Categorical, shape (cells + 1,)
        Names of stimulus and condition of each cell; missing in the last.
    digests : tuple of str
        Digest of each cell's clip.
    """

    key: Ints
    participant: Ints
    position: Ints
    part: "pd.Categorical[Any]"
    kind: "pd.Categorical[Any]"
    round: Ints
    pages: Ints
    cells: Ints
    stimuli: "pd.Categorical[Any]"
    conditions: "pd.Categorical[Any]"
    digests: tuple[str, ...]

    def cell(self, trials: Ints, place: Ints) -> Ints:
        """Return the cells that trials (by their entries) show at places of the page, from 1."""
        last = len(self.stimuli) - 1
        inside = place <= self.cells.shape[1]
        found: Ints = np.where(inside, self.cells[self.pages[trials], np.where(inside, place, 1) - 1], last)
        return found

    @property
    def shown(self) -> Ints:
        """Return how many clips each of the different pages shows."""
        number: Ints = (self.cells < len(self.digests)).sum(axis=1)
        return number

    def joined(self, names: Sequence[str]) -> Objects:
        """Return the names of what each of the different pages shows, joined with ``;``; None for nothing."""
        found = np.empty(len(self.cells), dtype=object)
        found[:] = [";".join(names[cell] for cell in row if cell < len(self.digests)) or None for row in self.cells]
        return found

    def conditions_of_pages(self) -> Objects:
        """Return the conditions that each of the different pages shows, as a tuple."""
        names = list(self.conditions)
        found = np.empty(len(self.cells), dtype=object)
        for page, row in enumerate(self.cells):
            found[page] = tuple(names[cell] for cell in row if cell < len(self.digests))
        return found


def read_trials(session: Session, study: Study) -> TrialTable:
    """Read all trials of a study."""
    names: dict[str, dict[str, int]] = {"part": {}, "kind": {}}
    result = session.execute(
        select(
            Trial.id,
            Participant.number,
            Trial.position,
            Trial.part,
            Trial.kind,
            func.coalesce(AnnotationRound.number + 1, 0),
            func.coalesce(Trial.stimulus_id, 0),
        )
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(AnnotationRound, Trial.round_id == AnnotationRound.id)
        .where(Participant.study_id == study.id)
        .order_by(Trial.id)
    )
    parts: list[Ints] = [np.empty((7, 0), dtype=np.int64)]
    for batch in result.partitions(_BATCH):
        columns: list[Sequence[Any]] = list(zip(*batch, strict=True))
        for place, known in ((3, names["part"]), (4, names["kind"])):
            columns[place] = [known.setdefault(one, len(known)) for one in columns[place]]
        parts.append(np.array(columns, dtype=np.int64))
    key, number, position, part, kind, round_number, stimulus = np.concatenate(parts, axis=1)
    cells = _cells(session, study)
    pages, shown = _pages(session, study, key, stimulus, {one: place for place, (one, *_) in enumerate(cells)})
    return TrialTable(
        key=key,
        participant=number + 1,
        position=position,
        part=pd.Categorical.from_codes(part, pd.Index(list(names["part"]))),
        kind=pd.Categorical.from_codes(kind, pd.Index(list(names["kind"]))),
        round=round_number,
        pages=pages,
        cells=shown,
        stimuli=pd.Categorical([*(name for _, name, _, _ in cells), None]),
        conditions=pd.Categorical([*(condition for _, _, condition, _ in cells), None]),
        digests=tuple(digest for *_, digest in cells),
    )


def _cells(session: Session, study: Study) -> list[tuple[int, str, str, str]]:
    """Return key, stimulus, condition and digest of each cell."""
    rows = session.execute(
        select(Stimulus.id, Stimulus.name, Condition.name, Clip.digest)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .join(Clip, Stimulus.clip_id == Clip.id)
        .where(Stimulus.study_id == study.id)
        .order_by(Stimulus.id)
    )
    return [(key, stimulus, condition, digest) for key, stimulus, condition, digest in rows]


def _pages(session: Session, study: Study, keys: Ints, stimulus: Ints, place_of: dict[int, int]) -> tuple[Ints, Ints]:
    """Return which of the different pages each trial shows, and the cells that each page shows."""
    beside = session.execute(
        select(TrialStimulus.trial_id, TrialStimulus.stimulus_id)
        .join(Stimulus, TrialStimulus.stimulus_id == Stimulus.id)
        .where(Stimulus.study_id == study.id)
        .order_by(TrialStimulus.trial_id, TrialStimulus.place)
    )
    more: dict[int, list[int]] = {}
    for trial, other in beside:
        more.setdefault(trial, []).append(other)
    first, pages = np.unique(stimulus, return_inverse=True)
    shown = [[place_of[one]] if one else [] for one in first.tolist()]
    known = {tuple(one): page for page, one in enumerate(shown)}
    for trial, others in more.items():
        entry = int(np.searchsorted(keys, trial))
        cells = tuple(place_of[one] for one in (int(stimulus[entry]), *others))
        pages[entry] = known.setdefault(cells, len(known))
    table = np.full((len(known), max((len(one) for one in known), default=0) or 1), len(place_of), dtype=np.int64)
    for cells, page in known.items():
        table[page, : len(cells)] = cells
    return pages.astype(np.int64), table


def trials(session: Session, slug: str) -> pd.DataFrame:
    """Return one row for each trial: what was shown, when, and how much of it was played.

    Returns
    -------
    pandas.DataFrame
        The columns `TRIAL_COLUMNS`, by participant and place.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    table, plays = read_trials(session, study), _plays(session, study)
    times = [Trial.shown_at, Trial.answered_at, Participant.consented_at, Participant.language]
    rest = session.execute(
        select(Trial.repeats, Trial.watched, *times)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
        .order_by(Trial.id)
    ).all()
    repeats, watched, shown_at, answered_at, consented_at, language = zip(*rest, strict=True) if rest else ((),) * 6
    names = [f"{name}" for name in table.stimuli[:-1]]
    first = table.cell(np.arange(len(table.key)), np.ones(len(table.key), dtype=np.int64))
    states = [
        "answered" if done else "shown" if seen else "waiting" for seen, done in zip(shown_at, answered_at, strict=True)
    ]
    frame = pd.DataFrame(
        {
            "participant": table.participant,
            "part": table.part.astype(object),
            "trial": table.position,
            "kind": table.kind.astype(object),
            "round": whole(table.round, table.round > 0),
            "repeats": pd.array(list(repeats), dtype="Int64"),
            "stimulus": np.array([*names, None], dtype=object)[first],
            "condition": table.joined(list(table.conditions))[table.pages],
            "clip": table.joined(table.digests)[table.pages],
            "language": np.array(language, dtype=object),
            "state": np.array(states, dtype=object),
            "consented_at": pd.Series(consented_at, dtype=object),
            "shown_at": pd.Series(shown_at, dtype=object),
            "answered_at": pd.Series(answered_at, dtype=object),
            "seconds": [_seconds(*pair) for pair in zip(shown_at, answered_at, strict=True)],
            "watched": pd.Series(watched, dtype=float),
            "plays": [plays.get(one, 0) for one in table.key.tolist()],
        },
        columns=list(TRIAL_COLUMNS),
    )
    return frame.astype({"seconds": float}).sort_values(["participant", "trial"], ignore_index=True)


def whole(numbers: Ints, known: npt.NDArray[np.bool_]) -> pd.arrays.IntegerArray:
    """Return whole numbers, missing where they are not known."""
    return pd.arrays.IntegerArray(np.ascontiguousarray(numbers), ~known)


def _seconds(shown_at: datetime | None, answered_at: datetime | None) -> float | None:
    return None if shown_at is None or answered_at is None else (answered_at - shown_at).total_seconds()


def _plays(session: Session, study: Study) -> dict[int, int]:
    ended = (
        select(PlaybackEvent.trial_id, func.count(PlaybackEvent.id))
        .join(Trial, Trial.id == PlaybackEvent.trial_id)
        .join(Participant, Participant.id == Trial.participant_id)
        .where(Participant.study_id == study.id, PlaybackEvent.kind == "ended")
        .group_by(PlaybackEvent.trial_id)
    )
    return dict(session.execute(ended).all())
