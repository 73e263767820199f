import numpy as np
import pytest
from scipy import stats

from evaluation.statistics.mixed.satterthwaite import Satterthwaite


def two_groups(n=(8, 15), variances=(4.0, 1.0)):
    """Two means with variances of their own: the case that Satterthwaite and Welch solved."""
    variances, n = np.array(variances), np.array(n)
    slopes = np.zeros((2, 2, 2))
    slopes[[0, 1], [0, 1], [0, 1]] = 1 / n
    # The deviance's second derivative by a variance v estimated from n - 1 degrees of freedom is (n - 1) / v^2.
    hessian = np.diag((n - 1) / variances**2)
    return Satterthwaite(beta=np.array([3.0, 1.5]), vcov=np.diag(variances / n), slopes=slopes, hessian=hessian)


def test_two_means_give_welchs_test():
    found = two_groups().coefficient([1, -1], name="difference", confidence=0.95)
    t, p = stats.ttest_ind_from_stats(3.0, 2.0, 8, 1.5, 1.0, 15, equal_var=False)
    assert (found.t, found.p) == (pytest.approx(t), pytest.approx(p))
    # Welch-Satterthwaite.
    assert found.df == pytest.approx((4 / 8 + 1 / 15) ** 2 / ((4 / 8) ** 2 / 7 + (1 / 15) ** 2 / 14))
    assert found.ci[1] - found.estimate == pytest.approx(stats.t.ppf(0.975, found.df) * found.se)


def test_an_f_test_merges_the_degrees_of_freedom_of_its_parts():
    tests = two_groups()
    found = tests.f_test(np.eye(2), name="both")
    assert pytest.approx((3.0**2 / 0.5 + 1.5**2 * 15) / 2) == found.F
    mean = 7 / 5 + 14 / 12
    assert found.df2 == pytest.approx(2 * mean / (mean - 2))
    assert tests.f_test([[1, 0], [2, 0]], name="one").df1 == 1
    one, t = tests.f_test([[1, -1]], name="one"), tests.coefficient([1, -1], name="one", confidence=0.9)
    assert (one.F, one.df2, one.p) == (pytest.approx(t.t**2), pytest.approx(t.df), pytest.approx(t.p))
    assert one.to_frame()["F"].tolist() == [one.F]


def test_an_f_test_with_hardly_any_degrees_of_freedom():
    assert two_groups(n=(3, 15)).f_test(np.eye(2), name="both").df2 == 2


def test_holm():
    found = two_groups().contrasts([[1, 0], [0, 1], [1, -1]], names=["a", "b", "c"], confidence=0.95)
    p = {one.name: one.p for one in found}
    order = sorted(p, key=p.__getitem__)
    expected = 0.0
    for steps, name in zip((3, 2, 1), order, strict=True):
        expected = max(expected, steps * p[name])
        assert next(one for one in found if one.name == name).p_holm == pytest.approx(expected)


def test_directions_in_which_the_deviance_is_flat_do_not_count():
    tests = two_groups()
    flat = Satterthwaite(beta=tests.beta, vcov=tests.vcov, slopes=tests.slopes, hessian=np.diag([7 / 16, 0.0]))
    assert flat.df(np.array([1.0, 0.0])) == pytest.approx(7)
    assert flat.estimate([1, 0], name="a", confidence=0.95).df == pytest.approx(7)
