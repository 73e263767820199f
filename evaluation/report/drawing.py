"""What all figures have in common: colours, shapes, settings, and the way to a file."""

import io
import re
from collections.abc import Callable
from threading import Lock
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Colours that people with any kind of colour vision tell apart (Okabe and Ito, 2008); shapes tell the same again.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
"""Colours of groups, in their order."""
SHAPES = ("o", "s", "^", "D", "v", "P")
"""Markers of groups, in their order."""
INK, SOFT, GRID = "#222222", "#6b6b6b", "#e3e3e3"

# Text stays text, so that it can be read aloud, searched and shown in the reader's fonts; fixed ids make the drawing
# of the same data the same file; a dollar sign in a label is a dollar sign.
_SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "padlab",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Noto Sans", "sans-serif"],
    "axes.unicode_minus": True,
    "text.parse_math": False,
}
_drawing = Lock()

NAMES_OF_DIMENSIONS = {"P": "Pleasure", "A": "Arousal", "D": "Dominance"}


def as_svg(make: Callable[[], Figure], *, name: str) -> str:
    """Return a figure as the text of an SVG file, the same for the same figure.

    Parameters
    ----------
    make : callable
        Makes the figure; it is called with the settings of the house.
    name : str
        The figure's name, with which its ids begin, so that several figures can stand on one page.

    Returns
    -------
    str
        An ``<svg>`` element, without XML declaration.
    """
    out = io.StringIO()
    # matplotlib reads these settings from the whole process while it draws, so drawings take turns.
    with _drawing, mpl.rc_context(_SETTINGS):
        make().savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    svg = out.getvalue()
    return _with_own_ids(svg[svg.index("<svg") :], name)


def as_png(make: Callable[[], Figure], *, dpi: int = 200) -> bytes:
    """Return a figure as the bytes of a PNG file, the same for the same figure.

    Parameters
    ----------
    make : callable
        Makes the figure; it is called with the settings of the house.
    dpi : int
        Pixels to the inch.

    Returns
    -------
    bytes
        The file.
    """
    out = io.BytesIO()
    with _drawing, mpl.rc_context(_SETTINGS):
        make().savefig(out, format="png", dpi=dpi, metadata={"Software": None})
    return out.getvalue()


def prepare(axes: Axes) -> None:
    """Give a panel the house's frame and ticks."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT)
    axes.tick_params(colors=INK, labelsize=9, length=3)


def drawable(text: str, otherwise: str) -> str:
    """Return the text, or `otherwise` if it has signs that matplotlib's own font, which measures it, does not have."""
    return text if all(ord(character) < 0x0500 for character in text) else otherwise


def _with_own_ids(svg: str, name: str) -> str:
    prefix = name.replace("_", "-")
    svg = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', svg)
    svg = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', svg)
    return re.sub(r"url\(#([^)]+)\)", rf"url(#{prefix}-\1)", svg)
