"""A plot of a clip as MTAP 2013 draws it in Figs. 5 and 7: the head's angles over its words, and what moves it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from synth.drawing import BLUE, GREEN, GRID, INK, ORANGE, RED, SOFT, check_suffix, drawable, write_figure
from synth.errors import SpecError
from synth.head.trajectory import HeadMotion
from synth.head.words import ProsodicWord, Syllable, check_words

Floats = NDArray[np.float64]

MAX_FRAMES = 100_000
"""Longest sequence that is drawn: more than an hour at 25 frames per second."""

# Inches on the page.
_LEFT, _RIGHT, _TOP, _BOTTOM, _LEGEND = 0.75, 0.2, 0.1, 0.1, 0.3
_ROW_WIDTH, _MARKS, _PITCH, _OTHER, _MOUTH, _GAP, _TIMES, _ROW_GAP = 10.0, 0.26, 1.5, 0.7, 0.45, 0.1, 0.27, 0.25
_LABEL_LINE, _LABEL_GAP, _BETWEEN_LABELS, _LABEL_PLACE = 0.18, 0.08, 0.06, 0.42
_LEGEND_WIDTH = 7.4
_TICKS_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 300.0, 1800.0, 7200.0)
_SCALES = (1.3, 1.6, 2.0, 2.6, 3.4)
_MAX_ROWS = 24
_WORD_SIZE, _VALUE_SIZE, _SMALL = 9.0, 7.5, 7.0

_AXES = (("Pitch", "down", BLUE), ("Yaw", "left", GREEN), ("Roll", "right", ORANGE))


@dataclass(frozen=True, slots=True)
class _Label:
    """A word under the curves: its text, (P, A), middle in seconds, and width in inches."""

    text: str
    values: str
    middle_s: float
    width: float


@dataclass(frozen=True, slots=True)
class _Row:
    """A stretch of time that is one row of the page, and its labels with their places (inches) and levels."""

    start_s: float
    end_s: float
    labels: tuple[tuple[_Label, float, int], ...]

    @property
    def levels(self) -> int:
        return 1 + max((level for _, _, level in self.labels), default=0)


@dataclass(frozen=True, slots=True, eq=False)
class _Clip:
    """What is drawn."""

    angles: Floats
    fps: float
    words: tuple[ProsodicWord, ...]
    head: HeadMotion | None
    mouth: Floats | None

    @property
    def times(self) -> Floats:
        return np.arange(len(self.angles)) / self.fps

    @property
    def end_s(self) -> float:
        return max(len(self.angles) / self.fps, max((word.end_s for word in self.words), default=0.0))


def plot_clip(
    head_angles: npt.ArrayLike,
    fps: float,
    words: Sequence[ProsodicWord],
    head: HeadMotion | None,
    out: Path,
    *,
    mouth: npt.ArrayLike | None = None,
) -> None:
    """Write a plot of a clip (MTAP 2013, Figs. 5 and 7).

    Pitch, yaw and roll over time, with dashed lines where words begin and end, each word with its (P, A) below, the
    peaks of pitch as dots (hollow in silence), and short bars on top for stressed syllables (S) and those with falling
    tone (F). Long clips take several rows.

    Parameters
    ----------
    head_angles : array_like, shape (T, 3)
        Pitch, yaw and roll in degrees.
    fps : float
        Frames per second.
    words : sequence of ProsodicWord
        In order.
    head : HeadMotion, optional
        The motion, which knows where the peaks were placed; without it none are marked.
    out : Path
        The file; its suffix, .svg or .png, tells the kind. The same clip gives the same bytes.
    mouth : array_like, shape (T,), optional
        Opening of the jaw (FAP 3, in MNS/1024), for a further panel.

    Raises
    ------
    SpecError
        If an argument is malformed.
    VideoError
        If the file cannot be written.
    """
    check_suffix(out)
    if not isinstance(fps, (int, float)) or not 1.0 <= fps <= 1000.0:
        raise SpecError(f"Plot: fps is {fps!r}, but must be a number from 1 to 1000.")
    angles = _numbers("the head's angles", head_angles, columns=3)
    opening = None if mouth is None else _numbers("the mouth's opening", mouth, columns=None)
    if opening is not None and len(opening) != len(angles):
        raise SpecError(f"Plot: the mouth has {len(opening)} frames, but the head {len(angles)}; both need the same.")
    clip = _Clip(angles, float(fps), check_words(words), head, opening)
    texts = drawable(word.text for word in clip.words)
    write_figure(out, lambda: _figure(clip, texts), texts=texts)


def _numbers(what: str, values: npt.ArrayLike, *, columns: int | None) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    wanted = "(frames,)" if columns is None else f"(frames, {columns})"
    if array.ndim != (1 if columns is None else 2) or (columns is not None and array.shape[1] != columns):
        raise SpecError(f"Plot: {what} have shape {array.shape}, but must be {wanted}.")
    if not 1 <= len(array) <= MAX_FRAMES:
        raise SpecError(f"Plot: {what} have {len(array)} frames, but there must be 1 to {MAX_FRAMES}.")
    if not np.isfinite(array).all():
        raise SpecError(f"Plot: {what} are not all finite numbers.")
    return array


def _figure(clip: _Clip, texts: tuple[str, ...]) -> Figure:
    rows, scale = _laid_out(clip, _labels(clip, texts))
    heights = [_row_height(row, clip) for row in rows]
    width = _LEFT + _RIGHT + max(row.end_s - row.start_s for row in rows) * scale
    height = _TOP + _LEGEND + sum(heights) + _ROW_GAP * (len(rows) - 1) + _BOTTOM
    figure = Figure(figsize=(width, height))
    top = height - _TOP - _LEGEND
    limits = [_limits(clip.angles[:, k]) for k in range(3)]
    for row, row_height in zip(rows, heights, strict=True):
        _draw_row(figure, clip, row, limits, scale=scale, top=top)
        top -= row_height + _ROW_GAP
    _draw_legend(figure, clip, height)
    return figure


# The layout: how many inches a second takes, where rows end, and where labels go.


def _labels(clip: _Clip, texts: tuple[str, ...]) -> tuple[_Label, ...]:
    figure = Figure(dpi=100)
    # A canvas of this kind measures text as it will be drawn.
    FigureCanvasAgg(figure)

    def inches(text: str, size: float) -> float:
        return figure.text(0, 0, text, size=size).get_window_extent().width / figure.dpi

    found = []
    for word, text in zip(clip.words, texts, strict=True):
        values = f"({word.P:.3g}, {word.A:.3g})".replace("-", "−")
        width = max(inches(text, _WORD_SIZE), inches(values, _VALUE_SIZE))
        found.append(_Label(text, values, (word.start_s + word.end_s) / 2, width))
    return tuple(found)


def _laid_out(clip: _Clip, labels: tuple[_Label, ...]) -> tuple[tuple[_Row, ...], float]:
    """Return rows with the smallest scale (inches to the second) at which at most two labels stand on each other."""
    longest_s = clip.end_s / _MAX_ROWS
    for step in _SCALES:
        # A short clip is drawn wide enough for the legend, and a very long one narrow enough for the page.
        scale = min(max(step, _LEGEND_WIDTH / clip.end_s), _ROW_WIDTH / longest_s)
        edges = _edges(clip, longest_s=_ROW_WIDTH / scale)
        rows = tuple(_row(labels, start, end, scale) for start, end in pairwise(edges))
        if all(row.levels <= 2 for row in rows):
            break
    return rows, scale


def _edges(clip: _Clip, *, longest_s: float) -> list[float]:
    """Return the times at which rows begin and end, at the beginnings of words where possible."""
    count = math.ceil(clip.end_s / longest_s - 1e-9)
    edges = [0.0]
    for k in range(1, count):
        ideal = clip.end_s * k / count
        starts = [word.start_s for word in clip.words if abs(word.start_s - ideal) < 0.3 * clip.end_s / count]
        edges.append(min(starts, key=lambda start: abs(start - ideal), default=ideal))
    return [*edges, clip.end_s]


def _row(labels: tuple[_Label, ...], start_s: float, end_s: float, scale: float) -> _Row:
    placed: list[tuple[_Label, float, int]] = []
    reached: list[float] = []
    right = (end_s - start_s) * scale
    for label in labels:
        if not start_s <= label.middle_s < end_s:
            continue
        centre = min((label.middle_s - start_s) * scale, right - label.width / 2)
        centre = max(centre, label.width / 2 - _LEFT / 2)
        left = centre - label.width / 2
        level = next((k for k, used in enumerate(reached) if left >= used + _BETWEEN_LABELS), len(reached))
        if level == len(reached):
            reached.append(0.0)
        reached[level] = centre + label.width / 2
        placed.append((label, centre, level))
    return _Row(start_s, end_s, tuple(placed))


def _row_height(row: _Row, clip: _Clip) -> float:
    mouth = 0.0 if clip.mouth is None else _MOUTH + _GAP
    labels = row.levels * (2 * _LABEL_LINE + _LABEL_GAP)
    return _MARKS + _PITCH + _GAP + _OTHER + _GAP + _OTHER + mouth + _TIMES + labels


def _limits(values: Floats) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    # A head that is still is a line in the middle, and small motions are not blown up.
    middle, half = (low + high) / 2, max((high - low) / 2, 1.0) * 1.12
    return middle - half, middle + half


# The drawing.


def _draw_row(
    figure: Figure, clip: _Clip, row: _Row, limits: list[tuple[float, float]], *, scale: float, top: float
) -> None:
    marks = _panel(figure, row, scale, top, _MARKS)
    top -= _MARKS
    _draw_marks(marks, clip, row)
    panels = []
    heights = [_PITCH, _OTHER, _OTHER, *([] if clip.mouth is None else [_MOUTH])]
    for height in heights:
        panels.append(_panel(figure, row, scale, top, height))
        top -= height + _GAP
    for k, axes in enumerate(panels):
        _draw_frame(axes, clip, row, last=k == len(panels) - 1)
        axes.xaxis.set_major_locator(MultipleLocator(next(step for step in _TICKS_S if step * scale >= 0.6)))
        axes.yaxis.set_label_coords(-_LABEL_PLACE / ((row.end_s - row.start_s) * scale), 0.5)
    for k, (name, positive, colour) in enumerate(_AXES):
        _draw_angle(panels[k], clip, row, k, colour)
        panels[k].set_ylim(limits[k])
        panels[k].set_ylabel(f"{name} (°)\n+ {positive}", fontsize=8, color=INK, linespacing=1.15)
    panels[0].locator_params(axis="y", nbins=6)
    for axes in panels[1:3]:
        axes.locator_params(axis="y", nbins=3)
    _draw_peaks(panels[0], clip, row)
    if clip.mouth is not None:
        _draw_mouth(panels[3], clip, clip.mouth)
    _draw_labels(figure, row, top=top + _GAP - _TIMES)


def _panel(figure: Figure, row: _Row, scale: float, top: float, height: float) -> Axes:
    width, whole = figure.get_size_inches()
    span = (row.end_s - row.start_s) * scale
    axes = figure.add_axes((_LEFT / width, (top - height) / whole, span / width, height / whole))
    axes.set_xlim(row.start_s, row.end_s)
    return axes


def _draw_frame(axes: Axes, clip: _Clip, row: _Row, *, last: bool) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT)
    axes.tick_params(colors=INK, labelsize=_SMALL, length=2.5, labelbottom=last)
    if last:
        axes.xaxis.set_major_formatter(lambda value, _position: f"{value:g} s")
    for time in sorted({time for word in clip.words for time in (word.start_s, word.end_s)}):
        if row.start_s <= time <= row.end_s:
            axes.axvline(time, color=SOFT, linewidth=0.6, linestyle=(0, (4, 3)), zorder=1)


def _draw_angle(axes: Axes, clip: _Clip, row: _Row, k: int, colour: str) -> None:
    axes.axhline(0.0, color=GRID, linewidth=0.8, zorder=0)
    shown = _shown(clip, row)
    axes.plot(clip.times[shown], clip.angles[shown, k], color=colour, linewidth=1.5, solid_joinstyle="round", zorder=3)


def _shown(clip: _Clip, row: _Row) -> NDArray[np.bool_]:
    """Return which frames a row shows: one more on each side, so that curves go to its edges."""
    return np.asarray((clip.times >= row.start_s - 1.5 / clip.fps) & (clip.times <= row.end_s + 1.5 / clip.fps))


def _draw_peaks(axes: Axes, clip: _Clip, row: _Row) -> None:
    for unit in () if clip.head is None else clip.head.units:
        frame = unit.peak[0]
        if frame < len(clip.angles) and row.start_s <= frame / clip.fps < row.end_s:
            face = RED if unit.text else "white"
            spot = (frame / clip.fps, clip.angles[frame, 0])
            axes.plot(*spot, "o", markersize=5, color=RED, markerfacecolor=face, zorder=4, clip_on=False)


def _marked(words: Sequence[ProsodicWord]) -> Iterator[tuple[Syllable, str]]:
    for word in words:
        for syllable in word.syllables:
            letters = "S" * syllable.stressed + "F" * syllable.falling
            if letters:
                yield syllable, letters


def _draw_marks(axes: Axes, clip: _Clip, row: _Row) -> None:
    axes.set_axis_off()
    axes.set_ylim(0.0, 1.0)
    for time in sorted({time for word in clip.words for time in (word.start_s, word.end_s)}):
        if row.start_s <= time <= row.end_s:
            axes.plot([time, time], [0.08, 0.38], color=INK, linewidth=1.1, clip_on=False)
    for syllable, letters in _marked(clip.words):
        middle = (syllable.start_s + syllable.end_s) / 2
        if not row.start_s <= middle < row.end_s:
            continue
        colour = RED if "S" in letters else SOFT
        inset = 0.12 * (syllable.end_s - syllable.start_s)
        ends = [syllable.start_s + inset, syllable.end_s - inset]
        axes.plot(ends, [0.23, 0.23], color=colour, linewidth=2.6, solid_capstyle="butt", clip_on=False)
        axes.text(middle, 0.42, letters, ha="center", va="bottom", size=_SMALL, color=colour, weight="bold")


def _draw_mouth(axes: Axes, clip: _Clip, mouth: Floats) -> None:
    axes.fill_between(clip.times, mouth, 0.0, color=INK, alpha=0.55, linewidth=0)
    axes.set_ylim(min(0.0, float(mouth.min())), max(1.0, float(mouth.max()) * 1.05))
    axes.locator_params(axis="y", nbins=2)
    axes.set_ylabel("Jaw\n(FAP 3)", fontsize=8, color=INK, linespacing=1.15)


def _draw_labels(figure: Figure, row: _Row, *, top: float) -> None:
    width, height = figure.get_size_inches()
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    for label, centre, level in row.labels:
        x = (_LEFT + centre) / width
        y = top - level * (2 * _LABEL_LINE + _LABEL_GAP)
        if level:
            # What stands lower is led to by a thin line, which passes behind the labels above.
            ends = [(top + 0.02) / height, (y + 0.02) / height]
            figure.add_artist(Line2D([x, x], ends, color=GRID, linewidth=0.8, zorder=0))
        figure.text(x, y / height, label.text, size=_WORD_SIZE, color=INK, ha="center", va="top", bbox=box)
        lower = (y - _LABEL_LINE) / height
        figure.text(x, lower, label.values, size=_VALUE_SIZE, color=SOFT, ha="center", va="top", bbox=box)


def _draw_legend(figure: Figure, clip: _Clip, height: float) -> None:
    handles, names = [], []
    if clip.head is not None and clip.head.units:
        handles.append(_dot(RED))
        names.append("peak placed in a word")
        handles.append(_dot("white"))
        names.append("in silence")
    letters = "".join(found for _, found in _marked(clip.words))
    for letter, colour, name in (("S", RED, "S: stressed syllable"), ("F", SOFT, "F: falling tone")):
        if letter in letters:
            handles.append(Line2D([], [], color=colour, linewidth=2.6))
            names.append(name)
    if clip.words:
        handles.append(Line2D([], [], color=SOFT, linewidth=0.8, linestyle=(0, (4, 3))))
        names.append("word boundary; (P, A) below")
    width = figure.get_figwidth()
    where = (_LEFT / width, 1.0 - (_TOP + _LEGEND) / height, 1.0 - (_LEFT + _RIGHT) / width, _LEGEND / height)
    if handles:
        figure.legend(
            handles,
            names,
            loc="center left",
            bbox_to_anchor=where,
            ncols=len(handles),
            frameon=False,
            fontsize=8,
            handlelength=1.6,
            columnspacing=1.4,
            borderpad=0.0,
            borderaxespad=0.0,
        )


def _dot(face: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker="o", markersize=5, color=RED, markerfacecolor=face)
