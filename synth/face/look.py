"""The look: how a figure wears its hair, brows, beard and top. Colours are in its palette."""

from dataclasses import dataclass, field
from typing import Literal

Knots = tuple[tuple[float, float], ...]

_OVER_THE_EAR: Knots = ((1.17, 6.97), (1.22, 7.24), (1.40, 7.41), (1.58, 7.36), (1.70, 7.12), (1.74, 6.86))
_NAPE: Knots = ((1.90, 6.55), (2.30, 6.36), (2.75, 6.30))

_SOFT_LINE: Knots = (
    *((0.00, 7.99), (0.28, 7.98), (0.47, 7.92), (0.64, 7.80), (0.76, 7.60), (0.86, 7.42), (0.98, 7.30)),
    *((1.06, 7.12), (1.10, 6.96)),
    *_OVER_THE_EAR,
    *_NAPE,
)
_CUT_LINE: Knots = (
    *((0.00, 8.02), (0.25, 8.04), (0.43, 8.06), (0.58, 8.00), (0.68, 7.86), (0.73, 7.68), (0.80, 7.50)),
    *((0.94, 7.39), (1.01, 7.20), (1.02, 6.92)),
    *_OVER_THE_EAR,
    *((1.80, 6.62), (2.20, 6.48), (2.75, 6.44)),
)


@dataclass(frozen=True)
class Hairstyle:
    """Hair as a layer over the scalp, and what hangs or stands off from it.

    Attributes
    ----------
    hairline : tuple of (float, float)
        The edge of the hair from the middle of the forehead to the nape: angle (rad) and height (dm) on the template,
        see `synth.face.wrapping.wrap`.
    top, sides : float
        Thickness of the layer on top of the head and at its sides, dm.
    ramp : float
        Distance from the hairline over which the thickness grows, dm.
    rough : float
        How uneven the layer's surface is, dm.
    strands : {"down", "aside", "back", "curls"}
        Which way the hair lies: down from the crown, to both sides, drawn to the back of the head, or in curls.
    soft, ragged : float
        Width of the painted hairline, and how far tufts stand out from it, dm.
    parting : float or None
        Angle of the parting, positive on the subject's left; rad.
    loose : {None, "bob", "bun"}
        What is not part of the layer.
    """

    hairline: Knots
    top: float
    sides: float
    ramp: float
    rough: float
    strands: Literal["down", "aside", "back", "curls"]
    soft: float
    ragged: float = 0.022
    parting: float | None = None
    loose: Literal["bob", "bun"] | None = None


BOB = Hairstyle(
    hairline=_SOFT_LINE,
    top=0.15,
    sides=0.11,
    ramp=0.40,
    rough=0.0,
    strands="aside",
    soft=0.12,
    ragged=0.012,
    parting=0.30,
    loose="bob",
)
DRAWN_BACK = Hairstyle(_SOFT_LINE, top=0.15, sides=0.07, ramp=0.40, rough=0.004, strands="back", soft=0.12, loose="bun")
SIDE_PARTED = Hairstyle(
    _CUT_LINE, top=0.20, sides=0.045, ramp=0.38, rough=0.008, strands="aside", soft=0.09, ragged=0.018, parting=0.42
)
SHORT_CUT = Hairstyle(_CUT_LINE, top=0.16, sides=0.040, ramp=0.24, rough=0.010, strands="down", soft=0.08, ragged=0.07)
CLOSE_CROP = Hairstyle(_CUT_LINE, top=0.035, sides=0.012, ramp=0.20, rough=0.0, strands="curls", soft=0.07)
AFRO = Hairstyle(_SOFT_LINE, top=0.17, sides=0.15, ramp=0.30, rough=0.005, strands="curls", soft=0.08)


@dataclass(frozen=True)
class Brows:
    """The shape of the eyebrows.

    Attributes
    ----------
    thickness : float
        Height of the brow as a multiple of the usual one.
    raised : float
        How far it lies above the usual place, dm.
    arch : float
        How far its highest part rises above its ends, dm.
    slant : float
        How much higher its outer end is than its inner one, dm.
    length : float
        Length as a multiple of the usual one.
    density : float
        How much the hairs cover, 0 to 1.
    """

    thickness: float = 1.0
    raised: float = 0.0
    arch: float = 0.042
    slant: float = -0.02
    length: float = 1.0
    density: float = 0.85


@dataclass(frozen=True)
class Neckline:
    """The upper edge of the top.

    Attributes
    ----------
    height : float
        Height on the template, as `synth.face.wrapping.wrap` counts it: the same at the throat and at the nape, dm.
    drop : float
        How much lower it is in the middle of the front, dm.
    width : float
        Half-angle of the part that drops, rad.
    pointed : bool
        Whether the drop is a V rather than a scoop.
    band : float
        Width of the ribbed band along the edge, dm.
    """

    height: float = 5.50
    drop: float = 0.0
    width: float = 1.2
    pointed: bool = False
    band: float = 0.08


@dataclass(frozen=True)
class Look:
    """Hair, brows, beard and top.

    Attributes
    ----------
    hair : Hairstyle
        The hair.
    brows : Brows
        The eyebrows.
    neckline : Neckline
        The edge of the top.
    beard : float
        How much of a shaven beard shows, 0 to 1.
    """

    hair: Hairstyle = BOB
    brows: Brows = field(default_factory=Brows)
    neckline: Neckline = field(default_factory=Neckline)
    beard: float = 0.0
