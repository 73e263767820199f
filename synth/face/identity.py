"""Identities: who the face is, as weights of MakeHuman targets on the base mesh, and what it looks like."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from synth.errors import AssetError
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
    description : str
        Who it is, in a few words.
    targets : dict of str to float
        Weights of targets in the compiled face data.
    palette : Palette
        Colours.
    """

    name: str
    sex: str
    description: str
    targets: Mapping[str, float]
    palette: Palette = field(default_factory=Palette)


_ALL = (
    Identity(
        name="mei",
        sex="female",
        description="young East Asian woman with a black bob",
        targets=MappingProxyType(
            {
                "macrodetails/asian-female-young": 0.65,
                "macrodetails/caucasian-female-young": 0.35,
                "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
                "eyes/l-eye-scale-incr": 0.35,
                "eyes/r-eye-scale-incr": 0.35,
                "mouth/mouth-angles-up": 0.35,
                "mouth/mouth-scale-vert-decr": 0.10,
            }
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
