"""Studies: apply a study file, open and close, look up."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from evaluation import located_yaml
from evaluation.errors import Problem, StudyFileError
from evaluation.study import Cell, StudySpec
from synth.clip import clip_digest
from synth.clip_spec import ClipSpec
from synth.errors import SpecError
from synth.text.analysis import analyse
from webapp import media_check
from webapp.config import Settings
from webapp.errors import ConflictError, NotFoundError
from webapp.media import CLIP, MediaStore
from webapp.media_check import UnplayableError
from webapp.models import Clip, ClipStatus, Condition, Participant, Response, Stimulus, Study, StudyState, Trial
from webapp.models.columns import now
from webapp.models.study import MEDIA
from webapp.services import audit


@dataclass(frozen=True)
class StudyOverview:
    """A study in one line of a list."""

    slug: str
    title: str
    state: str
    participants: int
    completed: int
    responses: int


def apply(session: Session, spec: StudySpec, text: str, settings: Settings, *, folder: Path | None = None) -> Study:
    """Bring a study file into the database and register its clips for rendering.

    Applying the same file again changes nothing. A study that has participants cannot be changed any more: what was
    collected must stay readable with the file it was collected with.

    Parameters
    ----------
    folder : Path, optional
        Where the study file lies, and its media files beside it.

    Raises
    ------
    ConflictError
        If the file differs from the applied one and participants have enrolled.
    StudyFileError
        If a clip of the file cannot be made, or a media file is not there.
    """
    query = select(Study).where(Study.slug == spec.slug)
    study = session.scalar(query.with_for_update().execution_options(populate_existing=True))
    if study is not None and study.enrolled:
        if study.digest == spec.digest:
            return study
        raise ConflictError(
            f"The study '{spec.slug}' has participants and cannot be changed; give the changed file a new slug"
        )
    wanted = _contents(spec, text, settings, folder)
    if study is not None and study.digest == spec.digest:
        applied = [stimulus.clip.digest for stimulus in study.stimuli]
        if applied == [content.digest for content in wanted.values()]:
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
    words = _words(spec)
    for cell, content in wanted.items():
        study.stimuli.append(
            Stimulus(
                name=cell.stimulus,
                condition=by_name[cell.condition],
                clip=_clip(session, content),
                words=words.get(cell.stimulus),
            )
        )
    session.flush()
    audit.note(session, study, audit.COMMAND_LINE, "apply", digest=spec.digest)
    return study


@dataclass(frozen=True)
class _Content:
    """What a cell shows: a clip to be made, or a file that is there."""

    digest: str
    spec: dict[str, Any]
    suffix: str = CLIP
    bytes: int | None = None
    duration_s: float | None = None


def _contents(spec: StudySpec, text: str, settings: Settings, folder: Path | None) -> dict[Cell, _Content]:
    made = clip_specs(spec, text, source=spec.slug)
    files = media_files(spec, text, source=spec.slug, folder=folder)
    found = {
        cell: _Content(clip_digest(clip, settings.face_dir, settings.models_dir), clip.to_dict())
        for cell, clip in made.items()
    }
    store = MediaStore(settings.media_url) if files else None
    for cell, (path, length) in files.items():
        digest = store.add_file(path) if store is not None else ""
        suffix = path.suffix.lower().removeprefix(".")
        found[cell] = _Content(digest, {"file": path.name}, suffix, path.stat().st_size, length)
    return {cell: found[cell] for cell in spec.cells()}


def _words(spec: StudySpec) -> dict[str, list[str]]:
    """Return the prosodic words of each stimulus, if the study asks about them."""
    if not any(spec.instrument(name).per == "word" for name in spec.instrument_names):
        return {}
    found = {}
    for stimulus in spec.stimuli:
        language, text = str(stimulus.clip.get("lang", "en")), str(stimulus.clip.get("text", ""))
        found[stimulus.id] = list(stimulus.words) or [word.text for word in analyse(text, language).words]
    return found


def media_files(
    spec: StudySpec, text: str, *, source: str = "study file", folder: Path | None = None
) -> dict[Cell, tuple[Path, float | None]]:
    """Return the file of each cell that shows one of the experimenter's own, and its length.

    Returns
    -------
    dict
        Cell to the path and the seconds that the file plays, None for a picture.

    Raises
    ------
    StudyFileError
        If a file is not there, or is none that browsers show; the message names line and field.
    """
    read: dict[str, float | None] = {}
    found: dict[Cell, tuple[Path, float | None]] = {}
    faults: dict[int, str] = {}
    places = {stimulus.id: k for k, stimulus in enumerate(spec.stimuli)}
    for cell in spec.cells():
        named = spec.stimulus(cell.stimulus).media
        if named is None:
            continue
        name = named.replace("{condition}", cell.condition)
        path = (folder or Path()) / name
        try:
            # A file that several cells show is read once.
            length = read[name] if name in read else _length_of(name, path)
        except UnplayableError as error:
            faults.setdefault(places[cell.stimulus], str(error))
            continue
        read[name] = length
        found[cell] = path, length
    if faults:
        located = located_yaml.parse(text, source=source)
        paths: list[tuple[tuple[str | int, ...], str]] = [(("stimuli", k, "media"), why) for k, why in faults.items()]
        raise StudyFileError(
            source, [Problem(located.line(path), located_yaml.field_name(path), why) for path, why in paths]
        )
    return found


def _length_of(name: str, path: Path) -> float | None:
    """Return how many seconds a file plays; UnplayableError with a whole sentence if it cannot be shown."""
    if path.suffix.lower().removeprefix(".") not in MEDIA:
        raise UnplayableError(f"{path.name} is not a file that is shown; right is one that ends in {', '.join(MEDIA)}.")
    if Path(name).is_absolute() or ".." in Path(name).parts:
        # A study file of somebody else must not publish what lies anywhere on this computer.
        raise UnplayableError(
            f"{name} leads out of the study file's folder; right is a file beside it, or in a folder there."
        )
    if not path.is_file():
        raise UnplayableError(f"there is no file {name} beside the study file.")
    try:
        return media_check.duration_s(path)
    except UnplayableError as error:
        raise UnplayableError(f"the file {name} {error}.") from error


def clip_specs(spec: StudySpec, text: str, *, source: str = "study file") -> dict[Cell, ClipSpec]:
    """Return the specification of the clip of each stimulus in each condition, but for the experimenter's own files.

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
        if spec.stimulus(cell.stimulus).media is not None:
            continue
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


def _clip(session: Session, content: _Content) -> Clip:
    clip = session.scalar(select(Clip).where(Clip.digest == content.digest))
    if clip is None:
        clip = Clip(digest=content.digest, spec=content.spec, suffix=content.suffix)
        session.add(clip)
    if content.bytes is not None:
        # A file of one's own is in the store by now, also if it had been lost.
        clip.status, clip.error, clip.bytes = ClipStatus.DONE, None, content.bytes
        clip.finished_at, clip.duration_s = clip.finished_at or now(), content.duration_s
    session.flush()
    return clip


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


def set_state(session: Session, slug: str, state: StudyState, *, actor: str = audit.COMMAND_LINE) -> Study:
    """Open or close a study for participants.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = find(session, slug)
    if study.state != state:
        audit.note(session, study, actor, {StudyState.OPEN: "open", StudyState.CLOSED: "close"}.get(state, state))
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
