"""``padlab db``: the schema of the database."""

import click

from webapp.config import Settings
from webapp.db import Database


@click.group()
def db() -> None:
    """Bring the database schema up to date, or tell which one it has."""


@db.command()
def upgrade() -> None:
    """Create the tables or bring them to the newest revision; data stays."""
    click.echo(f"The database has schema revision {Database(Settings.from_env().database_url).upgrade()}.")


@db.command()
def current() -> None:
    """Print the schema revision of the database and whether it is the newest."""
    database = Database(Settings.from_env().database_url)
    have, newest = database.current(), database.head()
    note = "newest" if have == newest else f"newest is {newest}; run `padlab db upgrade`"
    click.echo(f"{have or 'empty'} ({note})")
