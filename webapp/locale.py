"""The language of the pages: what the person chose, else what the browser asks for."""

from collections.abc import Mapping

from flask import Blueprint, redirect, request, session
from werkzeug.wrappers import Response

from webapp import security

DEFAULT = "en"
# Language of study files to the locale of the catalogues.
LOCALES: Mapping[str, str] = {"en": "en", "zh": "zh_Hans"}
NAMES: Mapping[str, str] = {"en": "English", "zh": "中文"}

blueprint = Blueprint("locale", __name__)


def language() -> str:
    """Return the page's language as study files name it ("en", "zh")."""
    chosen = session.get("language")
    if chosen in LOCALES:
        return str(chosen)
    for wanted in request.accept_languages.values():
        prefix = wanted.split("-")[0].lower()
        if prefix in LOCALES:
            return prefix
    return DEFAULT


def select() -> str:
    """Return the locale for Babel."""
    return LOCALES[language()]


def html_lang(locale: str) -> str:
    """Return the value of the page's ``lang`` attribute."""
    return locale.replace("_", "-")


@blueprint.post("/language")
def choose() -> Response:
    """Remember the chosen language and go back to the page."""
    chosen = request.form.get("language", "")
    if chosen in LOCALES:
        session["language"] = chosen
    return redirect(security.own_path(request.form.get("next")) or "/", code=303)
