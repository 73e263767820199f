"""``padlab bench``: measurements, printed as one flat object."""

import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import click
import numpy as np

from synth.expression.pad_pep import load_model
from synth.expression.pep_fap import pep_to_fap
from synth.face import assets
from synth.face.deformation import solve
from synth.face.mesh import load_face
from synth.face.rig import Rig
from synth.render import Renderer
from synth.video import VideoWriter
from webapp.cli.context import echo_json
from webapp.config import Settings

REPEATS = 3
SECONDS, FPS = 5, 25
WIDTH, HEIGHT = 720, 576


@click.group()
def bench() -> None:
    """Measure how fast padlab is on this machine."""


@bench.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def render(as_json: bool) -> None:
    """Measure the way from FAP values to an MP4 file, in one process, of a face that moves in every frame."""
    folder = Settings.from_env().face_dir
    assets.fetch(folder)
    seconds = _measure(folder)
    figures = {
        "render.frames_per_second": round(SECONDS * FPS / seconds, 2),
        "render.realtime_factor": round(SECONDS / seconds, 3),
    }
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def _measure(folder: Path) -> float:
    """Return the median time in seconds of several runs; the first one warms up and does not count."""
    rig = Rig(load_face(folder))
    apex = pep_to_fap(load_model("table").predict(np.array([[0.55, 0.24, 0.28]])))[0]
    # A clip's still parts cost nothing, so they would flatter: here the smile never stops swelling and fading.
    swell = 0.5 - 0.5 * np.cos(np.linspace(0, 6 * np.pi, SECONDS * FPS))
    faps = swell[:, None] * apex
    runs = []
    with Renderer(rig, width=WIDTH, height=HEIGHT) as renderer, TemporaryDirectory() as place:
        for _ in range(REPEATS + 1):
            start = time.perf_counter()
            motion = solve(faps, rig)
            with VideoWriter(Path(place) / "clip.mp4", WIDTH, HEIGHT, fps=FPS) as video:
                for picture in renderer.frames(motion):
                    video.write(picture)
            runs.append(time.perf_counter() - start)
    return median(runs[1:])
