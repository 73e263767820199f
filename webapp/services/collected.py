"""What was collected, row by row: every counting answer, and every trial."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import pandas as pd
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import Instrument
from evaluation.study import StudySpec
from webapp.models import (
    AnnotationRound,
    Clip,
    Condition,
    Participant,
    PlaybackEvent,
    Response,
    Stimulus,
    Study,
    Trial,
    TrialStimulus,
)
from webapp.services import studies

ANSWER_COLUMNS = {
    "participant": "number of the participant, counted from 1 in the order of enrolment",
    "part": "name of the part of the study",
    "trial": "place of the trial in the participant's order, counted from 1 over all parts",
    "kind": "what the trial is for; only those of the kind rating count",
    "round": "round of annotation, counted from 1; empty if there are none",
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

TRIAL_COLUMNS = {
    "participant": ANSWER_COLUMNS["participant"],
    "part": ANSWER_COLUMNS["part"],
    "trial": ANSWER_COLUMNS["trial"],
    "kind": ANSWER_COLUMNS["kind"],
    "round": ANSWER_COLUMNS["round"],
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

_WHOLE = ("round", "clip", "word", "place", "repeats")


class Shown(NamedTuple):
    """A stimulus in a condition, and the digest of its clip."""

    stimulus: str
    condition: str
    clip: str


class Collected(NamedTuple):
    """One answer with all that is known of it; `ANSWER_COLUMNS` describes the fields but the last.

    Attributes
    ----------
    conditions : tuple of str
        The conditions of all clips that the trial shows, in the order of the page.
    """

    participant: int
    part: str
    trial: int
    kind: str
    round: int | None
    stimulus: str | None
    condition: str | None
    clip: int | None
    instrument: str
    item: str
    word: int | None
    raw: Any
    flipped: bool
    place: int | None
    keyed: Any
    conditions: tuple[str, ...]


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


def as_frame(rows: list[Collected]) -> pd.DataFrame:
    """Return answers as the table that `answers` describes."""
    frame = pd.DataFrame(rows, columns=list(Collected._fields))[list(ANSWER_COLUMNS)]
    return _typed(frame).astype({"flipped": bool, "raw": object, "keyed": object})


def read(session: Session, study: Study) -> list[Collected]:
    """Return all counting answers of a study, by participant and trial."""
    spec = studies.spec_of(study)
    shown = _shown(session, study)
    instruments: dict[str, Instrument] = {}
    rows = session.execute(
        select(
            Participant.number,
            Trial.id,
            Trial.part,
            Trial.position,
            Trial.kind,
            AnnotationRound.number,
            Response.instrument,
            Response.answers,
            Response.raw,
            Response.display,
        )
        .select_from(Response)
        .join(Trial, Response.trial_id == Trial.id)
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(AnnotationRound, Trial.round_id == AnnotationRound.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position, Response.revision, Response.id)
    )
    # Later revisions come later and replace the earlier ones.
    counting = {(row[1], row[6]): row for row in rows}
    found = []
    for number, key, part, position, kind, round_number, name, keyed, raw, display in counting.values():
        if name not in instruments:
            instruments[name] = _instrument(spec, name)
        trial = (number + 1, part, position, kind, None if round_number is None else round_number + 1)
        page = _Page(instruments[name], keyed, raw, display)
        found += [Collected(*trial, *one) for one in page.rows(shown.get(key, []))]
    return found


class _Page(NamedTuple):
    """The answers to one instrument in one trial."""

    instrument: Instrument
    keyed: Mapping[str, Any]
    raw: Mapping[str, Any] | None
    display: Mapping[str, Any] | None

    def rows(self, shown: list[Shown]) -> Iterator[tuple[Any, ...]]:
        """Yield the fields of `Collected` from the stimulus on, in the order of clips or words, then of items."""
        raw, display = self.raw or {}, self.display or {}
        order = {item: place for place, item in enumerate(display.get("order", ()), start=1)}
        items = {item.id: place for place, item in enumerate(self.instrument.items)}
        split = {key: self._split(key) for key in self.keyed}
        for key in sorted(self.keyed, key=lambda key: (split[key][1], items.get(split[key][0], len(items)))):
            item, place = split[key]
            clip = place if self.instrument.per == "clip" else 1
            cell = shown[clip - 1] if clip <= len(shown) else None
            yield (
                cell.stimulus if cell else None,
                cell.condition if cell else None,
                clip if shown else None,
                self.instrument.name,
                item,
                place if self.instrument.per == "word" else None,
                _plain(raw.get(key, self.keyed[key])),
                key in display.get("flipped", ()),
                order.get(key),
                _plain(self.keyed[key]),
                tuple(one.condition for one in shown),
            )

    def _split(self, key: str) -> tuple[str, int]:
        if self.instrument.per == "trial":
            return key, 1
        item, _, place = key.rpartition("-")
        return item, int(place)


def _plain(answer: Any) -> Any:
    return tuple(answer) if isinstance(answer, list) else answer


def _instrument(spec: StudySpec, name: str) -> Instrument:
    own = {definition.name for definition in spec.own_instruments}
    return DISCUSSION if name == DISCUSSION.name and name not in own else spec.instrument(name)


def _shown(session: Session, study: Study) -> dict[int, list[Shown]]:
    """Return what each trial of a study shows, in the order of the page."""
    stimuli = {
        key: Shown(stimulus, condition, digest)
        for key, stimulus, condition, digest in session.execute(
            select(Stimulus.id, Stimulus.name, Condition.name, Clip.digest)
            .join(Condition, Stimulus.condition_id == Condition.id)
            .join(Clip, Stimulus.clip_id == Clip.id)
            .where(Stimulus.study_id == study.id)
        )
    }
    first = (
        select(Trial.id, Trial.stimulus_id)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
    )
    shown = {trial: [stimuli[key]] for trial, key in session.execute(first) if key is not None}
    beside = (
        select(TrialStimulus.trial_id, TrialStimulus.stimulus_id)
        .join(Stimulus, TrialStimulus.stimulus_id == Stimulus.id)
        .where(Stimulus.study_id == study.id)
        .order_by(TrialStimulus.trial_id, TrialStimulus.place)
    )
    for trial, key in session.execute(beside):
        shown[trial].append(stimuli[key])
    return shown


def trials(session: Session, slug: str) -> pd.DataFrame:
    """Return one row for each trial: what was shown, when, and how much of it was played.

    Returns
    -------
    pandas.DataFrame
        The columns `TRIAL_COLUMNS`.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    shown, plays = _shown(session, study), _plays(session, study)
    rows = session.execute(
        select(Trial, Participant, AnnotationRound.number)
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(AnnotationRound, Trial.round_id == AnnotationRound.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position)
    )
    records = []
    for trial, participant, round_number in rows:
        cells = shown.get(trial.id, [])
        records.append(
            {
                "participant": participant.number + 1,
                "part": trial.part,
                "trial": trial.position,
                "kind": trial.kind,
                "round": None if round_number is None else round_number + 1,
                "repeats": trial.repeats,
                "stimulus": cells[0].stimulus if cells else None,
                "condition": ";".join(cell.condition for cell in cells) or None,
                "clip": ";".join(cell.clip for cell in cells) or None,
                "language": participant.language,
                "state": "answered" if trial.answered_at else "shown" if trial.shown_at else "waiting",
                "consented_at": participant.consented_at,
                "shown_at": trial.shown_at,
                "answered_at": trial.answered_at,
                "seconds": _seconds(trial),
                "watched": trial.watched,
                "plays": plays.get(trial.id, 0),
            }
        )
    frame = pd.DataFrame(records, columns=list(TRIAL_COLUMNS))
    return _typed(frame, but="clip").astype({"seconds": float, "watched": float})


def _seconds(trial: Trial) -> float | None:
    if trial.shown_at is None or trial.answered_at is None:
        return None
    return (trial.answered_at - trial.shown_at).total_seconds()


def _plays(session: Session, study: Study) -> dict[int, int]:
    ended = (
        select(PlaybackEvent.trial_id, func.count(PlaybackEvent.id))
        .join(Trial, Trial.id == PlaybackEvent.trial_id)
        .join(Participant, Participant.id == Trial.participant_id)
        .where(Participant.study_id == study.id, PlaybackEvent.kind == "ended")
        .group_by(PlaybackEvent.trial_id)
    )
    return dict(session.execute(ended).all())


def _typed(frame: pd.DataFrame, *, but: str = "") -> pd.DataFrame:
    """Return a frame whose whole numbers stay whole where some are missing."""
    return frame.astype({column: "Int64" for column in _WHOLE if column in frame and column != but})
