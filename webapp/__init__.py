"""padlab's web application: participants' pages, the experimenter's pages and the command line."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flask import Flask

    from webapp.config import Settings

__version__ = "0.1.0"


def create_app(settings: "Settings | None" = None) -> "Flask":
    """Build the web application.

    Parameters
    ----------
    settings : Settings, optional
        By default read from the environment.

    Raises
    ------
    WebappError
        If a setting, the database or the media store cannot be used.
    """
    # Imported late, so that the command line starts quickly and the services can be used without Flask.
    from webapp.application import build  # noqa: PLC0415

    return build(settings)
