"""min F', from the analyses by rater and by stimulus."""

import numpy as np
import pytest
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.min_f import min_f
from evaluation.statistics.repeated_measures import repeated_measures


def analysis(units: int, conditions: int, seed: int) -> object:
    rng = np.random.default_rng(seed)
    return repeated_measures(rng.normal(size=(units, conditions)) + np.arange(conditions))


def test_it_follows_the_formula_of_clark() -> None:
    by_rater, by_stimulus = analysis(15, 3, 1), analysis(20, 3, 2)
    found = min_f(by_rater, by_stimulus)
    f1, f2 = by_rater.F, by_stimulus.F
    assert pytest.approx(f1 * f2 / (f1 + f2)) == found.F
    assert found.df1 == 2
    # n is the error's degrees of freedom of the analysis by rater, 28, m those by stimulus, 38.
    assert found.df2 == pytest.approx((f1 + f2) ** 2 / (f1**2 / 38 + f2**2 / 28))
    assert found.p == pytest.approx(stats.f.sf(found.F, 2, found.df2))
    assert min(f1, f2) > found.F
    assert found.apa().startswith("min F′(2, ")
    assert found.to_frame().iloc[0].to_dict() == {"F": found.F, "df1": 2, "df2": found.df2, "p": found.p}


def test_it_needs_two_analyses_of_the_same_conditions_that_differ() -> None:
    with pytest.raises(DataError, match="different numbers of conditions"):
        min_f(analysis(15, 3, 1), analysis(20, 4, 2))
    rng = np.random.default_rng(1)
    rest = rng.normal(size=(6, 1)) + np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0]])[[0, 1, 2, 0, 1, 2]]
    flat = repeated_measures(rest)
    with pytest.raises(InsufficientDataError, match="no min F′"):
        min_f(flat, flat)
