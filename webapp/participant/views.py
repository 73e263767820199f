"""The participant's pages. Each view parses, calls a service, answers."""

from typing import Any
from urllib.parse import quote

from flask import Blueprint, redirect, render_template, request, session, url_for
from werkzeug.wrappers import Response

from evaluation.study import StudySpec
from webapp import locale
from webapp.models import Participant, Study, StudyState, Trial
from webapp.models.columns import now
from webapp.participant import identity
from webapp.parts import parts
from webapp.services import enrolment, studies, trials, withdrawal
from webapp.services.withdrawal import Extent

blueprint = Blueprint("participant", __name__)


def go(endpoint: str, slug: str, **values: Any) -> Response:
    """Lead on to a page of a study."""
    # 303: whatever came in, the next page is fetched with GET.
    return redirect(url_for(f"participant.{endpoint}", slug=slug, **values), code=303)


def language_of(spec: StudySpec) -> str:
    """Return the language of a study's pages: the person's if the study has it, else the study's first."""
    wanted = locale.language()
    return wanted if wanted in spec.languages else spec.languages[0]


def study_page(template: str, spec: StudySpec, study: Study, **values: Any) -> str:
    """Render a page of a study."""
    language = language_of(spec)
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
        found = [(spec.slug, spec.title[language_of(spec)]) for spec in studies.open_specs(db)]
    return render_template("participant/home.html", studies=found, languages=list(locale.LOCALES))


@blueprint.get("/s/<slug>/")
def welcome(slug: str) -> Response | str:
    """Say what the study is and ask for consent; who is enrolled goes on where they stopped."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is not None:
            return go("trial" if participant.completed_at is None else "debrief", slug)
        identity.expect(slug)
        identity.note_panel(slug, request.args)
        return study_page("welcome.html", studies.spec_of(study), study, open=study.state == StudyState.OPEN)


@blueprint.post("/s/<slug>/consent")
def consent(slug: str) -> Response | str | tuple[str, int]:
    """Enrol the person who agreed."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        spec = studies.spec_of(study)
        if identity.find(db, slug) is not None:
            return go("instructions", slug)
        opened = study.state == StudyState.OPEN
        if request.form.get("consent") != "yes":
            return study_page("welcome.html", spec, study, open=opened, problem="consent")
    try:
        with parts().database.write() as db:
            participant = enrolment.enrol(
                db, slug, language=language_of(spec), token=identity.expect(slug), panel=identity.panel(slug)
            )
    except enrolment.FullError:
        return study_page("full.html", spec, study), 409
    return identity.remember(go("instructions", slug), slug, participant.token)


@blueprint.get("/s/<slug>/consent")
@blueprint.get("/s/<slug>/trial/<int(max=100000):position>")
def again(slug: str, position: int = 0) -> Response:
    """Lead an address that only takes forms (loaded again, or after a change of language) to the page it belongs to."""
    return go("welcome", slug)


@blueprint.post("/s/<slug>/leave")
def leave(slug: str) -> Response:
    """Forget who sits at this browser, so that somebody else can begin; answers stay."""
    with parts().database.read() as db:
        studies.find(db, slug)
    return identity.forget(go("welcome", slug), slug)


@blueprint.get("/s/<slug>/resume/<token>")
def resume(slug: str, token: str) -> Response:
    """Go on with a personal link, in this or another browser."""
    with parts().database.read() as db:
        participant = enrolment.find(db, slug, token)
        response = go("trial" if participant.completed_at is None else "debrief", slug)
        return identity.remember(response, slug, participant.token)


@blueprint.get("/s/<slug>/instructions")
def instructions(slug: str) -> Response | str:
    """Explain the task of the part that comes next."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        spec = studies.spec_of(study)
        current = trials.current(db, participant)
        if current is None:
            return go("trial", slug)
        part = spec.part(current.part)
        session[f"part_{slug}"] = part.name
        link = url_for("participant.resume", slug=slug, token=participant.token, _external=True)
        return study_page(
            "instructions.html",
            spec,
            study,
            part=part,
            part_number=spec.all_parts.index(part) + 1,
            paragraphs_of_part=(part.instructions or spec.instructions)[language_of(spec)],
            watched=part.watched,
            personal_link=link,
            trial_count=trials.remaining(db, participant, part.name),
        )


def not_now(participant: Participant, current: Trial | None) -> str | None:
    """Return the page that says why there is nothing to do now; None if there is.

    Parameters
    ----------
    participant : Participant
        Who is at the browser.
    current : Trial or None
        Their first trial without an answer.
    """
    study = participant.study
    spec = studies.spec_of(study)
    if participant.opens_at is not None and participant.opens_at > now():
        part = spec.all_parts[participant.part]
        link = url_for("participant.resume", slug=study.slug, token=participant.token, _external=True)
        return study_page("later.html", spec, study, opens_at=participant.opens_at, part=part, personal_link=link)
    if current is None:
        return study_page("between_rounds.html", spec, study)
    return None


@blueprint.get("/s/<slug>/withdraw")
def ask_to_withdraw(slug: str) -> Response | str:
    """Ask what is to become of the answers."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        return study_page("withdraw.html", studies.spec_of(study), study, answered=trials.answered(db, participant))


@blueprint.post("/s/<slug>/withdraw")
def withdraw(slug: str) -> Response | str:
    """Take the participant out of the study."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        spec = studies.spec_of(study)
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        if request.form.get("extent") not in set(Extent):
            answered = trials.answered(db, participant)
            return study_page("withdraw.html", spec, study, answered=answered, problem="extent")
    extent = Extent(request.form["extent"])
    with parts().database.write() as db:
        withdrawal.withdraw(db, participant, extent, actor="participant")
    return identity.forget(go("withdrawn", slug, extent=extent.value), slug)


@blueprint.get("/s/<slug>/withdrawn")
def withdrawn(slug: str) -> str:
    """Confirm a withdrawal."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        erased = request.args.get("extent") == Extent.ERASE
        return study_page("withdrawn.html", studies.spec_of(study), study, erased=erased)


@blueprint.get("/s/<slug>/debrief")
def debrief(slug: str) -> Response | str:
    """Thank, say what it was about, and give what the panel asks for."""
    with parts().database.read() as db:
        study = studies.find(db, slug)
        participant = identity.find(db, slug)
        if participant is None:
            return go("welcome", slug)
        if participant.completed_at is None:
            return go("trial", slug)
        spec = studies.spec_of(study)
        return study_page(
            "debrief.html",
            spec,
            study,
            number=participant.number + 1,
            code=participant.code,
            back_to_panel=_back_to_panel(spec, participant),
        )


def _back_to_panel(spec: StudySpec, participant: Participant) -> str | None:
    if spec.completion.redirect is None:
        return None
    filled = spec.completion.redirect.replace("{code}", quote(participant.code or "", safe=""))
    return filled.replace("{panel_id}", quote(participant.panel_id or "", safe=""))
