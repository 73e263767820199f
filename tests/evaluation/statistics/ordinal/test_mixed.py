import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, optimize, special, stats

from evaluation.errors import DataError, EvaluationError, InsufficientDataError
from evaluation.statistics.ordinal.fixed import cumulative_logit
from evaluation.statistics.ordinal.mixed import cumulative_logit_mixed

# As in test_ordinal.
WINE = [int(c) for c in "233444551213235423325544323232532343333332322454112223232223333412323244"]
TREATMENTS = np.column_stack([np.tile([0, 0, 0, 0, 1, 1, 1, 1], 9), np.tile([0, 0, 1, 1, 0, 0, 1, 1], 9)])
JUDGES = np.repeat(list("ABCDEFGHI"), 8)
BOTTLES = np.tile(np.arange(8), 9)

# Contagious bovine pleuropneumonia: herd, period, new cases, herd's size. Lesnoff et al. (2004), Prev. Vet. Med. 64:5,
# as in the R package lme4.
CATTLE = [
    *[(1, 1, 2, 14), (1, 2, 3, 12), (1, 3, 4, 9), (1, 4, 0, 5), (2, 1, 3, 22), (2, 2, 1, 18), (2, 3, 1, 21)],
    *[(3, 1, 8, 22), (3, 2, 2, 16), (3, 3, 0, 16), (3, 4, 2, 20), (4, 1, 2, 10), (4, 2, 0, 10), (4, 3, 2, 9)],
    *[(4, 4, 0, 6), (5, 1, 5, 18), (5, 2, 0, 25), (5, 3, 0, 24), (5, 4, 1, 4), (6, 1, 3, 17), (6, 2, 0, 17)],
    *[(6, 3, 0, 18), (6, 4, 1, 20), (7, 1, 8, 16), (7, 2, 1, 10), (7, 3, 3, 9), (7, 4, 0, 5), (8, 1, 12, 34)],
    *[(9, 1, 2, 9), (9, 2, 0, 6), (9, 3, 0, 8), (9, 4, 0, 6), (10, 1, 1, 22), (10, 2, 1, 22), (10, 3, 0, 18)],
    *[(10, 4, 2, 22), (11, 1, 0, 25), (11, 2, 5, 27), (11, 3, 3, 22), (11, 4, 1, 22), (12, 1, 2, 10), (12, 2, 1, 8)],
    *[(12, 3, 0, 6), (12, 4, 0, 5), (13, 1, 1, 21), (13, 2, 2, 24), (13, 3, 0, 19), (13, 4, 0, 23), (14, 1, 11, 19)],
    *[(14, 2, 0, 2), (14, 3, 0, 3), (14, 4, 0, 2), (15, 1, 1, 19), (15, 2, 1, 15), (15, 3, 1, 15), (15, 4, 0, 15)],
]


def simulated(raters, stimuli, *, sds, seed, effect=1.0):
    """Answers in five categories of each rater to each stimulus, and a predictor."""
    random = np.random.default_rng(seed)
    rater, stimulus = (grid.ravel() for grid in np.meshgrid(np.arange(raters), np.arange(stimuli), indexing="ij"))
    x = random.normal(size=rater.size)
    latent = effect * x + sds[0] * random.normal(size=raters)[rater] + sds[1] * random.normal(size=stimuli)[stimulus]
    y = np.digitize(latent + random.logistic(size=rater.size), [-2, -0.5, 0.5, 2])
    return y, x[:, None], rater, stimulus


def log_rows(found, y, x, intercepts):
    """Log-probabilities of the answers under an estimated model, from plain differences of distribution functions."""
    ends = np.array([-np.inf, *(one.estimate for one in found.thresholds), np.inf])
    eta = np.asarray(x) @ [one.estimate for one in found.coefficients] + intercepts
    place = np.searchsorted(found.categories, y)
    return np.log(special.expit(ends[place + 1] - eta) - special.expit(ends[place] - eta))


class TestWine:
    """Published: ``clmm(rating ~ temp + contact + (1 | judge), data = wine)``, vignette and manual of ordinal."""

    found = cumulative_logit_mixed(WINE, TREATMENTS, [("judge", JUDGES)], names=["warm", "contact"])

    def test_laplace(self):
        assert [one.estimate for one in self.found.coefficients] == pytest.approx([3.06300, 1.83488], rel=2e-5)
        assert [one.se for one in self.found.coefficients] == pytest.approx([0.59538, 0.51253], rel=1e-4)
        published = [-1.62367, 1.51337, 4.22853, 6.08877]
        assert [one.estimate for one in self.found.thresholds] == pytest.approx(published, abs=5e-5)
        assert self.found.random_sds == {"judge": pytest.approx(1.13113, rel=2e-5)}
        assert self.found.loglik == pytest.approx(-81.56541, abs=5e-6)
        assert self.found.aic == pytest.approx(177.13, abs=0.005)
        assert (self.found.converged, self.found.singular, self.found.flags) == (True, False, ())
        assert (self.found.groups, self.found.parameters) == ({"judge": 9}, 7)

    def test_quadrature(self):
        found = cumulative_logit_mixed(WINE, TREATMENTS, [("judge", JUDGES)], nodes=10)
        assert [one.estimate for one in found.coefficients] == pytest.approx([3.06189, 1.83343], rel=1e-5)
        assert found.random_sds["judge"] == pytest.approx(1.13478, rel=1e-5)
        assert found.loglik == pytest.approx(-81.53246, abs=5e-6)

    def test_bottles_differ_no_more_than_treatments_say(self):
        """The fit with bottles as well is singular, and that without them (manual of clmm: variance 0 of bottles)."""
        found = cumulative_logit_mixed(WINE, TREATMENTS, [("bottle", BOTTLES), ("judge", JUDGES)])
        assert found.random_sds["bottle"] == 0
        assert found.random_sds["judge"] == pytest.approx(self.found.random_sds["judge"], rel=1e-6)
        assert found.loglik == pytest.approx(self.found.loglik, abs=1e-8)
        assert found.singular
        assert found.parameters == 8
        assert "Singular fit: on its boundary, 0, is the spread of bottle" in found.summary()

    def test_words_and_tables(self):
        assert self.found.apa().startswith("warm: OR = 21.39, 95% CI [6.66, 68.71], z = 5.14, p < .001; contact: ")
        frame = self.found.to_frame()
        assert frame["kind"].tolist() == ["threshold"] * 4 + ["coefficient"] * 2 + ["random sd"]
        assert frame["estimate"].iloc[-1] == self.found.random_sds["judge"]


def test_two_categories_are_the_logistic_mixed_model():
    """Published: ``glmer(cbind(incidence, size - incidence) ~ period + (1 | herd), binomial, cbpp)`` in lme4's manual.

    Its search ends at about three digits, and its printed standard errors are not quite those of the full Hessian.
    """
    y, herds, periods = [], [], []
    for herd, period, cases, size in CATTLE:
        y += [1] * cases + [0] * (size - cases)
        herds += [herd] * size
        periods += [period] * size
    found = cumulative_logit_mixed(y, np.equal.outer(periods, [2, 3, 4]).astype(float), [("herd", herds)])
    assert found.thresholds[0].estimate == pytest.approx(1.3983, abs=1e-3)
    assert found.thresholds[0].se == pytest.approx(0.2312, rel=0.02)
    assert [one.estimate for one in found.coefficients] == pytest.approx([-0.9919, -1.1282, -1.5797], abs=1e-3)
    assert [one.se for one in found.coefficients] == pytest.approx([0.3032, 0.3228, 0.4220], rel=0.02)
    assert found.random_sds["herd"] == pytest.approx(0.6421, abs=1e-3)
    ways = sum(math.log(math.comb(size, cases)) for _, _, cases, size in CATTLE)
    assert found.loglik + ways == pytest.approx(-92.0, abs=0.05)


def test_quadrature_is_the_integral():
    y, x, rater, _ = simulated(5, 8, sds=(1.2, 0), seed=3)
    found = cumulative_logit_mixed(y, x, [("rater", rater)], nodes=25)
    sd = found.random_sds["rater"]
    assert sd > 0.3
    total = 0.0
    for one in range(5):
        mine = rater == one

        def integrand(u, mine=mine):
            return math.exp(log_rows(found, y[mine], x[mine], sd * u).sum()) * stats.norm.pdf(u)

        total += math.log(integrate.quad(integrand, -9, 9, epsabs=1e-14)[0])
    assert found.loglik == pytest.approx(total, abs=1e-7)


def dense_laplace(found, y, x, factors):
    """Laplace's approximation with the whole Hessian, by finite differences at a mode that a library finds."""
    design = np.hstack([found.random_sds[name] * np.equal.outer(codes, np.unique(codes)) for name, codes in factors])

    def loss(u):
        return 0.5 * u @ u - log_rows(found, y, x, design @ u).sum()

    def slope(u):
        ends = np.array([-np.inf, *(one.estimate for one in found.thresholds), np.inf])
        eta = x @ [one.estimate for one in found.coefficients] + design @ u
        upper, lower = special.expit(ends[y + 1] - eta), special.expit(ends[y] - eta)
        return u - design.T @ (upper + lower - 1)

    mode = optimize.minimize(loss, np.zeros(design.shape[1]), jac=slope, method="BFGS", options={"gtol": 1e-9}).x
    steps = 1e-5 * np.eye(mode.size)
    hessian = np.array([(slope(mode + step) - slope(mode - step)) / 2e-5 for step in steps])
    return -loss(mode) - 0.5 * np.linalg.slogdet(hessian)[1]


@pytest.mark.parametrize("third", [False, True])
def test_crossed_factors_have_the_dense_approximation_at_its_maximum(third):
    y, x, rater, stimulus = simulated(7, 9, sds=(1, 0.8), seed=5)
    factors = [("rater", rater), ("stimulus", stimulus)]
    if third:
        factors.append(("session", rater % 3 + 3 * (stimulus % 2)))
        y = np.clip(y + (factors[2][1] % 3 == 0), 0, 4)
    found = cumulative_logit_mixed(y, x, factors)
    assert not found.singular
    top = dense_laplace(found, y, x, factors)
    assert found.loglik == pytest.approx(top, abs=1e-6)
    # Steps to either side lose the same: the slope is 0.
    for name in found.random_sds:
        sides = []
        for factor in (0.98, 1.02):
            moved = dict(found.random_sds) | {name: found.random_sds[name] * factor}
            sides.append(dense_laplace(replace(found, random_sds=moved), y, x, factors))
        assert max(sides) < top
        assert sides[0] == pytest.approx(sides[1], abs=1e-3)


def test_standard_errors_hold_in_simulation():
    estimates, ses = [], []
    for seed in range(15):
        y, x, rater, stimulus = simulated(10, 8, sds=(1, 0.7), seed=seed, effect=0.8)
        (one,) = cumulative_logit_mixed(y, x, [("rater", rater), ("stimulus", stimulus)]).coefficients
        estimates.append(one.estimate)
        ses.append(one.se)
    assert np.mean(estimates) == pytest.approx(0.8, abs=0.15)
    assert np.std(estimates) == pytest.approx(np.mean(ses), rel=0.5)


@given(st.randoms(use_true_random=False), st.floats(-1e6, 1e6), st.sampled_from([1e-3, 1.0, 1e3]))
@settings(max_examples=4, deadline=None)
def test_order_labels_shifts_and_units_do_not_matter(random, shift, unit):
    y, x, rater, stimulus = simulated(5, 6, sds=(1, 1), seed=9)
    order = list(range(y.size))
    random.shuffle(order)
    one = cumulative_logit_mixed(y, x, [("rater", rater), ("stimulus", stimulus)])
    words = np.array([f"s{code}" for code in stimulus])
    other = cumulative_logit_mixed(
        y[order], (x[order] + shift) * unit, [("stimulus", words[order]), ("rater", rater[order])]
    )
    assert other.loglik == pytest.approx(one.loglik, abs=1e-6)
    assert other.coefficients[0].estimate * unit == pytest.approx(one.coefficients[0].estimate, rel=1e-4)
    assert other.random_sds["rater"] == pytest.approx(one.random_sds["rater"], abs=1e-3)


def test_raters_that_do_not_differ_leave_the_simple_model():
    y, x, rater, _ = simulated(6, 20, sds=(0, 0), seed=4)
    # Every rater gives the same answers.
    y, x = np.tile(y[:20], 6), np.tile(x[:20], (6, 1))
    found = cumulative_logit_mixed(y, x, [("rater", rater)])
    simple = cumulative_logit(y, x)
    assert found.random_sds == {"rater": 0}
    assert found.singular
    assert found.loglik == pytest.approx(simple.loglik)
    assert found.coefficients[0].estimate == pytest.approx(simple.coefficients[0].estimate)
    assert found.coefficients[0].se == pytest.approx(simple.coefficients[0].se)


class TestBadData:
    y = (1, 2, 3, 1, 2, 3, 2, 2)
    x = ((0,), (0,), (0,), (1,), (1,), (1,), (0,), (1,))

    @pytest.mark.parametrize(
        ("random", "options", "error", "message"),
        [
            ([], {}, DataError, "at least one random factor"),
            ([("a", "aabbaabb"), ("a", "abababab")], {}, DataError, "name of its own"),
            ([("a", [1, 1, 2, 2, 1, 1, 2, None])], {}, DataError, "place 7"),
            ([("a", [1, 1, 2])], {}, DataError, "3 labels for 8"),
            ([("rater", [1] * 8)], {}, InsufficientDataError, "only one rater"),
            ([("rater", range(8))], {}, InsufficientDataError, "single answer"),
            ([("a", "aabbaabb"), ("b", "abababab")], {"nodes": 5}, DataError, "exactly one random factor"),
            ([("a", "aabbaabb")], {"nodes": 0}, DataError, "nodes is 0"),
            ([("a", "aabbaabb")], {"nodes": 2.5}, DataError, "nodes is 2.5"),
            ([("a", "aabbaabb")], {"confidence": 1}, DataError, "confidence"),
        ],
    )
    def test_it_is_refused(self, random, options, error, message):
        factors = [(name, list(labels)) for name, labels in random]
        with pytest.raises(error, match=message):
            cumulative_logit_mixed(self.y, self.x, factors, **options)

    def test_levels_that_separate_the_answers_are_refused(self):
        rater = np.repeat(np.arange(8), 6)
        with pytest.raises(InsufficientDataError, match="intercepts of rater exceeds 20"):
            cumulative_logit_mixed(rater // 2, np.tile([[0], [1]], (24, 1)), [("rater", rater)])

    def test_predictors_that_separate_the_answers_are_refused(self):
        x = np.repeat([0, 1], 4)[:, None]
        with pytest.raises(InsufficientDataError, match="separated perfectly by x1"):
            cumulative_logit_mixed([1, 2, 1, 1, 2, 2, 2, 2], x, [("rater", list("aabbaabb"))])


@given(st.integers(0, 10**6), st.sampled_from([0, 0.3, 6]), st.integers(1, 4), st.integers(1, 4), st.integers(1, 2))
@settings(max_examples=25, deadline=None)
def test_any_data_gives_numbers_or_a_sentence(seed, sd, raters, stimuli, factors):
    y, x, rater, stimulus = simulated(raters, stimuli, sds=(sd, 0), seed=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = cumulative_logit_mixed(y, x, [("rater", rater), ("stimulus", stimulus)][:factors])
        except EvaluationError as error:
            assert str(error).endswith(".")
            return
    numbers = [value for one in found.coefficients for value in (one.estimate, one.se, one.p)]
    assert np.isfinite([*numbers, *found.random_sds.values()]).all() or found.flags
    # What random intercepts explain can only help.
    assert found.loglik >= cumulative_logit(y, x).loglik - 1e-4
