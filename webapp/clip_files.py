"""Clips over HTTP, with ranges, so that browsers can seek."""

from io import BytesIO

from flask import Blueprint, abort, send_file
from werkzeug.wrappers import Response

from webapp.parts import parts

blueprint = Blueprint("clip_files", __name__)
YEAR_SECONDS = 365 * 24 * 3600


@blueprint.get("/clips/<digest>.mp4")
def clip(digest: str) -> Response:
    """Send a clip; its address is the digest of its content, so it never changes."""
    media = parts().media
    try:
        path = media.local_path(digest)
        if path is not None and not path.is_file():
            abort(404)
        body = path or BytesIO(media.read(digest))
    except FileNotFoundError:
        abort(404)
    return send_file(body, mimetype="video/mp4", conditional=True, etag=digest, max_age=YEAR_SECONDS)
