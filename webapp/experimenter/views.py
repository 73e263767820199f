"""The experimenter's pages. Each view parses, calls a service, answers."""

import io
import zipfile
from collections.abc import Iterable
from typing import Any

from flask import Blueprint, Response, flash, redirect, render_template, request, url_for
from flask_babel import gettext
from flask_login import current_user, login_user, logout_user
from sqlalchemy.orm import Session
from werkzeug.wrappers import Response as BaseResponse

from evaluation.report import bundle, figures, html, tables
from webapp import locale, security
from webapp.errors import NotFoundError
from webapp.experimenter.login import Account, login_manager
from webapp.models import Study, StudyState
from webapp.parts import parts
from webapp.services import clips, enrolment, experimenters, exports, results, rounds, studies
from webapp.services.rounds import RoundOverview

blueprint = Blueprint("experimenter", __name__, url_prefix="/experimenter")


def page(template: str, **values: Any) -> str:
    """Render a page of the experimenter."""
    return render_template(f"experimenter/{template}", languages=list(locale.LOCALES), **values)


@blueprint.before_request
def require_login() -> BaseResponse | None:
    """Let nobody in without a login, whatever page is added to this blueprint."""
    if request.endpoint == "experimenter.login" or current_user.is_authenticated:
        return None
    answer: BaseResponse = login_manager.unauthorized()
    return answer


@blueprint.route("/login", methods=["GET", "POST"])
def login() -> BaseResponse | str | tuple[str, int]:
    """Ask for name and password."""
    target = security.own_path(request.values.get("next")) or url_for("experimenter.index")
    if current_user.is_authenticated:
        return redirect(target)
    if request.method == "GET":
        return page("login.html", next=target)
    with parts().database.read() as db:
        found = experimenters.authenticate(db, request.form.get("name", ""), request.form.get("password", ""))
    if found is None:
        return page("login.html", next=target, name=request.form.get("name", ""), failed=True), 401
    login_user(Account(found))
    return redirect(target, code=303)


@blueprint.post("/logout")
def logout() -> BaseResponse:
    """End the session."""
    logout_user()
    return redirect(url_for("experimenter.login"), code=303)


@blueprint.get("/")
def index() -> str:
    """List the studies."""
    with parts().database.read() as db:
        return page("index.html", studies=studies.overviews(db))


@blueprint.get("/<slug>/")
def study(slug: str) -> str:
    """Show what a study has collected and what it says so far."""
    with parts().database.read() as db:
        found = studies.find(db, slug)
        reports = results.reports(db, slug)
        return page(
            "study.html",
            study=found,
            progress=clips.progress(db, found),
            failures=clips.failures(db, found),
            participants=enrolment.participants(db, slug),
            rounds=_rounds(db, found),
            reports=[(part, tables.title(one), one.trials, tables.sections(one)) for part, one in reports.items()],
            figures=figures.NAMES,
            caption=figures.caption,
        )


def _rounds(db: Session, found: Study) -> list[RoundOverview]:
    return rounds.overview(db, found.slug) if rounds.annotated_parts(studies.spec_of(found)) else []


@blueprint.post("/<slug>/state")
def set_state(slug: str) -> BaseResponse:
    """Open or close the study."""
    state = StudyState(request.form["state"]) if request.form.get("state") in set(StudyState) else None
    if state is not None:
        with parts().database.write() as db:
            studies.set_state(db, slug, state, actor=current_user.name)
        flash(gettext("The study is open.") if state == StudyState.OPEN else gettext("The study is closed."), "success")
    return redirect(url_for("experimenter.study", slug=slug), code=303)


@blueprint.get("/<slug>/clips.json")
def clip_progress(slug: str) -> dict[str, int]:
    """Tell how far rendering is, for the progress bar."""
    with parts().database.read() as db:
        return clips.progress(db, studies.find(db, slug)).to_dict()


@blueprint.get("/<slug>/figures/<name>.svg")
def figure(slug: str, name: str) -> Response:
    """Draw a figure of the report."""
    if name not in figures.NAMES:
        raise NotFoundError(name)
    with parts().database.read() as db:
        svg = figures.draw(name, results.report(db, slug, request.args.get("part")))
    response = Response(svg, mimetype="image/svg+xml")
    # Drawings carry their styles inside.
    response.headers["Content-Security-Policy"] = security.REPORT_POLICY
    return response


@blueprint.get("/<slug>/report.html")
def report(slug: str) -> Response:
    """Send the whole report of a part (the first unless one is named) as one file."""
    with parts().database.read() as db:
        page = html.render(results.full_report(db, slug, request.args.get("part")), linked=False)
    response = Response(page, mimetype="text/html")
    response.headers["Content-Security-Policy"] = security.REPORT_POLICY
    return response


@blueprint.get("/<slug>/report.zip")
def report_files(slug: str) -> Response:
    """Send the reports on all parts with their figures and tables in one archive."""
    with parts().database.read() as db:
        found = results.full_reports(db, slug)
    return _archive(bundle.study_files(found), slug, f"{slug}-report.zip")


@blueprint.get("/papers.html")
def papers_page() -> Response:
    """Send the page that sets the papers' printed tables beside padlab's."""
    response = Response(bundle.papers_page()[1], mimetype="text/html")
    response.headers["Content-Security-Policy"] = security.REPORT_POLICY
    return response


@blueprint.get("/<slug>/export.zip")
def export_all(slug: str) -> Response:
    """Send all tables as CSV in one archive."""
    with parts().database.read() as db:
        frames = exports.frames(db, slug)
    return _archive(
        ((f"{name}.csv", exports.to_csv(one).encode()) for name, one in frames.items()), slug, f"{slug}.zip"
    )


def _archive(files: Iterable[tuple[str, bytes]], folder: str, name: str) -> Response:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as out:
        for path, content in files:
            out.writestr(f"{folder}/{path}", content)
    return _attachment(archive.getvalue(), "application/zip", name)


def _attachment(body: bytes, mimetype: str, name: str) -> Response:
    response = Response(body, mimetype=mimetype)
    response.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return response
