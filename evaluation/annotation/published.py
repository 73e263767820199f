"""What the papers print of the agreement of annotators, to be put beside one's own."""

from collections.abc import Mapping
from types import MappingProxyType

MTAP_SAMPLES, MTAP_RATERS = 486, 5
"""How many expressions were annotated, and by how many people (Jia et al., 2013, section 2.4)."""

MTAP_SD: Mapping[str, float] = MappingProxyType({"P": 0.20, "A": 0.32, "D": 0.30})
"""Mean standard deviation over annotators after six rounds, likewise."""

MTAP_PAIRWISE_R: Mapping[str, float] = MappingProxyType({"P": 0.80, "A": 0.44, "D": 0.35})
"""Mean Pearson correlation of two annotators, likewise."""
