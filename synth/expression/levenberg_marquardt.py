"""Nonlinear least squares by the method of Levenberg and Marquardt, for many problems of one shape at once.

The problems of a batch are solved side by side: one matrix product, one factorisation and one trial step for all that
are still under way. Each goes its own way (its own damping, its own end), and the result of one does not depend on
which others are in the batch.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
State = tuple[NDArray[np.float64], ...]

CONVERGED, EXHAUSTED, STUCK, OVERFITTING = "converged", "iterations", "damping", "validation"
"""Why an iteration ended: no more to gain; as many iterations as allowed; no step gains at any damping; early stop."""

_LARGEST_DAMPING, _SMALLEST_DAMPING = 1e12, 1e-20
_ROUNDING = 4.0 * float(np.finfo(np.float64).eps)


class Problems(Protocol):
    """A batch of least-squares problems with P parameters and N residuals each."""

    def residuals(self, params: Floats, which: Indices) -> tuple[Floats, State]:
        """Return the residuals (B, N) of parameters (B, P) of the problems ``which`` (B,), and what `jacobian` needs.

        The second is a tuple of arrays whose first axis is that of the problems.
        """
        ...

    def jacobian(self, params: Floats, which: Indices, state: State) -> Floats:
        """Return the derivatives (B, P, N) of the residuals by the parameters."""
        ...


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to go about it.

    Attributes
    ----------
    max_iterations : int
        Trial steps at most; each evaluates the residuals once.
    damping : float
        First mu.
    factor : float
        What mu is divided by after a step that lowers the sum of squares, and multiplied by after one that does not.
    scaled : bool
        Damp each parameter in proportion to the largest norm that its column of the Jacobian has had (Moré 1978),
        instead of all alike (``mu I``): for parameters of very different size.
    exact : bool
        Find the step by a QR decomposition of the Jacobian, which loses half as many digits as the normal equations.
    tolerance : float
        Relative reduction of the sum of squares, both actual and predicted, or relative length of the step, at which
        the iteration ends.
    patience : int
        Early stopping: this many accepted steps without a lower error on the validation part end the iteration.
    """

    max_iterations: int = 200
    damping: float = 1e-3
    factor: float = 10.0
    scaled: bool = False
    exact: bool = False
    tolerance: float = 1e-8
    patience: int = 6

    def __post_init__(self) -> None:
        if self.max_iterations < 1 or self.patience < 1:
            raise SpecError("Levenberg-Marquardt: max_iterations and patience must be at least 1.")
        if not (self.damping > 0.0 and self.factor > 1.0 and 0.0 <= self.tolerance < 1.0):
            raise SpecError("Levenberg-Marquardt: damping > 0, factor > 1 and 0 <= tolerance < 1 are needed.")


@dataclass(frozen=True, eq=False)
class Solution:
    """What came out, for B problems.

    Attributes
    ----------
    params : (B, P) float64
        The parameters; with a validation part those with the lowest error on it.
    sse : (B,) float64
        Sum of squared residuals at these parameters.
    iterations : (B,) int64
        Trial steps made.
    reasons : tuple of str
        Why each ended, see the module's constants.
    """

    params: Floats
    sse: Floats
    iterations: Indices
    reasons: tuple[str, ...]


def minimise(
    problems: Problems,
    start: Floats,
    *,
    options: Options | None = None,
    validation: Callable[[Floats, Indices], Floats] | None = None,
) -> Solution:
    """Minimise the sum of squared residuals of each problem of a batch.

    ``(J^T J + mu D) step = -J^T r`` with ``D = I`` (Levenberg 1944; Hagan and Menhaj 1994 for networks) or the squared
    column norms (Marquardt 1963; Moré 1978); ``mu`` is divided by the factor after a step that helps and multiplied by
    it after one that does not, which is then not made.

    Parameters
    ----------
    problems : Problems
        Residuals and their derivatives.
    start : (B, P)
        First parameters of each problem.
    options : Options, optional
        How to go about it.
    validation : callable, optional
        Takes parameters (B, P) and the problems (B,), returns the error (B,) on the validation part; switches early
        stopping on.

    Returns
    -------
    Solution
        The best parameters of each problem.

    Raises
    ------
    SpecError
        If ``start`` is not a finite (B, P) array, or the residuals there are not finite.
    """
    first = np.array(start, dtype=np.float64)
    if first.ndim != 2 or not np.isfinite(first).all():
        raise SpecError(f"Levenberg-Marquardt: the start, of shape {first.shape}, must be finite numbers (B, P).")
    batch = _Batch(problems, first, options or Options(), validation)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        batch.begin()
        for _ in range(batch.options.max_iterations):
            if not len(batch.which):
                break
            batch.step()
    batch.finish(np.ones(len(batch.which), dtype=bool), EXHAUSTED)
    return Solution(batch.params_found, batch.sse_found, batch.iterations, tuple(batch.reasons))


@dataclass
class _Under:
    """The problems still under way: their state, row by row."""

    params: Floats
    residuals: Floats
    sse: Floats
    mu: Floats
    gram: Floats
    """J^T J (B, P, P), or with exact steps the Jacobian itself (B, P, N)."""
    gradient: Floats
    scale: Floats
    best: Floats
    best_sse: Floats
    best_error: Floats
    failures: Indices

    def keep(self, rows: NDArray[np.bool_]) -> "_Under":
        return replace(self, **{name: values[rows] for name, values in vars(self).items()})


class _Batch:
    def __init__(
        self,
        problems: Problems,
        start: Floats,
        options: Options,
        validation: Callable[[Floats, Indices], Floats] | None,
    ) -> None:
        self.problems, self.options, self.validation = problems, options, validation
        self.params_found = start
        self.sse_found = np.zeros(len(start))
        self.iterations = np.zeros(len(start), dtype=np.int64)
        self.reasons = [EXHAUSTED] * len(start)
        self.which = np.arange(len(start))

    def begin(self) -> None:
        params = self.params_found.copy()
        residuals, state = self.problems.residuals(params, self.which)
        sse = _squares(residuals)
        if not np.isfinite(sse).all():
            raise SpecError(
                f"Levenberg-Marquardt: the residuals of problem {np.flatnonzero(~np.isfinite(sse))[0]} at the start "
                "are not finite; begin elsewhere."
            )
        count, size = params.shape
        self.now = _Under(
            params=params,
            residuals=residuals,
            sse=sse,
            mu=np.full(count, self.options.damping),
            gram=np.empty((count, size, residuals.shape[1] if self.options.exact else size)),
            gradient=np.empty((count, size)),
            scale=np.ones((count, size)) if not self.options.scaled else np.zeros((count, size)),
            best=params.copy(),
            best_sse=sse.copy(),
            best_error=np.full(count, np.inf) if self.validation is None else self.validation(params, self.which),
            failures=np.zeros(count, dtype=np.int64),
        )
        self._linearise(np.ones(count, dtype=bool), state)

    def _linearise(self, rows: NDArray[np.bool_], state: State) -> None:
        """Take derivatives anew at the parameters of some rows."""
        now = self.now
        jacobian = self.problems.jacobian(now.params[rows], self.which[rows], state)
        now.gradient[rows] = np.matmul(jacobian, now.residuals[rows][:, :, None])[:, :, 0]
        # The two operands are one array, so that only half of the symmetric product is computed.
        now.gram[rows] = jacobian if self.options.exact else np.matmul(jacobian, jacobian.transpose(0, 2, 1))
        if self.options.scaled:
            norms = np.einsum("bpn,bpn->bp", jacobian, jacobian)
            widest = np.maximum(now.scale[rows], norms)
            now.scale[rows] = np.where(widest > 0.0, widest, 1.0)

    def _solve(self) -> Floats:
        now = self.now
        damping = now.mu[:, None] * now.scale
        if self.options.exact:
            count, size, points = now.gram.shape
            tall = np.zeros((count, points + size, size))
            tall[:, :points] = now.gram.transpose(0, 2, 1)
            diagonal = np.arange(size)
            tall[:, points + diagonal, diagonal] = np.sqrt(damping)
            q, r = np.linalg.qr(tall)
            onto = np.matmul(q[:, :points].transpose(0, 2, 1), now.residuals[:, :, None])
            return -_solved(r, onto)
        matrix = now.gram.copy()
        diagonal = np.arange(matrix.shape[1])
        matrix[:, diagonal, diagonal] += damping
        return -_solved(matrix, now.gradient[:, :, None])

    def step(self) -> None:
        now, options = self.now, self.options
        step = self._solve()
        trial = now.params + step
        residuals, state = self.problems.residuals(trial, self.which)
        sse = _squares(residuals)
        predicted = np.einsum("bp,bp->b", step, now.mu[:, None] * now.scale * step - now.gradient)
        actual = now.sse - sse
        self.iterations[self.which] += 1

        # At the bottom rounding decides whether a step helps; a last exact one is welcome if it does no harm.
        no_harm = (predicted <= options.tolerance * now.sse) & (actual >= -_ROUNDING * now.sse)
        better = (actual > 0.0) | (no_harm & np.isfinite(sse))
        small_gain = (np.abs(actual) <= options.tolerance * now.sse) & (predicted <= options.tolerance * now.sse)
        # The first step that gains next to nothing may be a short one because of its damping.
        undamped = now.mu <= options.damping
        length, size = np.linalg.norm(step, axis=1), np.linalg.norm(now.params, axis=1)
        short = length <= options.tolerance * (size + options.tolerance)
        converged = (better & small_gain & (undamped | short)) | short | (now.sse == 0.0)

        now.params[better], now.residuals[better] = trial[better], residuals[better]
        now.sse[better] = sse[better]
        now.mu = np.clip(
            np.where(better, now.mu / options.factor, now.mu * options.factor),
            _SMALLEST_DAMPING,
            10 * _LARGEST_DAMPING,
        )
        overfitting = self._validate(better)
        going = better & ~converged & ~overfitting
        if going.any():
            self._linearise(going, tuple(part[going] for part in state))
        stuck = now.mu > _LARGEST_DAMPING
        ended = converged | stuck | overfitting
        if ended.any():
            self.finish(overfitting, OVERFITTING)
            self.finish(stuck & ~overfitting, STUCK)
            self.finish(converged & ~stuck & ~overfitting, CONVERGED)
            self.now, self.which = now.keep(~ended), self.which[~ended]

    def _validate(self, moved: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Remember the parameters that do best on the validation part; tell which have not improved for long."""
        now = self.now
        if self.validation is None or not moved.any():
            return np.zeros(len(moved), dtype=bool)
        error = np.full(len(moved), np.inf)
        error[moved] = self.validation(now.params[moved], self.which[moved])
        lower = error < now.best_error
        now.best[lower], now.best_sse[lower], now.best_error[lower] = now.params[lower], now.sse[lower], error[lower]
        now.failures = np.where(lower, 0, now.failures + (moved & ~lower))
        return now.failures >= self.options.patience

    def finish(self, rows: NDArray[np.bool_], reason: str) -> None:
        """Note the result of some rows."""
        now = self.now
        held = self.validation is not None
        self.params_found[self.which[rows]] = (now.best if held else now.params)[rows]
        self.sse_found[self.which[rows]] = (now.best_sse if held else now.sse)[rows]
        for problem in self.which[rows]:
            self.reasons[problem] = reason


def _squares(residuals: Floats) -> Floats:
    return np.asarray(np.einsum("bn,bn->b", residuals, residuals))


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solve (B, P, P) systems; one that is singular to the last digit gives NaN, which no step survives."""
    try:
        return np.asarray(np.linalg.solve(matrix, right)[:, :, 0])
    except np.linalg.LinAlgError:
        result = np.full(right.shape[:2], np.nan)
        for k, (own, side) in enumerate(zip(matrix, right, strict=True)):
            if np.isfinite(own).all() and np.linalg.matrix_rank(own) == len(own):
                result[k] = np.linalg.solve(own, side)[:, 0]
        return result
