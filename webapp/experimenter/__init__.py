"""The experimenter's pages: what was collected so far, and what it says."""

from webapp.experimenter.login import login_manager
from webapp.experimenter.views import blueprint

__all__ = ["blueprint", "login_manager"]
