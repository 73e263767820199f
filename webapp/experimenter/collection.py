"""What an experimenter does while a study runs: advance rounds, look after single participants, read the audit."""

from flask import flash, redirect, request, url_for
from flask_babel import gettext
from flask_login import current_user
from werkzeug.wrappers import Response

from webapp.experimenter.views import blueprint, page
from webapp.models import ParticipantState
from webapp.parts import parts
from webapp.services import audit, decisions, enrolment, rounds, studies, withdrawal
from webapp.services.decisions import GATES
from webapp.services.withdrawal import Extent


@blueprint.post("/<slug>/rounds/advance")
def advance_rounds(slug: str) -> Response:
    """Complete the open round if its raters are through, and open the next."""
    with parts().database.write() as db:
        sentences = rounds.advance(db, slug, actor=current_user.name)
    for sentence in sentences:
        flash(sentence, "info")
    return redirect(url_for("experimenter.study", slug=slug) + "#rounds", code=303)


@blueprint.get("/<slug>/participants/<int(max=2147483647):number>")
def participant(slug: str, number: int) -> str:
    """Show one participant: how far they are, and what can be done."""
    with parts().database.read() as db:
        found = enrolment.find_by_number(db, slug, number - 1)
        study = studies.find(db, slug)
        return page(
            "participant.html",
            study=study,
            participant=found,
            lines=enrolment.trial_lines(db, found),
            decision=decisions.of(db, found),
            gates=GATES,
            withdrawn=found.state == ParticipantState.WITHDRAWN,
        )


@blueprint.post("/<slug>/participants/<int(max=2147483647):number>/withdraw")
def withdraw(slug: str, number: int) -> Response:
    """Take a participant out of the study, as they asked for."""
    extent = request.form.get("extent", "")
    target = url_for("experimenter.participant", slug=slug, number=number)
    if extent not in set(Extent):
        flash(gettext("Choose what becomes of the answers."), "danger")
        return redirect(target, code=303)
    with parts().database.write() as db:
        found = enrolment.find_by_number(db, slug, number - 1)
        withdrawal.withdraw(db, found, Extent(extent), actor=current_user.name)
    flash(gettext("The participant has been withdrawn."), "success")
    return redirect(target, code=303)


@blueprint.post("/<slug>/participants/<int(max=2147483647):number>/decision")
def decide(slug: str, number: int) -> Response:
    """Set or take back the experimenter's own word on a participant."""
    target = url_for("experimenter.participant", slug=slug, number=number)
    gate, reason = request.form.get("gate", ""), request.form.get("reason", "").strip()
    with parts().database.write() as db:
        found = enrolment.find_by_number(db, slug, number - 1)
        if gate in GATES and not reason:
            flash(gettext("Give the reason: it is reported with the results."), "danger")
            return redirect(target, code=303)
        decisions.decide(db, found, gate, reason, actor=current_user.name)
    flash(gettext("The decision is stored."), "success")
    return redirect(target, code=303)


@blueprint.get("/<slug>/audit")
def audit_lines(slug: str) -> str:
    """List what was done to the study and its data."""
    with parts().database.read() as db:
        found = studies.find(db, slug)
        return page("audit.html", study=found, entries=audit.entries(db, found))
