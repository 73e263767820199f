import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.network import NetworkModel, Networks, parameter_count, start_parameters

sizes = st.integers(1, 6)


def some(seed, hidden, count=4):
    rng = np.random.default_rng(seed)
    return np.stack([start_parameters(hidden, 0.1, rng) for _ in range(count)]), rng


@given(st.integers(0, 2**32 - 1), sizes)
def test_equation_8(seed, hidden):
    params, rng = some(seed, hidden)
    model = NetworkModel.of_parameters(params)
    pad = rng.uniform(-1, 1, (5, 3))
    for n, row in enumerate(pad):
        for j in range(4):
            wanted = model.w2[j] @ np.tanh(model.W1[j] @ row + model.b1[j]) + model.b2[j]
            assert model.predict(pad)[n, j] == pytest.approx(np.clip(wanted, -1, 1))


@given(st.integers(0, 2**32 - 1), sizes)
def test_problem_and_model_agree(seed, hidden):
    params, rng = some(seed, hidden)
    pad = rng.uniform(-1, 1, (7, 3))
    problem = Networks([pad], [np.zeros(7)] * 4, [0] * 4, hidden=hidden)
    outputs, _ = problem.outputs(params, np.arange(4))
    np.testing.assert_allclose(
        np.clip(outputs, -1, 1).T, NetworkModel.of_parameters(params).predict(pad), rtol=1e-12, atol=1e-12
    )


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), sizes)
def test_the_jacobian_is_the_derivative_of_the_residuals(seed, hidden):
    params, rng = some(seed, hidden, count=3)
    parts = [rng.uniform(-1, 1, (n, 3)) for n in (6, 8)]
    problem = Networks(parts, [rng.normal(size=n) for n in (6, 8, 6)], [0, 1, 0], hidden=hidden)
    which = np.arange(3)
    residuals, state = problem.residuals(params, which)
    jacobian = problem.jacobian(params, which, state)
    assert jacobian.shape == (3, parameter_count(hidden), 8)
    for p in range(parameter_count(hidden)):
        moved = params.copy()
        moved[:, p] += 1e-6
        slope = (problem.residuals(moved, which)[0] - residuals) / 1e-6
        np.testing.assert_allclose(jacobian[:, p], slope, atol=1e-4)
    # Parts of other lengths are filled up with nothing.
    assert not residuals[[0, 2], 6:].any()
    assert not jacobian[[0, 2], :, 6:].any()


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_first_weights_use_the_inputs_range(seed, hidden):
    params = start_parameters(hidden, -0.3, np.random.default_rng(seed))
    assert params.shape == (parameter_count(hidden),) == (5 * hidden + 1,)
    weights = params[: 3 * hidden].reshape(3, hidden)
    np.testing.assert_allclose(np.linalg.norm(weights, axis=0), 0.7 * hidden ** (1 / 3))
    assert params[-1] == -0.3


def test_digests_tell_networks_apart():
    params, _ = some(1, 3)
    assert NetworkModel.of_parameters(params).digest != NetworkModel.of_parameters(params + 1e-9).digest


def test_wrong_shapes_are_refused():
    with pytest.raises(SpecError, match=r"\(K, H, 3\)"):
        NetworkModel.of(np.zeros((2, 4, 3)), np.zeros((2, 4)), np.zeros((2, 5)), np.zeros(2))
    with pytest.raises(SpecError, match="finite"):
        NetworkModel.of(np.zeros((1, 1, 3)), np.zeros((1, 1)), np.zeros((1, 1)), np.array([np.nan]))
