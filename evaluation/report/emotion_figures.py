"""Figures of PAD annotations by emotion category."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from evaluation.errors import DataError, InsufficientDataError
from evaluation.report.drawing import (
    COLOURS,
    GRID,
    INK,
    NAMES_OF_DIMENSIONS,
    SHAPES,
    SOFT,
    as_png,
    as_svg,
    drawable,
    prepare,
)
from evaluation.responses import DIMENSIONS
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.ellipse import ellipse
from evaluation.statistics.matrices import finite_array

# One more colour and two more shapes than the other figures need: the numbers have no common factor, so that it takes
# 56 categories for a colour and shape to come again together.
_COLOURS = (*COLOURS, "#444444")
_SHAPES = (*SHAPES, "X", "*")
_LONGEST_NAME = 40
# Fillings of more categories lie over each other.
_MOST_FILLED = 8
_PANELS = (("P", "A"), ("P", "D"), ("A", "D"))


def pad_by_category(pad: npt.ArrayLike, categories: Sequence[str], *, coverage: float = 0.5) -> Figure:
    """Draw PAD annotations by emotion category, with an ellipse around each category.

    Parameters
    ----------
    pad : array_like, shape (n, 3)
        Annotated pleasure, arousal and dominance, each in [-1, 1].
    categories : sequence of str, length n
        Emotion category of each; colours and shapes follow the order in which they first appear.
    coverage : float
        Probability of the ellipses, between 0 and 1.

    Returns
    -------
    matplotlib.figure.Figure
        Three panels with equal axes: arousal and dominance over pleasure, and dominance over arousal. A filled symbol
        with a dark edge marks each category's mean. A category whose points are too few for an ellipse, or all the
        same, is drawn without one.

    Raises
    ------
    DataError
        If `pad` is no table of three columns from -1 to 1, there are no annotations, there is not one category for
        each, or `coverage` is not between 0 and 1.

    References
    ----------
    Jia et al. (2013), Fig. 3.
    """
    table = finite_array(pad, axes=("annotations", "dimensions"), name="pad")
    if table.shape[1] != len(DIMENSIONS) or (np.abs(table) > 1).any():
        raise DataError("pad must have three columns, P, A and D, with values from -1 to 1.")
    names = [str(category) for category in categories]
    if not names or len(names) != len(table):
        raise DataError(f"There are {len(table)} annotations and {len(names)} categories; each needs its own.")
    if not 0 < coverage < 1:
        raise DataError(f"coverage is {coverage}, but must lie between 0 and 1.")
    members = {name: table[np.array([other == name for other in names])] for name in dict.fromkeys(names)}
    limit = min(1.05, float(np.ceil(np.abs(table).max() * 10 + 0.5)) / 10)
    labels = [_label(name, place, len(points)) for place, (name, points) in enumerate(members.items())]
    columns = _legend_columns(labels)
    figure = Figure(figsize=(11, 3.5 + 0.22 * math.ceil(len(members) / columns)), layout="compressed")
    panels = figure.subplots(1, len(_PANELS), gridspec_kw={"wspace": 0.06})
    for axes, (across, up) in zip(panels, _PANELS, strict=True):
        _prepare_panel(axes, across, up, limit)
        places = [DIMENSIONS.index(across), DIMENSIONS.index(up)]
        means = [
            _draw_category(axes, points[:, places], place, coverage, filled=len(members) <= _MOST_FILLED)
            for place, points in enumerate(members.values())
        ]
    figure.legend(
        means,
        labels,
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        fontsize=9,
        handletextpad=0.2,
        columnspacing=1.4,
    )
    return figure


def pad_by_category_svg(pad: npt.ArrayLike, categories: Sequence[str], *, coverage: float = 0.5) -> str:
    """Return `pad_by_category` as the text of an SVG file, the same for the same annotations."""
    return as_svg(lambda: pad_by_category(pad, categories, coverage=coverage), name="pad_by_category")


def pad_by_category_png(
    pad: npt.ArrayLike, categories: Sequence[str], *, coverage: float = 0.5, dpi: int = 200
) -> bytes:
    """Return `pad_by_category` as the bytes of a PNG file, the same for the same annotations."""
    return as_png(lambda: pad_by_category(pad, categories, coverage=coverage), dpi=dpi)


def caption(coverage: float = 0.5) -> str:
    """Return the sentence that stands under the figure."""
    return (
        f"PAD annotations by emotion category, with the {100 * coverage:g} % error ellipse of each category; "
        "the large symbols are the means, and the numbers in brackets count the annotations."
    )


def _prepare_panel(axes: Axes, across: str, up: str, limit: float) -> None:
    prepare(axes)
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    axes.xaxis.set_major_locator(MultipleLocator(0.5))
    axes.yaxis.set_major_locator(MultipleLocator(0.5))
    axes.grid(color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.axhline(0, color=SOFT, linewidth=0.7, zorder=1)
    axes.axvline(0, color=SOFT, linewidth=0.7, zorder=1)
    axes.set_xlabel(f"{NAMES_OF_DIMENSIONS[across]} ({across})", color=INK)
    axes.set_ylabel(f"{NAMES_OF_DIMENSIONS[up]} ({up})", color=INK)


def _draw_category(axes: Axes, points: FloatArray, place: int, coverage: float, *, filled: bool) -> Line2D:
    colour, shape = _COLOURS[place % len(_COLOURS)], _SHAPES[place % len(_SHAPES)]
    xs, ys = points.T
    axes.plot(xs, ys, linestyle="", marker=shape, markersize=4, color=colour, alpha=0.45, markeredgewidth=0, zorder=2)
    try:
        outline = ellipse(points, coverage=coverage).outline(180)
    except InsufficientDataError:
        outline = None
    if outline is not None:
        if filled:
            axes.fill(*outline.T, facecolor=colour, alpha=0.08, linewidth=0, zorder=3)
        axes.plot(*outline.T, color=colour, linewidth=1.6, zorder=4)
    (mean,) = axes.plot(
        [float(xs.mean())],
        [float(ys.mean())],
        linestyle="",
        marker=shape,
        markersize=8,
        color=colour,
        markeredgecolor=INK,
        markeredgewidth=0.8,
        zorder=5,
    )
    return mean


def _label(name: str, place: int, n: int) -> str:
    short = name if len(name) <= _LONGEST_NAME else f"{name[: _LONGEST_NAME - 1]}..."
    return f"{drawable(short, f'Category {place + 1}')} ({n})"


def _legend_columns(labels: Sequence[str]) -> int:
    lengths = [len(label) for label in labels]
    # The figure is 792 points wide; a letter takes about 5.5 and a symbol with its gaps 40.
    return max(1, min(len(lengths), int(792 / (5.5 * max(lengths) + 40))))
