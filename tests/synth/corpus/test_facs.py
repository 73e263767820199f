import json
import string
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.corpus.facs import ActionUnit, emotion_displays, faps_of, intensities, parse, unit_faps, units
from synth.errors import SpecError
from synth.fap.table import column, faps, mirrored

# FAPs that public AU to FAP tables raise (+) and lower (-), for the units that matter most.
RAISED = {1: (31, 32, 33), 2: (35, 36), 4: (37, 38), 7: (19, 22), 12: (6, 7, 12, 13, 59), 20: (6, 53, 54), 27: (3,)}
LOWERED = {4: (31, 34), 5: (19, 20), 10: (4, 8, 56), 15: (12, 13, 60), 16: (5, 52), 25: (4, 5, 58), 27: (5, 58)}


def test_units_move_what_public_tables_say():
    for table, sign in ((RAISED, 1.0), (LOWERED, -1.0)):
        for number, moved in table.items():
            assert (np.sign(units()[number][[column(fap) for fap in moved]]) == sign).all(), number


def test_a_full_movement_is_natural():
    """Each FAP at intensity E is usable; the jaw carries the lower lip, which moves further by as much."""
    for number, profile in units().items():
        own = profile.copy()
        own[[column(fap) for fap in (5, 10, 11, 52, 57, 58)]] += profile[column(3)]
        for fap in faps().values():
            low, high = fap.usable or (0, 0)
            assert low <= own[column(fap.fap)] <= high, (number, fap.fap)


def test_units_are_symmetric_but_for_the_head_and_gaze():
    for number, profile in units().items():
        if number not in {30, 51, 52, 55, 56, 61, 62}:
            np.testing.assert_array_equal(mirrored(profile[None])[0], profile, err_msg=str(number))


def test_sides_add_up_to_the_whole():
    for number in units():
        parts = [unit_faps(ActionUnit(number, side, 0, 1), 0.5) for side in ("L", "R", "")]
        np.testing.assert_allclose(parts[0] + parts[1], parts[2])
    left = unit_faps(ActionUnit(12, "L", 0, 1), 1.0)
    assert left[column(12)] > 0 == left[column(13)]


def test_intensities_grow():
    values = [intensities()[letter] for letter in "ABCDE"]
    assert values == sorted(values)
    assert values[-1] == 1.0
    assert values[0] > 0.0


def test_a_prototype_as_printed():
    display = parse("1+2+4+5*+20*+25|26|27")
    assert [[unit.number for unit in choice] for choice in display.required] == [[1], [2], [4], [5], [20], [25, 26, 27]]
    any_level = display.required[3][0]
    assert (any_level.low, any_level.high) == (intensities()["A"], 1.0)
    assert display.required[0][0].low > any_level.low
    assert display.optional == ()


def test_sides_levels_and_options():
    display = parse("R12A + L14C/D (+54+64)")
    right, left = (choice[0] for choice in display.required)
    assert (right.number, right.side, right.low, right.high) == (12, "R", intensities()["A"], intensities()["A"])
    assert (left.number, left.side, left.low, left.high) == (14, "L", intensities()["C"], intensities()["D"])
    assert [[choice[0].number for choice in group] for group in display.optional] == [[54, 64]]


def test_a_group_may_stand_anywhere():
    display = parse("(1+2)+4+(5)+25")
    assert [choice[0].number for choice in display.required] == [4, 25]
    assert [[choice[0].number for choice in group] for group in display.optional] == [[1, 2], [5]]


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("", "is empty"),
        ("1++2", "'' is no action unit"),
        ("1+2+", "'' is no action unit"),
        ("1|", "'' is no action unit"),
        ("12F", "'12F' is no action unit"),
        ("B12", "'B12' is no action unit"),
        ("smile", "'smile' is no action unit"),
        ("12D/B", "goes down"),
        ("13", "no profile of action unit 13"),
        ("1+(2", "parentheses"),
        ("1+((2))", "parentheses"),
        ("1)", "parentheses"),
        ("1+()", "'' is no action unit"),
    ],
)
def test_malformed_formulas_are_refused(formula, message):
    with pytest.raises(SpecError, match="FACS display") as caught:
        parse(formula)
    assert message in str(caught.value)


@given(st.text(alphabet=string.digits + "+|()*LRABCDEF/ ", max_size=12))
def test_a_formula_is_read_or_refused(formula):
    try:
        display = parse(formula)
    except SpecError:
        return
    assert display.required or display.optional
    drawn = display.draw(np.random.default_rng(0))
    assert len(drawn) >= len(display.required)
    assert all(unit.low <= level <= unit.high for unit, level in drawn)
    assert np.isfinite(faps_of(drawn)).all()


def test_alternatives_and_options_are_all_drawn():
    rng = np.random.default_rng(1)
    seen = {tuple(unit.number for unit, _ in parse("1+25|26|27(+64)").draw(rng)) for _ in range(200)}
    assert seen == {(1, lips, *rest) for lips in (25, 26, 27) for rest in ((), (64,))}


def test_contributions_add():
    both = faps_of(parse("1E+4E").draw(np.random.default_rng(0)))
    np.testing.assert_allclose(both, units()[1] + units()[4])
    # The brow of sadness: inner ends up and drawn together, outer ends not up.
    assert both[column(31)] > 30 > both[column(35)]
    assert both[column(37)] > 0


def test_typical_is_the_mean_of_many():
    display, rng = parse("1+20*+25|26|27(+54)"), np.random.default_rng(3)
    drawn = [faps_of((u, v) for u, v in display.draw(rng) if u.number != 54) for _ in range(4000)]
    np.testing.assert_allclose(np.mean(drawn, axis=0), display.typical(), atol=25)


def test_seven_emotions_with_their_sources():
    shown = emotion_displays()
    assert set(shown) == {"surprise", "fear", "happy", "sad", "anger", "disgust", "contempt"}
    assert not shown["disgust"].verified
    assert all(shown[name].verified for name in ("surprise", "fear", "happy", "sad", "anger"))
    assert [display.formula for display in shown["surprise"].prototypes] == ["1+2+5B+26", "1+2+5B+27"]
    assert len(shown["fear"].all) == 6
    for emotion in shown.values():
        formulas = [display.formula for display in emotion.all]
        assert len(set(formulas)) == len(formulas)
        assert emotion.source


def test_variants_of_anger_lack_one_unit():
    anger = emotion_displays()["anger"]
    assert "5*+7+23" in [display.formula for display in anger.variants]
    prototypes = [prototype.required for prototype in anger.prototypes]
    for variant in anger.variants:
        gone = [
            [choice[0].number for choice in whole if choice not in variant.required]
            for whole in prototypes
            if len(whole) == len(variant.required) + 1 and set(variant.required) < set(whole)
        ]
        assert gone, variant.formula
        assert all(number in {4, 5, 7, 10} for [number] in gone)


def test_unverified_units_are_marked():
    text = resources.files("synth.data").joinpath("facs.json").read_text(encoding="utf-8")
    assert {row["au"] for row in json.loads(text)["units"] if row.get("own")} == {9, 11}
