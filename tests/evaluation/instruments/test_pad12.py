import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.instruments.pad12 import PAD12

answers = st.fixed_dictionaries({item.id: st.integers(-4, 4) for item in PAD12.items})


@pytest.mark.parametrize("name", ["max_P", "max_A", "max_D", "mixed"])
def test_eq_13(case, name):
    published = case("pad12_eq13")
    given_answers = dict(zip((item.id for item in PAD12.items), published["data"]["answers"][name], strict=True))
    scores = PAD12.score(given_answers)
    assert list(scores) == ["P", "A", "D"]
    assert list(scores.values()) == pytest.approx(published["expected"][name], rel=1e-12)


@given(answers)
def test_scores_lie_in_range_in_steps_of_a_sixteenth(given_answers):
    for value in PAD12.score(given_answers).values():
        assert -1 <= value <= 1
        assert (value * 16).is_integer()


@given(answers)
def test_opposite_answers_give_opposite_scores(given_answers):
    opposite = {item: -value for item, value in given_answers.items()}
    assert PAD12.score(opposite) == {name: -value for name, value in PAD12.score(given_answers).items()}


def test_each_item_belongs_to_one_dimension():
    used = [item for score in PAD12.scores for item in score.weights]
    assert sorted(used) == sorted(item.id for item in PAD12.items)


def test_the_adjectives_are_those_of_the_papers_and_none_is_cut_off():
    english = [(item.left["en"], item.right["en"]) for item in PAD12.items]
    assert english[0] == ("Angry", "Activated")
    assert english[1] == ("Wide awake", "Sleepy")
    assert english[11] == ("Influential", "Influenced")
    chinese = [text for item in PAD12.items for text in (item.left["zh"], item.right["zh"])]
    assert all(text.endswith("的") for text in chinese)
    assert {"清醒的", "充满希望的", "有影响力的"} <= set(chinese)
    assert len(set(chinese)) == 23  # 放松的 stands in two pairs, and so does "Relaxed"


def test_the_codebook_prints_eq_13():
    formulas = {row.variable: row.scoring for row in PAD12.codebook()}
    assert formulas["P"] == "(Q1 - Q4 + Q7 - Q10) / 16"
    assert formulas["A"] == "(-Q2 + Q5 - Q8 + Q11) / 16"
    assert formulas["D"] == "(Q3 - Q6 + Q9 - Q12) / 16"
    assert formulas["pad12.Q10"] == "P (-1)"
