import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp

from evaluation.errors import DataError
from evaluation.statistics.arrays import centred
from evaluation.statistics.matrices import centred_columns, constant_columns, finite_array

AXES = ("rows", "columns")


def test_numbers_come_back_as_floats():
    found = finite_array([[1, 2], [3, 4]], axes=AXES, name="x")
    assert found.dtype == float
    assert found.tolist() == [[1, 2], [3, 4]]
    assert finite_array(np.empty((0, 2)), axes=AXES, name="x").shape == (0, 2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([1, 2], r"x has the shape \(2,\), but must have rows x columns"),
        ([[1, 2], [3]], "x: these values are not all numbers, or the rows differ in length"),
        ([["a"]], "not all numbers"),
        ([[1, 2], [3, float("nan")]], r"x: 1 of 4 values are missing or infinite \(the first at \[1, 1\]\)"),
        ([[1, float("-inf")]], "missing or infinite"),
        ([[1, None]], "missing or infinite"),
        ([[1, 1e200]], "exceeds 1e"),
    ],
)
def test_what_is_no_table_of_finite_numbers(values, message):
    with pytest.raises(DataError, match=message):
        finite_array(values, axes=AXES, name="x")


@given(hnp.arrays(float, (6, 3), elements={"min_value": -1e6, "max_value": 1e6}))
def test_each_column_is_centred_as_a_vector_is(matrix):
    means, differences = centred_columns(matrix)
    for place in range(3):
        mean, expected = centred(matrix[:, place])
        assert means[place] == pytest.approx(mean, rel=1e-15, abs=1e-15)
        assert differences[:, place] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_columns_that_differ_by_rounding_alone_are_constant():
    matrix = np.array([[0.3, 1e9 + 0.1, 1.0], [0.1 + 0.2, 1e9 + 0.1, 2.0]])
    assert constant_columns(matrix, centred_columns(matrix)[1]).tolist() == [True, True, False]
