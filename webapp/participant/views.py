"""The participant's pages. Each view parses, calls a service, answers."""

import json
from typing import Any

from flask import Blueprint, redirect, render_template, request, url_for
from sqlalchemy.orm import Session
from werkzeug.wrappers import Response

from evaluation import instruments
from evaluation.study import StudySpec
from webapp import locale
from webapp.models import ClipStatus, Participant, Study, StudyState, Trial
from webapp.participant import identity
from webapp.parts import parts
from webapp.services import clips, enrolment, studies, trials
from webapp.services.trials import AnswersRefusedError, Playback

blueprint = Blueprint("participant", __name__)
MAX_PLAYBACK_LENGTH = 20_000


def _go(endpoint: str, slug: str, **values: Any) -> Response:
    # 303: whatever came in, the next page is fetched with GET.
    return redirect(url_for(f"participant.{endpoint}", slug=slug, **values), code=303)


def _language(spec: StudySpec) -> str:
    wanted = locale.language()
    return wanted if wanted in spec.languages else spec.languages[0]


def _study_page(template: str, spec: StudySpec, study: Study, **values: Any) -> str:
    language = _language(spec)
    return render_template(
        f"participant/{template}",
        spec=spec,
        slug=study.slug,
        state=study.state,
        lang=language,
        title=spec.title[language],
        languages=spec.languages,
        **values,
    )


@blueprint.get("/")
def home() -> str:
    """List the studies that are open."""
    with parts().database.read() as db:
        found = [(spec.slug, spec.title[_language(spec)]) for spec in studies.open_specs(db)]
    return render_template("participant/home.html", studies=found, languages=list(locale.LOCALES))


@blueprint.get("/s/<slug>/")
def welcome(slug: str) -> Response | str:
    """Say what the study is and ask for consent; who is enrolled goes on where they stopped."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is not None:
            return _go("trial" if participant.completed_at is None else "debrief", slug)
        identity.expect(slug)
        return _study_page("welcome.html", studies.spec_of(study), study, open=study.state == StudyState.OPEN)


@blueprint.post("/s/<slug>/consent")
def consent(slug: str) -> Response | str:
    """Enrol the person who agreed."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        spec = studies.spec_of(study)
        if identity.find(db, slug) is not None:
            return _go("instructions", slug)
        if request.form.get("consent") != "yes":
            return _study_page("welcome.html", spec, study, open=study.state == StudyState.OPEN, problem="consent")
    with parts().database.write() as db:
        participant = enrolment.enrol(db, slug, language=_language(spec), token=identity.expect(slug))
    return identity.remember(_go("instructions", slug), slug, participant.token)


@blueprint.get("/s/<slug>/consent")
@blueprint.get("/s/<slug>/trial/<int(max=100000):position>")
def again(slug: str, position: int = 0) -> Response:
    """Lead an address that only takes forms (loaded again, or after a change of language) to the page it belongs to."""
    return _go("welcome", slug)


@blueprint.post("/s/<slug>/leave")
def leave(slug: str) -> Response:
    """Forget who sits at this browser, so that somebody else can begin; answers stay."""
    with parts().database.read() as db:
        studies.find(db, slug)
    return identity.forget(_go("welcome", slug), slug)


@blueprint.get("/s/<slug>/resume/<token>")
def resume(slug: str, token: str) -> Response:
    """Go on with a personal link, in this or another browser."""
    with parts().database.read() as db:
        participant = enrolment.find(db, slug, token)
        response = _go("trial" if participant.completed_at is None else "debrief", slug)
        return identity.remember(response, slug, participant.token)


@blueprint.get("/s/<slug>/instructions")
def instructions(slug: str) -> Response | str:
    """Explain the task."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is None:
            return _go("welcome", slug)
        spec = studies.spec_of(study)
        link = url_for("participant.resume", slug=slug, token=participant.token, _external=True)
        return _study_page(
            "instructions.html",
            spec,
            study,
            personal_link=link,
            trial_count=trials.count(db, participant),
        )


@blueprint.get("/s/<slug>/trial")
def trial(slug: str) -> Response | str:
    """Show the first trial without an answer."""
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        if participant is None:
            return _go("welcome", slug)
        identity.visit_id(participant)
        current = trials.current(db, participant)
        if current is None:
            return _go("debrief", slug)
        page = _trial_page(db, participant, current)
    if current.shown_at is None and current.stimulus.clip.status == ClipStatus.DONE:
        with parts().database.write() as db:
            trials.mark_shown(db, current.id)
    return page


def _trial_page(
    db: Session,
    participant: Participant,
    current: Trial,
    *,
    given: dict[str, str] | None = None,
    problems: dict[str, str] | None = None,
) -> str:
    study = participant.study
    spec = studies.spec_of(study)
    clip = current.stimulus.clip
    if clip.status != ClipStatus.DONE:
        failed = clip.status == ClipStatus.FAILED
        return _study_page("waiting.html", spec, study, failed=failed, clip_progress=clips.progress(db, study))
    return _study_page(
        "trial.html",
        spec,
        study,
        trial=current,
        total=trials.count(db, participant),
        clip=clip,
        width=clip.spec["width"],
        height=clip.spec["height"],
        instruments=[instruments.get(name) for name in spec.instruments],
        field_name=trials.field_name,
        given=given or {},
        problems=problems or {},
    )


@blueprint.post("/s/<slug>/trial/<int(max=100000):position>")
def answer(slug: str, position: int) -> Response | tuple[str, int]:
    """Store a trial's answers; the next trial is shown only when they are on disk."""
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        if participant is None:
            return _go("welcome", slug)
        spec = studies.spec_of(participant.study)
    visit = identity.visit_id(participant)
    try:
        answers = trials.validate(spec, request.form)
    except AnswersRefusedError as refused:
        return _answer_again(slug, position, refused.problems)
    with parts().database.write() as db:
        following = trials.record(
            db,
            participant,
            position,
            answers,
            visit_id=visit,
            playback=_playback(request.form.get("playback", "")),
        )
    return _go("debrief" if following is None else "trial", slug)


def _answer_again(slug: str, position: int, problems: dict[str, str]) -> Response | tuple[str, int]:
    with parts().database.read() as db:
        participant = identity.find(db, slug)
        current = trials.current(db, participant) if participant else None
        if participant is None or current is None or current.position != position:
            return _go("trial", slug)
        given = {name: value for name, value in request.form.items() if "." in name}
        return _trial_page(db, participant, current, given=given, problems=problems), 422


def _playback(text: str) -> list[Playback]:
    """Read the page's log of the video element; a log that makes no sense is dropped, the answers are not."""
    try:
        events = json.loads(text[:MAX_PLAYBACK_LENGTH] or "[]")
        return [
            Playback(str(kind), int(page_ms), float(media_s))
            for kind, page_ms, media_s in events[: trials.MAX_PLAYBACK_EVENTS]
            if kind in trials.PLAYBACK_KINDS and 0 <= page_ms < 2**31 and 0 <= media_s < 1e6
        ]
    except (ValueError, TypeError, OverflowError, RecursionError):
        return []


@blueprint.get("/s/<slug>/debrief")
def debrief(slug: str) -> Response | str:
    """Thank, and say what it was about."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is None:
            return _go("welcome", slug)
        if participant.completed_at is None:
            return _go("trial", slug)
        return _study_page("debrief.html", studies.spec_of(study), study, number=participant.number + 1)
