import numpy as np
import pytest

from synth.errors import SpecError
from synth.expression.pep import ACII, check_peps, codes, peps
from synth.fap.table import faps

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
    assert {int(pep.code): (set(pep.faps), pep.key) for pep in peps()} == TABLE_5


def test_37_distinct_faps():
    # MTAP 2013, section 4.2: "the 37 FAPs in Table 5".
    numbers = [fap for pep in peps() for fap in pep.faps]
    assert len(numbers) == len(set(numbers)) == 37


def test_order_is_by_number():
    assert codes() == tuple("123456789")


ACII_TABLE_2 = {
    "1.1": (33, {33, 31, 35, 34, 32, 36}),
    "1.2": (37, {37, 38}),
    "1.3": (31, {31, 35, 33, 32, 36, 34}),
    "2.1": (19, {19, 21, 20, 22}),
    "2.2": (23, {23, 24}),
    "2.3": (25, {25, 26}),
    "3.1": (5, {5, 10, 11, 52, 57, 58, 4, 8, 9, 51, 55, 56}),
    "3.2": (12, {12, 13, 59, 60}),
    "3.3": (16, {16, 17}),
    "3.4": (6, {6, 7, 53, 54}),
    "4.1": (3, {3}),
    "4.2": (15, {15}),
}


def test_acii_table_2():
    # The paper names the left key of each pair, and the FAPs of both sides together.
    found = {}
    for pep in peps(ACII):
        _, group = found.setdefault(pep.code.rstrip("LR"), (pep.key, set()))
        group.update(pep.faps)
    assert found == ACII_TABLE_2
    assert len(peps(ACII)) == 18


def test_acii_sides_mirror_each_other():
    by_code = {pep.code: pep for pep in peps(ACII)}
    for code, pep in by_code.items():
        if code.endswith("L"):
            other = by_code[code[:-1] + "R"]
            assert tuple(faps()[fap].mirror for fap in pep.faps) == other.faps
            assert faps()[pep.key].mirror == other.key


def test_unknown_scheme():
    with pytest.raises(SpecError, match="acii2007"):
        peps("candide")


def test_values_are_checked():
    with pytest.raises(SpecError, match=r"\(N, 9\)"):
        check_peps(np.zeros((3, 8)))
    with pytest.raises(SpecError, match="PEP 2 in row 0"):
        check_peps(np.array([[0, np.inf, 0, 0, 0, 0, 0, 0, 0]]))
