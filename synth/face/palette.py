"""The colours of a figure."""

from dataclasses import dataclass

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Palette:
    """Colours, sRGB from 0 to 1.

    Attributes
    ----------
    skin, flush, lips : (3,) float
        Skin, skin where the blood shows (cheeks, nose, ears), and the red of the lips.
    hair, brows : (3,) float
        Hair and eyebrows; the brows also stand for the shadow of a shaven beard.
    shirt : (3,) float
        The top.
    iris : (3,) float
        The iris in its middle ring.
    """

    skin: Colour = (0.885, 0.715, 0.620)
    flush: Colour = (0.860, 0.560, 0.500)
    lips: Colour = (0.735, 0.395, 0.375)
    hair: Colour = (0.155, 0.115, 0.100)
    brows: Colour = (0.240, 0.180, 0.155)
    shirt: Colour = (0.300, 0.400, 0.500)
    iris: Colour = (0.340, 0.205, 0.120)
