"""``padlab study``: study files and the studies made of them."""

import dataclasses
from pathlib import Path

import click

from evaluation import study as study_file
from evaluation.study import StudySpec
from webapp.cli.context import echo_json, open_database
from webapp.errors import ConflictError, NotFoundError
from webapp.models import ParticipantState, StudyState
from webapp.services import audit, clips, enrolment, studies, withdrawal
from webapp.services.withdrawal import Extent

FILE = click.Path(path_type=Path)


def read_study_file(path: Path) -> tuple[StudySpec, str]:
    """Read a study file, or a bundled one by its name.

    Returns
    -------
    tuple
        The specification and the file's text.

    Raises
    ------
    NotFoundError
        If there is neither such a file nor a bundled study of this name.
    StudyFileError
        If the file is not a valid study file; the message names line and field.
    """
    if not path.is_file() and str(path) in study_file.bundled_names():
        text = study_file.bundled_text(str(path))
        return StudySpec.from_yaml(text, source=f"{path} (bundled)"), text
    if not path.is_file():
        bundled = ", ".join(study_file.bundled_names())
        raise NotFoundError(f"There is no study file {path}; give a YAML file, or the name of a bundled one: {bundled}")
    text = study_file.read_text(path)
    return StudySpec.from_yaml(text, source=str(path)), text


@click.group()
def study() -> None:
    """Study files and the studies made of them."""


@study.command()
@click.argument("file", type=FILE)
def validate(file: Path) -> None:
    """Check a study FILE (or the name of a bundled one) without changing anything."""
    spec, text = read_study_file(file)
    _check_contents(spec, text, file)
    click.echo(
        f"{file} is a valid study file: '{spec.slug}', {_counted(len(spec.stimuli), 'stimulus', 'stimuli')} in "
        f"{_counted(len(spec.conditions), 'condition', 'conditions')}, {_counted(len(spec.cells()), 'clip', 'clips')}."
    )


@study.command()
@click.argument("file", type=FILE)
def apply(file: Path) -> None:
    """Bring a study FILE (or a bundled one) into the database; then render its clips and open it."""
    spec, text = read_study_file(file)
    _check_contents(spec, text, file)
    settings, database = open_database()
    with database.write() as session:
        slug = studies.apply(session, spec, text, settings, folder=file.parent).slug
    click.echo(f"The study '{slug}' is applied. Next: padlab clips render {slug}; padlab study open {slug}")


def _check_contents(spec: StudySpec, text: str, file: Path) -> None:
    """Refuse a study whose clips cannot be made, or whose media files are not beside it."""
    studies.clip_specs(spec, text, source=str(file))
    studies.media_files(spec, text, source=str(file), folder=file.parent)


def _counted(count: int, one: str, several: str) -> str:
    return f"{count} {one if count == 1 else several}"


@study.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def list_studies(as_json: bool) -> None:
    """List the studies in the database."""
    _, database = open_database()
    with database.read() as session:
        found = studies.overviews(session)
    if as_json:
        echo_json([dataclasses.asdict(overview) for overview in found])
        return
    for overview in found:
        click.echo(
            f"{overview.slug}\t{overview.state}\t{overview.participants} participants\t"
            f"{overview.responses} responses\t{overview.title}"
        )
    if not found:
        click.echo("There is no study yet; `padlab demo` makes one, `padlab study apply FILE` another.", err=True)


@study.command()
@click.argument("slug")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def show(slug: str, as_json: bool) -> None:
    """Show the state of the study SLUG."""
    _, database = open_database()
    with database.read() as session:
        found = studies.find(session, slug)
        overview = next(item for item in studies.overviews(session) if item.slug == slug)
        progress = clips.progress(session, found)
        digest = found.digest
    if as_json:
        echo_json({**dataclasses.asdict(overview), "digest": digest, "clips": progress.to_dict()})
        return
    click.echo(f"{overview.title} ({slug}), {overview.state}")
    click.echo(f"participants: {overview.participants}, of whom completed: {overview.completed}")
    click.echo(f"responses: {overview.responses}")
    click.echo(f"clips: {progress.done} of {progress.total} rendered, {progress.failed} failed")
    click.echo(f"study file: sha-256 {digest}")


@study.command()
def schema() -> None:
    """Print the JSON Schema of study files, for editors that complete and check."""
    echo_json(StudySpec.json_schema())


@study.command("open")
@click.argument("slug")
def open_study(slug: str) -> None:
    """Let participants into the study SLUG."""
    _set_state(slug, StudyState.OPEN)


@study.command()
@click.argument("slug")
def close(slug: str) -> None:
    """Let nobody new into the study SLUG; what was collected stays."""
    _set_state(slug, StudyState.CLOSED)


@study.command()
@click.argument("slug")
@click.argument("participant", type=click.IntRange(min=1))
@click.option("--erase", is_flag=True, help="Delete all that they gave [default].")
@click.option("--anonymise", is_flag=True, help="Keep their ratings, without anything that leads to them.")
@click.option("--yes", is_flag=True, help="Do not ask.")
def withdraw(slug: str, participant: int, *, erase: bool, anonymise: bool, yes: bool) -> None:
    """Take PARTICIPANT (their number, from 1) out of the study SLUG; this cannot be taken back."""
    if erase and anonymise:
        raise click.UsageError("--erase and --anonymise exclude each other")
    extent = Extent.ANONYMISE if anonymise else Extent.ERASE
    _, database = open_database()
    with database.read() as session:
        person = enrolment.find_by_number(session, slug, participant - 1)
        if person.state == ParticipantState.WITHDRAWN:
            raise ConflictError(f"Participant {participant} of the study '{slug}' has withdrawn already")
    if not yes:
        what = "Keep the ratings, but no trace, of" if anonymise else "Delete all answers of"
        click.confirm(f"{what} participant {participant} of '{slug}'? This cannot be taken back", abort=True)
    with database.write() as session:
        person = enrolment.find_by_number(session, slug, participant - 1)
        withdrawal.withdraw(session, person, extent, actor=audit.COMMAND_LINE)
    done = "the ratings stay, without a name" if anonymise else "all answers are deleted"
    click.echo(f"Participant {participant} of the study '{slug}' has withdrawn; {done}.")


def _set_state(slug: str, state: StudyState) -> None:
    _, database = open_database()
    with database.write() as session:
        studies.set_state(session, slug, state)
    click.echo(f"The study '{slug}' is {state}.")
