"""The command line, ``padlab``: thin commands over the same services as the pages."""

from webapp.cli.main import main

__all__ = ["main"]
