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
    _, database = open_database()
    password = sys.stdin.readline().rstrip("\r\n") if password_stdin else experimenters.new_password()
    with database.write() as session:
        experimenters.add(session, name, password, role=role)
    click.echo(f"Experimenter '{name}' may log in now.")
    if not password_stdin:
        click.echo(f"Password (shown only now): {password}")
