"""Published cases with data and expected values, run through padlab's public functions."""

from reference_cases.cases import Case, Comparison, compared, read_cases

__all__ = ["Case", "Comparison", "compared", "read_cases"]
