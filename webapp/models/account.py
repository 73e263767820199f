"""Who may look behind the scenes."""

from sqlalchemy import String
from sqlalchemy.orm import Mapped, mapped_column

from webapp.db import Base
from webapp.models.columns import Key, Moment, Name, now


class Experimenter(Base):
    """A person with a login."""

    __tablename__ = "experimenter"

    id: Mapped[Key]
    name: Mapped[Name] = mapped_column(unique=True)
    password_hash: Mapped[str] = mapped_column(String(300))
    role: Mapped[str] = mapped_column(String(20))
    created_at: Mapped[Moment] = mapped_column(default=now)
