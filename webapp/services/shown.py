"""What trials show: the clips of a study, and which of them stand beside each other on a page."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from webapp.models import Clip, Condition, Stimulus, Study, TrialStimulus


class Shown(NamedTuple):
    """A stimulus in a condition, and the digest of its clip."""

    stimulus: str
    condition: str
    clip: str


class Shows(NamedTuple):
    """What the trials of a study show.

    Attributes
    ----------
    clips : mapping of int to Shown
        The study's clips by the key of the stimulus.
    beside : mapping of int to tuple of int
        By the key of a trial, the keys of the stimuli that it shows beside its first one; trials of one clip are not
        in it.
    """

    clips: Mapping[int, Shown]
    beside: Mapping[int, tuple[int, ...]]

    def page(self, stimulus: int | None, others: Sequence[int] = ()) -> tuple[Shown, ...]:
        """Return what a page shows, in its order, by the keys of its stimuli."""
        return () if stimulus is None else tuple(self.clips[key] for key in (stimulus, *others))


def shows(session: Session, study: Study) -> Shows:
    """Read what the trials of a study show."""
    rows = session.execute(
        select(Stimulus.id, Stimulus.name, Condition.name, Clip.digest)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .join(Clip, Stimulus.clip_id == Clip.id)
        .where(Stimulus.study_id == study.id)
    )
    clips = {key: Shown(stimulus, condition, digest) for key, stimulus, condition, digest in rows}
    others = session.execute(
        select(TrialStimulus.trial_id, TrialStimulus.stimulus_id)
        .join(Stimulus, TrialStimulus.stimulus_id == Stimulus.id)
        .where(Stimulus.study_id == study.id)
        .order_by(TrialStimulus.trial_id, TrialStimulus.place)
    )
    beside: dict[int, tuple[int, ...]] = {}
    for trial, key in others:
        beside[trial] = (*beside.get(trial, ()), key)
    return Shows(clips, beside)
