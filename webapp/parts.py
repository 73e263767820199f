"""What the pages work with: the settings, the database and the media store of the running application."""

from dataclasses import dataclass

from flask import current_app

from webapp.config import Settings
from webapp.db import Database
from webapp.media import MediaStore


@dataclass(frozen=True)
class Parts:
    """The parts of one application, kept in its ``extensions``."""

    settings: Settings
    database: Database
    media: MediaStore


def parts() -> Parts:
    """Return the parts of the running application."""
    found: Parts = current_app.extensions["padlab"]
    return found
