"""Names beside points, placed so that they cover neither each other nor the points."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from evaluation.statistics.arrays import FloatArray

_Box = tuple[float, float, float, float]

# Right, left, above, below, then the corners and further out: (side, height) in units of the gap.
_PLACES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
_GAPS = (5.0, 10.0, 16.0, 24.0)


def place_labels(axes: Axes, xs: FloatArray, ys: FloatArray, names: Sequence[str], *, color: str, size: float) -> None:
    """Write a name beside each point.

    Each name takes the first of 32 places around its point that overlaps nothing, or else the one that overlaps least;
    names far from their point get a thin line to it. The size of a name is estimated from its letters.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where the points are, with final limits.
    xs, ys : numpy.ndarray, shape (n,)
        The points, in data units.
    names : sequence of str
        One for each point.
    color : str
        Colour of the names.
    size : float
        Font size in points.
    """
    to_points = 72 / axes.figure.dpi
    centres = axes.transData.transform(np.column_stack([xs, ys])) * to_points
    frame = np.array(axes.get_window_extent().extents) * to_points
    taken: list[_Box] = [(x - 3, y - 3, x + 3, y + 3) for x, y in centres]
    # Crowded points first, since they have the fewest free places.
    crowding = [np.sum(np.hypot(*(centres - centre).T) < 30) for centre in centres]
    for index in np.argsort(crowding, kind="stable")[::-1]:
        centre, name = centres[index], names[index]
        width, height = 0.6 * size * len(name), 1.15 * size
        choices = [(_box(centre, place, gap, width, height), place, gap) for gap in _GAPS for place in _PLACES]
        box, place, gap = min(choices, key=lambda choice: _cost(choice[0], taken, frame))
        taken.append(box)
        line = {"arrowstyle": "-", "color": color, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 3}
        axes.annotate(
            name,
            (xs[index], ys[index]),
            xytext=(gap * place[0], gap * place[1]),
            textcoords="offset points",
            ha={1: "left", 0: "center", -1: "right"}[place[0]],
            va={1: "bottom", 0: "center", -1: "top"}[place[1]],
            arrowprops=line if gap > _GAPS[1] else None,
            color=color,
            fontsize=size,
            zorder=5,
        ).set_in_layout(False)


def _box(centre: FloatArray, place: tuple[int, int], gap: float, width: float, height: float) -> _Box:
    x, y = float(centre[0]) + gap * place[0], float(centre[1]) + gap * place[1]
    left = x - width * (1 - place[0]) / 2
    bottom = y - height * (1 - place[1]) / 2
    return left, bottom, left + width, bottom + height


def _cost(box: _Box, taken: Sequence[_Box], frame: FloatArray) -> float:
    left, bottom, right, top = box
    overlap = sum(
        max(0.0, min(right, other[2]) - max(left, other[0])) * max(0.0, min(top, other[3]) - max(bottom, other[1]))
        for other in taken
    )
    beyond = (frame[0] - left, right - frame[2], frame[1] - bottom, top - frame[3])
    return overlap + 100 * sum(max(0.0, float(distance)) for distance in beyond)
