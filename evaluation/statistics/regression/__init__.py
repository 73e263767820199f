"""Linear and nonlinear least squares."""

from evaluation.statistics.regression.linear import LinearFit, SimpleRegression, linear_fit, simple_regression, written
from evaluation.statistics.regression.nonlinear import NonlinearFit, nonlinear_fit

__all__ = [
    "LinearFit",
    "NonlinearFit",
    "SimpleRegression",
    "linear_fit",
    "nonlinear_fit",
    "simple_regression",
    "written",
]
