import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from synth.errors import SpecError
from synth.expression.levenberg_marquardt import EXHAUSTED, OVERFITTING, Options, minimise

MODELS = {
    "Misra1a": lambda x, b: b[0] * (1 - np.exp(-b[1] * x)),
    "Hahn1": lambda x, b: (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3),
    "MGH09": lambda x, b: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "Rat43": lambda x, b: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Eckerle4": lambda x, b: (b[0] / b[1]) * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Bennett5": lambda x, b: b[0] * (b[1] + x) ** (-1 / b[2]),
    "DanWood": lambda x, b: b[0] * x ** b[1],
}
# Parameters of very different size need damping in proportion, and the flat valley of Bennett5 many steps.
CERTIFIED = Options(max_iterations=2000, scaled=True, exact=True, tolerance=1e-14)


class Curves:
    """Curves y = f(x; b) that are fitted to data, with derivatives by the complex step, which are exact to rounding."""

    def __init__(self, curve, x, ys):
        self.curve, self.x, self.ys = curve, x, ys

    def residuals(self, params, which):
        return np.stack([self.curve(self.x, b) - self.ys[k] for b, k in zip(params, which, strict=True)]), (params,)

    def jacobian(self, _params, _which, state):
        return np.stack([self._slopes(b) for b in state[0]])

    def _slopes(self, b):
        rows = []
        for k in range(len(b)):
            moved = b.astype(complex)
            moved[k] += 1e-30j
            rows.append(self.curve(self.x, moved).imag / 1e-30)
        return np.stack(rows)


@pytest.mark.parametrize("start", ["start1", "start2"])
@pytest.mark.parametrize("name", MODELS)
def test_nist_certified_values_from_both_starts(nist, name, start):
    data, expected = nist(f"nls_{name}")["data"], nist(f"nls_{name}")["expected"]
    problem = Curves(MODELS[name], np.array(data["x"]), np.array([data["y"]]))
    found = minimise(problem, np.array([data[start]]), options=CERTIFIED)
    np.testing.assert_allclose(found.params[0], expected["params"], rtol=1e-6)
    assert found.sse[0] == pytest.approx(expected["rss"], rel=1e-9)


def line(x, b):
    return b[0] + b[1] * np.tanh(b[2] * x)


@pytest.mark.parametrize("options", [Options(), Options(scaled=True), Options(exact=True), CERTIFIED])
def test_it_finds_what_scipy_finds(options):
    rng = np.random.default_rng(2)
    x = np.linspace(-2, 2, 40)
    y = line(x, (0.3, 1.2, 0.8)) + 0.05 * rng.normal(size=40)
    problem = Curves(line, x, y[None])
    found = minimise(problem, np.array([[0.0, 1.0, 0.5]]), options=options)
    other = least_squares(lambda b: line(x, b) - y, [0.0, 1.0, 0.5], method="lm", xtol=1e-12)
    np.testing.assert_allclose(found.params[0], other.x, rtol=1e-4)
    assert found.sse[0] <= 2 * other.cost * (1 + 1e-7)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6))
def test_a_problem_does_not_depend_on_its_batch(seed, count):
    rng = np.random.default_rng(seed)
    x = np.linspace(-2, 2, 30)
    ys = np.stack([line(x, rng.uniform(0.2, 1.5, 3)) for _ in range(count)]) + 0.05 * rng.normal(size=(count, 30))
    starts = rng.uniform(0.1, 1.0, (count, 3))
    together = minimise(Curves(line, x, ys), starts)
    for k in range(count):
        alone = minimise(Curves(line, x, ys[k : k + 1]), starts[k : k + 1])
        np.testing.assert_allclose(together.params[k], alone.params[0], rtol=1e-9, atol=1e-12)
        assert together.iterations[k] == alone.iterations[0]
        assert together.reasons[k] == alone.reasons[0]


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_sum_of_squares_never_rises(seed):
    rng = np.random.default_rng(seed)
    x = np.linspace(-2, 2, 30)
    y = rng.normal(size=(1, 30))
    start = rng.normal(size=(1, 3))
    problem = Curves(line, x, y)
    last = float((problem.residuals(start, [0])[0] ** 2).sum())
    for steps in (1, 2, 5, 20):
        now = minimise(problem, start, options=Options(max_iterations=steps)).sse[0]
        assert now <= last * (1 + 1e-12)
        last = now


def test_it_stops_early_where_the_validation_part_says_so():
    x = np.linspace(-2, 2, 30)
    problem = Curves(line, x, line(x, (0.3, 1.2, 0.8))[None])
    # The best place for the validation part is where the way begins: each step makes it worse.
    start = np.array([[0.0, 1.0, 0.5]])
    found = minimise(
        problem, start, options=Options(patience=3), validation=lambda b, _: np.linalg.norm(b - start, axis=1)
    )
    assert found.reasons == (OVERFITTING,)
    assert found.iterations[0] == 3
    np.testing.assert_array_equal(found.params, start)


def test_iterations_are_counted_and_limited():
    x = np.linspace(-2, 2, 30)
    found = minimise(
        Curves(line, x, np.sin(9 * x)[None]), np.array([[0.0, 1.0, 3.0]]), options=Options(max_iterations=2)
    )
    assert found.iterations[0] == 2
    assert found.reasons == (EXHAUSTED,)


def test_a_perfect_start_stays():
    x = np.linspace(-2, 2, 30)
    found = minimise(Curves(line, x, line(x, (0.3, 1.2, 0.8))[None]), np.array([[0.3, 1.2, 0.8]]))
    np.testing.assert_allclose(found.params, [[0.3, 1.2, 0.8]])
    assert found.sse[0] == pytest.approx(0.0, abs=1e-25)


def test_wrong_input_is_refused():
    problem = Curves(line, np.zeros(3), np.zeros((1, 3)))
    with pytest.raises(SpecError, match="finite"):
        minimise(problem, np.array([[np.nan, 0, 0]]))
    with pytest.raises(SpecError, match="begin elsewhere"):
        minimise(Curves(line, np.zeros(3), np.full((1, 3), np.inf)), np.zeros((1, 3)))
    for wrong in ({"max_iterations": 0}, {"damping": 0.0}, {"factor": 1.0}, {"tolerance": -1.0}, {"patience": 0}):
        with pytest.raises(SpecError, match="Levenberg-Marquardt"):
            Options(**wrong)
