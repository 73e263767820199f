"""The colours of a figure."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Palette:
    """Colours, sRGB from 0 to 1."""

    skin: tuple[float, float, float] = (0.885, 0.715, 0.620)
    flush: tuple[float, float, float] = (0.860, 0.560, 0.500)
    lips: tuple[float, float, float] = (0.735, 0.395, 0.375)
    hair: tuple[float, float, float] = (0.155, 0.115, 0.100)
    shirt: tuple[float, float, float] = (0.300, 0.400, 0.500)
    iris: tuple[float, float, float] = (0.340, 0.205, 0.120)
