"""The trial page: what is shown, the form, and what comes after it."""

import json
import math

from flask import request, session
from sqlalchemy.orm import Session
from werkzeug.datastructures import MultiDict
from werkzeug.wrappers import Response

from evaluation import known_answers
from evaluation.playback import KINDS, PlayEvent
from evaluation.study import StudySpec
from webapp.models import ClipStatus, Participant, ParticipantState, Study, Trial
from webapp.participant import identity
from webapp.participant import page as pages
from webapp.participant.views import blueprint, go, language_of, not_now, study_page
from webapp.parts import parts
from webapp.services import asking, clips, discussion, enrolment, studies, trials
from webapp.services.asking import AnswersRefusedError, Submission
from webapp.services.trials import NotWatchedError, Playback

MAX_PLAYBACK_LENGTH = 60_000


@blueprint.get("/s/<slug>/trial")
def trial(slug: str) -> Response | str:
    """Show the first trial without an answer, or say why there is none now."""
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        if participant.completed_at is not None:
            return go("debrief", slug)
        current = trials.current(db, participant)
        idle = current is None or participant.state == ParticipantState.LAPSED
    if idle:
        # Whoever lapsed is back, and what has opened meanwhile is laid out.
        with parts().database.write() as db:
            enrolment.come_back(db, participant.id)
    identity.visit_id(participant)
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        if participant is None or participant.completed_at is not None:
            return go("debrief", slug)
        spec = studies.spec_of(participant.study)
        current = trials.current(db, participant)
        page = not_now(participant, current)
        if page is not None or current is None:
            return page or go("debrief", slug)
        if _begins_part(spec, current) and session.get(f"part_{slug}") != current.part:
            return go("instructions", slug)
        page = _trial_page(db, participant, spec, current)
    if current.shown_at is None and _ready(current):
        with parts().database.write() as db:
            trials.mark_shown(db, current.id)
    return page


def _begins_part(spec: StudySpec, current: Trial) -> bool:
    return len(spec.all_parts) > 1 and current.shown_at is None


def _ready(current: Trial) -> bool:
    return all(stimulus.clip.status == ClipStatus.DONE for stimulus in current.stimuli)


def _trial_page(
    db: Session,
    participant: Participant,
    spec: StudySpec,
    current: Trial,
    *,
    given: MultiDict[str, str] | None = None,
    problems: dict[str, str] | None = None,
    unwatched: bool = False,
) -> str:
    study = participant.study
    if not _ready(current):
        failed = any(stimulus.clip.status == ClipStatus.FAILED for stimulus in current.stimuli)
        return study_page("waiting.html", spec, study, failed=failed, clip_progress=clips.progress(db, study))
    part = spec.part(current.part)
    language = language_of(spec)
    asks = asking.asked(spec, participant, current)
    words = tuple(current.stimulus.words or ()) if current.stimulus is not None else ()
    prompt = part.instructed[current.check_place or 0].prompt[language] if current.kind == "instructed" else None
    return study_page(
        "trial.html",
        spec,
        study,
        trial=current,
        place=trials.place(db, participant, current),
        clips=[stimulus.clip for stimulus in current.stimuli],
        asked=asks,
        sections=pages.sections(spec, asks, words),
        field_name=asking.field_name,
        discussed=discussion.item_text,
        watched=part.watched,
        prompt=prompt,
        discussion=discussion.of_trial(db, study, spec, current),
        feedback=session.pop(f"feedback_{study.slug}", None),
        given=given if given is not None else MultiDict(),
        problems=problems or {},
        unwatched=unwatched,
        # A page that comes back goes on with its log: what was watched before it was sent counts.
        playback_log=request.form.get("playback", "")[:MAX_PLAYBACK_LENGTH],
    )


@blueprint.post("/s/<slug>/trial/<int(max=100000):position>")
def answer(slug: str, position: int) -> Response | tuple[str, int]:
    """Store a trial's answers; the next trial is shown only when they are on disk."""
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        spec = studies.spec_of(participant.study)
        current = trials.at(db, participant, position)
        asked = asking.asked(spec, participant, current)
    visit = identity.visit_id(participant)
    try:
        submissions = asking.read_form(asked, request.form.to_dict(flat=False))
        with parts().database.write() as db:
            following = trials.record(
                db,
                participant,
                position,
                submissions,
                visit_id=visit,
                playback=read_playback(request.form.get("playback", "")),
            )
            finished = following is None and db.get_one(Participant, participant.id).completed_at is not None
    except AnswersRefusedError as refused:
        return _answer_again(slug, position, problems=refused.problems)
    except NotWatchedError:
        return _answer_again(slug, position, unwatched=True)
    _remember_feedback(spec, participant.study, current, submissions)
    return go("debrief" if finished else "trial", slug)


def _answer_again(
    slug: str, position: int, *, problems: dict[str, str] | None = None, unwatched: bool = False
) -> Response | tuple[str, int]:
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        current = trials.current(db, participant) if participant else None
        if participant is None or current is None or current.position != position:
            return go("trial", slug)
        spec = studies.spec_of(participant.study)
        given = MultiDict((name, value) for name, value in request.form.items(multi=True) if "." in name)
        page = _trial_page(db, participant, spec, current, given=given, problems=problems, unwatched=unwatched)
        return page, 422


def _remember_feedback(spec: StudySpec, study: Study, current: Trial, submissions: dict[str, Submission]) -> None:
    """Keep the explanation of a training trial for the next page."""
    if current.kind != "training" or current.check_place is None:
        return
    part = spec.part(current.part)
    accept = known_answers.accepted(part, current.kind, current.check_place)
    answers = {name: own.answers for name, own in submissions.items()}
    several = {use.use for use in part.instruments if spec.instrument(use.use).per != "trial"}
    places = known_answers.by_place(answers, several)
    session[f"feedback_{study.slug}"] = {
        "text": part.training[current.check_place].feedback[language_of(spec)],
        "right": all(known_answers.passes(accept, about) for about in places) if accept else None,
    }


def read_playback(text: str) -> list[Playback]:
    """Read the page's log of its players; a log that makes no sense is dropped, the answers are not.

    The log is a JSON list of ``[kind, page_ms, media_s, value or null, place]``; the last two may be left out.
    """
    try:
        events = json.loads(text[:MAX_PLAYBACK_LENGTH] or "[]")
        found = [_event(*event) for event in events[: trials.MAX_PLAYBACK_EVENTS]]
    except (ValueError, TypeError, OverflowError, RecursionError):
        return []
    return [event for event in found if event is not None]


def _event(kind: str, page_ms: float, media_s: float, value: float | None = None, place: int = 1) -> Playback | None:
    number = None if value is None else float(value)
    sound = kind in KINDS and 0 <= page_ms < 2**31 and 0 <= media_s < 1e6 and 1 <= place <= 100
    if not sound or (number is not None and not math.isfinite(number)):
        return None
    return Playback(PlayEvent(str(kind), int(page_ms), float(media_s), number), int(place))
