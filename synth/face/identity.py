"""Identities: who the face is, as weights of MakeHuman targets on the base mesh."""

from collections.abc import Mapping
from types import MappingProxyType

IDENTITIES: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "default": {
            "macrodetails/asian-female-young": 0.65,
            "macrodetails/caucasian-female-young": 0.35,
            "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
            "eyes/l-eye-scale-incr": 0.35,
            "eyes/r-eye-scale-incr": 0.35,
            "mouth/mouth-angles-up": 0.35,
            "mouth/mouth-scale-vert-decr": 0.10,
        },
    }
)
"""Weights of targets in the compiled face data, by the identity's name."""
