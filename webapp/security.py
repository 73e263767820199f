"""Headers that every answer carries: nothing from other hosts, no inline script, no framing."""

from flask import Flask, Response, abort, request
from flask.sessions import SecureCookieSessionInterface

PAGE_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        # Bootstrap's stylesheet draws its icons from data: addresses.
        "img-src 'self' data:",
        "font-src 'self'",
        "media-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "frame-ancestors 'none'",
        "base-uri 'none'",
    )
)
# A report is one self-contained file with its styles inside; it gets no scripts and no origin at all.
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox allow-popups; frame-ancestors 'none'"
)

_HEADERS = {
    "Content-Security-Policy": PAGE_POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


def install(app: Flask) -> None:
    """Add the headers to every answer that does not set its own, and keep the session's cookie to HTTPS."""
    app.session_interface = SecureOverHttps()

    @app.before_request
    def refuse_nul() -> None:
        # No text of ours has one, and PostgreSQL stores none.
        if any("\0" in text for text in (request.path, *request.values.values())):
            abort(400)

    @app.after_request
    def add_headers(response: Response) -> Response:
        for name, value in _HEADERS.items():
            response.headers.setdefault(name, value)
        if response.mimetype == "text/html":
            # A page belongs to one person and one moment: going back must not show yesterday's form.
            response.headers.setdefault("Cache-Control", "no-store")
        return response


def own_path(target: str | None) -> str | None:
    """Return `target` when it is a path of this site, otherwise None: two slashes lead to another host."""
    if not target or not target.startswith("/") or target.startswith("//"):
        return None
    # Browsers take a backslash for a slash, and drop tabs and line ends before they look.
    return None if any(char in "\\\x7f" or char <= " " for char in target) else target


class SecureOverHttps(SecureCookieSessionInterface):
    """A session whose cookie is for HTTPS only, as soon as the page came over HTTPS."""

    def get_cookie_secure(self, app: Flask) -> bool:
        """Tell whether the present request came over HTTPS."""
        return request.is_secure
