"""Withdrawing: what a participant gave is erased, or kept without a trace of who gave it; the audit line stays."""

from enum import StrEnum

from sqlalchemy import ColumnElement, delete, select, update
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import TextItem
from evaluation.study import StudySpec
from webapp.errors import ConflictError
from webapp.models import (
    Decision,
    Participant,
    ParticipantState,
    PlaybackEvent,
    Response,
    Study,
    Trial,
    TrialStimulus,
    Visit,
)
from webapp.models.columns import now
from webapp.services import audit, enrolment, places, studies


class Extent(StrEnum):
    """What becomes of the answers."""

    ERASE = "erase"
    ANONYMISE = "anonymise"


def withdraw(session: Session, participant: Participant, extent: Extent, *, actor: str) -> dict[str, int]:
    """Take a participant out of their study.

    With `Extent.ERASE` every answer, trial, sitting and playback log goes. With `Extent.ANONYMISE` ratings stay, but
    answers in their own words go. In both cases the personal link, the panel's identifiers, the completion code and the
    kind of the browser go, and nobody can come back as this participant. The row that is left holds the number, the
    language and the times of consent and withdrawal. The place in the design is given back unless the ratings of a
    complete participant stay.

    Returns
    -------
    dict
        How many rows of each kind were deleted.

    Raises
    ------
    ConflictError
        If they have withdrawn already.
    """
    participant = enrolment.locked(session, participant.id)
    if participant.state == ParticipantState.WITHDRAWN:
        raise ConflictError(f"Participant {participant.number + 1} has withdrawn already")
    study = session.get_one(Study, participant.study_id)
    session.refresh(study, with_for_update=True)
    stays = extent == Extent.ANONYMISE and participant.state == ParticipantState.COMPLETED
    # A lapsed participant's place has been given back already, and may have a new holder.
    held = participant.state != ParticipantState.LAPSED
    deleted = _erase(session, participant) if extent == Extent.ERASE else _anonymise(session, study, participant)
    participant.state = ParticipantState.WITHDRAWN
    participant.withdrawn_at = now()
    participant.token = enrolment.new_token()
    participant.panel = participant.panel_id = participant.panel_session = participant.code = None
    participant.due_at = participant.opens_at = None
    if extent == Extent.ERASE:
        participant.completed_at = None
    session.flush()
    if held and not stays:
        places.give_back(session, participant)
    audit.note(session, study, actor, "withdraw", participant=participant.number, extent=extent.value, deleted=deleted)
    return deleted


def _erase(session: Session, participant: Participant) -> dict[str, int]:
    own = select(Trial.id).where(Trial.participant_id == participant.id)
    deleted = {}
    conditions: dict[str, tuple[type, ColumnElement[bool]]] = {
        "playback events": (PlaybackEvent, PlaybackEvent.trial_id.in_(own)),
        "responses": (Response, Response.trial_id.in_(own)),
        "trial stimuli": (TrialStimulus, TrialStimulus.trial_id.in_(own)),
        "trials": (Trial, Trial.participant_id == participant.id),
        "visits": (Visit, Visit.participant_id == participant.id),
        "decisions": (Decision, Decision.participant_id == participant.id),
    }
    for name, (table, condition) in conditions.items():
        # Only a deletion by condition tells its number in one statement; nothing of it is in the session.
        result = session.execute(delete(table).where(condition).execution_options(synchronize_session=False))
        deleted[name] = int(getattr(result, "rowcount", 0))
    return deleted


def _anonymise(session: Session, study: Study, participant: Participant) -> dict[str, int]:
    session.execute(update(Visit).where(Visit.participant_id == participant.id).values(user_agent=""))
    # The decision stays, since the ratings do; its reason may tell who it was.
    session.execute(update(Decision).where(Decision.participant_id == participant.id).values(reason="withdrawn"))
    texts = _text_items(studies.spec_of(study))
    removed = 0
    own = select(Response).join(Trial).where(Trial.participant_id == participant.id)
    for response in session.scalars(own):
        gone = [item for item in response.answers if _is_text(texts, response.instrument, item)]
        if gone:
            response.answers = {item: value for item, value in response.answers.items() if item not in gone}
            response.raw = {item: value for item, value in (response.raw or {}).items() if item not in gone}
            removed += len(gone)
    return {"texts": removed}


def _text_items(spec: StudySpec) -> set[tuple[str, str]]:
    names = {use.use for part in spec.all_parts for use in part.instruments}
    names |= {name for part in spec.all_parts for name in (*part.before, *part.after)}
    names |= {told.instrument for part in spec.all_parts for told in part.instructed}
    asked = [*map(spec.instrument, names), DISCUSSION]
    return {(one.name, item.id) for one in asked for item in one.items if isinstance(item, TextItem)}


def _is_text(texts: set[tuple[str, str]], instrument: str, item: str) -> bool:
    """Tell whether an item is one of these, or asks one of them about one of several clips or words ("why-2")."""
    base, _, place = item.rpartition("-")
    return (instrument, item) in texts or (place.isdecimal() and (instrument, base) in texts)
