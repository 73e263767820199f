"""The tables of an export that are no answers: people, playback, annotation, rounds, screening, audit."""

import json
from collections.abc import Mapping

import pandas as pd
from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation.screening import ScreeningReport
from evaluation.study import StudySpec
from webapp.models import Condition, Participant, PlaybackEvent, Stimulus, Study, Trial
from webapp.services import annotated, audit, rounds

PARTICIPANT_COLUMNS = {
    "participant": "number of the participant, counted from 1 in the order of enrolment",
    "slot": "place in the study's design, counted from 0",
    "state": "active, completed, lapsed or withdrawn",
    "language": "language of the pages",
    "consented_at": "when the participant agreed (UTC)",
    "completed_at": "when the last trial was answered (UTC); empty if not yet",
    "withdrawn_at": "when the participant withdrew (UTC); empty if not",
    "panel": "the panel that the participant came from",
    "panel_id": "who the panel says this is",
    "accepted": "whether the work is accepted, and paid; empty if nothing was answered",
    "used": "whether the ratings are used in the analysis; empty if nothing was answered",
    "reasons": "why not",
}
PLAYBACK_COLUMNS = {
    "participant": PARTICIPANT_COLUMNS["participant"],
    "trial": "place of the trial in the participant's order, counted from 1",
    "clip": "place of the clip on the page, counted from 1",
    "kind": "what the player did",
    "page_ms": "milliseconds since the page was opened",
    "media_s": "position in the clip in seconds",
    "value": "the new rate, the frames dropped so far, or the clip's duration",
}
ANNOTATION_COLUMNS = {
    "part": "name of the part of the study",
    "stimulus": "id of the stimulus in the study file",
    "condition": "name of the condition in the study file",
    "word": "which word of the sentence, counted from 1; empty if not words are annotated",
    "dimension": "what is rated",
    "value": "the annotation: mean over raters, or the value on which they agree; empty if they do not",
    "participant": "number of a rater; empty if each round has raters of its own",
    "rating": "that rater's mean over rounds, or in a consensus the last word",
}
ROUND_COLUMNS = {
    "part": "name of the part of the study",
    "round": "number of the round, counted from 1",
    "samples": "how many samples it holds",
    "reannotated": "how many of them were rated in an earlier round",
    "raters": "how many raters it needs",
    "finished": "how many have rated all of it",
    "complete": "whether it is closed",
    "agreed": "share of the answers on which enough raters agree (consensus)",
    "dimension": "what is rated",
    "sd": "mean over samples of the standard deviation over raters",
    "pairwise_r": "mean Pearson correlation of two raters",
    "largest_p": "largest p value of these correlations",
}
SCREENING_COLUMNS = {
    "part": "name of the part of the study",
    "participant": PARTICIPANT_COLUMNS["participant"],
    "rule": "name of the rule in the study file, or manual",
    "score": "the score that decided; empty if the rule is not about scores",
    "value": "what was measured; empty if it cannot be told",
    "limit": "the rule's limit",
    "gate": "what failing leads to: accepted (neither paid nor used), used (not used) or report (nothing)",
    "fails": "whether the rule is broken",
    "reason": "all of this in words",
}
AUDIT_COLUMNS = {
    "at": "when (UTC)",
    "actor": "who did it",
    "action": "what was done",
    "participant": "number of the participant whom it concerns, counted from 1; empty if none",
    "details": "more, as JSON",
}


def participants(session: Session, study: Study, screenings: Mapping[str, ScreeningReport]) -> pd.DataFrame:
    """Return one row for each participant, with what screening makes of them over all parts.

    Parameters
    ----------
    screenings : mapping of str to ScreeningReport
        Screening of each part. Somebody is accepted, or used, who is so in all parts.
    """
    verdicts: dict[object, list[tuple[bool, bool, str]]] = {}
    for part, screening in screenings.items():
        about = f"{part}: " if len(screenings) > 1 else ""
        for rater in screening.raters:
            reasons = "; ".join(f"{about}{reason}" for reason in rater.reasons)
            verdicts.setdefault(rater.participant, []).append((rater.accepted, rater.used, reasons))
    records = []
    for person in session.scalars(
        select(Participant).where(Participant.study_id == study.id).order_by(Participant.number)
    ):
        own = verdicts.get(person.number + 1, [])
        records.append(
            {
                "participant": person.number + 1,
                "slot": person.slot,
                "state": str(person.state),
                "language": person.language,
                "consented_at": person.consented_at,
                "completed_at": person.completed_at,
                "withdrawn_at": person.withdrawn_at,
                "panel": person.panel,
                "panel_id": person.panel_id,
                "accepted": all(accepted for accepted, _, _ in own) if own else None,
                "used": all(used for _, used, _ in own) if own else None,
                "reasons": "; ".join(reasons for _, _, reasons in own if reasons),
            }
        )
    return pd.DataFrame(records, columns=list(PARTICIPANT_COLUMNS)).astype({"accepted": "boolean", "used": "boolean"})


def playback(session: Session, study: Study) -> pd.DataFrame:
    """Return one row for each event of a player."""
    rows = session.execute(
        select(
            Participant.number,
            Trial.position,
            PlaybackEvent.place,
            PlaybackEvent.kind,
            PlaybackEvent.page_ms,
            PlaybackEvent.media_s,
            PlaybackEvent.value,
        )
        .select_from(PlaybackEvent)
        .join(Trial, PlaybackEvent.trial_id == Trial.id)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
        .order_by(Participant.number, Trial.position, PlaybackEvent.id)
    )
    return pd.DataFrame([(number + 1, *rest) for number, *rest in rows], columns=list(PLAYBACK_COLUMNS))


def annotation(session: Session, study: Study, spec: StudySpec) -> pd.DataFrame:
    """Return what each annotated part has come to: a row for each sample (or word), dimension and rater."""
    cells = {
        key: (stimulus, condition)
        for key, stimulus, condition in session.execute(
            select(Stimulus.id, Stimulus.name, Condition.name)
            .join(Condition, Stimulus.condition_id == Condition.id)
            .where(Stimulus.study_id == study.id)
        )
    }
    numbers = dict(
        session.execute(select(Participant.id, Participant.number + 1).where(Participant.study_id == study.id)).all()
    )
    rows = []
    for part in rounds.annotated_parts(spec):
        found = annotated.annotated(session, study, spec, part)
        if found is None:
            continue
        by_word = any(spec.instrument(use.use).per == "word" for use in part.instruments)
        for row, (key, word) in enumerate(found.stimuli):
            for column, dimension in enumerate(found.dimensions):
                about = (part.name, *cells[key], word if by_word else None, dimension, found.values[row, column])
                ratings = zip(found.raters, found.ratings[row, :, column], strict=True)
                rated: list[tuple[object, object]] = [(numbers[rater], rating) for rater, rating in ratings]
                rows += [(*about, *one) for one in rated or [(None, None)]]
    frame = pd.DataFrame(rows, columns=list(ANNOTATION_COLUMNS))
    return frame.astype({"word": "Int64", "participant": "Int64", "value": float, "rating": float})


def annotation_rounds(session: Session, study: Study, spec: StudySpec) -> pd.DataFrame:
    """Return the agreement in each round of annotation: a row for each round and dimension."""
    rows = []
    for line in rounds.overview(session, study.slug) if rounds.annotated_parts(spec) else []:
        about = (
            *(line.part, line.index, line.samples, line.reannotated),
            *(line.raters, line.finished, line.complete, line.agreed),
        )
        rows += [
            (*about, dimension, line.sd[dimension], line.pairwise_r[dimension], line.largest_p[dimension])
            for dimension in line.sd
        ]
    numbers = dict.fromkeys(("agreed", "sd", "pairwise_r", "largest_p"), float)
    return pd.DataFrame(rows, columns=list(ROUND_COLUMNS)).astype(numbers)


def screening(screenings: Mapping[str, ScreeningReport]) -> pd.DataFrame:
    """Return what each rule finds of each rater in each part."""
    frames = [found.to_frame().assign(part=part) for part, found in screenings.items() if found.findings]
    if not frames:
        return pd.DataFrame(columns=list(SCREENING_COLUMNS))
    return pd.concat(frames, ignore_index=True)[list(SCREENING_COLUMNS)]


def audit_lines(session: Session, study: Study) -> pd.DataFrame:
    """Return the audit of a study, the oldest line first."""
    rows = [
        (
            line.at,
            line.actor,
            line.action,
            None if line.participant is None else line.participant + 1,
            json.dumps(line.details, ensure_ascii=False, sort_keys=True),
        )
        for line in reversed(audit.entries(session, study))
    ]
    return pd.DataFrame(rows, columns=list(AUDIT_COLUMNS)).astype({"participant": "Int64"})
