"""Whatever the values, each comparison of groups gives an error of its own, or numbers that are numbers."""

import math
import warnings
from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from evaluation.errors import EvaluationError
from evaluation.statistics.anova import one_way, one_way_of_matrix
from evaluation.statistics.assumptions import bartlett, fligner, levene, shapiro, shapiro_residuals
from evaluation.statistics.factorial import two_way
from evaluation.statistics.rank_tests import friedman, kruskal_wallis, mann_whitney, wilcoxon
from evaluation.statistics.repeated_measures import repeated_measures, repeated_measures_by_unit
from evaluation.statistics.t_test import paired_t, student_t, welch_t
from evaluation.statistics.welch import welch

# Ratings, their likes far from zero, and what spoils them.
sound = st.one_of(
    st.integers(1, 5).map(float),
    st.sampled_from([1e6 + 0.1, 1e6 + 0.2, 0.0, 1e-300, -1e139, 1e139, 5e-324, 1e-160]),
    st.floats(-1e9, 1e9),
)
value = st.one_of(sound, st.sampled_from([math.nan, math.inf, -math.inf, 1e300]))
element = st.one_of(st.just(sound), st.just(st.integers(1, 3).map(float)), st.just(value))
vector = element.flatmap(lambda kind: st.lists(kind, max_size=8))
matrix = element.flatmap(lambda kind: hnp.arrays(float, st.tuples(st.integers(0, 7), st.integers(0, 5)), elements=kind))


def equally_long(n):
    """Two vectors of one length."""
    return element.flatmap(lambda kind: st.tuples(*(st.lists(kind, min_size=n, max_size=n),) * 2))


OF_GROUPS = [one_way, welch, levene, bartlett, fligner, shapiro_residuals, kruskal_wallis]
OF_MATRICES = [one_way_of_matrix, friedman, repeated_measures]
OF_PAIRS = [paired_t, student_t, welch_t, mann_whitney, wilcoxon]


def checked(test, *data):
    """Run a test with every warning an error; what it returns has no NaN, and no infinity without a flag."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = test(*data)
        except EvaluationError as error:
            assert str(error).endswith("."), error
            return
        frame = found.to_frame()
        text = found.summary()
    numbers = [getattr(found, field.name) for field in fields(found)]
    numbers = [number for number in numbers if isinstance(number, float)]
    assert not any(math.isnan(number) for number in numbers), found
    assert found.flags or all(math.isfinite(number) for number in numbers), found
    assert 0 <= getattr(found, "p", 0) <= 1
    assert "nan" not in text
    assert len(frame) >= 1


@pytest.mark.parametrize("test", OF_GROUPS)
@given(groups=st.lists(vector, max_size=4))
@settings(max_examples=25, deadline=None)
def test_groups(test, groups):
    checked(test, {str(number): values for number, values in enumerate(groups)})


@pytest.mark.parametrize("test", OF_MATRICES)
@given(table=matrix)
@settings(max_examples=25, deadline=None)
def test_matrices(test, table):
    checked(test, table)


@pytest.mark.parametrize("test", OF_PAIRS)
@given(pairs=st.one_of(st.tuples(vector, vector), st.integers(0, 8).flatmap(equally_long)))
@settings(max_examples=25, deadline=None)
def test_pairs(test, pairs):
    checked(test, *pairs)


@given(vector)
@settings(max_examples=25, deadline=None)
def test_one_vector(values):
    checked(shapiro, values)


@given(vector, st.lists(st.integers(0, 2), min_size=8, max_size=8), st.lists(st.integers(0, 2), min_size=8, max_size=8))
@settings(max_examples=25, deadline=None)
def test_long_tables(values, first, second):
    n = len(values)
    for ss_type in (1, 2, 3):
        checked(lambda *data, ss_type=ss_type: two_way(*data, ss_type=ss_type), values, first[:n], second[:n])
    checked(repeated_measures_by_unit, values, first[:n], second[:n])
