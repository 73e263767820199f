"""Who is at the other end: a long-lived cookie names the participant, a session cookie the sitting."""

from flask import Flask, current_app, request, session
from sqlalchemy.orm import Session
from werkzeug.wrappers import Response

from webapp.errors import NotFoundError
from webapp.models import Participant
from webapp.services import enrolment

COOKIE_SECONDS = 180 * 24 * 3600


def _cookie(slug: str) -> str:
    return f"padlab_{slug}"


def remember(response: Response, slug: str, token: str) -> Response:
    """Let the browser remember the participant, so that a closed browser loses nothing."""
    response.set_cookie(
        _cookie(slug), token, max_age=COOKIE_SECONDS, httponly=True, samesite="Lax", secure=request.is_secure, path="/"
    )
    return response


def find(db: Session, slug: str) -> Participant | None:
    """Return the participant that the browser remembers, if that is one of this study."""
    token = request.cookies.get(_cookie(slug))
    if not token:
        return None
    try:
        return enrolment.find(db, slug, token)
    except NotFoundError:
        return None


def visit_id(participant: Participant) -> int:
    """Return this sitting's number, beginning one when the browser was opened anew."""
    key = f"visit_{participant.id}"
    if key not in session:
        app: Flask = current_app
        with app.extensions["padlab"].database.write() as db:
            session[key] = enrolment.begin_visit(db, participant, user_agent=request.user_agent.string).id
    return int(session[key])
