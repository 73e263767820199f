"""What was collected, as the frames that the statistics take."""

import pandas as pd
from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation.report.analysis import RESPONSE_COLUMNS, StudyReport, analyse
from webapp.models import Condition, Participant, PlaybackEvent, Response, Stimulus, Trial
from webapp.services import studies

TRIAL_COLUMNS = {
    "participant": "number of the participant, counted from 1 in the order of enrolment",
    "trial": "place of the trial in the participant's order, counted from 1",
    "stimulus": "what was shown",
    "condition": "in which condition",
    "clip": "sha-256 of all that made the clip; leads to its lineage in the media store",
    "language": "language of the pages",
    "consented_at": "when the participant agreed (UTC)",
    "shown_at": "when the trial was first on the screen (UTC); empty if not yet",
    "answered_at": "when its answers were stored (UTC); empty if not yet",
    "plays": "how often the clip was played to its end",
}
"""The columns of `trials` and what they mean."""


def responses(session: Session, slug: str) -> pd.DataFrame:
    """Return all counting answers of a study, one row for each item (the last revision of each).

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    rows = session.execute(
        select(
            Participant.number,
            Trial.position,
            Stimulus.name,
            Condition.name,
            Response.instrument,
            Response.answers,
        )
        .select_from(Response)
        .join(Trial, Response.trial_id == Trial.id)
        .join(Participant, Trial.participant_id == Participant.id)
        .join(Stimulus, Trial.stimulus_id == Stimulus.id)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position, Response.revision, Response.id)
    )
    # Later revisions come later and replace the earlier ones.
    counting = {(row[0], row[1], row[4]): row for row in rows}
    records = [
        (number + 1, position, stimulus, condition, instrument, item, value)
        for number, position, stimulus, condition, instrument, answers in counting.values()
        for item, value in answers.items()
    ]
    return pd.DataFrame.from_records(records, columns=list(RESPONSE_COLUMNS))


def report(session: Session, slug: str) -> StudyReport:
    """Analyse what a study has collected so far.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    spec = studies.spec_of(studies.find(session, slug))
    return analyse(spec, responses(session, slug))


def trials(session: Session, slug: str) -> pd.DataFrame:
    """Return one row for each trial: what was shown, when, and how often the clip was played to its end."""
    study = studies.find(session, slug)
    ended = (
        select(PlaybackEvent.trial_id)
        .where(PlaybackEvent.kind == "ended")
        .join(Trial, Trial.id == PlaybackEvent.trial_id)
        .join(Participant, Participant.id == Trial.participant_id)
        .where(Participant.study_id == study.id)
    )
    plays = pd.Series(list(session.scalars(ended)), dtype="int64").value_counts()
    rows = session.execute(
        select(Trial, Participant, Stimulus)
        .join(Participant, Trial.participant_id == Participant.id)
        .join(Stimulus, Trial.stimulus_id == Stimulus.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position)
    )
    return pd.DataFrame(
        [
            {
                "participant": participant.number + 1,
                "trial": trial.position,
                "stimulus": stimulus.name,
                "condition": stimulus.condition.name,
                "clip": stimulus.clip.digest,
                "language": participant.language,
                "consented_at": participant.consented_at,
                "shown_at": trial.shown_at,
                "answered_at": trial.answered_at,
                "plays": int(plays.get(trial.id, 0)),
            }
            for trial, participant, stimulus in rows
        ],
        columns=list(TRIAL_COLUMNS),
    )
