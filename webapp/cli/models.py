"""``padlab train`` and ``padlab models``: from annotated expressions to models, and how good these are."""

import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import click
import numpy as np

from synth.errors import SpecError
from synth.expression.model_set import FILE_NAME, KINDS, ModelSet, bundled_set
from synth.expression.models import check_model_name
from synth.face import assets
from webapp.cli import model_tables
from webapp.cli.context import echo_json, progress_bar
from webapp.cli.options import end_on_signals
from webapp.config import Settings
from webapp.errors import ConfigError
from webapp.services import corpora, modelling
from webapp.services.modelling import ModelReport

OWN = "(built in)"

FOLDER = click.Path(path_type=Path, file_okay=False)


def _named(_context: click.Context, _param: click.Parameter, data: str) -> str:
    """Refuse --data that names nothing."""
    if not data.removeprefix(corpora.STUDY_PREFIX).strip():
        raise click.BadParameter(f"'{data}' names nothing; it takes pseudo, a folder, or study:SLUG")
    return data


data_option = click.option(
    "--data",
    default=corpora.PSEUDO,
    callback=_named,
    show_default=True,
    help="Annotated expressions: 'pseudo', a folder of landmarks and ratings, or 'study:SLUG'.",
)
seed_option = click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True)


@click.command()
@data_option
@seed_option
@click.option("--out", type=FOLDER, help="Folder of the set [default: named after the data, among padlab's models].")
def train(data: str, seed: int, out: Path | None) -> None:
    """Train the models from PAD to the face on annotated expressions.

    Writes the set (models.json) and its evaluation. A set in padlab's folder of models is used by its name, for
    instance `padlab face 0.5 0.2 0.3 --model pseudo/ann`, and in study files likewise.
    """
    end_on_signals()
    settings = Settings.from_env()
    folder = out or settings.models_dir / _set_name(data)
    _check_folder(folder)
    report = _build(settings, data, seed)
    files = report.write(folder, model_tables.text_of(report))
    report.models.write(folder / FILE_NAME)
    for path in [folder / FILE_NAME, *files]:
        click.echo(f"Written: {path}")
    click.echo(model_tables.verdict(report))
    if not _is_set_name(folder.resolve().name):
        click.echo(
            "To use it by name, name the folder with letters without accents, digits and . _ - (a letter first)."
        )
    elif folder.resolve().parent == settings.models_dir:
        click.echo(f"Use it as --model {', '.join(f'{folder.resolve().name}/{kind}' for kind in KINDS)}.")
    else:
        click.echo(f"To use it by name, move the folder into {settings.models_dir}.")


@click.group()
def models() -> None:
    """Tell which models there are and how good they are."""


@models.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def list_models(as_json: bool) -> None:
    """List the sets of models: padlab's own, and those made by `padlab train`.

    NMSE is the normalised mean square error of PAD to PEP, the mean over PEPs and folds of the set's cross-validation:
    0 is perfect, 1 as good as always the mean. Sets of different data cannot be compared by it.
    """
    settings = Settings.from_env()
    found = [(OWN, bundled_set())]
    for path in sorted(settings.models_dir.glob(f"*/{FILE_NAME}")):
        try:
            found.append((path.parent.name, ModelSet.read(path)))
        except SpecError as error:
            # One damaged set does not hide the others.
            click.echo(f"Left out: {error}", err=True)
    if as_json:
        echo_json([_row(name, one) | {"nmse": _errors(one)} for name, one in found])
        return
    for name, one in found:
        errors = ", ".join(f"{kind} {value:.3f}" for kind, value in _errors(one).items())
        click.echo(f"{name}\t{one.origin.get('data')}, {one.origin.get('samples')} expressions\tNMSE {errors}")


@models.command()
@data_option
@seed_option
@click.option("--out", type=FOLDER, help="Write evaluation.json, evaluation.txt and the figure of PAD by emotion here.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def evaluate(data: str, seed: int, out: Path | None, as_json: bool) -> None:
    """Evaluate the models as both papers do, with the papers' figures beside ours.

    All is computed anew: cross-validation, test set, emotions held out, a check with shuffled annotation, canonical
    correlation and clusters (MTAP 2013, Table 6; ACII 2007, Tables 4 and 7).
    """
    end_on_signals()
    report = _build(Settings.from_env(), data, seed)
    text = model_tables.text_of(report)
    if out is not None:
        report.write(out, text)
    if as_json:
        echo_json(report.to_dict())
    else:
        click.echo(text)


def _build(settings: Settings, data: str, seed: int) -> ModelReport:
    if data == corpora.PSEUDO:
        assets.fetch(settings.face_dir)
    click.echo("Reading the data" if data != corpora.PSEUDO else "Making the pseudo database", err=True)
    corpus = corpora.load(data, settings, seed=seed)
    with _progress_bars("Training networks") as update:
        return modelling.build(corpus, seed=seed, on_progress=update)


@contextmanager
def _progress_bars(label: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar for each of several passes; a pass begins with (0, all)."""
    with ExitStack() as bars:
        update: Callable[[int, int], None] | None = None

        def tell(finished: int, total: int) -> None:
            nonlocal update
            if update is None or not finished:
                bars.close()
                update = bars.enter_context(progress_bar(label))
            update(finished, total)

        yield tell


def _check_folder(folder: Path) -> None:
    """Refuse a folder that could not be made or written to, before models are trained for it."""
    there = folder.resolve()
    while not there.exists() and there != there.parent:
        there = there.parent
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise ConfigError(
            f"The set cannot be written to {folder} ({there}: {error.strerror or error}); name another with --out"
        ) from error


def _is_set_name(name: str) -> bool:
    try:
        check_model_name(f"{name}/{KINDS[0]}")
    except SpecError:
        return False
    return True


def _set_name(data: str) -> str:
    slug = data.removeprefix(corpora.STUDY_PREFIX)
    # The name of "." or ".." is that of the folder it stands for.
    plain = slug if slug != data else Path(data).resolve().name
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-._")
    if not name:
        raise ConfigError(f"No name for the set can be made of --data {data}; name a folder with --out")
    return name


def _row(name: str, one: ModelSet) -> dict[str, Any]:
    origin = {key: one.origin.get(key) for key in ("data", "pseudo", "samples", "seed", "note")}
    return {"name": name, **origin, "hidden": one.ann.hidden}


def _errors(one: ModelSet) -> dict[str, float]:
    """Return the mean NMSE in cross-validation by kind of model, as the set's file tells it."""
    by_kind = one.origin.get("evaluation", {}).get("pad_pep", {})
    known = {kind: [error for error in own["nmse"] if error is not None] for kind, own in by_kind.items()}
    return {kind: float(np.mean(errors)) for kind, errors in known.items() if errors}
