"""Cumulative-logit models of ordered answers, without and with random effects."""

from evaluation.statistics.ordinal.crossed import CrossedCumulativeLogit, crossed_cumulative_logit
from evaluation.statistics.ordinal.fixed import CumulativeLogit, cumulative_logit
from evaluation.statistics.ordinal.mixed import CumulativeLogitMixed, cumulative_logit_mixed

__all__ = [
    "CrossedCumulativeLogit",
    "CumulativeLogit",
    "CumulativeLogitMixed",
    "crossed_cumulative_logit",
    "cumulative_logit",
    "cumulative_logit_mixed",
]
