import numpy as np
import pytest

from synth.errors import SpecError
from synth.expression.pep import check_peps, peps

TABLE_5 = {
    1: ({31, 32, 33, 34, 35, 36}, 34),
    2: ({37, 38}, 37),
    3: ({19, 20, 21, 22}, 20),
    4: ({23, 24}, 23),
    5: ({25, 26}, 25),
    6: ({4, 8, 9, 51, 55, 56}, 9),
    7: ({3, 5, 10, 11, 52, 57, 58}, 58),
    8: ({12, 13, 59, 60}, 12),
    9: ({6, 7, 53, 54}, 6),
}


def test_table_5():
    # MTAP 2013, Table 5: FAP subsets with the key FAP in parentheses.
    assert {pep.pep: (set(pep.faps), pep.key) for pep in peps()} == TABLE_5


def test_37_distinct_faps():
    # MTAP 2013, section 4.2: "the 37 FAPs in Table 5".
    numbers = [fap for pep in peps() for fap in pep.faps]
    assert len(numbers) == len(set(numbers)) == 37


def test_order_is_by_number():
    assert [pep.pep for pep in peps()] == list(range(1, 10))


def test_values_are_checked():
    with pytest.raises(SpecError, match=r"\(N, 9\)"):
        check_peps(np.zeros((3, 8)))
    with pytest.raises(SpecError, match="PEP 2 in row 0"):
        check_peps(np.array([[0, np.inf, 0, 0, 0, 0, 0, 0, 0]]))
