"""Studies: apply a study file, open and close, look up."""

from dataclasses import dataclass
from functools import lru_cache

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation import located_yaml
from evaluation.errors import Problem, StudyFileError
from evaluation.study import Cell, StudySpec
from synth.clip import clip_digest
from synth.clip_spec import ClipSpec
from synth.errors import SpecError
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
    StudyFileError
        If a clip of the file cannot be made.
    """
    study = session.scalar(select(Study).where(Study.slug == spec.slug).with_for_update())
    if study is not None and _enrolled(session, study):
        if study.digest == spec.digest:
            return study
        raise ConflictError(
            f"The study '{spec.slug}' has participants and cannot be changed; give the changed file a new slug"
        )
    wanted = clip_specs(spec, text, source=spec.slug)
    digests = {cell: clip_digest(clip, settings.face_dir, settings.models_dir) for cell, clip in wanted.items()}
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


def clip_specs(spec: StudySpec, text: str, *, source: str = "study file") -> dict[Cell, ClipSpec]:
    """Return the specification of the clip of each stimulus in each condition.

    Parameters
    ----------
    spec : StudySpec
        The study.
    text : str
        The text of its file, in which faults are located.
    source : str
        Name of the file, for messages.

    Raises
    ------
    StudyFileError
        If the file asks for what synthesis cannot do; the message names each fault's line and field.
    """
    stimuli = {stimulus.id: ("stimuli", k, "clip") for k, stimulus in enumerate(spec.stimuli)}
    conditions = {condition.name: ("conditions", k, "clip") for k, condition in enumerate(spec.conditions)}
    made: dict[Cell, ClipSpec] = {}
    faults: dict[tuple[str, int, str], str] = {}
    for cell in spec.cells():
        alone = {**spec.video.model_dump(), **spec.stimulus(cell.stimulus).clip}
        # What fails without the condition is the stimulus's fault; what fails only with it, the condition's.
        for path, fields in (
            (stimuli[cell.stimulus], alone),
            (conditions[cell.condition], spec.clip_fields(*cell)),
        ):
            try:
                made[cell] = ClipSpec.from_dict(fields)
            except SpecError as error:
                faults.setdefault(path, str(error))
                break
    if faults:
        located = located_yaml.parse(text, source=source)
        problems = [Problem(located.line(path), located_yaml.field_name(path), fault) for path, fault in faults.items()]
        raise StudyFileError(source, sorted(problems, key=lambda problem: problem.line or 0))
    return made


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
