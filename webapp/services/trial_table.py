"""The trials of a study as a table: what was shown, when, and how much of it was played."""

from datetime import datetime

import pandas as pd
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from webapp.models import AnnotationRound, Participant, PlaybackEvent, Study, Trial
from webapp.services import studies
from webapp.services.shown import shows

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

_WHOLE = ("round", "repeats")


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
    found, plays = shows(session, study), _plays(session, study)
    rows = session.connection().execute(
        select(
            *(Participant.number, Trial.part, Trial.position, Trial.kind, AnnotationRound.number, Trial.repeats),
            *(Trial.id, Trial.stimulus_id, Participant.language, Participant.consented_at),
            *(Trial.shown_at, Trial.answered_at, Trial.watched),
        )
        .select_from(Trial)
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(AnnotationRound, Trial.round_id == AnnotationRound.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position)
    )
    records = []
    for number, part, position, kind, round_number, again, key, stimulus, language, agreed, seen, done, watched in rows:
        clips = found.page(stimulus, found.beside.get(key, ()))
        records.append(
            (
                *(number + 1, part, position, kind, None if round_number is None else round_number + 1, again),
                clips[0].stimulus if clips else None,
                ";".join(one.condition for one in clips) or None,
                ";".join(one.clip for one in clips) or None,
                *(language, "answered" if done else "shown" if seen else "waiting", agreed, seen, done),
                *(_seconds(seen, done), watched, plays.get(key, 0)),
            )
        )
    frame = pd.DataFrame(records, columns=list(TRIAL_COLUMNS))
    return frame.astype({**dict.fromkeys(_WHOLE, "Int64"), "seconds": float, "watched": float})


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
