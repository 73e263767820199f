"""The Flask application: what its parts are and how errors become pages."""

import hashlib
from functools import cache

from flask import Flask, render_template, request, url_for
from flask_babel import Babel, get_locale
from flask_bootstrap import Bootstrap5
from flask_wtf.csrf import CSRFError, CSRFProtect
from werkzeug.exceptions import HTTPException
from werkzeug.middleware.proxy_fix import ProxyFix

from webapp import clip_files, experimenter, locale, participant, security
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConflictError, NotFoundError
from webapp.media import MediaStore
from webapp.parts import Parts
from webapp.resources import resource_dir

YEAR_SECONDS = 365 * 24 * 3600
MAX_FORM_BYTES = 1024 * 1024


class Site(Flask):
    """The application; its static files have addresses with a digest, so browsers may keep them for good."""

    def get_send_file_max_age(self, filename: str | None) -> int | None:
        """Return for how many seconds a browser may keep a static file."""
        return YEAR_SECONDS if filename is not None and "v" in request.args else super().get_send_file_max_age(filename)


def build(settings: Settings | None = None) -> Flask:
    """Build the application; see `webapp.create_app`."""
    settings = settings or Settings.from_env()
    app = Site("webapp", static_folder=str(resource_dir("static")))
    app.config.update(
        SECRET_KEY=settings.secret_key,
        MAX_CONTENT_LENGTH=MAX_FORM_BYTES,
        SESSION_COOKIE_SAMESITE="Lax",
        SESSION_COOKIE_HTTPONLY=True,
        BOOTSTRAP_SERVE_LOCAL=True,
        WTF_CSRF_TIME_LIMIT=None,
        BABEL_DEFAULT_LOCALE=locale.DEFAULT,
    )
    database = Database(settings.database_url)
    database.require_current()
    app.extensions["padlab"] = Parts(settings, database, MediaStore(settings.media_url))
    # One reverse proxy may stand in front; without one these headers are not trusted to change anything but the scheme.
    app.wsgi_app = ProxyFix(app.wsgi_app, x_for=0, x_proto=1, x_host=0)  # type: ignore[method-assign]

    Babel(app, locale_selector=locale.select)
    Bootstrap5(app)
    CSRFProtect(app)
    security.install(app)
    for module in (participant, experimenter, clip_files, locale):
        app.register_blueprint(module.blueprint)
    experimenter.login_manager.init_app(app)
    _install_error_pages(app)
    app.jinja_env.globals.update(
        asset=asset,
        page_language=lambda: locale.html_lang(str(get_locale())),
        html_lang=lambda code: locale.html_lang(locale.LOCALES[code]),
        language_name=lambda code: locale.NAMES.get(code, code),
        chosen_language=locale.language,
    )
    return app


@cache
def _digest(path: str) -> str:
    return hashlib.sha256((resource_dir("static") / path).read_bytes()).hexdigest()[:12]


def asset(path: str) -> str:
    """Return the address of a static file that changes with the file, so that browsers never keep an old one."""
    return url_for("static", filename=path, v=_digest(path))


def _install_error_pages(app: Flask) -> None:
    def page(code: int, message: str) -> tuple[str, int]:
        return render_template("error.html", code=code, message=message), code

    @app.errorhandler(NotFoundError)
    def not_found(error: NotFoundError) -> tuple[str, int]:
        # The list of studies that the message carries is for the command line, not for strangers.
        return page(404, "")

    @app.errorhandler(ConflictError)
    def conflict(error: ConflictError) -> tuple[str, int]:
        return page(409, str(error))

    @app.errorhandler(CSRFError)
    def forged(error: CSRFError) -> tuple[str, int]:
        # Over HTTPS the form's page must have the address that the server thinks it has: a matter of the proxy.
        if "referrer" in str(error.description):
            app.logger.error("A form was refused: %s Does the proxy pass on Host?", error.description)
        return page(400, "csrf")

    @app.errorhandler(HTTPException)
    def other(error: HTTPException) -> tuple[str, int]:
        return page(error.code or 500, "")

    @app.errorhandler(Exception)
    def unexpected(error: Exception) -> tuple[str, int]:
        app.logger.exception("%s %s failed", request.method, request.path)
        return page(500, "")
