"""The painting: skin, brows, hair and clothes as one picture that is wrapped round the head.

Places on it depend on the template only, so that one painting fits each identity. Left and right are mirror images:
the picture covers half the head, from the middle of the face (left border) to the middle of the nape (right border).
"""

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.face.palette import Palette

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 1024, 1024
_HEAD_AXIS, _NECK_AXIS = 0.4, 0.15
"""Depth in dm of the vertical axis that the painting is wrapped round, in the head and in the neck."""
_LOWEST, _HIGHEST = 4.4, 8.6
_ALL_HAIR = (8.2, 8.55)
"""Heights in dm between which the painting shows hair at each angle."""
_SLOPE, _NECK_RADIUS = 1.3, 0.5
"""The shoulders spread away from the axis: their distance beyond the neck counts as depth below it."""


def wrap(template: Floats) -> tuple[Floats, Floats]:
    """Return the angle from the middle of the face (radians, 0 to pi) and the height (dm) of places on the template."""
    x, y = np.abs(template[:, 0]), template[:, 1]
    below_jaw = _step(6.3 - y, 0.0, 0.6)
    z = template[:, 2] - (_HEAD_AXIS + (_NECK_AXIS - _HEAD_AXIS) * below_jaw)
    beyond = np.maximum(0.0, np.hypot(x, z) - _NECK_RADIUS)
    return np.arctan2(x, z), y - _SLOPE * beyond * below_jaw


def place(template: Floats) -> Floats:
    """Return texture coordinates (N, 2) of places on the template (N, 3)."""
    angle, height = wrap(template)
    return np.column_stack([angle / np.pi, (height - _LOWEST) / (_HIGHEST - _LOWEST)])


def place_strand(across: Floats, along: Floats) -> Floats:
    """Return texture coordinates (N, 2) within the painted hair: across the strands 0 to 1, along them 0 to 1."""
    lowest, highest = ((height - _LOWEST) / (_HIGHEST - _LOWEST) for height in _ALL_HAIR)
    return np.column_stack([across, highest + (lowest - highest) * along])


def above_hairline(angle: ArrayLike, height: ArrayLike) -> Floats:
    """Return how far a place lies inside the hair, in dm; negative on bare skin."""
    line_angle = [0.0, 0.25, 0.45, 0.62, 0.76, 0.88, 1.02, 1.16, 1.30, 1.50, 1.75, 2.1, np.pi]
    line_height = [8.06, 8.05, 7.99, 7.87, 7.70, 7.50, 7.27, 7.10, 6.98, 6.78, 6.60, 6.45, 6.32]
    line = _smooth_line(np.asarray(angle, dtype=np.float64), line_angle, line_height)
    return np.asarray(height, dtype=np.float64) - line


def below_neckline(angle: ArrayLike, height: ArrayLike) -> Floats:
    """Return how far a place lies under the shirt, in dm; negative on bare skin."""
    line = _smooth_line(
        np.asarray(angle, dtype=np.float64), [0.0, 0.8, 1.6, 2.4, np.pi], [4.81, 4.91, 5.07, 5.25, 5.30]
    )
    return line - np.asarray(height, dtype=np.float64)


@functools.cache
def paint(palette: Palette) -> NDArray[np.uint8]:
    """Return the picture (HEIGHT, WIDTH, 3), top row first; painted once for each palette, not to be written to."""
    columns = (np.arange(WIDTH) + 0.5) / WIDTH * np.pi
    rows = _HIGHEST - (np.arange(HEIGHT) + 0.5) / HEIGHT * (_HIGHEST - _LOWEST)
    angle, height = np.meshgrid(columns, rows)
    noise = _Noise(np.random.default_rng(20130607))

    picture = _skin(palette, angle, height, noise)
    picture = _mix(picture, np.multiply(palette.hair, 1.6), 0.85 * _brow(angle, height, noise))
    strands = noise.stretched(rough=(300, 5))
    hair = np.multiply(palette.hair, (1.0 + 0.30 * strands)[..., None])
    inside = above_hairline(angle, height) + 0.014 * noise.stretched(rough=(420, 10))
    picture = _mix(picture, hair, _step(inside, -0.06, 0.07))
    # The lowest row stands for all below it, where a pattern would be drawn out to streaks.
    weave = 0.03 * noise.stretched(rough=(500, 500)) * _step(height, _LOWEST + 0.05, _LOWEST + 0.3)
    shirt = np.multiply(palette.shirt, (1.0 + weave)[..., None])
    under = below_neckline(angle, height)
    band = 1.0 - 0.10 * _step(0.10 - under, -0.006, 0.006) - 0.12 * np.exp(-(((under - 0.10) / 0.010) ** 2))
    picture = _mix(picture, shirt * band[..., None], _step(under, -0.005, 0.005))
    result = np.rint(255 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)
    result.setflags(write=False)
    return result


def _skin(palette: Palette, angle: Floats, height: Floats, noise: "_Noise") -> Floats:
    """Skin with flushed cheeks, nose and chin, a shadow in the lid's fold, and a little unevenness."""
    flush = 0.38 * _spot(angle, height, (0.52, 6.98), (0.22, 0.20))
    flush += 0.22 * _spot(angle, height, (0.0, 6.90), (0.12, 0.12))
    flush += 0.10 * _spot(angle, height, (0.0, 6.35), (0.20, 0.12))
    lid = 0.30 * _spot(angle, height, (0.33, 7.375), (0.17, 0.045))
    tone = 1.0 + 0.012 * noise.stretched(rough=(60, 60)) + 0.010 * noise.stretched(rough=(400, 400))
    skin = _mix(np.broadcast_to(palette.skin, (*angle.shape, 3)), palette.flush, flush)
    return _mix(skin, np.multiply(palette.skin, (0.72, 0.62, 0.60)), lid) * tone[..., None]


def _brow(angle: Floats, height: Floats, noise: "_Noise") -> Floats:
    """Return how much brow hair covers each place: a gentle arch that thins towards its tail."""
    along = (angle - 0.135) / 0.45
    centre = 7.510 + 0.042 * np.sin(np.clip(along, 0, 1.3) * 2.45) - 0.030 * np.clip(along, 0, 1.3) ** 2
    half = 0.036 * np.interp(along, [-0.1, 0.1, 0.4, 0.7, 1.0, 1.1], [0.65, 0.95, 1.0, 0.75, 0.35, 0.2])
    across = np.abs(height - centre) / half
    hairs = noise.slanted(angle, height)
    body = 1.0 - _step(across + 0.16 * hairs, 0.25, 1.35)
    ends = _step(along, -0.10, 0.14) * (1.0 - _step(along, 0.85, 1.10))
    return body * ends * (0.88 + 0.10 * hairs)


class _Noise:
    """Smooth random pictures with values around 0, most of them within 1."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def stretched(self, rough: tuple[int, int]) -> Floats:
        """Return noise with about ``rough`` bumps across and down the painting."""
        across, down = rough
        coarse = self._rng.standard_normal((down + 2, across + 2))
        rows = np.linspace(0, down, HEIGHT)
        columns = np.linspace(0, across, WIDTH)
        partly = _lerp_rows(coarse, rows)
        return _lerp_rows(partly.T, columns).T * 0.8

    def slanted(self, angle: Floats, height: Floats) -> Floats:
        """Return streaks that lean outwards as they rise, as brow hairs do near the nose, and flatten further out."""
        streaks = self._rng.standard_normal(4096)
        lean = np.interp(angle, [0.1, 0.3, 0.6], [0.3, 1.5, 3.0])
        phase = (angle - lean * (height - 7.5)) * 260.0 + 900.0
        low = np.floor(phase).astype(int)
        part = phase - low
        values: Floats = 0.8 * (streaks[low % 4096] * (1 - part) + streaks[(low + 1) % 4096] * part)
        return values


def _lerp_rows(values: Floats, rows: Floats) -> Floats:
    low = np.floor(rows).astype(int)
    part = (rows - low)[:, None]
    between: Floats = values[low] * (1 - part) + values[low + 1] * part
    return between


def _smooth_line(x: Floats, knots: list[float], values: list[float]) -> Floats:
    """Interpolate linearly over an averaged, finer line: no kinks at the knots."""
    fine = np.linspace(0, np.pi, 400)
    line = np.interp(np.concatenate([-fine[25:0:-1], fine, np.pi + fine[1:26]]), knots, values)
    kernel = np.hanning(53)[1:-1]
    smooth: Floats = np.interp(x, fine, np.convolve(line, kernel / kernel.sum(), mode="valid"))
    return smooth


def _mix(base: Floats, over: ArrayLike, cover: Floats) -> Floats:
    mixed: Floats = base + (np.asarray(over) - base) * np.clip(cover, 0.0, 1.0)[..., None]
    return mixed


def _spot(angle: Floats, height: Floats, centre: tuple[float, float], radius: tuple[float, float]) -> Floats:
    spot: Floats = np.exp(-(((angle - centre[0]) / radius[0]) ** 2) - ((height - centre[1]) / radius[1]) ** 2)
    return spot


def _step(x: Floats, low: float, high: float) -> Floats:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    step: Floats = t * t * (3 - 2 * t)
    return step
