"""``padlab user``: experimenters' accounts."""

import sys

import click

from webapp.cli.context import open_database
from webapp.services import experimenters


@click.group()
def user() -> None:
    """Accounts for the experimenter's pages."""


@user.command()
@click.argument("name")
@click.option("--password-stdin", is_flag=True, help="Read the password from standard input (one line).")
@click.option("--role", type=click.Choice(experimenters.ROLES), default="experimenter", show_default=True)
def add(name: str, password_stdin: bool, role: str) -> None:
    """Make an account NAME; without --password-stdin a password is made and printed once."""
    given = _read_password(password_stdin)
    _, database = open_database()
    with database.write() as session:
        experimenters.add(session, name, given, role=role)
    click.echo(f"Experimenter '{name}' may log in now.")
    _show(given, password_stdin)


@user.command()
@click.argument("name")
@click.option("--password-stdin", is_flag=True, help="Read the password from standard input (one line).")
def password(name: str, password_stdin: bool) -> None:
    """Give the account NAME a new password; without --password-stdin one is made and printed once."""
    given = _read_password(password_stdin)
    _, database = open_database()
    with database.write() as session:
        experimenters.set_password(session, name, given)
    click.echo(f"Experimenter '{name}' has a new password.")
    _show(given, password_stdin)


def _read_password(from_stdin: bool) -> str:
    return sys.stdin.readline().rstrip("\r\n") if from_stdin else experimenters.new_password()


def _show(given: str, from_stdin: bool) -> None:
    if not from_stdin:
        click.echo(f"Password (shown only now): {given}")
