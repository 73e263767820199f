"""The tables: what a study is, who takes part, what was shown and what was answered."""

from webapp.db import Base
from webapp.models.account import Experimenter
from webapp.models.participation import Participant, PlaybackEvent, Response, Trial, Visit
from webapp.models.study import Clip, ClipStatus, Condition, Stimulus, Study, StudyState

__all__ = [
    "Base",
    "Clip",
    "ClipStatus",
    "Condition",
    "Experimenter",
    "Participant",
    "PlaybackEvent",
    "Response",
    "Stimulus",
    "Study",
    "StudyState",
    "Trial",
    "Visit",
]
