import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.report.printed_check import (
    NO,
    ROUNDING,
    YES,
    Check,
    check_block,
    nearest_count,
    plain_block,
    possible,
    share,
    spanned,
)
from evaluation.report.section import NOTHING


@pytest.mark.parametrize(
    ("printed", "value", "span", "verdict"),
    [
        ("0.69", 0.6925, None, YES),
        ("0.69", 0.695, None, YES),
        ("0.69", 0.6849, None, NO),
        ("0.69", 0.6825, (0.6775, 0.6875), ROUNDING),
        ("0.69", 0.6825, (0.6800, 0.6849), NO),
        ("-0.5", -0.54, None, YES),
        ("57", 57.0, None, YES),
        ("57", 56.4, None, NO),
        (None, 1.0, (0.0, 2.0), None),
    ],
)
def test_verdicts(printed, value, span, verdict):
    assert Check("x", printed, value, span).agrees == verdict


@given(st.floats(-100, 100), st.integers(0, 5))
def test_a_number_agrees_with_itself_rounded(value, digits):
    assert Check("x", f"{value:.{digits}f}", value).agrees == YES


@given(st.integers(1, 60), st.data())
def test_rounded_shares_are_possible(number, data):
    counts = data.draw(st.lists(st.integers(0, number), min_size=1, max_size=5))
    percents = [f"{share(count, number):.0f}" for count in counts]
    assert possible(percents, number)
    assert [nearest_count(f"{share(count, number):.6f}", number) for count in counts] == counts


def test_shares_that_are_not_possible():
    assert not possible(["67"], 14)
    assert possible(["67"], 12)
    # 99 % needs so many raters that one of them is less than one percent and a half.
    assert next(number for number in range(1, 80) if possible(["99"], number)) == 67


def test_a_span_goes_over_all_corners():
    low, high = spanned(lambda a, b: a / b, "2.0", "-4")
    assert (low, high) == pytest.approx((2.05 / -3.5, 1.95 / -4.5))


def test_the_column_of_spans_is_there_only_with_spans():
    exact, spread = Check("a", "2", 2.0), Check("b", None, 0.5, (0.4, 0.6), 1)
    without = check_block("one", "One", [exact]).sections[0]
    assert without.rows == (("a", YES, "2", "2"),)
    block = check_block("both", "Both", [exact, spread], ["A note."])
    section, frame = block.sections[0], block.frames["both"]
    assert section.rows == (("a", YES, "2", "2", NOTHING), ("b", NOTHING, NOTHING, "0.5", "0.4–0.6"))
    assert len(section.header) == 5
    assert section.notes == ("A note.",)
    assert frame["recomputed"].tolist() == [2.0, 0.5]
    assert frame["lowest"].isna().tolist() == [True, False]


def test_a_frame_as_it_is():
    table = pd.DataFrame({"name": ["a"], "n": [3], "x": [0.126]})
    block = plain_block("t", "T", ("Name", "n", "x"), table, digits=(0, 2))
    assert block.sections[0].rows == (("a", "3", "0.13"),)
    assert block.frames["t"] is table
