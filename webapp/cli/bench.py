"""``padlab bench``: measurements, printed as one flat object."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from synth.clip import ClipSpec, render_clip
from synth.face import assets
from webapp.cli.context import echo_json
from webapp.config import Settings

REPEATS = 3
CLIP_SECONDS = 5.0


@click.group()
def bench() -> None:
    """Measure how fast padlab is on this machine."""


@bench.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def render(as_json: bool) -> None:
    """Measure the way from a specification to an MP4 file, in one process."""
    folder = Settings.from_env().face_dir
    assets.fetch(folder)
    seconds, frames = _median_run(folder)
    figures = {
        "render.frames_per_second": round(frames / seconds, 2),
        "render.realtime_factor": round(frames / ClipSpec().fps / seconds, 3),
    }
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def _median_run(folder: Path) -> tuple[float, int]:
    """Render the same clip several times; the median, since machines are noisy. The first run only warms up."""
    spec = ClipSpec(pad=(0.55, 0.24, 0.28), hold_s=CLIP_SECONDS)
    runs = []
    with TemporaryDirectory() as place:
        for _ in range(REPEATS + 1):
            start = time.perf_counter()
            lineage = render_clip(spec, Path(place) / "clip.mp4", folder)
            runs.append(time.perf_counter() - start)
    return sorted(runs[1:])[REPEATS // 2], int(lineage["frames"])
