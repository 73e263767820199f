"""``padlab study``: study files and the studies made of them."""

import dataclasses
from pathlib import Path

import click

from evaluation import study as study_file
from evaluation.study import StudySpec
from webapp.cli.context import echo_json, open_database
from webapp.errors import NotFoundError
from webapp.models import StudyState
from webapp.services import clips, studies

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
    studies.clip_specs(spec, text, source=str(file))
    click.echo(
        f"{file} is a valid study file: '{spec.slug}', {len(spec.stimuli)} stimuli in "
        f"{len(spec.conditions)} conditions, {len(spec.cells())} clips."
    )


@study.command()
@click.argument("file", type=FILE)
def apply(file: Path) -> None:
    """Bring a study FILE (or a bundled one) into the database; then render its clips and open it."""
    spec, text = read_study_file(file)
    studies.clip_specs(spec, text, source=str(file))
    settings, database = open_database()
    with database.write() as session:
        slug = studies.apply(session, spec, text, settings).slug
    click.echo(f"The study '{slug}' is applied. Next: padlab clips render {slug}; padlab study open {slug}")


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


def _set_state(slug: str, state: StudyState) -> None:
    _, database = open_database()
    with database.write() as session:
        studies.set_state(session, slug, state)
    click.echo(f"The study '{slug}' is {state}.")
