"""Who is at the other end: a long-lived cookie names the participant, a session cookie the sitting."""

from collections.abc import Mapping

from flask import request, session
from sqlalchemy.orm import Session
from werkzeug.wrappers import Response

from webapp.errors import NotFoundError
from webapp.models import Participant
from webapp.parts import parts
from webapp.services import enrolment
from webapp.services.enrolment import Panel

COOKIE_SECONDS = 180 * 24 * 3600


def _cookie(slug: str) -> str:
    return f"padlab_{slug}"


def remember(response: Response, slug: str, token: str) -> Response:
    """Let the browser remember the participant, so that a closed browser loses nothing."""
    response.set_cookie(
        _cookie(slug), token, max_age=COOKIE_SECONDS, httponly=True, samesite="Lax", secure=request.is_secure, path="/"
    )
    return response


def forget(response: Response, slug: str) -> Response:
    """Let the browser forget the participant."""
    for key in ("enrol", "panel", "part", "feedback"):
        session.pop(f"{key}_{slug}", None)
    response.delete_cookie(_cookie(slug), path="/")
    return response


def expect(slug: str) -> str:
    """Return the token with which this browser will enrol, the same however often the button is pressed."""
    key = f"enrol_{slug}"
    if key not in session:
        session[key] = enrolment.new_token()
    return str(session[key])


def note_panel(slug: str, parameters: Mapping[str, str]) -> None:
    """Remember whom a panel says that this is, until they enrol."""
    found = enrolment.panel_of(parameters)
    if found is not None:
        session[f"panel_{slug}"] = list(found)


def panel(slug: str) -> Panel | None:
    """Return whom a panel said that this is."""
    found = session.get(f"panel_{slug}")
    return Panel(*found) if found else None


def find(db: Session, slug: str) -> Participant | None:
    """Return the participant that the browser remembers, if that is one of this study."""
    token = request.cookies.get(_cookie(slug))
    # A cookie may hold anything, even characters that PostgreSQL refuses to look up.
    if not token or not token.isascii() or not token.isprintable():
        return None
    try:
        participant = enrolment.find(db, slug, token)
    except NotFoundError:
        return None
    # On another device, or after the browser was closed, the pages go on in the language they were begun in.
    session.setdefault("language", participant.language)
    return participant


def visit_id(participant: Participant) -> int:
    """Return this sitting's number, beginning one when the browser was opened anew."""
    key = f"visit_{participant.id}"
    if key not in session:
        with parts().database.write() as db:
            session[key] = enrolment.begin_visit(db, participant, user_agent=request.user_agent.string).id
    return int(session[key])
