"""The tables: what a study is, who takes part, what was shown and what was answered."""

from webapp.db import Base
from webapp.models.account import Experimenter
from webapp.models.annotation import AnnotationRound, RoundSample
from webapp.models.audit import AuditEntry
from webapp.models.participation import (
    Decision,
    FreeSlot,
    Participant,
    ParticipantState,
    PlaybackEvent,
    Response,
    Trial,
    TrialStimulus,
    Visit,
)
from webapp.models.study import Clip, ClipStatus, Condition, Stimulus, Study, StudyState

__all__ = [
    "AnnotationRound",
    "AuditEntry",
    "Base",
    "Clip",
    "ClipStatus",
    "Condition",
    "Decision",
    "Experimenter",
    "FreeSlot",
    "Participant",
    "ParticipantState",
    "PlaybackEvent",
    "Response",
    "RoundSample",
    "Stimulus",
    "Study",
    "StudyState",
    "Trial",
    "TrialStimulus",
    "Visit",
]
