"""Derivatives of a function that is only known by its values."""

import warnings
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from evaluation.statistics.arrays import FloatArray

Values = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]

_STEP = 1e-20
# Weights of the values at 1, 2 and 3 steps to either side (Fornberg, 1988, Mathematics of Computation 51:699).
_WEIGHTS = (45 / 60, -9 / 60, 1 / 60)
# Balances the error of the formula, of order 6, against rounding.
_SHARE = float(np.finfo(float).eps) ** (1 / 7)
# A parameter may be large and its effect local, as that of a peak's place: steps are also tried 4, 16 … times finer.
_FINEST = 5


def complex_step(values: Values, parameters: FloatArray) -> FloatArray | None:
    """Return derivatives that are exact to rounding, or None if the function does not take complex numbers.

    Parameters
    ----------
    values : callable
        Takes parameters of shape (p,) and returns shape (n,).
    parameters : numpy.ndarray, shape (p,)
        Where.

    Returns
    -------
    numpy.ndarray, shape (n, p), or None
        The derivatives.

    References
    ----------
    Squire and Trapp (1998), Using complex variables to estimate derivatives of real functions, SIAM Review 40:110.
    """
    columns = []
    for place in range(parameters.size):
        step = _STEP * max(abs(float(parameters[place])), _STEP)
        moved = parameters.astype(complex)
        moved[place] += 1j * step
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", np.exceptions.ComplexWarning)
                found = values(moved)
        except (TypeError, ValueError, AttributeError, np.exceptions.ComplexWarning):
            return None
        if not np.iscomplexobj(found) or not np.isfinite(found).all():
            return None
        columns.append(found.imag / step)
    return np.column_stack(columns)


def differences(values: Values, parameters: FloatArray, *, sizes: FloatArray) -> FloatArray:
    """Return derivatives by central differences of sixth order, with 11 to 13 digits for smooth functions.

    Parameters
    ----------
    values : callable
        Takes parameters of shape (p,) and returns shape (n,).
    parameters : numpy.ndarray, shape (p,)
        Where.
    sizes : numpy.ndarray, shape (p,)
        Size of a parameter that is 0, for the step.

    Returns
    -------
    numpy.ndarray, shape (n, p)
        The derivatives; not finite where the function is not.
    """
    columns = []
    for place in range(parameters.size):
        step = _SHARE * (abs(float(parameters[place])) or float(sizes[place]))
        found = [_central(values, parameters, place, step / 4**finer) for finer in range(_FINEST + 1)]
        # Two steps agree best where neither the curvature nor rounding disturbs.
        unlike = [float(np.abs(one - other).max()) for one, other in pairwise(found)]
        best = int(np.argmin([change if np.isfinite(change) else np.inf for change in unlike]))
        columns.append(found[best + 1] if best else found[0])
    return np.column_stack(columns)


def _central(values: Values, parameters: FloatArray, place: int, step: float) -> FloatArray:
    total = np.zeros(1)
    for number, weight in enumerate(_WEIGHTS, start=1):
        above, below = parameters.copy(), parameters.copy()
        above[place] += number * step
        below[place] -= number * step
        total = total + weight * (values(above) - values(below))
    return total / step
