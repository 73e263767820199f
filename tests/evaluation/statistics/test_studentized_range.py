import numpy as np
import pytest
from scipy import stats

from evaluation.errors import DataError
from evaluation.statistics.studentized_range import quantile, upper_tail


@pytest.mark.parametrize(("groups", "df"), [(2, 1.0), (3, 27), (3, 2.5), (6, 66), (10, 14.3), (30, 300)])
def test_as_scipy(groups, df):
    q = np.array([1e-3, 0.5, 2, 4, 6, 9])
    assert upper_tail(q, groups, df) == pytest.approx(stats.studentized_range.sf(q, groups, df), rel=1e-8, abs=1e-11)
    assert quantile(0.95, groups, [df]) == pytest.approx([stats.studentized_range.ppf(0.95, groups, df)], rel=1e-8)


def test_two_groups_are_student_s_t():
    for df in (1, 4.5, 300, 1e7):
        q = np.array([0.01, 1, 5, 20])
        assert upper_tail(q, 2, df) == pytest.approx(2 * stats.t.sf(q / np.sqrt(2), df), rel=1e-9)


def test_published_quantiles():
    # Harter (1960), Annals of Mathematical Statistics 31:1122, upper 5 and 1 % points.
    assert quantile(0.95, 3, [10])[0] == pytest.approx(3.877, abs=5e-4)
    assert quantile(0.95, 10, [20])[0] == pytest.approx(5.008, abs=5e-4)
    assert quantile(0.99, 5, [5])[0] == pytest.approx(8.421, abs=5e-4)


def test_probabilities_and_quantiles_go_together_in_any_shape():
    df = np.array([[1.0, 3.3], [20.0, 1e5]])
    found = quantile(0.9, 7, df)
    assert found.shape == df.shape
    assert upper_tail(found, 7, df) == pytest.approx(np.full((2, 2), 0.1), rel=1e-9)
    assert upper_tail([], 3, 5).size == 0
    assert upper_tail(0.0, 3, 5) == pytest.approx(1)
    assert 0 <= upper_tail(1e6, 3, 500) < 1e-100


@pytest.mark.parametrize(("groups", "df"), [(1, 5), (3, 0.5), (3, np.nan)])
def test_what_has_no_range_is_refused(groups, df):
    with pytest.raises(DataError):
        upper_tail(1.0, groups, df)
