"""Experimenters: accounts and passwords."""

import secrets

from sqlalchemy import select
from sqlalchemy.orm import Session
from werkzeug.security import check_password_hash, generate_password_hash

from webapp.errors import ConflictError, NotFoundError
from webapp.models import Experimenter

ROLES = ("admin", "experimenter")
MIN_PASSWORD_LENGTH = 8
# Checked when a name is unknown, so that the time of the answer does not tell which names exist.
_NOBODY = generate_password_hash(secrets.token_urlsafe(12))


def add(session: Session, name: str, password: str, *, role: str = "experimenter") -> Experimenter:
    """Make an account.

    Raises
    ------
    ConflictError
        If the name is taken or the password too short.
    """
    hashed = _hash(password)
    if not name or len(name) > 80:
        raise ConflictError("An experimenter's name takes 1 to 80 characters")
    if session.scalar(select(Experimenter).where(Experimenter.name == name)) is not None:
        raise ConflictError(
            f"There is an experimenter '{name}' already; choose another name, or run `padlab user password {name}`"
        )
    experimenter = Experimenter(name=name, password_hash=hashed, role=role)
    session.add(experimenter)
    session.flush()
    return experimenter


def set_password(session: Session, name: str, password: str) -> None:
    """Give an account a new password.

    Raises
    ------
    NotFoundError
        If there is no such account.
    ConflictError
        If the password is too short.
    """
    experimenter = session.scalar(select(Experimenter).where(Experimenter.name == name))
    if experimenter is None:
        raise NotFoundError(f"There is no experimenter '{name}'; `padlab user add {name}` makes one")
    experimenter.password_hash = _hash(password)


def _hash(password: str) -> str:
    if len(password) < MIN_PASSWORD_LENGTH:
        raise ConflictError(f"The password is too short; it takes at least {MIN_PASSWORD_LENGTH} characters")
    return generate_password_hash(password)


def any_exists(session: Session) -> bool:
    """Tell whether there is an account at all."""
    return session.scalar(select(Experimenter.id).limit(1)) is not None


def authenticate(session: Session, name: str, password: str) -> Experimenter | None:
    """Return the experimenter with this name and password, or None."""
    experimenter = session.scalar(select(Experimenter).where(Experimenter.name == name))
    good = check_password_hash(experimenter.password_hash if experimenter else _NOBODY, password)
    return experimenter if good else None


def get(session: Session, experimenter_id: int) -> Experimenter | None:
    """Return the experimenter with this number, or None."""
    return session.get(Experimenter, experimenter_id)


def new_password() -> str:
    """Return a password that is hard to guess and easy to type."""
    alphabet = "abcdefghjkmnpqrstuvwxyz23456789"
    return "-".join("".join(secrets.choice(alphabet) for _ in range(4)) for _ in range(4))
