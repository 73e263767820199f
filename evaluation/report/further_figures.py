"""Figures of the full report beside those of the papers: ellipses in PAD space, and spread against mean."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.instruments.mos import MOS5
from evaluation.report.analysis import StudyReport
from evaluation.report.block import attempt
from evaluation.report.drawing import COLOURS, GRID, INK, SHAPES, SOFT, drawable, prepare
from evaluation.report.emotion_figures import pad_by_category
from evaluation.report.section import label
from evaluation.responses import DIMENSIONS
from evaluation.seeding import generator
from evaluation.statistics import wording
from evaluation.statistics.sos import Sos, sos_from_summary

MOST_CATEGORIES = 28
"""Stimuli above which their ellipses are not drawn; more could not be told apart."""

MOST_POINTS = 20_000
"""Ratings above which they are not drawn one by one."""

LOW, HIGH = (float(end(MOS5.items[0].values)) for end in (min, max))


def has_ellipses(report: StudyReport) -> bool:
    """Tell whether there are faces to draw in PAD space, and few enough."""
    rated = len(report.scores.dropna(subset=list(DIMENSIONS)))
    return 0 < rated <= MOST_POINTS and len(report.pad_by_stimulus) <= MOST_CATEGORIES


def pad_ellipsoids(report: StudyReport) -> Figure:
    """Draw the PAD ratings of each stimulus with the ellipse that holds half of a normal distribution."""
    rated = report.scores.dropna(subset=list(DIMENSIONS))
    if rated.empty:
        return _nothing("No face has been rated yet.")
    # In the order of the study file, so that a stimulus has the same colour whoever rated first.
    order = {stimulus.id: place for place, stimulus in enumerate(report.spec.stimuli)}
    rated = rated.sort_values("stimulus", key=lambda column: column.map(order), kind="stable")
    names = [drawable(label(report.spec.stimulus(one).label), one) for one in rated["stimulus"]]
    return pad_by_category(rated[list(DIMENSIONS)].to_numpy(dtype=float), names)


def has_spread(report: StudyReport) -> bool:
    """Tell whether there are opinion scores whose spread is known."""
    return bool((report.mos_by_cell["n"] > 1).any())


def spread_and_mean(report: StudyReport) -> Figure:
    """Draw the variance of the opinion scores of each clip against its mean, with the parabola of the SOS hypothesis.

    References
    ----------
    Hoßfeld, Schatz and Egger (2011), SOS: The MOS is not enough!, QoMEX.
    """
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axes: Axes = figure.subplots()
    prepare(axes)
    axes.grid(color=GRID)
    axes.set_axisbelow(True)
    cells = report.mos_by_cell[report.mos_by_cell["n"] > 1]
    for place, condition in enumerate(report.conditions):
        own = cells[cells["condition"] == condition]
        axes.plot(
            own["mean"].to_numpy(dtype=float),
            own["sd"].to_numpy(dtype=float) ** 2,
            linestyle="",
            marker=SHAPES[place % len(SHAPES)],
            markersize=5,
            alpha=0.6,
            markeredgewidth=0,
            color=COLOURS[place % len(COLOURS)],
            label=drawable(label(report.spec.condition(condition).label), condition),
        )
    found = attempt(
        lambda: sos_from_summary(
            cells["mean"].to_numpy(dtype=float),
            cells["sd"].to_numpy(dtype=float) ** 2,
            low=LOW,
            high=HIGH,
            rng=generator(report.study.seed, "report", "sos"),
            resamples=100,
        )
    )
    means = np.linspace(LOW, HIGH, 101)
    axes.plot(means, (means - LOW) * (HIGH - means), color=SOFT, linewidth=1, linestyle=(0, (4, 3)), label="largest")
    if isinstance(found, Sos):
        curve = found.expected_sd(means) ** 2
        axes.plot(means, curve, color=INK, linewidth=1.6, label=f"a = {wording.share(found.a)}")
    axes.set_xlim(LOW - 0.1, HIGH + 0.1)
    axes.set_ylim(0, None)
    axes.set_xlabel("Mean opinion score of a clip", color=INK)
    axes.set_ylabel("Variance of its ratings", color=INK)
    figure.legend(loc="outside lower center", ncols=min(5, len(report.conditions) + 2), frameon=False, fontsize=9)
    return figure


def _nothing(reason: str) -> Figure:
    figure = Figure(figsize=(6.4, 2.4), layout="constrained")
    axes = figure.subplots()
    axes.set_axis_off()
    axes.text(0.5, 0.5, reason, ha="center", va="center", color=SOFT, fontsize=11)
    return figure
