"""What simulated raters are told beside the pages: what each clip truly shows, and what attention checks want."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation import instruments
from evaluation.errors import EvaluationError
from evaluation.instruments import Instrument
from evaluation.responses import DIMENSIONS, input_pad
from evaluation.seeding import generator
from evaluation.simulate import PAD_SPREAD
from evaluation.study import StudySpec
from webapp.models import Clip, Condition, Stimulus
from webapp.services import studies

LOWEST_QUALITY, HIGHEST_QUALITY = 2.5, 4.0
"""Mean opinion of a study's first and last condition."""

Pad = tuple[float, float, float]


@dataclass(frozen=True)
class Truth:
    """What a clip truly shows: its PAD, its mean opinion (1 to 5), and its length where that is known."""

    digest: str
    pad: Pad
    quality: float
    duration_s: float | None = None


INDIFFERENT = Truth("", (0.0, 0.0, 0.0), 3.0)
"""What is answered about where no clip is shown."""


@dataclass(frozen=True)
class Known:
    """What is known of a study; nothing, if its database is elsewhere.

    Attributes
    ----------
    spec : StudySpec or None
        The study file.
    clips : mapping of str to Truth
        Each clip by its digest.
    """

    spec: StudySpec | None = None
    clips: Mapping[str, Truth] = field(default_factory=dict)

    def truth(self, digest: str) -> Truth:
        """Return what a clip shows; of one that is not known, what all raters make of its digest."""
        return self.clips.get(digest) or drawn(digest)

    def instrument(self, name: str) -> Instrument | None:
        """Return an instrument by its name, None if it is not known."""
        try:
            return instruments.get(name) if self.spec is None else self.spec.instrument(name)
        except EvaluationError:
            return None

    def wanted(self, prompt: str) -> Mapping[str, tuple[int, ...]]:
        """Return the accepted answers of the question with this text, by "instrument.item"; nothing if not known."""
        parts = self.spec.all_parts if self.spec is not None else ()
        for asked in (asked for part in parts for asked in part.instructed):
            if prompt in {" ".join(text.split()) for text in asked.prompt.values()}:
                return asked.accept
        return {}


def drawn(digest: str) -> Truth:
    """Return a truth drawn from a clip's digest alone, spread as the faces of MTAP 2013 (`PAD_SPREAD`)."""
    rng = generator(0, "truth of a clip", digest)
    values = np.clip([rng.normal(0, PAD_SPREAD[dimension]) for dimension in DIMENSIONS], -1, 1)
    P, A, D = (float(value) for value in values)
    return Truth(digest, (P, A, D), float(rng.uniform(LOWEST_QUALITY, HIGHEST_QUALITY)))


def read(session: Session, slug: str) -> Known:
    """Return what the database knows of a study.

    Raises
    ------
    NotFoundError
        If it has no such study.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    names = [condition.name for condition in spec.conditions]
    levels = np.linspace(LOWEST_QUALITY, HIGHEST_QUALITY, len(names)).tolist()
    quality = dict(zip(names, levels, strict=True))
    rows = session.execute(
        select(Stimulus.name, Condition.name, Clip.digest, Clip.duration_s)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .join(Clip, Stimulus.clip_id == Clip.id)
        .where(Stimulus.study_id == study.id)
    )
    found = {}
    for stimulus, condition, digest, duration_s in rows:
        pad = shown_pad(spec, stimulus, condition) or drawn(digest).pad
        found[digest] = Truth(digest, pad, quality[condition], duration_s)
    return Known(spec, found)


def shown_pad(spec: StudySpec, stimulus: str, condition: str) -> Pad | None:
    """Return the PAD that a cell's clip shows: its own times its intensity; None if it names none."""
    pad = input_pad(spec, stimulus, condition)
    if pad is None:
        return None
    intensity = spec.clip_fields(stimulus, condition).get("intensity", 1.0)
    factor = float(intensity) if isinstance(intensity, (int, float)) else 1.0
    P, A, D = (min(1.0, max(-1.0, value * factor)) for value in pad)
    return P, A, D
