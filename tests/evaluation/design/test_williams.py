from collections import Counter
from itertools import pairwise, permutations

import pytest

from evaluation.design.williams import williams_rows
from evaluation.errors import EvaluationError


@pytest.mark.parametrize("n", range(1, 14))
def test_each_condition_is_in_each_place_and_after_each_other_equally_often(n):
    rows = williams_rows(n)
    assert len(rows) == (n if n % 2 == 0 else 2 * n)
    times = len(rows) // n
    assert Counter(place_and_letter for row in rows for place_and_letter in enumerate(row)) == {
        (place, letter): times for place in range(n) for letter in range(n)
    }
    neighbours = Counter(pair for row in rows for pair in pairwise(row))
    assert neighbours == dict.fromkeys(permutations(range(n), 2), times)


def test_the_design_for_four_is_the_published_one():
    # Williams (1949): 1 2 4 3 and its cyclic shifts.
    assert williams_rows(4) == ((0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1))


def test_there_is_no_design_for_nothing():
    with pytest.raises(EvaluationError, match="1 or more conditions, not for 0"):
        williams_rows(0)
