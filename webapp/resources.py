"""Where files beside the code are: in a checkout at the top, in an installed package inside of it."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def resource_dir(name: str) -> Path:
    """Return the folder `name` (``static`` or ``migrations``)."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name
