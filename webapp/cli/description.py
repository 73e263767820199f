"""``padlab face --describe``: which emotion a FAP file shows."""

from pathlib import Path

import click

from synth.errors import SynthError
from synth.expression.description import describe
from synth.expression.model_set import FILE_NAME, ModelSet, bundled_set
from synth.expression.models import load_model
from synth.expression.pep import peps
from synth.fap.file import read_fap
from synth.pad import DIMENSIONS, PAD
from synth.words import nearest_words
from webapp.cli.context import echo_json
from webapp.config import Settings


def describe_file(file: Path, model: str, *, as_json: bool) -> None:
    """Print PAD, nearest words and PEPs of a FAP file's strongest frame; as JSON of all frames."""
    if not file.is_file():
        raise SynthError(f"There is no FAP file {file}.")
    models = _set_of(model)
    found = describe(read_fap(file).values, models)
    apex = PAD.parse(found.pad[found.apex].tolist())
    words = nearest_words(apex, 3)
    if as_json:
        echo_json(
            {
                "apex": {
                    "frame": found.apex,
                    "pad": list(apex.as_tuple()),
                    "pep": found.pep[found.apex].tolist(),
                    "words": [{"word": word.word, "distance": distance} for word, distance in words],
                },
                "rmse": dict(zip(DIMENSIONS, found.rmse.tolist(), strict=True)),
                "frames": found.pad.tolist(),
                "models": str(models.origin.get("data")),
                "note": str(models.origin.get("note")),
            }
        )
        return
    click.echo(f"Strongest expression: frame {found.apex} of {len(found.pad)}")
    for name, value, rmse in zip(DIMENSIONS, found.pad[found.apex], found.rmse, strict=True):
        click.echo(f"{name}  {value:+.2f}  (RMSE {rmse:.2f})")
    click.echo("Nearest words: " + ", ".join(f"{word.word} ({distance:.2f})" for word, distance in words))
    for pep, value in zip(peps(), found.pep[found.apex], strict=True):
        # What is written as 0.00 points nowhere; adding 0.0 keeps "-0.00" off the page.
        shown = round(float(value), 2) + 0.0
        click.echo(f"PEP {pep.code}  {shown:+.2f}  {(pep.plus if shown > 0 else pep.minus) if shown else '-'}")
    click.echo(f"By models trained on {models.origin.get('data')}. {models.origin.get('note')}")


def _set_of(model: str) -> ModelSet:
    """Return the set that a model belongs to; padlab's own for the built-in ones."""
    if "/" not in model:
        return bundled_set()
    models_dir = Settings.from_env().models_dir
    # Tells which sets there are if there is none of this name.
    load_model(model, models_dir)
    return ModelSet.read(models_dir / model.split("/", maxsplit=1)[0] / FILE_NAME)
