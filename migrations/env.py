"""Alembic's entry: runs on the connection that padlab hands over, or on the one its settings name."""

from alembic import context
from sqlalchemy import Connection

from webapp.config import Settings
from webapp.db import Database
from webapp.models import Base
from webapp.models.columns import UtcDateTime


def render_item(kind: str, item: object, _context: object) -> str | bool:
    """Write our own column types as the plain types that they are in the database."""
    return "sa.DateTime(timezone=True)" if kind == "type" and isinstance(item, UtcDateTime) else False


def run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=Base.metadata,
        compare_type=True,
        render_item=render_item,
    )
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:
    with Database(Settings.from_env().database_url).engine.begin() as own:
        run(own)
