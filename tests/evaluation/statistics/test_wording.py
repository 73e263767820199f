import pytest

from evaluation.statistics import wording


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.473, ".47"),
        (-0.473, "-.47"),
        (0.0, ".00"),
        (-0.001, ".00"),
        (1.0, "1.00"),
        (-1.0, "-1.00"),
        (0.997, ".997"),
        (-0.9996, "-.9996"),
    ],
)
def test_a_share_has_no_leading_zero_and_is_not_rounded_to_one(value, text):
    assert wording.share(value) == text


def test_a_number_keeps_its_leading_zero_but_no_negative_zero():
    assert wording.number(0.473) == "0.47"
    assert wording.number(-0.001) == "0.00"


@pytest.mark.parametrize(
    ("p", "text"), [(0.0336, "p = .034"), (0.0009999, "p < .001"), (0.001, "p = .001"), (0.99999, "p > .999")]
)
def test_p(p, text):
    assert wording.p_value(p) == text
