"""Identities: who the face is, as weights of MakeHuman targets on the base mesh, and what it looks like."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from synth.errors import AssetError
from synth.face.look import AFRO, BOB, CLOSE_CROP, DRAWN_BACK, SHORT_CUT, SIDE_PARTED, Brows, Look, Neckline
from synth.face.palette import Palette

DEFAULT_IDENTITY = "mei"


@dataclass(frozen=True)
class Identity:
    """One person.

    Attributes
    ----------
    name : str
        The name it is chosen by.
    sex : {"female", "male"}
        As it appears.
    ethnicity : {"African", "East Asian", "European"}
        As it appears.
    description : str
        Who it is, in a few words.
    targets : dict of str to float
        Weights of targets in the compiled face data.
    palette : Palette
        Colours.
    look : Look
        Hair, brows, beard and top.
    """

    name: str
    sex: Literal["female", "male"]
    ethnicity: Literal["African", "East Asian", "European"]
    description: str
    targets: Mapping[str, float]
    palette: Palette = field(default_factory=Palette)
    look: Look = field(default_factory=Look)


def _targets(*, both_sides: Mapping[str, float], **weights: float) -> Mapping[str, float]:
    """Return weights by target; those of ``both_sides`` hold for the left (``l-``) and the right (``r-``) alike."""
    sides = {
        f"{folder}/{side}-{target}": weight
        for (folder, target), weight in ((name.split("/"), weight) for name, weight in both_sides.items())
        for side in "lr"
    }
    return MappingProxyType(weights | sides)


_ALL = (
    Identity(
        name="mei",
        sex="female",
        ethnicity="East Asian",
        description="young East Asian woman with a black bob",
        targets=_targets(
            **{
                "macrodetails/asian-female-young": 0.65,
                "macrodetails/caucasian-female-young": 0.35,
                "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.35,
                "mouth/mouth-scale-vert-decr": 0.10,
            },
            both_sides={"eyes/eye-scale-incr": 0.35},
        ),
        look=Look(hair=BOB, brows=Brows(thickness=0.85), neckline=Neckline(height=5.46, drop=0.04)),
    ),
    Identity(
        name="wei",
        sex="male",
        ethnicity="East Asian",
        description="young East Asian man with short black hair",
        targets=_targets(
            **{
                "macrodetails/asian-male-young": 0.75,
                "macrodetails/caucasian-male-young": 0.25,
                "macrodetails/universal-male-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.35,
                "head/head-oval": 0.3,
            },
            both_sides={"eyes/eye-scale-incr": 0.25, "eyes/eye-height2-incr": 0.2},
        ),
        palette=Palette(
            skin=(0.845, 0.675, 0.560),
            flush=(0.820, 0.520, 0.430),
            lips=(0.690, 0.430, 0.385),
            hair=(0.130, 0.110, 0.105),
            brows=(0.170, 0.135, 0.120),
            shirt=(0.335, 0.345, 0.365),
            iris=(0.290, 0.180, 0.110),
        ),
        look=Look(hair=SHORT_CUT, brows=Brows(thickness=1.15, raised=-0.005, arch=0.03), beard=0.25),
    ),
    Identity(
        name="anna",
        sex="female",
        ethnicity="European",
        description="young European woman with brown hair tied in a bun",
        targets=_targets(
            **{
                "macrodetails/caucasian-female-young": 1.0,
                "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.35,
                "head/head-oval": 0.4,
                "nose/nose-point-up": 0.2,
                "chin/chin-width-decr": 0.25,
            },
            both_sides={"eyes/eye-scale-incr": 0.2},
        ),
        palette=Palette(
            skin=(0.915, 0.755, 0.675),
            flush=(0.885, 0.560, 0.510),
            lips=(0.760, 0.430, 0.410),
            hair=(0.395, 0.265, 0.170),
            brows=(0.400, 0.290, 0.215),
            shirt=(0.470, 0.250, 0.270),
            iris=(0.290, 0.390, 0.430),
        ),
        look=Look(
            hair=DRAWN_BACK,
            brows=Brows(thickness=0.8, arch=0.045, slant=0.0),
            neckline=Neckline(height=5.52, drop=0.10),
        ),
    ),
    Identity(
        name="erik",
        sex="male",
        ethnicity="European",
        description="European man with short fair hair",
        targets=_targets(
            **{
                "macrodetails/caucasian-male-young": 1.0,
                "macrodetails/universal-male-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.45,
                "nose/nose-scale-horiz-decr": 0.2,
                "chin/chin-width-decr": 0.2,
                "neck/neck-scale-horiz-decr": 0.25,
            },
            both_sides={"eyes/eye-scale-incr": 0.25, "eyes/eye-height2-incr": 0.2},
        ),
        palette=Palette(
            skin=(0.885, 0.710, 0.620),
            flush=(0.860, 0.530, 0.470),
            lips=(0.720, 0.450, 0.410),
            hair=(0.370, 0.270, 0.180),
            brows=(0.340, 0.245, 0.175),
            shirt=(0.240, 0.330, 0.280),
            iris=(0.330, 0.400, 0.420),
        ),
        look=Look(
            hair=SIDE_PARTED,
            brows=Brows(thickness=1.15, raised=-0.005, arch=0.03),
            neckline=Neckline(height=5.62, drop=0.16, width=0.45, pointed=True),
            beard=0.6,
        ),
    ),
    Identity(
        name="amara",
        sex="female",
        ethnicity="African",
        description="young African woman with short natural hair",
        targets=_targets(
            **{
                "macrodetails/african-female-young": 1.0,
                "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.3,
                "chin/chin-width-decr": 0.2,
                "mouth/mouth-scale-horiz-decr": 0.15,
                "nose/nose-width3-decr": 0.2,
            },
            both_sides={"cheek/cheek-bones-incr": 0.3},
        ),
        palette=Palette(
            skin=(0.520, 0.345, 0.255),
            flush=(0.540, 0.290, 0.215),
            lips=(0.500, 0.240, 0.200),
            hair=(0.095, 0.078, 0.072),
            brows=(0.150, 0.090, 0.065),
            shirt=(0.720, 0.600, 0.330),
            iris=(0.210, 0.130, 0.085),
        ),
        look=Look(hair=AFRO, brows=Brows(thickness=0.85, arch=0.05, density=0.92), neckline=Neckline(height=5.53)),
    ),
    Identity(
        name="kofi",
        sex="male",
        ethnicity="African",
        description="African man with closely cropped hair",
        targets=_targets(
            **{
                "macrodetails/african-male-young": 1.0,
                "macrodetails/universal-male-young-averagemuscle-averageweight": 1.0,
                "mouth/mouth-angles-up": 0.45,
                "mouth/mouth-scale-vert-decr": 0.15,
                "nose/nose-width3-decr": 0.15,
            },
            both_sides={"eyes/eye-scale-incr": 0.25},
        ),
        palette=Palette(
            skin=(0.475, 0.318, 0.243),
            flush=(0.450, 0.245, 0.185),
            lips=(0.425, 0.212, 0.185),
            hair=(0.085, 0.070, 0.065),
            brows=(0.145, 0.086, 0.062),
            shirt=(0.760, 0.760, 0.740),
            iris=(0.190, 0.120, 0.080),
        ),
        look=Look(
            hair=CLOSE_CROP, brows=Brows(thickness=1.15, density=0.92), neckline=Neckline(height=5.60), beard=0.5
        ),
    ),
)

IDENTITIES: Mapping[str, Identity] = MappingProxyType({identity.name: identity for identity in _ALL})
"""The identities by name."""


def find_identity(name: str) -> Identity:
    """Return the identity of a name.

    Raises
    ------
    AssetError
        If there is none; the message lists those that there are.
    """
    if name not in IDENTITIES:
        raise AssetError(f"There is no identity {name!r}; there are: {', '.join(sorted(IDENTITIES))}.")
    return IDENTITIES[name]
