"""Animations to files, for several commands."""

import re
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from synth.fap.file import write_fap
from synth.interchange.arkit import write_arkit
from synth.interchange.gltf import write_gltf
from synth.stage import Stage

SUFFIXES = (".fap", ".json", ".csv", ".glb")


def write_animation(
    faps: NDArray[np.float64], files: Sequence[Path], face_dir: Path, *, fps: int, identity: str
) -> None:
    """Write FAP values in the format that each file's suffix names, one of `SUFFIXES`, and tell so.

    Parameters
    ----------
    faps : (T, 68)
        FAP values in FAPU.
    files : sequence of Path
        FAP files, ARKit weights (.json, .csv) and glTF (.glb).
    face_dir : Path
        Folder of the compiled face data.
    fps : int
        Frames per second.
    identity : str
        Whose face.
    """
    moving = [path for path in files if path.suffix.lower() != ".fap"]
    stage = Stage(face_dir, identity) if moving else None
    motion = stage.move(faps) if stage is not None else None
    for path in files:
        note = ""
        if stage is None or motion is None or path not in moving:
            write_fap(path, faps, fps=fps, name=re.sub(r"\s+", "_", path.stem))
        elif path.suffix.lower() == ".glb":
            write_gltf(path, stage.rig, motion, fps=fps)
        else:
            clipped = write_arkit(path, motion, fps=fps)
            if clipped:
                note = f" ({clipped} of {motion.weights.size} weights lay outside 0 to 1 and were cut)"
        click.echo(f"Written: {path}{note}")
