"""Noise: smooth random pictures for paintings."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

Floats = NDArray[np.float64]

_TABLE = 512


class Noise:
    """Smooth random pictures with values around 0, most of them within 1.

    Parameters
    ----------
    rng : numpy.random.Generator
        Where the values come from; each picture takes new ones.
    width, height : int
        Size of the pictures in pixels.
    """

    def __init__(self, rng: np.random.Generator, width: int, height: int) -> None:
        self._rng = rng
        self._width, self._height = width, height

    def bumps(self, across: int, down: int) -> Floats:
        """Return a picture (height, width) with about this many bumps across and down."""
        coarse = self._rng.standard_normal((down + 2, across + 2))
        partly = _between_rows(coarse, np.linspace(0, down, self._height))
        return _between_rows(partly.T, np.linspace(0, across, self._width)).T * 0.8

    def at(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """Return values at any coordinates, about one bump for each unit of ``x`` and of ``y``."""
        table = self._rng.standard_normal((_TABLE, _TABLE))
        values: Floats = map_coordinates(table, np.broadcast_arrays(y, x), order=1, mode="grid-wrap")
        return values * 0.8


def _between_rows(values: Floats, rows: Floats) -> Floats:
    low = np.floor(rows).astype(int)
    part = (rows - low)[:, None]
    between: Floats = values[low] * (1 - part) + values[low + 1] * part
    return between
