"""``padlab experiment``: the sixty clips of one of the experiments of MTAP 2013."""

import json
from pathlib import Path
from typing import Any

import click

from synth.clip import clip_digest, render_clip
from synth.clip_spec import ClipSpec
from synth.experiments import EXPERIMENTS, experiment_clips
from synth.files import write_whole
from synth.text.sentence import LANGUAGES
from webapp.cli.context import progress_bar
from webapp.cli.options import end_on_signals, face_dir, identity_option, size_option, voice_option
from webapp.config import Settings


@click.command()
@click.argument("name", type=click.Choice(EXPERIMENTS))
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder of the clips.")
@click.option(
    "--lang", type=click.Choice(LANGUAGES), default="zh", show_default=True, help="Language of the sentences."
)
@voice_option
@click.option("--mute", is_flag=True, help="Without sound; the timing stays.")
@identity_option
@size_option
def experiment(
    *, name: str, out: Path, lang: str, voice: str, mute: bool, identity: str, size: tuple[int, int]
) -> None:
    """Render an experiment of MTAP 2013, Table 9: three conditions, twenty sentences about scenic spots each.

    Beside each clip is its lineage (JSON). A clip that is there already is not rendered again, so that the command goes
    on where it was interrupted.
    """
    end_on_signals()
    models_dir = Settings.from_env().models_dir
    clips = experiment_clips(name, lang, voice=voice, identity=identity, mute=mute, width=size[0], height=size[1])
    out.mkdir(parents=True, exist_ok=True)
    folder = face_dir()
    rendered = 0
    with progress_bar("Rendering clips") as update:
        update(0, len(clips))
        for count, (clip, spec) in enumerate(clips.items(), start=1):
            rendered += _render(spec, out / f"{clip}.mp4", folder, models_dir)
            update(count, len(clips))
    click.echo(f"{rendered} clips rendered, {len(clips) - rendered} were there already: {out}")


def _render(spec: ClipSpec, file: Path, folder: Path, models_dir: Path) -> bool:
    """Render a clip unless it is there; tell whether it was rendered."""
    sidecar = file.with_suffix(".json")
    if file.is_file() and _digest_in(sidecar) == clip_digest(spec, folder, models_dir):
        return False
    # Without it the clip counts as not there, whatever was begun: it goes first and comes last.
    sidecar.unlink(missing_ok=True)
    made = render_clip(spec, file, folder, models_dir)
    write_whole(sidecar, json.dumps(made, ensure_ascii=False, indent=1))
    return True


def _digest_in(sidecar: Path) -> Any:
    try:
        return json.loads(sidecar.read_text(encoding="utf-8")).get("digest")
    except (OSError, ValueError, AttributeError):
        return None
