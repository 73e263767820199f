"""``padlab fap``: FAP files to clips and to the formats of other programs."""

from pathlib import Path
from typing import Any

import click

from synth.clip import render_faps
from synth.face.identity import find_identity
from synth.fap.file import FapFile, read_fap
from synth.fap.table import column, faps
from webapp.cli.animation import write_animation
from webapp.cli.context import echo_json, progress_bar
from webapp.cli.options import FILE, check_out, end_on_signals, face_dir, identity_option, size_option


@click.group()
def fap() -> None:
    """Play, convert and check FAP files (MPEG-4 facial animation parameters)."""


@fap.command()
@click.argument("file", type=FILE)
@click.option("--out", type=FILE, required=True, help="The clip (MP4).")
@click.option("--audio", type=FILE, help="Its sound (WAV).")
@identity_option
@size_option
def render(*, file: Path, out: Path, audio: Path | None, identity: str, size: tuple[int, int]) -> None:
    """Make a clip of a FAP file, at its own frame rate."""
    end_on_signals()
    check_out(out, ".mp4")
    if audio is not None and audio.suffix.lower() != ".wav":
        raise click.BadParameter(f"'{audio}' must end with .wav", param_hint="--audio")
    find_identity(identity)
    found = _read(file)
    with progress_bar("Rendering frames") as update:
        render_faps(
            found.values,
            out,
            face_dir(),
            fps=found.fps,
            identity=identity,
            width=size[0],
            height=size[1],
            audio=audio,
            on_progress=update,
        )
    click.echo(f"Written: {out}")


@fap.command()
@click.argument("file", type=FILE)
@click.option("--out", type=FILE, required=True, help="ARKit weights (JSON or CSV), or figure and animation (GLB).")
@identity_option
def export(*, file: Path, out: Path, identity: str) -> None:
    """Convert a FAP file to ARKit weights or glTF, by the suffix of --out."""
    end_on_signals()
    check_out(out, ".json", ".csv", ".glb")
    find_identity(identity)
    found = _read(file)
    write_animation(found.values, [out], face_dir(), fps=found.fps, identity=identity)


@fap.command()
@click.argument("file", type=FILE)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(*, file: Path, as_json: bool) -> None:
    """Tell how long a FAP file is, which parameters move, and how far."""
    found = read_fap(file)
    summary = _summary(found)
    if as_json:
        echo_json(summary)
        return
    click.echo(
        f"{file} ({found.name}): {summary['frames']} frames at {found.fps} per second, {summary['seconds']:g} s, "
        f"{len(summary['faps'])} FAPs move"
    )
    for row in summary["faps"]:
        usable = row["usable"]
        beyond = usable is not None and not usable[0] <= row["min"] <= row["max"] <= usable[1]
        note = f"\tbeyond what looks natural, {usable[0]:g} to {usable[1]:g}" if beyond else ""
        click.echo(f"FAP {row['fap']}\t{row['name']}\t{row['min']:g} to {row['max']:g}{note}")
    _tell_ignored(found)


def _summary(found: FapFile) -> dict[str, Any]:
    rows = []
    for one in faps().values():
        course = found.values[:, column(one.fap)]
        if course.any():
            reach = {"min": float(course.min()), "max": float(course.max())}
            rows.append({"fap": one.fap, "name": one.name, **reach, "usable": one.usable})
    frames = len(found.values)
    return {
        "name": found.name,
        "fps": found.fps,
        "frames": frames,
        "seconds": round(frames / found.fps, 6),
        "faps": rows,
        "ignored": found.ignored,
    }


def _read(file: Path) -> FapFile:
    found = read_fap(file)
    _tell_ignored(found)
    return found


def _tell_ignored(found: FapFile) -> None:
    if found.ignored:
        which = " and ".join(f"FAP {number}" for number in found.ignored)
        click.echo(f"{which} (viseme, expression) are ignored: text files do not agree on their form.", err=True)
