"""What plots of this package have in common: colours, settings, fonts that have the text's characters, and files."""

import contextlib
import io
import logging
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.figure import Figure

from synth.errors import SpecError
from synth.files import write_whole

# Colours that people with any kind of colour vision tell apart (Okabe and Ito, 2008).
BLUE, RED, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
INK, SOFT, GRID = "#222222", "#6b6b6b", "#e3e3e3"

MISSING = "\u25a1"
"""What stands for a character that no installed font has."""

SUFFIXES = (".svg", ".png")
"""Kinds of files."""

_DPI = 200
_LARGEST_SIDE = 60_000  # pixels; Matplotlib draws no more than 65,535
_OWN_FONT = "DejaVu Sans"
# Fonts with thousands of Chinese characters, the first ones first; any other font that has them will do as well.
_PREFERRED = (
    *("Noto Sans CJK TC", "Noto Sans CJK SC", "Noto Sans CJK JP", "Source Han Sans", "WenQuanYi Zen Hei"),
    *("WenQuanYi Micro Hei", "PingFang TC", "PingFang SC", "Microsoft YaHei", "Microsoft JhengHei", "SimHei"),
)
# Text stays text in SVG, so that it can be searched and shown in the reader's fonts; fixed ids make the drawing of the
# same data the same file; a dollar sign in a word is a dollar sign.
_SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "padlab",
    "font.sans-serif": [_OWN_FONT, "Verdana", "sans-serif"],
    "axes.unicode_minus": True,
    "text.parse_math": False,
}
_drawing = Lock()


def write_figure(path: Path, make: Callable[[], Figure], *, texts: Iterable[str] = ()) -> None:
    """Write a figure as SVG or PNG by the file's suffix; the same figure gives the same bytes.

    Parameters
    ----------
    path : Path
        The file.
    make : callable
        Makes the figure; it is called with the settings of the house.
    texts : iterable of str
        Texts in it that need characters beyond those of Matplotlib's own font; see also `drawable`.

    Raises
    ------
    SpecError
        If the suffix is another.
    VideoError
        If the file cannot be written.
    """
    check_suffix(path)
    fonts = _fonts_for(_characters(texts))[0]
    out = io.BytesIO()
    # Matplotlib reads these settings from the whole process while it draws, so drawings take turns.
    with _drawing, _quiet(), mpl.rc_context({**_SETTINGS, "font.family": [_OWN_FONT, *fonts, "sans-serif"]}):
        figure = make()
        if path.suffix.lower() == ".svg":
            figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
        else:
            dpi = min(_DPI, _LARGEST_SIDE / max(figure.get_size_inches()))
            figure.savefig(out, format="png", dpi=dpi, metadata={"Software": None})
    write_whole(path, out.getvalue())


def check_suffix(path: Path) -> None:
    """Raise `SpecError` if a figure cannot be written under this name."""
    if path.suffix.lower() not in SUFFIXES:
        raise SpecError(f"Plot: the file is {path.name!r}, but its name must end in {' or '.join(SUFFIXES)}.")


def drawable(texts: Iterable[str]) -> tuple[str, ...]:
    """Return texts on one line each, with `MISSING` for what no installed font or no SVG file can have."""
    lines = [" ".join(text.split()) for text in texts]
    characters = _characters(lines)
    impossible = {character for character in characters if unicodedata.category(character) in {"Cc", "Cs", "Cn"}}
    missing = impossible | _fonts_for(characters - impossible)[1]
    table = {ord(character): MISSING for character in missing}
    return tuple(line.translate(table) for line in lines)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Matplotlib from warning that a font has another weight than the one asked for: most Chinese fonts do."""
    logger = logging.getLogger(font_manager.__name__)
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


def _characters(texts: Iterable[str]) -> frozenset[str]:
    return frozenset(character for text in texts for character in text)


@lru_cache(maxsize=64)
def _fonts_for(characters: frozenset[str]) -> tuple[tuple[str, ...], frozenset[str]]:
    """Return the names of further fonts that together have the most of the characters, and those that none has."""
    own = font_manager.findfont(_OWN_FONT)
    missing = frozenset(character for character in characters if ord(character) not in _glyphs(own))
    chosen: list[str] = []
    while missing:
        best = max(_candidates(), key=lambda font: len(_had(font[1], missing)), default=None)
        found = frozenset() if best is None else _had(best[1], missing)
        if best is None or not found:
            break
        chosen.append(best[0])
        missing -= found
    return tuple(chosen), missing


@lru_cache(maxsize=1)
def _candidates() -> tuple[tuple[str, str], ...]:
    """Return name and file of every usable font, preferred ones first."""
    names = {entry.name for entry in font_manager.fontManager.ttflist if not entry.name.startswith("Last Resort")}
    ordered = sorted(names, key=lambda name: (_PREFERRED.index(name) if name in _PREFERRED else len(_PREFERRED), name))
    # Matplotlib is told names only, so the file must be the one that it takes by that name.
    with _quiet():
        return tuple((name, font_manager.findfont(name)) for name in ordered)


@lru_cache(maxsize=512)
def _glyphs(file: str) -> frozenset[int]:
    """Return the characters that a font has; none if it cannot be drawn at any size."""
    try:
        font = font_manager.get_font(file)
    except (OSError, RuntimeError):
        return frozenset()
    return frozenset(font.get_charmap()) if font.scalable else frozenset()


def _had(file: str, characters: frozenset[str]) -> frozenset[str]:
    glyphs = _glyphs(file)
    return frozenset(character for character in characters if ord(character) in glyphs)
