"""The experimenter's pages: studies, progress, results, downloads, and what is done while a study runs."""

from webapp.experimenter import collection
from webapp.experimenter.login import login_manager
from webapp.experimenter.views import blueprint

__all__ = ["blueprint", "collection", "login_manager"]
