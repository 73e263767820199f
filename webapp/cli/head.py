"""``padlab head``: head motion of words, statistics of recordings, head rotation from facial points."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from synth.errors import SpecError
from synth.fap.file import MAX_RATE, write_fap
from synth.head import pose as head_pose
from synth.head.annotation import read_words, write_words
from synth.head.published import (
    AXES,
    FPS,
    SYLLABLE_TYPES,
    example_sentence,
    printed,
    published_counts,
    published_peaks,
    published_statistics,
)
from synth.head.recording import RecordingStatistics, percentages, recording_statistics
from synth.head.track import read_angles, read_points, write_angles
from synth.head.trajectory import KINDS, TRANSITIONS, HeadMotion, head_motion, head_track
from synth.head.words import ProsodicWord
from webapp.cli.context import echo_json
from webapp.cli.options import FILE, check_out, size_option

_SAMPLE_WORDS = 12  # as many as the paper's Table 2 has
_ROTATION_ROWS = (
    ("Angle range", "angle_range"),
    ("Angle SD", "angle_sd"),
    ("Amp mean", "amp_mean"),
    ("Amp SD", "amp_sd"),
    ("Avg mean", "avg_mean"),
    ("Avg SD", "avg_sd"),
)
_PEAK_NAMES = ("SYL_S", "SYL_F", "SYL_P", "Others")
fps_option = click.option(
    "--fps", type=click.IntRange(1, MAX_RATE), default=FPS, show_default=True, help="Frames per second, of all files."
)


@click.group()
def head() -> None:
    """Move the head by prosodic words, and measure how heads move (MTAP 2013, section 3)."""


@head.command()
@click.argument("words", type=FILE)
@click.option("--out", type=FILE, required=True, help="The FAP file.")
@click.option("--kind", type=click.Choice(KINDS), default="prosodic", show_default=True, help="How the head moves.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of what is drawn.")
@fps_option
@click.option(
    "--transition",
    type=click.Choice(tuple(TRANSITIONS)),
    default="average",
    show_default=True,
    help="From word to word by the paper's moving average, or by a smoother glide.",
)
@click.option("--level", is_flag=True, help="Draw the mean position about 0: the paper's speaker held her head raised.")
@click.option("--keep-gaze", is_flag=True, help="Turn the eyes back, so that they stay on the camera.")
@click.option("--angles", type=FILE, help="Also write the angles in degrees (CSV).")
@click.option("--json", "as_json", is_flag=True, help="Print the motion of each word as JSON.")
def move(
    *,
    words: Path,
    out: Path,
    kind: str,
    seed: int,
    fps: int,
    transition: str,
    level: bool,
    keep_gaze: bool,
    angles: Path | None,
    as_json: bool,
) -> None:
    """Make a FAP file that moves the head along with the prosodic words of WORDS (CSV)."""
    check_out(out, ".fap")
    check_out(angles, ".csv", option="--angles")
    table = published_statistics()
    motion = head_motion(
        read_words(words, fps=fps),
        rng=np.random.default_rng(seed),
        kind=kind,
        fps=fps,
        statistics=replace(table, avg_mean=np.zeros(len(AXES))) if level else table,
        transition=transition,
    )
    # A whole step of FAP 48 to 50 is 1e-5 rad, and the standard's values are whole.
    write_fap(out, np.rint(head_track(motion.angles, keep_gaze=keep_gaze)), fps=fps, name="head")
    if angles is not None:
        write_angles(angles, motion.angles)
    if as_json:
        echo_json(_motion_dict(motion))
        return
    speeds = ", ".join(f"{axis} {speed:.0f}" for axis, speed in zip(AXES, motion.largest_speed, strict=True))
    click.echo(f"Written: {out}")
    if angles is not None:
        click.echo(f"Written: {angles}")
    click.echo(f"{len(motion.angles)} frames at {fps} per second; largest speed in degrees per second: {speeds}")


@head.command()
@click.argument("angles", type=FILE)
@click.argument("words", type=FILE)
@fps_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def statistics(*, angles: Path, words: Path, fps: int, as_json: bool) -> None:
    """Print Tables 1 to 4 of MTAP 2013 for a recording: ANGLES (CSV) of each frame, and its WORDS (CSV)."""
    track, spoken = read_angles(angles), read_words(words, fps=fps)
    found = recording_statistics(track.angles, spoken, fps=fps, first=track.first)
    if as_json:
        echo_json({**found.to_dict(), "paper": _paper()})
        return
    click.echo("\n\n".join(_sections(found, spoken)))


@head.command()
@click.argument("points", type=FILE)
@click.option("--out", type=FILE, required=True, help="The angles (CSV).")
@click.option(
    "--method",
    type=click.Choice(("five", "many")),
    default="five",
    show_default=True,
    help="Eye corners and nose tip, or all landmarks (needs OpenCV: padlab[pose]).",
)
@click.option(
    "--focal", type=click.FloatRange(1.0, 1e5), help="Focal length in pixels; by default the picture's width."
)
@click.option("--reference", type=click.IntRange(min=0), help="Number of the neutral frame; by default the first.")
@size_option
def pose(
    *, points: Path, out: Path, method: str, focal: float | None, reference: int | None, size: tuple[int, int]
) -> None:
    """Find the head's rotation from facial landmarks in POINTS (CSV, pixels from the upper left corner)."""
    check_out(out, ".csv")
    names = head_pose.FIVE if method == "five" else tuple(head_pose.landmarks())
    track = read_points(points, names)
    _require_landmarks(points, track.names, method)
    number = track.first if reference is None else reference
    row = number - track.first
    if not 0 <= row < len(track.points):
        last = track.first + len(track.points) - 1
        raise SpecError(f"{points} has no frame {number} for --reference; its frames are {track.first} to {last}.")
    from_middle = track.points - 0.5 * np.array(size)
    pixels = float(size[0]) if focal is None else focal
    if method == "five":
        found = head_pose.five_points(from_middle, focal=pixels, reference=row)
    else:
        model = np.array([head_pose.landmarks()[name] for name in track.names])
        found = head_pose.many_points(from_middle, model, focal=pixels, reference=row)
    write_angles(out, found, first=track.first)
    click.echo(f"Written: {out}")


@head.command()
@click.option("--out", type=FILE, required=True, help="The words (CSV).")
def example(*, out: Path) -> None:
    """Write the sentence of MTAP 2013, Table 2, as a file of annotated words, 25 frames per second."""
    check_out(out, ".csv")
    write_words(out, example_sentence(), fps=FPS)
    click.echo(f"Written: {out}")


def _require_landmarks(points: Path, names: Sequence[str], method: str) -> None:
    if method == "five":
        lacking = [name for name in head_pose.FIVE if name not in names]
        if lacking:
            raise SpecError(
                f"{points}, line 1: there is no {', '.join(lacking)}; the method of five points needs "
                f"{', '.join(head_pose.FIVE)}, each with columns _x and _y."
            )
    elif len(names) < head_pose.MIN_POINTS:
        raise SpecError(
            f"{points}, line 1: there are {len(names)} landmarks; the method of many points needs "
            f"{head_pose.MIN_POINTS} of {', '.join(head_pose.landmarks())}, each with columns _x and _y."
        )


def _motion_dict(motion: HeadMotion) -> dict[str, Any]:
    return {
        "kind": motion.kind,
        "fps": motion.fps,
        "frames": len(motion.angles),
        "largest_speed": dict(zip(AXES, motion.largest_speed.tolist(), strict=True)),
        "units": motion.lineage(),
    }


def _paper() -> dict[str, Any]:
    """Return what the paper prints, in the form of `RecordingStatistics.to_dict`."""
    table = published_statistics()
    counts = published_counts()
    return {
        "words_by_pa": [
            {"P": P, "A": A, "words": n, "percent": share}
            for ((P, A), n), share in zip(counts.items(), percentages(tuple(counts.values())), strict=True)
        ],
        "rotation": {name: dict(zip(AXES, getattr(table, name).tolist(), strict=True)) for _, name in _ROTATION_ROWS},
        "peaks_by_syllable": dict(published_peaks()),
        "extreme_points": printed()["extreme_points"],
        "extreme_distance_frames": printed()["extreme_distance_frames"],
    }


def _sections(found: RecordingStatistics, words: Sequence[ProsodicWord]) -> list[str]:
    speech = (
        f"{found.words} prosodic words, {found.syllables} syllables, {found.frames} frames at {found.fps:g} per second"
    )
    return [
        speech,
        f"Table 1  (P, A) of prosodic words\n{_counts_table(found)}",
        f"Table 2  Example: the first {min(_SAMPLE_WORDS, len(words))} words\n{_words_table(words)}",
        f"Table 3  Head rotation in degrees\n{_rotation_table(found)}",
        f"Table 4  Syllables with the peak of pitch\n{_peaks_table(found)}",
        f"Figure 6  Mean Amp in degrees; (0, -0.5) is silence between words\n{_amp_table(found)}",
        _motion_text(found),
        _coefficients_text(found),
    ]


def _counts_table(found: RecordingStatistics) -> str:
    pairs = sorted({*found.counts, *published_counts()})
    rows = [["", *(_pa(*pair) for pair in pairs)]]
    for label, counts in (("here", found.counts), ("paper", published_counts())):
        numbers = [counts.get(pair, 0) for pair in pairs]
        rows.append([f"{label}, words", *map(str, numbers)])
        rows.append([f"{label}, %", *(f"{share:.1f}" for share in percentages(numbers))])
    return _aligned(rows)


def _words_table(words: Sequence[ProsodicWord]) -> str:
    return "\n".join(f"{_pa(word.P, word.A):<12}{word.text}" for word in words[:_SAMPLE_WORDS])


def _rotation_table(found: RecordingStatistics) -> str:
    rows = [["", *AXES, *(f"paper, {axis}" for axis in AXES)]]
    for label, name in _ROTATION_ROWS:
        both = (*getattr(found.rotation, name), *getattr(published_statistics(), name))
        rows.append([label, *(f"{value:.2f}" for value in both)])
    return _aligned(rows)


def _peaks_table(found: RecordingStatistics) -> str:
    rows = [["", *_PEAK_NAMES]]
    for label, counts in (("here", found.peaks), ("paper", published_peaks())):
        numbers = [counts[name] for name in SYLLABLE_TYPES]
        rows.append([f"{label}, peaks", *map(str, numbers)])
        rows.append([f"{label}, %", *(f"{share:.1f}" for share in percentages(numbers))])
    return _aligned(rows)


def _amp_table(found: RecordingStatistics) -> str:
    return _aligned(
        [["(P, A)", *AXES], *([_pa(*pair), *(f"{amp:.2f}" for amp in amps)] for pair, amps in found.mean_amp.items())]
    )


def _motion_text(found: RecordingStatistics) -> str:
    pairs = (("pitch and yaw", 0, 1), ("pitch and roll", 0, 2), ("yaw and roll", 1, 2))
    correlations = ", ".join(
        f"{name} {'none' if np.isnan(found.correlations[i, j]) else f'{found.correlations[i, j]:.2f}'}"
        for name, i, j in pairs
    )
    distance = "none" if found.extreme_distance is None else f"{found.extreme_distance:.1f} frames"
    return (
        f"Correlations: {correlations} (paper: all below 0.3)\n"
        f"Extreme points of pitch: {found.extreme_points}, mean distance {distance} "
        f"(paper: {printed()['extreme_points']}, {printed()['extreme_distance_frames']} frames)"
    )


def _coefficients_text(found: RecordingStatistics) -> str:
    if found.model is None:
        return f"Eq. 2 is not fitted. {found.model_fault}"
    rows = [["", *AXES]]
    rows += [[f"C{k}", *(f"{c:.3f}" for c in row)] for k, row in enumerate(found.model.coefficients, start=1)]
    rows.append(["R²", *(f"{share:.2f}" for share in found.model.explained)])
    return f"Eq. 2 fitted to {found.model.n} words and silences (the paper prints no coefficients)\n{_aligned(rows)}"


def _pa(P: float, A: float) -> str:
    return f"({P:g}, {A:g})"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as lines: the first column flush left, the others flush right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )
