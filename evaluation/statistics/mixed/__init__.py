"""Linear mixed models: crossed random effects by REML, with Satterthwaite's degrees of freedom."""

from evaluation.statistics.mixed.models import compare, crossed_mixed_model, mixed_model
from evaluation.statistics.mixed.result import CrossedMixedModel, LikelihoodRatio, MixedModel
from evaluation.statistics.mixed.satterthwaite import FTest
from evaluation.statistics.mixed.terms import RandomTerm

__all__ = [
    "CrossedMixedModel",
    "FTest",
    "LikelihoodRatio",
    "MixedModel",
    "RandomTerm",
    "compare",
    "crossed_mixed_model",
    "mixed_model",
]
