"""What most commands begin with: settings, an up-to-date database, a progress bar."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from webapp.config import Settings
from webapp.db import Database

# PAD values may be negative: an unknown "-0.18" is then taken as an argument, not as an option.
NEGATIVE_NUMBERS = {"ignore_unknown_options": True}


def open_database() -> tuple[Settings, Database]:
    """Return the settings and a database whose schema is the code's.

    Raises
    ------
    WebappError
        If a setting is wrong, or the database cannot be used.
    """
    settings = Settings.from_env()
    database = Database(settings.database_url)
    database.require_current()
    return settings, database


def echo_json(value: Any) -> None:
    """Print a value as JSON."""
    click.echo(json.dumps(value, ensure_ascii=False, indent=2))


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Show progress: a bar on a terminal, a plain line now and then elsewhere.

    Yields
    ------
    callable
        To be called with (finished, all); the first call should be (0, all).
    """
    if not sys.stderr.isatty():
        yield lambda finished, total: _plain_line(label, finished, total)
        return
    bar: Any = None

    def update(finished: int, total: int) -> None:
        nonlocal bar
        if bar is None and total:
            bar = click.progressbar(length=total, label=label, show_pos=True, file=sys.stderr)
            bar.__enter__()
        if bar is not None:
            bar.update(finished - bar.pos)

    try:
        yield update
    finally:
        if bar is not None:
            bar.__exit__(None, None, None)


def _plain_line(label: str, finished: int, total: int) -> None:
    step = max(1, total // 5)
    if total and (finished % step == 0 or finished == total):
        click.echo(f"{label}: {finished} of {total}", err=True)
