"""The figures of a report, as SVG and PNG."""

import textwrap
from collections.abc import Callable
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evaluation.errors import EvaluationError
from evaluation.instruments.mos import MOS5
from evaluation.report.analysis import ReverseEvaluation, StudyReport, Unavailable
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
from evaluation.report.further_figures import has_ellipses, has_spread, pad_ellipsoids, spread_and_mean
from evaluation.report.labels import place_labels
from evaluation.report.tables import label
from evaluation.responses import DIMENSIONS, pad_instruments
from evaluation.statistics import wording
from evaluation.statistics.opinion import OpinionScore

MOST_NAMED = 40
"""Number of stimuli above which figures do not name them."""


def draw(name: str, report: StudyReport) -> str:
    """Return a figure as the text of an SVG file, the same for the same report.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    report : StudyReport
        As `evaluation.report.analysis.analyse` returns it. Where there is nothing to draw yet, the figure says so.

    Returns
    -------
    str
        An ``<svg>`` element, without XML declaration; its ids begin with the figure's name, so that several figures
        can stand on one page.

    Raises
    ------
    EvaluationError
        If there is no figure of this name.
    """
    if name not in _FIGURES:
        raise EvaluationError(f"There is no figure {name!r}; there are {', '.join(_FIGURES)}.")
    return as_svg(lambda: _FIGURES[name](report), name=name)


def draw_png(name: str, report: StudyReport) -> bytes:
    """Return a figure as the bytes of a PNG file, the same for the same report; parameters and errors as `draw`."""
    if name not in _FIGURES:
        raise EvaluationError(f"There is no figure {name!r}; there are {', '.join(_FIGURES)}.")
    return as_png(lambda: _FIGURES[name](report))


def shown(report: StudyReport) -> tuple[str, ...]:
    """Return the names of the figures that a study has something for."""
    return tuple(name for name in _FIGURES if _SHOWN[name](report))


def caption(name: str) -> str:
    """Return the sentence that stands under a figure; EvaluationError if there is none of this name."""
    if name not in _CAPTIONS:
        raise EvaluationError(f"There is no figure {name!r}; there are {', '.join(_FIGURES)}.")
    return _CAPTIONS[name]


def reverse_evaluation(report: StudyReport) -> Figure:
    """Draw evaluated against input PAD: a panel for each dimension, a point for each stimulus.

    Points have their names if there are at most `MOST_NAMED`; more could not be read.

    Parameters
    ----------
    report : StudyReport
        The analysis.

    Returns
    -------
    matplotlib.figure.Figure
        Three panels with equal axes from -1 to 1 or less, the line of equality, the least-squares line and r.

    References
    ----------
    Jia et al. (2013), Table 8, drawn.
    """
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    panels = figure.subplots(1, 3)
    limit = _pad_limit(report)
    pooled = {found.dimension: found for found in report.reverse_evaluation if found.condition is None}
    for axes, dimension in zip(panels, DIMENSIONS, strict=True):
        prepare(axes)
        axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel(f"Input {dimension}", color=INK)
        axes.set_ylabel(f"Evaluated {dimension}", color=INK)
        _draw_dimension(axes, report, pooled[dimension], limit)
    handles, names = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, names, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9)
    # The names can be placed only when the layout has settled where each point is.
    figure.draw_without_rendering()
    means = report.pad_by_stimulus
    if len(means) > MOST_NAMED:
        return figure
    words = [drawable(label(report.spec.stimulus(word).label), word) for word in means["stimulus"]]
    for axes, dimension in zip(panels, DIMENSIONS, strict=True):
        xs, ys = means[f"input_{dimension}"].to_numpy(dtype=float), means[dimension].to_numpy(dtype=float)
        known = ~np.isnan(xs)
        shown = [word for word, is_known in zip(words, known, strict=True) if is_known]
        place_labels(axes, xs[known], ys[known], shown, color=INK, size=7)
    return figure


def mos_by_condition(report: StudyReport) -> Figure:
    """Draw the mean opinion score of each condition with its interval, and that of each stimulus behind it.

    Parameters
    ----------
    report : StudyReport
        The analysis.

    Returns
    -------
    matplotlib.figure.Figure
        One panel, the scale of 1 to 5 upwards with its labels.

    References
    ----------
    Jia et al. (2013), Table 10, drawn.
    """
    figure = Figure(figsize=(2.4 + 1.7 * max(2, len(report.mos_by_condition)), 4.6), layout="constrained")
    axes = figure.subplots()
    prepare(axes)
    axes.grid(axis="y", color=GRID)
    axes.set_axisbelow(True)
    for place, found in enumerate(report.mos_by_condition):
        colour, shape = COLOURS[place % len(COLOURS)], SHAPES[place % len(SHAPES)]
        cells = report.mos_by_cell[report.mos_by_cell["condition"] == found.condition]["mean"].to_numpy(dtype=float)
        # Stimuli side by side in the order of the file, so that a place on the page is always the same stimulus.
        beside = place - 0.3 + np.linspace(-0.12, 0.12, len(cells)) if len(cells) else np.array([])
        axes.plot(beside, cells, linestyle="", marker="o", markersize=4, color=colour, alpha=0.35, markeredgewidth=0)
        if isinstance(found.result, OpinionScore):
            _draw_opinion(axes, place, found.result, colour, shape)
        else:
            axes.text(place, 3.5, "no ratings\nyet", ha="center", va="center", color=SOFT, fontsize=9)
    names = [drawable(label(report.spec.condition(name).label), name) for name in report.conditions]
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.6, len(names) - 0.4)
    options = sorted(MOS5.items[0].options, key=lambda option: option.value) if MOS5.items[0].kind == "likert" else []
    axes.set_yticks([option.value for option in options], [f"{o.label['en']}  {o.value}" for o in options])
    axes.set_ylim(0.8, 5.2)
    axes.set_ylabel("Mean opinion score", color=INK)
    return figure


_FIGURES: MappingProxyType[str, Callable[[StudyReport], Figure]] = MappingProxyType(
    {
        "reverse_evaluation": reverse_evaluation,
        "mos_by_condition": mos_by_condition,
        "pad_ellipsoids": pad_ellipsoids,
        "precision": spread_and_mean,
    }
)
_SHOWN: MappingProxyType[str, Callable[[StudyReport], bool]] = MappingProxyType(
    {
        "reverse_evaluation": lambda report: bool(pad_instruments(report.spec)),
        "mos_by_condition": lambda report: "mos5" in report.spec.instrument_names,
        "pad_ellipsoids": has_ellipses,
        "precision": has_spread,
    }
)
_CAPTIONS = MappingProxyType(
    {
        "reverse_evaluation": (
            "Evaluated against input PAD. Black points: each stimulus over all conditions, with the least-squares line "
            "and Pearson's r; coloured points: each condition. On the dashed line people see what was put in."
        ),
        "mos_by_condition": (
            "Mean opinion score of each condition over all ratings, with its 95 % interval; the small points on its "
            "left are the stimuli."
        ),
        "pad_ellipsoids": (
            "Ratings of each stimulus in the space of pleasure, arousal and dominance, with the ellipse that holds "
            "half of a normal distribution of their mean and covariance in each plane."
        ),
        "precision": (
            "Variance of the ratings of each clip against their mean. Solid: the SOS hypothesis with the parameter a; "
            "dashed: the largest variance that the scale allows."
        ),
    }
)
NAMES = tuple(_FIGURES)
"""Names of the figures, each that of the section in `evaluation.report.tables.sections` it belongs to."""


def _draw_dimension(axes: Axes, report: StudyReport, found: ReverseEvaluation, limit: float) -> None:
    dimension = found.dimension
    axes.axhline(0, color=GRID, linewidth=1, zorder=0)
    axes.axvline(0, color=GRID, linewidth=1, zorder=0)
    axes.plot([-limit, limit], [-limit, limit], color=SOFT, linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    for place, condition in enumerate(map(report.spec.condition, report.conditions)):
        cells = report.pad_by_cell[report.pad_by_cell["condition"] == condition.name]
        if len(report.conditions) > 1 and len(cells):
            axes.plot(
                cells[f"input_{dimension}"].to_numpy(dtype=float),
                cells[dimension].to_numpy(dtype=float),
                linestyle="",
                marker=SHAPES[place % len(SHAPES)],
                markersize=4.5,
                color=COLOURS[place % len(COLOURS)],
                alpha=0.55,
                markeredgewidth=0,
                label=drawable(label(condition.label), condition.name),
                zorder=2,
            )
    means = report.pad_by_stimulus
    xs, ys = means[f"input_{dimension}"].to_numpy(dtype=float), means[dimension].to_numpy(dtype=float)
    if len(xs):
        axes.plot(xs, ys, linestyle="", marker="o", markersize=5, color=INK, label="All conditions", zorder=4)
    name = NAMES_OF_DIMENSIONS[dimension]
    if isinstance(found.result, Unavailable):
        axes.set_title(name, color=INK, fontsize=12)
        box = {"facecolor": "white", "edgecolor": "none"}
        reason = textwrap.fill(found.result.reason, 30)
        axes.text(0, limit * 0.5, reason, ha="center", va="center", color=SOFT, fontsize=9, bbox=box)
        return
    axes.set_title(f"{name}: r = {wording.share(found.result.r)}", color=INK, fontsize=12)
    ends = np.array([np.nanmin(xs), np.nanmax(xs)])
    axes.plot(ends, found.result.intercept + found.result.slope * ends, color=INK, linewidth=1.4, zorder=3)


def _draw_opinion(axes: Axes, place: int, found: OpinionScore, colour: str, shape: str) -> None:
    if found.ci is not None:
        low, high = found.ci
        axes.plot([place, place], [low, high], color=colour, linewidth=2.2, solid_capstyle="butt")
        for end in (low, high):
            axes.plot([place - 0.06, place + 0.06], [end, end], color=colour, linewidth=2.2)
    axes.plot([place], [found.mean], marker=shape, markersize=9, color=colour, markeredgecolor="white")
    axes.annotate(
        wording.number(found.mean),
        (place, found.mean),
        xytext=(12, 0),
        textcoords="offset points",
        va="center",
        color=INK,
        fontsize=11,
    )


def _pad_limit(report: StudyReport) -> float:
    columns = [f"{prefix}{dimension}" for prefix in ("input_", "") for dimension in DIMENSIONS]
    values = np.abs(report.pad_by_cell[columns].to_numpy(dtype=float))
    largest = float(np.nanmax(values)) if values.size and not np.isnan(values).all() else 1.0
    return min(1.05, float(np.ceil(largest * 10 + 0.5)) / 10)
