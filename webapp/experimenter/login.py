"""Logging in and out."""

from flask_babel import lazy_gettext
from flask_login import LoginManager, UserMixin

from webapp.models import Experimenter
from webapp.parts import parts
from webapp.services import experimenters

login_manager = LoginManager()
login_manager.login_view = "experimenter.login"
login_manager.login_message = lazy_gettext("Please log in to see this page.")
login_manager.login_message_category = "info"


class Account(UserMixin):  # type: ignore[misc]
    """A logged-in experimenter, detached from the database."""

    def __init__(self, experimenter: Experimenter) -> None:
        self.id = str(experimenter.id)
        self.name = experimenter.name
        self.role = experimenter.role


def load(account_id: str) -> Account | None:
    """Return the account that a session cookie names, None when it is gone."""
    with parts().database.read() as db:
        experimenter = experimenters.get(db, int(account_id)) if account_id.isdigit() else None
        return Account(experimenter) if experimenter else None


login_manager.user_loader(load)
