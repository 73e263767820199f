"""Headers that every answer carries: nothing from other hosts, no inline script, no framing."""

from flask import Flask, Response

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
    """Add the headers to every answer that does not set its own."""

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
    return target if target and target.startswith("/") and not target.startswith(("//", "/\\")) else None
