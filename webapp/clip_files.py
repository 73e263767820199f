"""Clips over HTTP, with ranges, so that browsers can seek."""

from io import BytesIO
from types import MappingProxyType

from flask import Blueprint, abort, send_file
from werkzeug.wrappers import Response

from webapp.parts import parts

blueprint = Blueprint("clip_files", __name__)
YEAR_SECONDS = 365 * 24 * 3600
TYPES = MappingProxyType(
    {
        "mp4": "video/mp4",
        "webm": "video/webm",
        "wav": "audio/wav",
        "mp3": "audio/mpeg",
        "ogg": "audio/ogg",
        "m4a": "audio/mp4",
        "png": "image/png",
        "jpg": "image/jpeg",
        "jpeg": "image/jpeg",
        "webp": "image/webp",
        "gif": "image/gif",
    }
)
"""What a clip is sent as, by the suffix of its file; others are not sent, since a browser might run them."""


@blueprint.get("/clips/<digest>.<suffix>")
def clip(digest: str, suffix: str) -> Response:
    """Send a clip; its address is the digest of its content, so it never changes."""
    if suffix not in TYPES:
        abort(404)
    media = parts().media
    try:
        path = media.local_path(digest, suffix)
        if path is not None and not path.is_file():
            abort(404)
        body = path or BytesIO(media.read(digest, suffix))
    except FileNotFoundError:
        abort(404)
    return send_file(body, mimetype=TYPES[suffix], conditional=True, etag=digest, max_age=YEAR_SECONDS)
