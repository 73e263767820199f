"""Studies: apply a study file, open and close, look up."""

from dataclasses import dataclass
from functools import lru_cache

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation.study import StudySpec
from synth.clip import ClipSpec, clip_digest
from webapp.config import Settings
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Clip, Condition, Participant, Response, Stimulus, Study, StudyState, Trial


@dataclass(frozen=True)
class StudyOverview:
    """A study in one line of a list."""

    slug: str
    title: str
    state: str
    participants: int
    completed: int
    responses: int


def apply(session: Session, spec: StudySpec, text: str, settings: Settings) -> Study:
    """Bring a study file into the database and register its clips for rendering.

    Applying the same file again changes nothing. A study that has participants cannot be changed any more: what was
    collected must stay readable with the file it was collected with.

    Raises
    ------
    ConflictError
        If the file differs from the applied one and participants have enrolled.
    SynthError
        If a clip of the file cannot be specified.
    """
    study = session.scalar(select(Study).where(Study.slug == spec.slug).with_for_update())
    if study is not None and _enrolled(session, study):
        if study.digest == spec.digest:
            return study
        raise ConflictError(
            f"The study '{spec.slug}' has participants and cannot be changed; give the changed file a new slug"
        )
    wanted = {cell: clip_spec(spec, *cell) for cell in spec.cells()}
    digests = {cell: clip_digest(clip, settings.face_dir) for cell, clip in wanted.items()}
    if study is not None and study.digest == spec.digest:
        applied = [stimulus.clip.digest for stimulus in study.stimuli]
        if applied == list(digests.values()):
            return study
    if study is None:
        study = Study(slug=spec.slug)
        session.add(study)
    study.title = spec.title.get("en") or next(iter(spec.title.values()))
    study.text = text
    study.digest = spec.digest
    study.stimuli.clear()
    study.conditions.clear()
    session.flush()
    study.conditions = [Condition(name=condition.name, position=k) for k, condition in enumerate(spec.conditions)]
    by_name = {condition.name: condition for condition in study.conditions}
    for cell, clip in wanted.items():
        study.stimuli.append(
            Stimulus(name=cell.stimulus, condition=by_name[cell.condition], clip=_clip(session, clip, digests[cell]))
        )
    session.flush()
    return study


def clip_spec(spec: StudySpec, stimulus: str, condition: str) -> ClipSpec:
    """Return the specification of the clip that shows `stimulus` in `condition`.

    Raises
    ------
    SynthError
        If the study file asks for what synthesis cannot do; the message names the field.
    """
    return ClipSpec.from_dict(spec.clip_fields(stimulus, condition))


def _clip(session: Session, spec: ClipSpec, digest: str) -> Clip:
    clip = session.scalar(select(Clip).where(Clip.digest == digest))
    if clip is None:
        clip = Clip(digest=digest, spec=spec.to_dict())
        session.add(clip)
        session.flush()
    return clip


def _enrolled(session: Session, study: Study) -> int:
    return session.scalar(select(func.count(Participant.id)).where(Participant.study_id == study.id)) or 0


def find(session: Session, slug: str) -> Study:
    """Return the study with this slug.

    Raises
    ------
    NotFoundError
        If there is none; the message lists those there are.
    """
    study = session.scalar(select(Study).where(Study.slug == slug))
    if study is None:
        known = session.scalars(select(Study.slug).order_by(Study.slug)).all()
        there = f"there are: {', '.join(known)}" if known else "there is none yet; `padlab demo` makes one"
        raise NotFoundError(f"There is no study '{slug}'; {there}")
    return study


def spec_of(study: Study) -> StudySpec:
    """Return the study file as it was applied."""
    return _parsed(study.text, f"{study.slug} (as applied)")


@lru_cache(maxsize=64)
def _parsed(text: str, source: str) -> StudySpec:
    """Read a study file; every page needs it, and reading takes longer than the rest of the page."""
    return StudySpec.from_yaml(text, source=source)


def open_specs(session: Session) -> list[StudySpec]:
    """Return the study files of all open studies, by slug."""
    found = session.scalars(select(Study).where(Study.state == StudyState.OPEN).order_by(Study.slug))
    return [spec_of(study) for study in found]


def set_state(session: Session, slug: str, state: StudyState) -> Study:
    """Open or close a study for participants.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = find(session, slug)
    study.state = state
    return study


def overviews(session: Session) -> list[StudyOverview]:
    """List all studies by slug, with how many people enrolled, finished, and how many trials were answered."""
    people = (
        select(
            Participant.study_id,
            func.count(Participant.id).label("participants"),
            func.count(Participant.completed_at).label("completed"),
        )
        .group_by(Participant.study_id)
        .subquery()
    )
    answers = (
        select(Participant.study_id, func.count(Response.id).label("responses"))
        .join(Trial, Trial.participant_id == Participant.id)
        .join(Response, Response.trial_id == Trial.id)
        .where(Response.revision == 1)
        .group_by(Participant.study_id)
        .subquery()
    )
    rows = session.execute(
        select(Study, people.c.participants, people.c.completed, answers.c.responses)
        .outerjoin(people, people.c.study_id == Study.id)
        .outerjoin(answers, answers.c.study_id == Study.id)
        .order_by(Study.slug)
    )
    return [
        StudyOverview(study.slug, study.title, study.state, enrolled or 0, completed or 0, responses or 0)
        for study, enrolled, completed, responses in rows
    ]
