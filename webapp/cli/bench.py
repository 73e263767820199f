"""``padlab bench``: measurements, printed as one flat object."""

import multiprocessing
import resource
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import click
import numpy as np
from numpy.typing import NDArray

from synth.baseline import NaiveRenderer
from synth.clip import film_plan
from synth.clip_spec import ClipSpec
from synth.expression.models import load_model
from synth.face import assets
from synth.face.deformation import solve
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.fap.table import column
from synth.plan import plan_clip
from synth.render import Renderer
from synth.speech.voices import forget_speech
from synth.text.analysis import guess_language
from synth.video import VideoWriter
from webapp.cli.bench_statistics import statistics
from webapp.cli.bench_study import study
from webapp.cli.bench_training import train
from webapp.cli.context import echo_json
from webapp.config import Settings

REPEATS = 5
SECONDS, NAIVE_SECONDS, FPS = 5, 2, 25
WIDTH, HEIGHT = 720, 576
MEMORY_SECONDS = (10, 60)

Floats = NDArray[np.float64]

SENTENCES = (
    "Victoria Peak is the most popular place in Hong Kong, and from the top you can look down on tall towers, the "
    "world-famous harbour and the quiet green islands beyond it.",
    "Thank you very much for your help, it was wonderful.",
    "太平山頂是香港最受歡迎的名勝景點，登臨其間，可俯瞰山下鱗次櫛比的摩天高樓。",
    "對不起，您能再說一遍嗎？",
)
"""What is said; the first takes about ten seconds."""

_MOUTHS_PER_SECOND = 3.7
_NODS = {48: (12_000, 0.31), 49: (16_000, 0.23), 50: (7_000, 0.17)}
"""Pitch, yaw and roll of the head: largest value in units of 1e-5 rad, and cycles in a second."""


@click.group()
def bench() -> None:
    """Measure how fast padlab is on this machine."""


bench.add_command(train)
bench.add_command(study)
bench.add_command(statistics)


@bench.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def render(as_json: bool) -> None:
    """Measure the way from FAP values to an MP4 file: speed, shares of the stages, memory, and the plain pyrender loop.

    The face talks, blinks and turns its head in every frame. Ours and the plain loop take turns; the ratio is the
    median over the pairs.
    """
    folder = Settings.from_env().face_dir
    assets.fetch(folder)
    figures = _speed(folder)
    for seconds in MEMORY_SECONDS:
        figures[f"render.peak_memory_mb_{seconds}s"] = round(_in_fresh_process(_peak_memory, folder, seconds), 1)
    figures |= _saying(folder)
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def _saying(folder: Path) -> dict[str, float]:
    """Measure the way from text to film, all on, and that from text to FAPs, without drawing; both when warm."""
    films, plans = [], []
    spec = ClipSpec(text=SENTENCES[0])
    with TemporaryDirectory() as place:
        for seed in range(REPEATS + 1):
            # Another seed is another clip; the text is analysed and spoken anew by clearing what is kept.
            forget_speech()
            start = time.perf_counter()
            plan = plan_clip(replace(spec, seed=seed))
            film_plan(plan, Path(place) / "clip.mp4", folder)
            films.append(plan.duration_s / (time.perf_counter() - start))
    for text in SENTENCES:
        plan_clip(ClipSpec(text=text, lang=guess_language(text)))
    for _ in range(REPEATS):
        for text in SENTENCES:
            forget_speech()
            start = time.perf_counter()
            plan_clip(ClipSpec(text=text, lang=guess_language(text)))
            plans.append(1000.0 * (time.perf_counter() - start))
    # The first film warms up and does not count.
    return {
        "say.realtime_factor": round(median(films[1:]), 3),
        "say.clip_seconds": round(plan_clip(spec).duration_s, 2),
        "text.ms_per_sentence": round(median(plans), 1),
    }


def talking(seconds: float) -> Floats:
    """Return the FAPs (T, 68) of a face that smiles, talks, blinks and turns its head a few degrees all the time."""
    at = np.arange(round(seconds * FPS)) / FPS
    smile = load_model("table").apex(np.array([[0.55, 0.24, 0.28]]))[1][0]
    faps: Floats = (0.5 + 0.3 * np.sin(2 * np.pi * 0.4 * at))[:, None] * smile
    loud = 0.6 + 0.4 * np.sin(2 * np.pi * 0.9 * at)
    jaw = loud * np.maximum(0.0, np.sin(2 * np.pi * _MOUTHS_PER_SECOND * at))
    blink = np.maximum(0.0, 1.0 - np.abs((at % 2.5) - 1.0) / 0.16)
    for fap, course in {
        **dict.fromkeys((3,), 350 * jaw),
        **dict.fromkeys((4, 51), -60 * jaw),
        **dict.fromkeys((5, 52), -200 * jaw),
        **dict.fromkeys((19, 20), 700 * blink),
        **dict.fromkeys((31, 32, 35, 36), 60 * np.sin(2 * np.pi * 0.7 * at)),
        **{fap: size * np.sin(2 * np.pi * often * at + fap) for fap, (size, often) in _NODS.items()},
    }.items():
        faps[:, column(fap)] += course
    return faps


def _speed(folder: Path) -> dict[str, float]:
    rig = Rig(load_face(folder))
    faps = talking(SECONDS)
    pairs = []
    with (
        TemporaryDirectory() as place,
        Renderer(rig, width=WIDTH, height=HEIGHT) as renderer,
        NaiveRenderer(rig, width=WIDTH, height=HEIGHT) as naive,
    ):
        out = Path(place) / "clip.mp4"
        for _ in range(REPEATS + 1):
            own = _frames_per_second(faps, rig, renderer.frames, out)
            pairs.append((own, _frames_per_second(faps[: NAIVE_SECONDS * FPS], rig, naive.frames, out)))
        shares = _shares(faps, rig, renderer, out)
    # The first pair warms up and does not count.
    own, other = (median(side) for side in zip(*pairs[1:], strict=True))
    return {
        "render.frames_per_second": round(own, 2),
        "render.realtime_factor": round(own / FPS, 3),
        "render.naive_frames_per_second": round(other, 2),
        "render.ratio_to_naive": round(median(mine / theirs for mine, theirs in pairs[1:]), 3),
        **{f"render.share_{stage}": round(share, 4) for stage, share in shares.items()},
    }


def _frames_per_second(
    faps: Floats, rig: Rig, draw: Callable[[Motion], Iterable[NDArray[np.uint8]]], out: Path
) -> float:
    start = time.perf_counter()
    with VideoWriter(out, WIDTH, HEIGHT, fps=FPS) as video:
        for picture in draw(solve(faps, rig)):
            video.write(picture)
    return len(faps) / (time.perf_counter() - start)


def _shares(faps: Floats, rig: Rig, renderer: Renderer, out: Path) -> dict[str, float]:
    """Return each stage's share of the time when they run one after the other, without overlap."""
    start = time.perf_counter()
    motion = solve(faps, rig)
    solved = time.perf_counter() - start
    frames = [renderer.timed_frame(motion, frame) for frame in range(len(motion))]
    start = time.perf_counter()
    with VideoWriter(out, WIDTH, HEIGHT, fps=FPS) as video:
        for picture, _ in frames:
            video.write(picture)
    encode = time.perf_counter() - start
    seconds = {
        "solve": solved + sum(times.pose for _, times in frames),
        "upload": sum(times.upload for _, times in frames),
        "draw": sum(times.draw for _, times in frames),
        "readback": sum(times.readback for _, times in frames),
        "encode": encode,
    }
    return {stage: value / sum(seconds.values()) for stage, value in seconds.items()}


def _in_fresh_process(measure: Callable[[Path, int], float], folder: Path, seconds: int) -> float:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(measure, (folder, seconds))


def _peak_memory(folder: Path, seconds: int) -> float:
    """Film a clip and return the largest memory that this process has held, in MB; ffmpeg's is not in it."""
    rig = Rig(load_face(folder))
    with (
        TemporaryDirectory() as place,
        Renderer(rig, width=WIDTH, height=HEIGHT) as renderer,
        VideoWriter(Path(place) / "clip.mp4", WIDTH, HEIGHT, fps=FPS) as video,
    ):
        for picture in renderer.frames(solve(talking(seconds), rig)):
            video.write(picture)
    status = Path("/proc/self/status")
    if status.exists():
        # What getrusage reports may stem from the parent, whose memory the child had before it became a new program.
        lines = dict(line.split(":", 1) for line in status.read_text(encoding="ascii").splitlines())
        return int(lines["VmHWM"].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
