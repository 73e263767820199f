"""What was collected: every counting answer."""

import json
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from sqlalchemy import Text, cast, select
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import Instrument
from evaluation.study import StudySpec
from webapp.models import Participant, Response, Study, Trial
from webapp.services import studies
from webapp.services.trial_table import TRIAL_COLUMNS, Ints, TrialTable, read_trials, whole

ANSWER_COLUMNS = {
    **{name: TRIAL_COLUMNS[name] for name in ("participant", "part", "trial", "kind", "round")},
    "stimulus": "id of the stimulus in the study file; empty if nothing is shown",
    "condition": "name of the condition in the study file; empty if nothing is shown",
    "clip": "place of the clip on the page that the answer is about, counted from 1; the first of a question about all",
    "instrument": "name of the instrument",
    "item": "id of the item in the instrument",
    "word": "which word of the sentence the answer is about, counted from 1; empty if none",
    "raw": "the answer as it stood on the page; several of one question are joined with ;",
    "flipped": "whether the poles had changed sides on the page",
    "place": "place of the item on the page, counted from 1; empty for answers from before that was kept",
    "keyed": "the answer as if no poles had changed sides",
}
"""The columns of `answers` and what they mean."""

_BATCH = 50_000


def answers(session: Session, slug: str) -> pd.DataFrame:
    """Return all counting answers of a study (the last revision of each), one row for each item.

    Returns
    -------
    pandas.DataFrame
        The columns `ANSWER_COLUMNS`. Several answers of a multiple choice are a tuple.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    return as_frame(read(session, studies.find(session, slug)))


def as_frame(rows: pd.DataFrame) -> pd.DataFrame:
    """Return answers, as `read` returns them, as the table that `answers` describes."""
    table = rows[list(ANSWER_COLUMNS)]
    return table.astype({column: object for column in table if isinstance(table[column].dtype, pd.CategoricalDtype)})


def read(session: Session, study: Study) -> pd.DataFrame:
    """Return all counting answers of a study, by participant and trial, in a form that stays small for millions.

    Pages that were answered alike are read once, and names are categories.

    Returns
    -------
    pandas.DataFrame
        The columns `ANSWER_COLUMNS`, names as categories; then `shown`, the number of clips that the trial shows, and
        `conditions`, a tuple of their conditions in the order of the page.
    """
    spec = studies.spec_of(study)
    trials = read_trials(session, study)
    given = _read_pages(session, study, spec)
    place = np.searchsorted(trials.key, given.trial)
    order = _counting(given, trials.participant[place], trials.position[place])
    return _table(given.pages, given.page[order], place[order], trials)


class _Given(NamedTuple):
    """Answers to one instrument in one trial: arrays with an entry for each revision, and the different pages."""

    trial: Ints
    instrument: Ints
    revision: Ints
    page: Ints
    pages: list["_Page"]


class _Page(NamedTuple):
    """The answers to one instrument on one page."""

    instrument: Instrument
    keyed: Mapping[str, Any]
    raw: Mapping[str, Any]
    display: Mapping[str, Any]

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Yield clip, item, word, raw, flipped, place and keyed, in the order of clips or words, then of items."""
        order = {item: place for place, item in enumerate(self.display.get("order", ()), start=1)}
        items = {item.id: place for place, item in enumerate(self.instrument.items)}
        split = {key: self._split(key) for key in self.keyed}
        for key in sorted(self.keyed, key=lambda key: (split[key][1], items.get(split[key][0], len(items)))):
            item, place = split[key]
            yield (
                place if self.instrument.per == "clip" else 1,
                item,
                place if self.instrument.per == "word" else None,
                _plain(self.raw.get(key, self.keyed[key])),
                key in self.display.get("flipped", ()),
                order.get(key),
                _plain(self.keyed[key]),
            )

    def _split(self, key: str) -> tuple[str, int]:
        if self.instrument.per == "trial":
            return key, 1
        item, _, place = key.rpartition("-")
        return item, int(place)


def _plain(answer: Any) -> Any:
    return tuple(answer) if isinstance(answer, list) else answer


def _read_pages(session: Session, study: Study, spec: StudySpec) -> _Given:
    """Read all answers, each different page once; texts are compared as they are stored."""
    result = session.execute(
        select(
            Response.trial_id,
            Response.revision,
            Response.instrument,
            cast(Response.answers, Text),
            cast(Response.raw, Text),
            cast(Response.display, Text),
        )
        .join(Trial, Response.trial_id == Trial.id)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
        .order_by(Response.id)
    )
    instruments: dict[str, int] = {}
    known: dict[tuple[str, ...], int] = {}
    parts: list[Ints] = [np.empty((4, 0), dtype=np.int64)]
    for batch in result.partitions(_BATCH):
        columns = list(zip(*batch, strict=True))
        trial, revision, names = columns[:3]
        page = [known.setdefault(texts, len(known)) for texts in zip(*columns[2:], strict=True)]
        asked = [instruments.setdefault(one, len(instruments)) for one in names]
        parts.append(np.array([trial, asked, revision, page], dtype=np.int64))
    named = {name: _instrument(spec, name) for name in instruments}
    pages = []
    for name, *texts in known:
        keyed, raw, display = (json.loads(text or "null") or {} for text in texts)
        pages.append(_Page(named[name], keyed, raw, display))
    trials, asked_in, revisions, page_of = np.concatenate(parts, axis=1)
    return _Given(trials, asked_in, revisions, page_of, pages)


def _instrument(spec: StudySpec, name: str) -> Instrument:
    own = {definition.name for definition in spec.own_instruments}
    return DISCUSSION if name == DISCUSSION.name and name not in own else spec.instrument(name)


def _counting(given: _Given, participant: Ints, position: Ints) -> Ints:
    """Return where the last revision of each page is, by participant and trial, then as first answered."""
    order = np.lexsort((given.revision, position, participant))
    # Pages of one trial are next to each other now; a later revision of one comes later and replaces the earlier.
    key = given.trial[order] * (int(given.instrument.max(initial=0)) + 1) + given.instrument[order]
    _, first = np.unique(key, return_index=True)
    _, last = np.unique(key[::-1], return_index=True)
    counting: Ints = order[len(key) - 1 - last[np.argsort(first)]]
    return counting


def _table(pages: list[_Page], page: Ints, place: Ints, trials: TrialTable) -> pd.DataFrame:
    """Return a row for each item of each page; `place` tells the trial of each page."""
    rows = [list(one.rows()) for one in pages]
    length = np.array([len(one) for one in rows], dtype=np.int64)
    begin, times = np.cumsum(length) - length, length[page]
    # For each row of the table: which page it belongs to, and which of the different rows it is.
    owner = np.repeat(place, times)
    row = np.arange(len(owner)) + np.repeat(begin[page] - (np.cumsum(times) - times), times)
    clip, item, word, raw, flipped, where, keyed = _columns(rows)
    number = np.array(clip, dtype=np.int64)[row]
    shown = trials.shown[trials.pages[owner]]
    cell = trials.cell(owner, number)
    names = pd.Categorical([one.instrument.name for one in pages])
    return pd.DataFrame(
        {
            "participant": trials.participant[owner],
            "part": trials.part[owner],
            "trial": trials.position[owner],
            "kind": trials.kind[owner],
            "round": whole(trials.round[owner], trials.round[owner] > 0),
            "stimulus": trials.stimuli[cell],
            "condition": trials.conditions[cell],
            "clip": whole(number, shown > 0),
            "instrument": names[np.repeat(page, times)],
            "item": pd.Categorical(item)[row],
            "word": pd.array(word, dtype="Int64")[row],
            "raw": _objects(raw)[row],
            "flipped": np.array(flipped, dtype=bool)[row],
            "place": pd.array(where, dtype="Int64")[row],
            "keyed": _objects(keyed)[row],
            "shown": shown,
            "conditions": trials.conditions_of_pages()[trials.pages[owner]],
        }
    )


def _columns(rows: list[list[tuple[Any, ...]]]) -> list[list[Any]]:
    columns: list[list[Any]] = [[], [], [], [], [], [], []]
    for one in rows:
        for entry in one:
            for column, value in zip(columns, entry, strict=True):
                column.append(value)
    return columns


def _objects(values: list[Any]) -> npt.NDArray[np.object_]:
    found = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        found[place] = value
    return found
