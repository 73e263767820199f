"""The likelihood of a cumulative-logit mixed model: Laplace's approximation or adaptive Gauss-Hermite quadrature."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.ordinal.data import Rows
from evaluation.statistics.ordinal.fit import gap_terms
from evaluation.statistics.ordinal.intercepts import Intercepts

_MOST_STEPS = 200
_MOST_HALVINGS = 60
_TOLERANCE = 1e-10
# By how much of itself a sum over all rows may seem to fall by rounding alone.
_ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class _Mode:
    """Where the integrand is highest, and its second and third derivatives there by row."""

    values: FloatArray
    intercept: FloatArray
    upper: FloatArray
    lower: FloatArray
    log_rows: FloatArray

    @property
    def curved(self) -> tuple[FloatArray, FloatArray]:
        """Density of the logistic distribution at the upper and at the lower bound."""
        return self.upper * (1 - self.upper), self.lower * (1 - self.lower)

    @property
    def bent(self) -> tuple[FloatArray, FloatArray]:
        """Slope of that density at the upper and at the lower bound."""
        above, below = self.curved
        return above * (2 * self.upper - 1), below * (1 - 2 * self.lower)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pieces:
    """What the slope of the likelihood is put together from: see `MixedLikelihood._slope`."""

    upper: FloatArray
    lower: FloatArray
    scale: FloatArray
    variance: FloatArray
    pull: FloatArray


class MixedLikelihood:
    """Log-likelihood of thresholds, coefficients and standard deviations of random intercepts, with its slope.

    Parameters
    ----------
    rows : Rows
        The data, with at least one random factor, that with the most levels first.
    nodes : int
        1 is Laplace's approximation; more are nodes of adaptive Gauss-Hermite quadrature, for one factor.

    Notes
    -----
    With H the curvature at the mode u of the integrand h, the approximation is h(u) - log|H| / 2. Its slope follows the
    mode by the implicit function theorem: d u = H^-1 (d of h's slope in u). (Pinheiro and Chao, 2006, J. Comput. Graph.
    Stat. 15:58; for ordered categories Christensen, 2019, vignette of the R package ordinal.)
    """

    def __init__(self, rows: Rows, *, nodes: int = 1) -> None:
        self.rows = rows
        self.intercepts = Intercepts(rows.factors)
        places, weights = np.polynomial.hermite.hermgauss(nodes)
        self._nodes, self._log_weights = places, np.log(weights) + places**2
        self._start = np.zeros(self.intercepts.number)

    def value_and_slope(
        self, thresholds: FloatArray, coefficients: FloatArray, sds: FloatArray
    ) -> tuple[float, FloatArray, FloatArray, FloatArray]:
        """Return the log-likelihood, and its slopes in thresholds, coefficients and logarithms of the sds."""
        rows = self.rows
        gaps, gap_slope = gap_terms(rows, thresholds)
        eta = rows.x @ coefficients
        mode = self._mode(thresholds, eta, sds)
        self._start = mode.values
        if self._nodes.size == 1:
            value, pieces = self._laplace(mode, sds)
        else:
            value, pieces = self._quadrature(mode, thresholds, eta, sds)
        of_thresholds, of_eta, scales = self._slope(mode, pieces, sds)
        return value + gaps, of_thresholds + gap_slope, rows.x.T @ of_eta, scales

    def _mode(self, thresholds: FloatArray, eta: FloatArray, sds: FloatArray) -> _Mode:
        rows, intercepts = self.rows, self.intercepts
        above, below = rows.bounds(thresholds, eta)
        mode = self._at(self._start, above, below, sds)
        height = self._height(mode)
        zero = self._at(np.zeros(intercepts.number), above, below, sds)
        if self._height(zero) > height:
            mode, height = zero, self._height(zero)
        for _ in range(_MOST_STEPS):
            slope = intercepts.gather(rows.weight * (mode.lower - mode.upper), sds) - mode.values
            curved_above, curved_below = mode.curved
            step = intercepts.curvature(rows.weight * (curved_above + curved_below), sds).solve(slope)
            gain = float(slope @ step)
            for halving in range(_MOST_HALVINGS):
                trial = self._at(mode.values + step / 2**halving, above, below, sds)
                risen = self._height(trial)
                if risen >= height - _ROUNDING * abs(height):
                    break
            mode, height = trial, risen
            if gain < _TOLERANCE:
                break
        return mode

    def _at(self, values: FloatArray, above: FloatArray, below: FloatArray, sds: FloatArray) -> _Mode:
        intercept = self.intercepts.spread(values, sds)
        a, c = above - intercept, below - intercept
        return _Mode(
            values=values,
            intercept=intercept,
            upper=special.expit(-a),
            lower=special.expit(c),
            log_rows=special.log_expit(a) + special.log_expit(-c),
        )

    def _height(self, mode: _Mode) -> float:
        return float(self.rows.weight @ mode.log_rows) - 0.5 * float(mode.values @ mode.values)

    def _laplace(self, mode: _Mode, sds: FloatArray) -> tuple[float, _Pieces]:
        weight, intercepts = self.rows.weight, self.intercepts
        curved_above, curved_below = mode.curved
        curvature = intercepts.curvature(weight * (curved_above + curved_below), sds)
        diagonal, variance = curvature.inverse_parts()
        bent_above, bent_below = mode.bent
        pull = curvature.solve(intercepts.gather(-weight * (bent_above + bent_below) * variance, sds))
        scale = np.empty(sds.size)
        for f, code in enumerate(intercepts.codes):
            own = sds[f] * intercepts.part(mode.values, f)[code]
            scale[f] = weight @ ((mode.lower - mode.upper) * own) - (1 - intercepts.part(diagonal, f)).sum()
        value = self._height(mode) - 0.5 * curvature.log_determinant
        return value, _Pieces(upper=mode.upper, lower=mode.lower, scale=scale, variance=variance, pull=pull)

    def _quadrature(
        self, mode: _Mode, thresholds: FloatArray, eta: FloatArray, sds: FloatArray
    ) -> tuple[float, _Pieces]:
        rows, (code,), (levels,), (sd,) = self.rows, self.intercepts.codes, self.intercepts.levels, sds
        curved_above, curved_below = mode.curved
        bent_above, bent_below = mode.bent
        height = 1 + sd**2 * np.bincount(code, rows.weight * (curved_above + curved_below), levels)
        third = -(sd**3) * np.bincount(code, rows.weight * (bent_above + bent_below), levels)
        width = 1 / np.sqrt(height)
        at = mode.values[:, None] + math.sqrt(2) * width[:, None] * self._nodes
        above, below = (bound[:, None] - sd * at[code] for bound in rows.bounds(thresholds, eta))
        upper, lower = special.expit(-above), special.expit(below)
        logs = rows.weight[:, None] * (special.log_expit(above) + special.log_expit(-below))
        log_terms, slopes = np.empty((2, *at.shape))
        for node in range(self._nodes.size):
            log_terms[:, node] = np.bincount(code, logs[:, node], levels)
            slopes[:, node] = np.bincount(code, rows.weight * (lower - upper)[:, node], levels)
        log_terms += self._log_weights - 0.5 * at**2
        logs_of_sums = special.logsumexp(log_terms, axis=1)
        shares = np.exp(log_terms - logs_of_sums[:, None])
        value = float((logs_of_sums + np.log(width)).sum()) - 0.5 * levels * math.log(math.pi)
        slope_in_u = sd * slopes - at
        shift = (shares * slope_in_u).sum(axis=1)
        widen = -0.5 * (1 + math.sqrt(2) * width * (shares * slope_in_u * self._nodes).sum(axis=1))
        return value, _Pieces(
            upper=(upper * shares[code]).sum(axis=1),
            lower=(lower * shares[code]).sum(axis=1),
            scale=np.array([sd * (shares * at * slopes).sum() + 2 * (widen * (1 - 1 / height)).sum()]),
            variance=(-2 * widen * sd**2 / height)[code],
            pull=-2 * (shift + widen * third / height) / height,
        )

    def _slope(self, mode: _Mode, pieces: _Pieces, sds: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the slopes in thresholds, in each row's linear predictor, and in logarithms of the sds.

        A bound of a row acts directly, through the weight that the row has in the curvature (half of that times the
        `variance` of the row's intercept), and through the mode (half the `pull` on it).
        """
        rows, intercepts = self.rows, self.intercepts
        (curved_above, curved_below), (bent_above, bent_below) = mode.curved, mode.bent
        pull = intercepts.spread(pieces.pull, sds)
        indirect_above = -0.5 * rows.weight * (pieces.variance * bent_above + pull * curved_above)
        indirect_below = -0.5 * rows.weight * (pieces.variance * bent_below + pull * curved_below)
        of_upper = rows.weight * pieces.upper + indirect_above
        of_lower = -rows.weight * pieces.lower + indirect_below
        total = rows.sets * rows.cuts
        sums = np.bincount(rows.upper, of_upper, total + 2) + np.bincount(rows.lower, of_lower, total + 2)
        scales = pieces.scale.copy()
        for f, code in enumerate(intercepts.codes):
            own = sds[f] * intercepts.part(mode.values, f)
            scales[f] -= np.bincount(code, indirect_above + indirect_below, own.size) @ own
            scales[f] -= 0.5 * intercepts.part(pieces.pull, f) @ intercepts.part(mode.values, f)
        return sums[:total].astype(float), -of_upper - of_lower, scales
