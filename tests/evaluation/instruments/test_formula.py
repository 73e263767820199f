from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.instruments.base import Score
from evaluation.instruments.formula import FormulaError, parse_formula
from evaluation.instruments.pad12 import PAD12

ITEMS = ("q1", "q2", "q3")

numbers = st.one_of(
    st.integers(0, 50).map(str), st.tuples(st.integers(0, 20), st.integers(0, 99)).map(lambda p: f"{p[0]}.{p[1]:02}")
)


def grown(inner):
    several = st.lists(inner, min_size=1, max_size=4).map(", ".join)
    return st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-"]), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(inner, numbers).map(lambda t: f"{t[0]} * {t[1]}"),
        st.tuples(numbers, inner).map(lambda t: f"{t[0]} * ({t[1]})"),
        st.tuples(inner, st.integers(1, 30)).map(lambda t: f"({t[0]}) / {t[1]}"),
        inner.map(lambda text: f"-({text})"),
        several.map(lambda text: f"mean({text})"),
        several.map(lambda text: f"sum({text})"),
    )


expressions = st.recursive(st.one_of(st.sampled_from(ITEMS), numbers), grown, max_leaves=12)


def as_numpy(text, answers):
    """The same text read by Python, as numpy computes it."""
    names = {"mean": lambda *terms: np.mean(terms), "sum": lambda *terms: np.sum(terms), "__builtins__": {}}
    return eval(text, names, {item: np.float64(value) for item, value in answers.items()})


@given(expressions, st.fixed_dictionaries({item: st.integers(-9, 9) for item in ITEMS}))
def test_a_formula_comes_to_what_numpy_computes(text, answers):
    try:
        formula = parse_formula(text, ITEMS)
    except FormulaError as error:
        assert "is the same for all answers" in str(error)
        others = [as_numpy(text, dict.fromkeys(ITEMS, value)) for value in (0, 1, 7)]
        assert others == pytest.approx([others[0]] * 3, rel=1e-9, abs=1e-9)
        return
    value = float(sum(weight * answers[item] for item, weight in formula.weights.items()) + formula.constant)
    assert value == pytest.approx(float(as_numpy(text, answers)), rel=1e-9, abs=1e-6)
    assert all(formula.weights.values())


@given(expressions)
def test_what_the_codebook_prints_is_the_same_formula(text):
    try:
        formula = parse_formula(text, ITEMS)
    except FormulaError:
        return
    score = Score(name="s", text="", weights=formula.weights, constant=formula.constant, divisor=1, source="")
    again = parse_formula(score.formula, ITEMS)
    assert dict(again.weights) == dict(formula.weights)
    assert again.constant == formula.constant


@pytest.mark.parametrize("score", PAD12.scores, ids=lambda score: score.name)
def test_eq_13_as_printed_is_read_as_eq_13(score):
    formula = parse_formula(score.formula, [item.id for item in PAD12.items])
    assert formula.weights == {item: Fraction(weight, 16) for item, weight in score.weights.items()}
    assert formula.constant == 0


def test_numbers_are_exact():
    formula = parse_formula("0.1 * q1 + .3 - q2 / 3 + 2. * mean(q1, q2, 4)", ITEMS)
    assert formula.weights == {"q1": Fraction(1, 10) + Fraction(2, 3), "q2": Fraction(1, 3)}
    assert formula.constant == Fraction(3, 10) + Fraction(8, 3)


def test_an_item_may_be_called_mean():
    assert parse_formula("mean(mean, sum)", ["mean", "sum"]).weights == {"mean": Fraction(1, 2), "sum": Fraction(1, 2)}


def test_line_breaks_are_spaces():
    assert parse_formula("\n (q1\n\t + q2) ", ITEMS).weights == {"q1": 1, "q2": 1}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("q1 + q4", "there is no item 'q4'; there are q1, q2, q3"),
        ("q1 * q2", "'q1 \\* q2' multiplies items"),
        ("(q1 + 1) * (q2 - 2)", "multiplies items"),
        ("q1 / 0", "'q1 / 0' divides by zero"),
        ("q1 / (2 - 2.0)", "divides by zero"),
        ("8 / q1", "'8 / q1' divides by an item"),
        ("word + q1", "the answers to word are no numbers; right are items of the kinds"),
        ("7 / 2", "'7 / 2' is the same for all answers"),
        ("q1 - q1", "is the same for all answers"),
        ("", "'' is not a formula"),
        ("q1 +", "'q1 \\+' is not a formula"),
        ("2 q1", "is not a formula"),
        ("(q1", "is not a formula"),
        ("q1 q2", "is not a formula"),
        ("if", "is not a formula"),
        ("q1 ** 2", "'q1 \\*\\* 2' uses an operator that is none of"),
        ("q1 // 2", "uses an operator"),
        ("q1, q2", "cannot stand in a formula"),
        ("q1.real", "'q1.real' cannot stand in a formula"),
        ("1e3 * q1", "'1e3' cannot stand"),
        ("0x1F * q1", "'0x1F' cannot stand"),
        ("1_000 * q1", "'1_000' cannot stand"),
        ("2j * q1", "'2j' cannot stand"),
        ("True * q1", "'True' cannot stand"),
        ("0or q1", "'0or' cannot stand"),
        ("not q1", "cannot stand"),
        ("lambda", "is not a formula"),
        ("max(q1, q2)", "neither mean"),
        ("mean()", "nothing between its parentheses"),
        ("mean(*q1)", "'\\*q1' cannot stand"),
        ("q1(2)", "neither mean"),
        ("q1 ^ 2", "the formula cannot hold '\\^'"),
        ("q1 # more", "cannot hold '#'"),
        ("'q1'", "cannot hold"),
        ("ｑ1", "cannot hold 'ｑ'"),
        ("q1\x00", "cannot hold"),
        ("q1\u00a0+ q2", r"cannot hold '\\xa0'"),
        ("(" * 250 + "q1" + ")" * 250, "is not a formula|nested too deeply"),
        ("-" * 1900 + "q1", "nested too deeply|is not a formula"),
        ("1" * 400 + "* q1", "cannot stand"),
        ("q1 + " * 500 + "q1", "longer than 2000 characters"),
    ],
)
def test_each_fault_has_its_sentence(text, message):
    with pytest.raises(FormulaError, match=message) as caught:
        parse_formula(text, ITEMS, others=["word"])
    assert str(caught.value).endswith(".")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250


def test_ids_that_formulas_cannot_hold_are_explained():
    with pytest.raises(
        FormulaError, match="no item 'q'; there are q-1, q-2; in formulas ids have letters, digits and _"
    ):
        parse_formula("q-1 + q-2", ["q-1", "q-2"])


def test_nothing_to_compute_with():
    with pytest.raises(FormulaError, match="no item 'q1'; none of the items is a number"):
        parse_formula("q1", [])


@given(st.text(max_size=40))
def test_nonsense_is_refused_and_nothing_else_happens(text):
    with pytest.raises(FormulaError):
        parse_formula(text, ["an_item_that_chance_does_not_write"])
