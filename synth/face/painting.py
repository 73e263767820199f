"""The painting: skin, brows, hair and clothes as one picture that is wrapped round the head."""

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import zoom

from synth.face.look import Look
from synth.face.noise import Noise
from synth.face.palette import Palette
from synth.face.wrapping import CROWN, HIGHEST, LOWEST, above_hairline, below_neckline, canvas, step

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 1024, 1024
_COARSE = 4
"""The distance to the hairline is smooth: it is found for one pixel of so many across and down."""
_SEED = 20130607
_SWEEP = 0.5
"""How far parted hair is combed backwards, rad; 0 is straight to the sides."""


@functools.cache
def paint(palette: Palette, look: Look) -> NDArray[np.uint8]:
    """Return the picture (HEIGHT, WIDTH, 3), sRGB, top row first; painted once for each look, not to be written to."""
    painter = _Painter(palette, look)
    picture = painter.skin()
    picture = painter.beard(picture)
    picture = painter.brows(picture)
    picture = painter.hair(picture)
    picture = painter.top(picture)
    result = np.rint(255 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)
    result.setflags(write=False)
    return result


class _Painter:
    """Lays one coat after the other on pictures (HEIGHT, WIDTH, 3) of sRGB values from 0 to 1."""

    def __init__(self, palette: Palette, look: Look) -> None:
        self._palette, self._look = palette, look
        self._noise = Noise(np.random.default_rng(_SEED), WIDTH, HEIGHT)
        self._angle, self._height = canvas(WIDTH, HEIGHT)
        # No face is its own mirror image.
        self._aside = np.abs(self._angle + 0.008 * self._noise.bumps(9, 7))
        self._up = self._height + 0.010 * self._noise.bumps(9, 7)

    def skin(self) -> Floats:
        """Skin: blood in cheeks, nose and chin, shadow round the eyes and in the lid's fold, a little unevenness."""
        palette, noise = self._palette, self._noise
        flush = 0.42 * self._spot((0.50, 6.93), (0.22, 0.18))
        flush += 0.30 * self._spot((0.0, 6.88), (0.11, 0.10))
        flush += 0.22 * self._spot((0.15, 6.82), (0.06, 0.07))
        flush += 0.14 * self._spot((0.0, 6.30), (0.20, 0.10))
        flush += 0.05 * self._spot((0.0, 7.75), (0.40, 0.12))
        # Under the jaw the painting is drawn out, and a pattern would show as streaks.
        even = step(self._up, 6.0, 6.3)
        flush += (0.07 * noise.bumps(40, 50) + 0.05 * noise.bumps(150, 150)) * even
        shadow = 0.28 * self._spot((0.33, 7.375), (0.17, 0.045))
        shadow += 0.22 * self._spot((0.17, 7.27), (0.05, 0.10))
        shadow += 0.13 * self._spot((0.30, 7.12), (0.16, 0.05))
        shadow += 0.10 * self._spot((0.0, 6.44), (0.16, 0.03))
        # The underside of the jaw gets less light from the room than its openness to the sky says.
        shadow += 0.10 * step(-self._up, -6.15, -5.85)
        tone = 1.0 + 0.010 * (noise.bumps(70, 60) + noise.bumps(450, 400)) * even
        skin = _mix(np.broadcast_to(palette.skin, (HEIGHT, WIDTH, 3)), palette.flush, flush)
        return _mix(skin, np.multiply(palette.skin, (0.70, 0.60, 0.58)), shadow) * tone[..., None]

    def beard(self, base: Floats) -> Floats:
        """Shade where a shaven beard grows: upper lip, chin, jaw and up to the sideburns."""
        if not self._look.beard:
            return base
        rows = _rows(6.0, 7.2)
        angle, height = self._aside[rows], self._up[rows]
        cheek = 6.46 + 0.62 * step(angle, 0.45, 1.05)
        area = step(cheek - height, -0.10, 0.12) * step(height, 6.16, 6.34) * (1 - step(angle, 1.10, 1.30))
        lip = step(height, 6.60, 6.66) * (1 - step(height, 6.74, 6.82)) * (1 - step(angle, 0.20, 0.34))
        corner = self._spot((0.34, 6.58), (0.09, 0.12))[rows]
        stubble = 1.0 + 0.30 * self._noise.bumps(500, 500)[rows]
        cover = 0.45 * self._look.beard * np.maximum(np.maximum(area, 0.65 * lip), 0.45 * corner) * stubble
        shadow = 0.75 * np.array(self._palette.brows) + 0.20 * np.array(self._palette.skin)
        base[rows] = _mix(base[rows], shadow, cover)
        return base

    def brows(self, base: Floats) -> Floats:
        """Paint each brow as an arch that thins towards its tail, with hairs."""
        rows = _rows(7.2, 7.8)
        brows, angle, height = self._look.brows, self._aside[rows], self._up[rows]
        along = (angle - 0.135) / (0.45 * brows.length)
        reach = np.clip(along, 0, 1.3)
        centre = 7.510 + brows.raised + brows.arch * np.sin(reach * 2.45) + brows.slant * reach
        taper = np.interp(along, [-0.1, 0.1, 0.4, 0.7, 1.0, 1.1], [0.65, 0.95, 1.0, 0.75, 0.35, 0.2])
        across = np.abs(height - centre) / (0.036 * brows.thickness * taper)
        # Hairs lean outwards as they rise, upright near the nose and nearly flat at the tail.
        lean = np.interp(angle, [0.1, 0.3, 0.6], [0.3, 1.5, 3.0])
        hairs = self._noise.at((angle - lean * (height - 7.5)) * 260.0, height * 6.0)
        body = 1.0 - step(across + 0.16 * hairs, 0.25, 1.35)
        ends = step(along, -0.10, 0.14) * (1.0 - step(along, 0.85, 1.10))
        cover = brows.density * body * ends * (1.0 + 0.12 * hairs)
        base[rows] = _mix(base[rows], self._palette.brows, cover)
        return base

    def hair(self, base: Floats) -> Floats:
        """Lay the hair over the scalp, with strands the way the style has them."""
        style, noise = self._look.hair, self._noise
        right = slice(None, None, _COARSE), slice(None, WIDTH // 2, _COARSE)
        coarse = above_hairline(style.hairline, self._angle[right], self._height[right])
        half = zoom(coarse, _COARSE, order=1, grid_mode=True, mode="nearest")
        inside = np.concatenate([half, half[:, ::-1]], axis=1)
        if style.strands == "curls":
            strands = 0.9 * noise.bumps(210, 260) + 0.8 * noise.bumps(420, 520)
            tufts = noise.bumps(420, 440)
        else:
            across, along = self._flow()
            strands = 0.75 * noise.at(across * 240, along * 2) + 0.45 * noise.at(across * 70, along)
            tufts = 0.6 * noise.bumps(560, 20) + 0.6 * noise.bumps(150, 12)
        if style.loose is not None:
            hanging = 0.7 * noise.bumps(420, 3) + 0.5 * noise.bumps(130, 3)
            strands = np.where(self._height > CROWN, hanging, strands)
        # Single strands catch the light, on black hair as on fair hair.
        hair = np.multiply(self._palette.hair, (1.0 + 0.24 * strands)[..., None])
        hair += 0.06 * np.maximum(strands, 0.0)[..., None]
        if style.parting is not None:
            # The scalp shows through, less and less towards the crown.
            off = (self._angle - style.parting) * np.cos(np.clip(self._height - 7.4, 0, 1.5))
            line = np.exp(-((off / 0.016) ** 2)) * (1 - step(self._height, 8.10, 8.45)) * step(self._height, 7.7, 7.8)
            hair = _mix(hair, self._palette.skin, 0.30 * line)
        # The hair shades the skin along its edge.
        shaded = base * (1.0 - 0.16 * step(inside, -0.16, 0.0))[..., None]
        # Tufts hang over the forehead; sideburns and nape are trimmed.
        ragged = style.ragged * (0.3 + 0.7 * step(self._height, 7.5, 7.8))
        return _mix(shaded, hair, step(inside + ragged * tufts, -0.5 * style.soft, 0.5 * style.soft))

    def _flow(self) -> tuple[Floats, Floats]:
        """Return coordinates across and along the strands, in radians or dm.

        The head is taken for an ellipsoid, which is good enough to lead strands along.
        """
        angle, height = self._angle, self._height
        level = np.sqrt(np.clip(1.0 - (np.clip(height - 7.3, 0.0, 1.55) / 1.6) ** 2, 0.0, 1.0))
        x, z = 0.75 * level * np.sin(angle), 0.95 * level * np.cos(angle)
        if self._look.hair.strands == "back":
            # Round the place behind the crown where it is tied.
            return 0.6 * np.arctan2(x, height - 6.6), z
        if self._look.hair.strands == "aside":
            # Away from the parting and backwards, then down.
            side = np.where(angle < (self._look.hair.parting or 0.0), 1.0, -1.0)
            return np.arctan2(np.cos(_SWEEP) * z - np.sin(_SWEEP) * side * x, height - 5.6), side * x
        return 0.5 * angle, height

    def top(self, base: Floats) -> Floats:
        """Lay the top over the shoulders, with a ribbed band along its edge and its shadow on the skin."""
        noise, band = self._noise, self._look.neckline.band
        # The lowest row stands for all below it, where a pattern would be drawn out to streaks.
        fading = step(self._height, LOWEST + 0.05, LOWEST + 0.3)
        weave = (0.025 * noise.bumps(700, 500) + 0.008 * noise.bumps(30, 24)) * fading
        under = below_neckline(self._look.neckline, self._angle, self._height)
        ribs = 0.03 * np.sin(self._angle * 130.0) * step(under, 0.0, 0.01) * (1 - step(under, band - 0.01, band))
        seam = 0.12 * np.exp(-(((under - band) / 0.012) ** 2))
        shirt = np.multiply(self._palette.shirt, (1.0 + weave + ribs - seam)[..., None])
        shaded = base * (1.0 - 0.22 * step(under, -0.12, 0.0))[..., None]
        return _mix(shaded, shirt, step(under, -0.006, 0.006))

    def _spot(self, centre: tuple[float, float], radius: tuple[float, float]) -> Floats:
        across, down = (self._aside - centre[0]) / radius[0], (self._up - centre[1]) / radius[1]
        spot: Floats = np.exp(-(across**2) - down**2)
        return spot


def _rows(low: float, high: float) -> slice:
    """Return the rows of the painting between two heights."""
    top, bottom = ((HIGHEST - height) / (HIGHEST - LOWEST) * HEIGHT for height in (high, low))
    return slice(int(top), int(bottom))


def _mix(base: Floats, over: ArrayLike, cover: Floats) -> Floats:
    mixed: Floats = base + (np.asarray(over) - base) * np.clip(cover, 0.0, 1.0)[..., None]
    return mixed
