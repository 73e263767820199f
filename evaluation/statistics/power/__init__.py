"""Power and planning, in closed form and by simulation."""

from evaluation.statistics.power.closed_form import (
    Power,
    chance,
    correlation_power,
    effect_f,
    independent_t_power,
    one_way_power,
    paired_t_power,
    repeated_measures_power,
    required_n,
)
from evaluation.statistics.power.crossed import CrossedPower, condition_means, crossed_power, power_table, required
from evaluation.statistics.power.presets import CorrelationEffect, MeanEffect, preset, usual_components
from evaluation.statistics.power.simulation import (
    Share,
    SimulatedPower,
    simulate_correlation_power,
    simulate_power,
    wilson,
)

__all__ = [
    "CorrelationEffect",
    "CrossedPower",
    "MeanEffect",
    "Power",
    "Share",
    "SimulatedPower",
    "chance",
    "condition_means",
    "correlation_power",
    "crossed_power",
    "effect_f",
    "independent_t_power",
    "one_way_power",
    "paired_t_power",
    "power_table",
    "preset",
    "repeated_measures_power",
    "required",
    "required_n",
    "simulate_correlation_power",
    "simulate_power",
    "usual_components",
    "wilson",
]
