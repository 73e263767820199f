"""How reliable questionnaires are as scales."""

from evaluation.statistics.scale_reliability.alpha import CronbachAlpha, ItemStatistics, cronbach_alpha, spearman_brown
from evaluation.statistics.scale_reliability.omega import McdonaldOmega, fit_flags, mcdonald_omega
from evaluation.statistics.scale_reliability.one_factor import FactorFit, OneFactorCheck, one_factor_check
from evaluation.statistics.scale_reliability.pad import DimensionQuality, PadScaleQuality, pad_scale_quality

__all__ = [
    "CronbachAlpha",
    "DimensionQuality",
    "FactorFit",
    "ItemStatistics",
    "McdonaldOmega",
    "OneFactorCheck",
    "PadScaleQuality",
    "cronbach_alpha",
    "fit_flags",
    "mcdonald_omega",
    "one_factor_check",
    "pad_scale_quality",
    "spearman_brown",
]
