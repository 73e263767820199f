import pytest

from evaluation.errors import AnswerError
from evaluation.instruments.pad5 import PAD5


def test_five_steps_from_minus_one_to_one():
    for raw, score in zip(range(-2, 3), (-1.0, -0.5, 0.0, 0.5, 1.0), strict=True):
        assert PAD5.score({"P": raw, "A": -raw, "D": raw}) == {"P": score, "A": -score, "D": score}


def test_the_poles_are_those_of_section_2_4():
    poles = {item.id: (item.left["en"], item.right["en"]) for item in PAD5.items}
    assert poles == {"P": ("Negative", "Positive"), "A": ("Calm", "Excited"), "D": ("Weak", "Strong")}


def test_the_codebook():
    rows = {row.variable: row for row in PAD5.codebook()}
    assert rows["pad5.A"].text == "Arousal (Calm – Excited)"
    assert rows["pad5.A"].values == "-2 (Calm) to 2 (Excited)"
    assert (rows["A"].scoring, rows["A"].values) == ("A / 2", "-1 to 1, in steps of 0.5")


def test_halves_are_not_answers():
    with pytest.raises(AnswerError, match=r"pad5, P: '0\.5' is not a whole number"):
        PAD5.validate({"P": "0.5", "A": "0", "D": "0"})
