"""What was collected: every counting answer."""

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from sqlalchemy import Executable, Text, cast, select
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import Instrument
from evaluation.study import StudySpec
from webapp.models import AnnotationRound, Participant, Response, Study, Trial
from webapp.services import studies
from webapp.services.shown import Shown, shows
from webapp.services.trial_table import TRIAL_COLUMNS

Ints = npt.NDArray[np.int64]

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


def read(session: Session, study: Study, *, displayed: bool = True) -> pd.DataFrame:
    """Return all counting answers of a study, by participant and trial, in a form that stays small for millions.

    Pages that were answered alike are read once, and names are categories.

    Parameters
    ----------
    displayed : bool
        Whether to read how the page stood, too; without, `raw` is the keyed answer, nothing is `flipped`, and there is
        no `place`.

    Returns
    -------
    pandas.DataFrame
        The columns `ANSWER_COLUMNS`, names as categories; then `shown`, the number of clips that the trial shows, and
        `conditions`, a tuple of their conditions in the order of the page.
    """
    given = _read(session, study, displayed=displayed)
    counting = _counting(given)
    return _table(given, counting)


class _Given(NamedTuple):
    """All answers to one instrument in one trial, in all revisions: arrays with an entry for each.

    Attributes
    ----------
    key, revision, trial, position, participant, instrument : numpy.ndarray of int
        What tells the answers apart.
    page, about : numpy.ndarray of int
        Places of the answers in `pages`, and of the trial in `abouts`.
    pages : list of _Page
        The different answers.
    abouts : list of _About
        The different trials, but for who answered them when.
    """

    key: Ints
    revision: Ints
    trial: Ints
    position: Ints
    participant: Ints
    instrument: Ints
    page: Ints
    about: Ints
    pages: list["_Page"]
    abouts: list["_About"]


class _About(NamedTuple):
    """What a trial is, apart from who answered it."""

    part: str
    kind: str
    round: int | None
    clips: tuple[Shown, ...]


class _Place(NamedTuple):
    """What a key of the stored answers stands for; `word` is None unless the instrument asks about words."""

    key: str
    item: str
    clip: int
    word: int | None


class _Page(NamedTuple):
    """The answers to one instrument on one page."""

    instrument: Instrument
    keyed: Mapping[str, Any]
    raw: Mapping[str, Any]
    display: Mapping[str, Any]

    def rows(self, places: Sequence[_Place]) -> Iterator[tuple[Any, ...]]:
        """Yield clip, item, word, raw, flipped, place and keyed of each answer."""
        order = {item: place for place, item in enumerate(self.display.get("order", ()), start=1)}
        flipped, raw, keyed = self.display.get("flipped", ()), self.raw, self.keyed
        for key, item, clip, word in places:
            answer = keyed[key]
            yield clip, item, word, _plain(raw.get(key, answer)), key in flipped, order.get(item), _plain(answer)

    def places(self) -> list[_Place]:
        """Return what the keys stand for, in the order of clips or words, then of items."""
        items = {item.id: place for place, item in enumerate(self.instrument.items)}
        found = [self._place(key) for key in self.keyed]
        return sorted(found, key=lambda one: (one.word or one.clip, items.get(one.item, len(items))))

    def _place(self, key: str) -> _Place:
        per = self.instrument.per
        if per == "trial":
            return _Place(key, key, 1, None)
        item, _, number = key.rpartition("-")
        return _Place(key, item, int(number) if per == "clip" else 1, int(number) if per == "word" else None)


def _plain(answer: Any) -> Any:
    return tuple(answer) if isinstance(answer, list) else answer


def _read(session: Session, study: Study, *, displayed: bool) -> _Given:
    """Read all answers, those with the same text, and trials that show the same, once."""
    spec, found = studies.spec_of(study), shows(session, study)
    texts = (Response.answers, Response.raw, Response.display) if displayed else (Response.answers,)
    statement = (
        select(
            *(Response.id, Response.revision, Response.trial_id, Trial.position, Participant.number),
            *(Trial.part, Trial.kind, AnnotationRound.number, Trial.stimulus_id),
            *(Response.instrument, *(cast(text, Text) for text in texts)),
        )
        .select_from(Response)
        .join(Trial, Response.trial_id == Trial.id)
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(AnnotationRound, Trial.round_id == AnnotationRound.id)
        .where(Participant.study_id == study.id)
    )
    pages: dict[tuple[str, ...], int] = {}
    abouts: dict[tuple[Any, ...], int] = {}
    parts: list[Ints] = [np.empty((7, 0), dtype=np.int64)]
    for batch in _batches(session, statement):
        columns = list(zip(*batch, strict=True))
        beside = map(found.beside.get, columns[2], repeat(()))
        codes = (
            [pages.setdefault(page, len(pages)) for page in zip(*columns[9:], strict=True)],
            [abouts.setdefault(about, len(abouts)) for about in zip(*columns[5:9], beside, strict=True)],
        )
        parts.append(np.array([*columns[:5], *codes], dtype=np.int64))
    named = {name: _instrument(spec, name) for name in dict.fromkeys(name for name, *_ in pages)}
    # No text, or the text null, stands for answers from before raw and display were kept.
    read = [(named[name], [json.loads(text or "null") or {} for text in page]) for name, *page in pages]
    key, revision, trial, position, participant, page, about = np.concatenate(parts, axis=1)
    number = {name: place for place, name in enumerate(named)}
    instrument = np.array([number[name] for name, *_ in pages], dtype=np.int64)
    return _Given(
        *(key, revision, trial, position, participant, instrument[page] if pages else page, page, about),
        [_Page(asked, *[*texts, {}, {}][:3]) for asked, texts in read],
        [
            _About(part, kind, None if number is None else number + 1, found.page(stimulus, others))
            for part, kind, number, stimulus, others in abouts
        ],
    )


def _batches(session: Session, statement: Executable) -> Iterator[Sequence[Sequence[Any]]]:
    """Yield the rows of a question, some thousands at a time, since there may be millions."""
    connection = session.connection()
    if connection.dialect.name == "sqlite":
        # The driver's own tuples: to make rows of them takes as long again, and here is nothing to convert.
        cursor = connection.execute(statement).cursor
        while cursor is not None and (batch := cursor.fetchmany(_BATCH)):
            yield batch
    else:
        yield from connection.execute(statement.execution_options(yield_per=_BATCH)).partitions()


def _instrument(spec: StudySpec, name: str) -> Instrument:
    own = {definition.name for definition in spec.own_instruments}
    return DISCUSSION if name == DISCUSSION.name and name not in own else spec.instrument(name)


def _counting(given: _Given) -> Ints:
    """Return where the last revision of each page is, by participant and trial, then as first answered."""
    order = np.lexsort((given.key, given.revision, given.position, given.participant))
    # Answers of one trial are next to each other now; a later revision comes later and replaces the earlier.
    page = given.trial[order] * (int(given.instrument.max(initial=0)) + 1) + given.instrument[order]
    _, first = np.unique(page, return_index=True)
    _, last = np.unique(page[::-1], return_index=True)
    counting: Ints = order[len(page) - 1 - last[np.argsort(first)]]
    return counting


def _table(given: _Given, counting: Ints) -> pd.DataFrame:
    """Return a row for each item of each page that counts."""
    # Pages of one instrument have the same keys, but for answers that are missing.
    places: dict[tuple[str, frozenset[str]], list[_Place]] = {}
    rows = []
    for one in given.pages:
        keys = (one.instrument.name, frozenset(one.keyed))
        if keys not in places:
            places[keys] = one.places()
        rows.append(list(one.rows(places[keys])))
    length = np.array([len(one) for one in rows], dtype=np.int64)
    page = given.page[counting]
    begin, times = np.cumsum(length) - length, length[page]
    # For each row of the table: the answers that it belongs to, and which of the different rows it is.
    owner = np.repeat(counting, times)
    row = np.arange(len(owner)) + np.repeat(begin[page] - (np.cumsum(times) - times), times)
    clip, item, word, raw, flipped, where, keyed = _columns(rows)
    number = np.array(clip, dtype=np.int64)[row]
    about = given.about[owner]
    shown = np.array([len(one.clips) for one in given.abouts], dtype=np.int64)
    return pd.DataFrame(
        {
            "participant": given.participant[owner] + 1,
            "part": pd.Categorical([one.part for one in given.abouts])[about],
            "trial": given.position[owner],
            "kind": pd.Categorical([one.kind for one in given.abouts])[about],
            "round": pd.array([one.round for one in given.abouts], dtype="Int64")[about],
            "stimulus": _names([[clip.stimulus for clip in one.clips] for one in given.abouts], about, number),
            "condition": _names([[clip.condition for clip in one.clips] for one in given.abouts], about, number),
            "clip": pd.arrays.IntegerArray(number, shown[about] == 0),
            "instrument": pd.Categorical([one.instrument.name for one in given.pages])[given.page[owner]],
            "item": pd.Categorical(item)[row],
            "word": pd.array(word, dtype="Int64")[row],
            "raw": _objects(raw)[row],
            "flipped": np.array(flipped, dtype=bool)[row],
            "place": pd.array(where, dtype="Int64")[row],
            "keyed": _objects(keyed)[row],
            "shown": shown[about],
            "conditions": _objects([tuple(clip.condition for clip in one.clips) for one in given.abouts])[about],
        }
    )


def _names(lists: list[list[str]], which: Ints, place: Ints) -> "pd.Categorical[Any]":
    """Return the names at places, from 1, of some of the lists; missing where a list is shorter."""
    widest = max(map(len, lists), default=0)
    names = pd.Categorical([*(name for one in lists for name in [*one, *[None] * (widest - len(one))]), None])
    inside = place <= widest
    return names[np.where(inside, which * widest + place - 1, len(names) - 1)]


def _columns(rows: list[list[tuple[Any, ...]]]) -> list[list[Any]]:
    flat = [entry for one in rows for entry in one]
    return [list(column) for column in zip(*flat, strict=True)] if flat else [[], [], [], [], [], [], []]


def _objects(values: list[Any]) -> npt.NDArray[np.object_]:
    found = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        found[place] = value
    return found
