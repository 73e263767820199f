"""The figures of the self-assessment manikin: padlab's own drawings, nine for each dimension.

``python -m webapp.figures_sam`` writes them to ``static/img/sam``. What they vary is that of Bradley & Lang (1994):
pleasure the face, arousal a burst in the chest and the eyes, dominance the size; the drawings are new.
"""

import math
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType

from webapp.resources import resource_dir

LEVELS = 9
WIDTH, HEIGHT = 48, 64

_INK = "#1d2733"
_SKIN = "#f4f6f9"
_BURST = "#f2a900"
_LINE = 2.0


def figure(dimension: str, level: int) -> str:
    """Return one figure as SVG.

    Parameters
    ----------
    dimension : {"pleasure", "arousal", "dominance"}
        What the figures vary.
    level : int
        1 (unhappy, calm, controlled) to 9 (happy, excited, in control).

    Returns
    -------
    str
        A complete SVG document, 48 units wide and 64 high.
    """
    if not 1 <= level <= LEVELS:
        raise ValueError(f"There is no figure {level}; there are 1 to {LEVELS}.")
    share = (level - 1) / (LEVELS - 1)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" fill="none" stroke="{_INK}" '
        f'stroke-width="{_LINE:g}" stroke-linecap="round" stroke-linejoin="round">{_DRAWINGS[dimension](share)}</svg>\n'
    )


def write(folder: Path) -> int:
    """Write all figures to a folder and return how many there are."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [(dimension, level) for dimension in _DRAWINGS for level in range(1, LEVELS + 1)]
    for dimension, level in names:
        (folder / f"{dimension}-{level}.svg").write_text(figure(dimension, level), encoding="utf-8")
    return len(names)


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _path(*parts: str | float, **style: str) -> str:
    course = " ".join(part if isinstance(part, str) else _number(part) for part in parts)
    return f'<path d="{course}"{_style(style)}/>'


def _circle(x: float, y: float, radius: float, **style: str) -> str:
    return f'<circle cx="{_number(x)}" cy="{_number(y)}" r="{_number(radius)}"{_style(style)}/>'


def _style(style: dict[str, str]) -> str:
    return "".join(f' {name.replace("_", "-")}="{value}"' for name, value in style.items())


def _pleasure(share: float) -> str:
    """Draw head and shoulders; mouth and brows go from a deep frown to a broad, open smile."""
    tone = 2 * share - 1
    x, y, radius = 24.0, 25.0, 21.0
    shoulders = _path("M", 3.0, 63.0, "C", 4.0, 52.0, 13.0, 50.0, 24.0, 50.0, "S", 44.0, 52.0, 45.0, 63.0, fill=_SKIN)
    head = _circle(x, y, radius, fill=_SKIN)
    # Brows that slope would say anger or sorrow, which differ in more than pleasure: they only rise and arch.
    parts = [shoulders, head]
    for side in (-1, 1):
        level, arch = y - 10 - 1.5 * tone, 1 + 3 * max(tone, 0)
        parts.append(_path("M", x + side * 4.5, level, "Q", x + side * 9.5, level - arch, x + side * 14.0, level + 0.5))
        parts.append(_eye(x + side * 8.5, y - 3.5, tone))
    parts.append(_mouth(x, y + 8.5, tone))
    return "".join(parts)


def _eye(x: float, y: float, tone: float) -> str:
    if tone > 0.6:
        # Eyes that laugh are two arches.
        return _path("M", x - 3.5, y + 1.5, "Q", x, y - 4.0, x + 3.5, y + 1.5)
    return _circle(x, y, 2.2, fill=_INK, stroke="none")


def _mouth(x: float, y: float, tone: float) -> str:
    half = 9.0 + 2.5 * abs(tone)
    corner, depth = y - 4.5 * tone, y + 9.0 * tone
    if tone <= 0.6:
        return _path("M", x - half, corner, "Q", x, depth, x + half, corner, stroke_width="2.4")
    upper = corner + 3.0 * (1 - tone)
    return _path(
        "M", x - half, corner, "Q", x, depth, x + half, corner, "Q", x, upper, x - half, corner, "Z", fill="#fff"
    )


def _manikin(x: float, feet: float, height: float, *, arms: float) -> str:
    """Draw a whole figure; `arms` goes from 0 (hanging, close to the body) to 1 (hands on the hips)."""
    unit = height / 20
    top = feet - height
    head = _circle(x, top + 2.9 * unit, 2.7 * unit, fill=_SKIN)
    shoulder, hip = top + 6.6 * unit, top + 13.0 * unit
    wide, narrow = (2.6 + 1.0 * arms) * unit, 2.1 * unit
    body = _path(
        *("M", x - wide, shoulder, "L", x + wide, shoulder, "L", x + narrow, hip),
        *("L", x + narrow, feet, "L", x, feet, "L", x, hip + 1.5 * unit, "L", x, feet),
        *("L", x - narrow, feet, "L", x - narrow, hip, "Z"),
        fill=_SKIN,
    )
    limbs = []
    for side in (-1, 1):
        elbow = (x + side * (wide + (0.5 + 2.6 * arms) * unit), shoulder + 3.4 * unit)
        hand = (x + side * (wide + 0.5 * unit - 1.4 * arms * unit), hip + (0.6 - 0.6 * arms) * unit)
        limbs.append(_path("M", x + side * wide, shoulder, "L", *elbow, "L", *hand))
    # A small figure has finer lines, or it would be a blot.
    return f'<g stroke-width="{_number(0.9 + 1.1 * height / HEIGHT)}">{"".join([*limbs, body, head])}</g>'


def _arousal(share: float) -> str:
    """Draw the upper body; a burst in the chest grows, the eyes open, and at last the figure trembles."""
    body = _path(
        "M",
        6.0,
        63.0,
        "L",
        7.5,
        34.0,
        "Q",
        8.0,
        27.5,
        14.0,
        27.5,
        "L",
        34.0,
        27.5,
        "Q",
        40.0,
        27.5,
        40.5,
        34.0,
        "L",
        42.0,
        63.0,
        "Z",
        fill=_SKIN,
    )
    head = _circle(24.0, 14.0, 11.5, fill=_SKIN)
    eyes = "".join(_lid(24.0 + side * 4.6, 13.0, share) for side in (-1, 1))
    mouth = (
        _circle(24.0, 20.5, 0.8 + 1.8 * share, fill=_INK, stroke="none")
        if share > 0.5
        else _path("M", 21.0, 20.5, "L", 27.0, 20.5)
    )
    return body + _burst(24.0, 46.0, share) + head + eyes + mouth + _trembling(share)


def _lid(x: float, y: float, share: float) -> str:
    if share < 0.1:
        return _path("M", x - 2.8, y, "Q", x, y + 2.4, x + 2.8, y)
    half = 0.7 + 2.3 * share
    white = (
        f'<ellipse cx="{_number(x)}" cy="{_number(y)}" rx="2.9" ry="{_number(half)}" fill="#fff" stroke-width="1.4"/>'
    )
    return white + _circle(x, y, min(half, 1.3), fill=_INK, stroke="none")


def _burst(x: float, y: float, share: float) -> str:
    outer = 1.6 + 14.4 * share
    if share < 0.1:
        return _circle(x, y, outer, fill=_BURST, stroke="none")
    spikes = 6 + round(6 * share)
    inner = outer * (0.72 - 0.22 * share)
    course: list[str | float] = []
    for step in range(2 * spikes):
        radius = outer if step % 2 == 0 else inner
        angle = math.pi * step / spikes - math.pi / 2
        course += ["L" if course else "M", x + radius * math.cos(angle), y + radius * math.sin(angle)]
    return _path(*course, "Z", fill=_BURST, stroke_width="1.3")


def _trembling(share: float) -> str:
    strokes = max(0, round(4 * (share - 0.5) / 0.5))
    drawn = []
    for side in (-1, 1):
        for step in range(strokes):
            y = 3.0 + 6.0 * step
            start = 24.0 + side * 15.5
            drawn.append(_path("M", start, y + 1.5, "L", start + side * (3.0 + 4.0 * share), y, stroke_width="1.6"))
    return "".join(drawn)


def _dominance(share: float) -> str:
    """Draw a figure that fills its frame, which the page draws, more and more, its arms more and more akimbo."""
    return _manikin(24.0, 62.0, 14.0 + 46.5 * share, arms=share)


_DRAWINGS: MappingProxyType[str, Callable[[float], str]] = MappingProxyType(
    {"pleasure": _pleasure, "arousal": _arousal, "dominance": _dominance}
)

if __name__ == "__main__":
    write(resource_dir("static") / "img" / "sam")
