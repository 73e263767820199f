import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.fap.blend import MOUTH, blend
from synth.fap.table import FAP_COUNT, column, faps

values = st.floats(-900.0, 900.0)


def _one(fap, value):
    row = np.zeros((1, FAP_COUNT))
    row[0, column(fap)] = value
    return row


def _mixed(fap, viseme, expression, lip=-800.0, **options):
    """Blend one FAP, with the lower lip well open, since the jaw goes with it."""
    mouth = _one(fap, viseme)
    if fap != 5:
        mouth[0, column(5)] = lip
    return blend(mouth, _one(fap, expression), **options)[0, column(fap)]


@pytest.mark.parametrize(
    ("fap", "viseme", "expression"),
    [(3, 600, 900), (5, -720, -900), (4, -210, -316), (6, 100, 160), (12, 60, 630), (12, -50, -400), (17, 300, 200)],
)
@pytest.mark.parametrize("delta", [0.0, 0.3, 0.5, 1.0])
def test_where_both_go_the_same_way_it_is_equation_14(fap, viseme, expression, delta):
    mixed = _mixed(fap, viseme, expression, delta=delta)
    assert mixed == pytest.approx(delta * viseme + (1 - delta) * expression)


@pytest.mark.parametrize(
    ("fap", "viseme", "expression"),
    [(5, 80, -1299), (4, 80, -316), (5, -300, 230), (6, -180, 160), (12, -300, 630), (12, 460, -400), (17, -160, 300)],
)
def test_where_they_oppose_the_viseme_decides(fap, viseme, expression):
    assert _mixed(fap, viseme, expression) == viseme


def test_closed_lips_stay_closed_and_the_jaw_with_them_but_the_corners_smile():
    """A bilabial in a wide smile."""
    viseme, expression = np.zeros((2, 1, FAP_COUNT))
    for fap, spoken, felt in ((3, 60, 390), (4, 80, -316), (5, 80, -487), (10, 70, -445), (12, 0, 633), (6, 0, 160)):
        viseme[0, column(fap)], expression[0, column(fap)] = spoken, felt
    mixed = blend(viseme, expression)[0]
    assert [mixed[column(fap)] for fap in (3, 4, 5, 10)] == [60, 80, 80, 70]
    assert mixed[column(12)] == pytest.approx(316.5)
    assert mixed[column(6)] == pytest.approx(80)


def test_without_expression_articulation_is_whole():
    mouth = np.linspace(-100, 100, 3 * FAP_COUNT).reshape(3, FAP_COUNT)
    columns = [column(fap) for fap in MOUTH]
    np.testing.assert_array_equal(blend(mouth, np.zeros_like(mouth))[:, columns], mouth[:, columns])


@given(st.sampled_from(MOUTH), values, values, st.floats(0.0, 1.0))
def test_the_mixture_lies_between(fap, viseme, expression, delta):
    mixed = _mixed(fap, viseme, expression, delta=delta)
    assert min(viseme, expression) - 1e-9 <= mixed <= max(viseme, expression) + 1e-9


@given(st.sampled_from(MOUTH), values, values, st.booleans())
def test_nothing_jumps(fap, viseme, expression, of_the_viseme):
    step = 1e-4
    one = _mixed(fap, viseme, expression)
    other = _mixed(fap, viseme + step * of_the_viseme, expression + step * (not of_the_viseme))
    assert abs(other - one) < 400 * step


@pytest.mark.parametrize("fap", MOUTH)
def test_nothing_jumps_at_a_change_of_sign(fap):
    high = faps()[fap].usable[1]
    for viseme, expression in ((0.0, high), (0.0, -high), (high, 0.0), (-high, 0.0), (0.0, 0.0)):
        around = [
            _mixed(fap, viseme + a, expression + b, lip=lip)
            for a in (-1e-6, 0.0, 1e-6)
            for b in (-1e-6, 0.0, 1e-6)
            for lip in (-800.0, 0.0)
        ]
        per_lip = np.array(around).reshape(-1, 2)
        assert np.ptp(per_lip, axis=0).max() < 1e-2


def test_the_expression_has_the_mouth_where_nobody_speaks_and_the_rest_of_the_face_always():
    mouth, face = np.full((3, FAP_COUNT), -50.0), np.full((3, FAP_COUNT), 70.0)
    mixed = blend(mouth, face, speaking=np.array([0.0, 0.5, 1.0]))
    np.testing.assert_array_equal(mixed[0], face[0])
    rest = [k for k in range(FAP_COUNT) if k + 1 not in MOUTH]
    np.testing.assert_array_equal(mixed[:, rest], face[:, rest])
    np.testing.assert_allclose(mixed[1], (mixed[0] + mixed[2]) / 2)
    assert mixed[2, column(5)] == -50.0


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((np.zeros((2, 68)), np.zeros((3, 68))), {}, "2 frames of visemes, but 3"),
        ((np.zeros((2, 67)), np.zeros((2, 68))), {}, "shape"),
        ((np.full((2, 68), np.nan), np.zeros((2, 68))), {}, "not a finite"),
        ((np.zeros((2, 68)), np.zeros((2, 68))), {"delta": 1.5}, "delta"),
        ((np.zeros((2, 68)), np.zeros((2, 68))), {"delta": float("nan")}, "delta"),
        ((np.zeros((2, 68)), np.zeros((2, 68))), {"speaking": np.ones(3)}, "speaking"),
        ((np.zeros((2, 68)), np.zeros((2, 68))), {"speaking": np.array([0.0, np.nan])}, "speaking"),
    ],
)
def test_bad_input_is_refused(arguments, options, message):
    with pytest.raises(SpecError, match=message):
        blend(*arguments, **options)
