import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.pep import ACII, MTAP, codes, peps
from synth.expression.pep_fap import PepFapModel, pep_to_fap, template
from synth.fap.table import column, faps, mirrored

values = st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9).map(lambda row: np.array([row]))


def _fap(pep, value):
    row = np.zeros((1, 9))
    row[0, pep - 1] = value
    return {k + 1: v for k, v in enumerate(pep_to_fap(row)[0]) if v}


@pytest.mark.parametrize("pep", peps(), ids=lambda pep: pep.name)
@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_a_pep_moves_its_own_faps_and_no_other(pep, value):
    one_way = {fap for fap in pep.faps if not faps()[fap].two_way}
    assert set(_fap(int(pep.code), value)) == set(pep.faps) - (one_way if value < 0 else set())


@pytest.mark.parametrize(
    ("pep", "signs"),
    [
        (1, {31: 1, 34: 1, 36: 1}),
        (2, {37: 1, 38: 1}),
        # Lids: a positive FAP closes, so the opening PEP has to be negative.
        (3, {19: -1, 20: -1, 21: -1, 22: -1}),
        (4, {23: 1, 24: 1}),
        (5, {25: 1, 26: 1}),
        # Lips: a positive FAP closes; FAP 3 alone opens.
        (6, {4: -1, 8: -1, 9: -1, 51: -1, 55: -1, 56: -1}),
        (7, {3: 1, 5: -1, 10: -1, 11: -1, 52: -1, 57: -1, 58: -1}),
        (8, {12: 1, 13: 1, 59: 1, 60: 1}),
        (9, {6: 1, 7: 1, 53: 1, 54: 1}),
    ],
)
def test_signs(pep, signs):
    up, down = _fap(pep, 1.0), _fap(pep, -1.0)
    assert {fap: np.sign(up[fap]) for fap in signs} == signs
    assert {fap: -np.sign(down[fap]) for fap in signs if faps()[fap].two_way} == {
        fap: sign for fap, sign in signs.items() if faps()[fap].two_way
    }


def test_closed_eyes_are_exactly_closed():
    # The iris diameter is 1024 units; upper and lower lid share it.
    closed = _fap(3, -1.0)
    assert closed[19] + closed[21] == pytest.approx(1024, abs=5)


@given(values)
def test_other_faps_are_fixed_shares_of_the_key(row):
    # MTAP 2013, Eq. 3.
    full, some = pep_to_fap(np.ones((1, 9)))[0], pep_to_fap(row)[0]
    for pep in peps():
        for fap in pep.faps:
            share = full[column(fap)] / full[column(pep.key)]
            wanted = share * some[column(pep.key)]
            assert some[column(fap)] == pytest.approx(wanted if faps()[fap].two_way else max(wanted, 0.0))


@given(values, st.floats(0.0, 2.0))
def test_a_stronger_expression_is_the_same_expression(row, factor):
    np.testing.assert_allclose(pep_to_fap(factor * row), factor * pep_to_fap(row), atol=1e-9)


@given(values)
def test_expressions_are_symmetric_but_for_the_gaze(row):
    row[0, 3] = 0.0
    found = pep_to_fap(row)
    np.testing.assert_allclose(mirrored(found), found)


def test_neutral_is_all_zero():
    assert not pep_to_fap(np.zeros((2, 9))).any()


def test_the_digest_tells_translations_apart():
    own = template()
    other = PepFapModel(own.scheme, own.plus, 1.01 * own.minus)
    assert len(own.digest) == 64
    assert len({own.digest, other.digest, template(ACII).digest}) == 3


def test_one_way_faps_go_one_way():
    """The standard has no jaw that opens by less than nothing."""
    values = pep_to_fap(np.vstack([np.eye(9), -np.eye(9)]))
    for fap in faps().values():
        if not fap.two_way:
            assert values[:, column(fap.fap)].min() >= 0.0, fap.name


def some_peps(scheme):
    count = len(peps(scheme))
    return st.lists(st.floats(-1.0, 1.0), min_size=count, max_size=count).map(lambda row: np.array([row]))


@given(some_peps(ACII))
def test_acii_contributions_to_the_brows_add(row):
    alone = [pep_to_fap(np.where(np.arange(18) == k, row, 0.0), ACII) for k in range(18)]
    np.testing.assert_allclose(pep_to_fap(row, ACII), np.sum(alone, axis=0), atol=1e-9)


@pytest.mark.parametrize(
    ("code", "signs"),
    [
        ("1.1L", {31: 1, 33: 1, 35: 1}),
        ("1.3R", {32: 1, 36: -1}),
        # The sign traps: FAP 19 closes the lid, FAP 5 closes the lips, FAP 15 goes to the subject's right.
        ("2.1L", {19: -1, 21: -1}),
        ("3.1", {5: -1, 52: -1, 4: -1}),
        ("4.1", {3: 1}),
        ("4.2", {15: -1}),
    ],
)
def test_acii_signs(code, signs):
    row = np.where(np.array(codes(ACII)) == code, 1.0, 0.0)[None]
    found = pep_to_fap(row, ACII)[0]
    assert {fap: np.sign(found[column(fap)]) for fap in signs} == signs


def test_acii_shares_stay_within_one():
    # ACII 2007, Eq. 1: alpha in [-1, 1].
    for k, pep in enumerate(peps(ACII)):
        for profile in (template(ACII).plus[k], template(ACII).minus[k]):
            assert np.abs(profile).max() <= abs(profile[column(pep.key)]) + 1e-9


@pytest.mark.parametrize("scheme", [MTAP, ACII])
@given(data=st.data())
def test_the_way_back(scheme, data):
    row = data.draw(some_peps(scheme))
    if scheme == ACII:
        # The jaw goes down only: a closed jaw does not tell how hard it is closed.
        row[0, codes(ACII).index("4.1")] = abs(row[0, codes(ACII).index("4.1")])
    np.testing.assert_allclose(template(scheme).invert(pep_to_fap(row, scheme)), row, atol=1e-9)


@pytest.mark.parametrize("scheme", [MTAP, ACII])
def test_a_translation_is_found_again(scheme):
    rng = np.random.default_rng(3)
    # Eq. 4 has one alpha for both directions, which the template keeps but for the jaw: no value below 0 here.
    row = rng.uniform(-1, 1, (60, len(peps(scheme))))
    if scheme == MTAP:
        row[:, 6] = np.abs(row[:, 6])
    measured = pep_to_fap(row, scheme)
    found = PepFapModel.fit(measured, scheme=scheme)
    np.testing.assert_allclose(found.translate(found.invert(measured)), measured, atol=1e-6)
    assert (np.abs(found.invert(measured)) <= 1.0 + 1e-9).all()


def test_alpha_is_equation_4():
    rng = np.random.default_rng(4)
    measured = np.zeros((40, 68))
    measured[:, [column(fap) for pep in peps() for fap in pep.faps]] = rng.normal(size=(40, 37))
    found = PepFapModel.fit(measured)
    for k, pep in enumerate(peps()):
        key = measured[:, column(pep.key)]
        for fap in pep.faps:
            alpha = measured[:, column(fap)] @ key / (key @ key)
            ratio = found.plus[k, column(fap)] / found.plus[k, column(pep.key)]
            if faps()[fap].two_way:
                assert ratio == pytest.approx(alpha)


def test_a_key_that_never_moves_is_named():
    measured = np.ones((5, 68))
    measured[:, column(12)] = 0.0
    with pytest.raises(SpecError, match=r"PEP 8.*key FAP 12"):
        PepFapModel.fit(measured)
