"""The participant's way through a study: consent, instructions, trials, debrief."""

from webapp.participant import trial_views
from webapp.participant.views import blueprint

__all__ = ["blueprint", "trial_views"]
