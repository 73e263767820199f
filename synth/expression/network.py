"""The neural networks of MTAP 2013: one for each PEP, three inputs, one hidden layer of tanh units, a linear output."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.levenberg_marquardt import State
from synth.expression.pad_pep import bounded
from synth.expression.samples import check_pad, digest

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

INPUTS = 3


def parameter_count(hidden: int) -> int:
    """Return how many weights and biases a network with so many hidden units has: ``5 H + 1``."""
    return (INPUTS + 2) * hidden + 1


@dataclass(frozen=True, eq=False)
class NetworkModel:
    """K networks side by side (MTAP 2013, Eqs. 8-11): ``PEP_j = w2_j tanh(W1_j E + b1_j) + b2_j``.

    Attributes
    ----------
    W1 : (K, H, 3) float64
        Weights of the hidden layer.
    b1 : (K, H) float64
        Its biases.
    w2 : (K, H) float64
        Weights of the output layer.
    b2 : (K,) float64
        Its biases.
    """

    W1: Floats
    b1: Floats
    w2: Floats
    b2: Floats

    @classmethod
    def of(cls, W1: Floats, b1: Floats, w2: Floats, b2: Floats) -> Self:
        """Make a model of weights and biases.

        Raises
        ------
        SpecError
            If their shapes do not belong together, or one is not a finite number.
        """
        arrays = [np.asarray(part, dtype=np.float64) for part in (W1, b1, w2, b2)]
        outputs, hidden = arrays[1].shape if arrays[1].ndim == 2 else (0, 0)
        shapes = [(outputs, hidden, INPUTS), (outputs, hidden), (outputs, hidden), (outputs,)]
        if not outputs or not hidden or [part.shape for part in arrays] != shapes:
            raise SpecError(
                f"Network: W1, b1, w2, b2 have the shapes {[part.shape for part in arrays]}, "
                "but must be (K, H, 3), (K, H), (K, H), (K,)."
            )
        if not all(np.isfinite(part).all() for part in arrays):
            raise SpecError("Network: a weight or bias is not a finite number.")
        return cls(*arrays)

    @classmethod
    def of_parameters(cls, params: Floats) -> Self:
        """Make a model of parameter vectors (K, 5 H + 1), one for each output, as `Networks` orders them."""
        hidden = (params.shape[1] - 1) // (INPUTS + 2)
        first = params[:, : INPUTS * hidden].reshape(len(params), INPUTS, hidden).transpose(0, 2, 1)
        b1, w2 = params[:, INPUTS * hidden : -1].reshape(len(params), 2, hidden).transpose(1, 0, 2)
        return cls.of(first, b1, w2, params[:, -1])

    @property
    def digest(self) -> str:
        """Sha-256 of the weights and biases."""
        return digest("network", self.W1, self.b1, self.w2, self.b2)

    @property
    def hidden(self) -> int:
        """Number of hidden units, H."""
        return int(self.b1.shape[1])

    def predict(self, pad: NDArray[np.floating] | Floats) -> Floats:
        """Return the outputs (N, K), clipped to [-1, 1], of PAD values (N, 3)."""
        activations = np.tanh(np.einsum("khi,ni->nkh", self.W1, check_pad(pad)) + self.b1)
        return bounded(np.einsum("nkh,kh->nk", activations, self.w2) + self.b2)


class Networks:
    """Least-squares problems of many networks of one size, for `synth.expression.levenberg_marquardt.minimise`.

    Parameters
    ----------
    inputs : sequence of (N_f, 3)
        The inputs of each training part; the parts may differ in length.
    outputs : sequence of (N_f,)
        The wanted outputs of each network.
    parts : sequence of int
        Which training part each network has.
    hidden : int
        Number of hidden units.

    Notes
    -----
    The parameters of a network are, in this order, the weights of the three inputs (H each), the hidden biases (H), the
    output weights (H) and the output bias.
    """

    def __init__(
        self, inputs: Sequence[Floats], outputs: Sequence[Floats], parts: Sequence[int], *, hidden: int
    ) -> None:
        self.hidden = hidden
        self._part = np.asarray(parts, dtype=np.int64)
        shortest, longest = (end(len(part) for part in inputs) for end in (min, max))
        self._inputs = np.zeros((len(inputs), INPUTS, longest))
        self._wanted = np.zeros((len(outputs), longest))
        self._counts = np.zeros((len(inputs), 1, longest))
        for k, part in enumerate(inputs):
            self._inputs[k, :, : len(part)] = part.T
            self._counts[k, :, : len(part)] = 1.0
        for k, wanted in enumerate(outputs):
            self._wanted[k, : len(wanted)] = wanted
        # Only what lies beyond the shortest part has to be masked.
        self._tail = slice(shortest, longest)
        self._even = shortest == longest

    def outputs(self, params: Floats, which: Indices) -> tuple[Floats, Floats]:
        """Return outputs (B, N) and hidden activations (B, H, N) of parameters (B, P)."""
        H = self.hidden
        first = params[:, : INPUTS * H].reshape(-1, INPUTS, H).transpose(0, 2, 1)
        hidden = np.matmul(first, self._inputs[self._part[which]])
        hidden += params[:, INPUTS * H : (INPUTS + 1) * H, None]
        np.tanh(hidden, out=hidden)
        result = np.matmul(params[:, None, (INPUTS + 1) * H : -1], hidden)[:, 0] + params[:, -1:]
        return result, hidden

    def residuals(self, params: Floats, which: Indices) -> tuple[Floats, State]:
        """Return outputs minus wanted outputs (B, N), 0 where a training part has no sample, and the activations."""
        result, hidden = self.outputs(params, which)
        result -= self._wanted[which]
        if not self._even:
            result[:, self._tail] *= self._counts[self._part[which], 0, self._tail]
        return result, (hidden,)

    def jacobian(self, params: Floats, which: Indices, state: State) -> Floats:
        """Return the derivatives (B, P, N) of the residuals."""
        (hidden,) = state
        H, part = self.hidden, self._part[which]
        result = np.empty((len(params), parameter_count(H), hidden.shape[2]))
        biases, weights = result[:, INPUTS * H : (INPUTS + 1) * H], result[:, (INPUTS + 1) * H : -1]
        np.multiply(hidden, hidden, out=biases)
        np.subtract(1.0, biases, out=biases)
        biases *= params[:, (INPUTS + 1) * H : -1, None]
        weights[:] = hidden
        result[:, -1] = 1.0
        if not self._even:
            result[:, INPUTS * H :, self._tail] *= self._counts[part, :, self._tail]
        inputs = self._inputs[part]
        for k in range(INPUTS):
            np.multiply(biases, inputs[:, k : k + 1], out=result[:, k * H : (k + 1) * H])
        return result

    def errors(self, params: Floats, which: Indices) -> Floats:
        """Return the sum of squared residuals (B,)."""
        residuals, _ = self.residuals(params, which)
        return np.asarray(np.einsum("bn,bn->b", residuals, residuals))


def start_parameters(hidden: int, level: float, rng: np.random.Generator) -> Floats:
    """Draw first parameters (5 H + 1,): hidden units whose slopes lie across the inputs' range.

    Parameters
    ----------
    hidden : int
        Number of hidden units, at least 1.
    level : float
        First output bias, usually the mean of the wanted outputs.
    rng : numpy.random.Generator
        Source of chance.

    References
    ----------
    Nguyen and Widrow 1990, Improving the learning speed of 2-layer neural networks, for inputs in [-1, 1].
    """
    steepness = 0.7 * hidden ** (1.0 / INPUTS)
    directions = rng.normal(size=(INPUTS, hidden))
    directions *= steepness / np.linalg.norm(directions, axis=0)
    biases = rng.uniform(-steepness, steepness, hidden)
    weights = rng.uniform(-0.5, 0.5, hidden) / math.sqrt(hidden)
    return np.concatenate([directions.reshape(-1), biases, weights, [level]])
